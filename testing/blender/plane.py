"""A white plane under lights: our irradiance beside Cycles' picture."""

import warnings

import bpy
import numpy as np

from restir_engine.kernels.core import rng
from restir_engine.kernels.core.jit import kernel
from restir_engine.kernels.core.memory import address, store_f64
from restir_engine.kernels.core.records import (
    SCRATCH_BYTES,
    SCRATCH_LIGHT_SAMPLE,
    SCRATCH_POINT,
    light_sample_at,
    shading_point_at,
)
from restir_engine.kernels.core.vec import put
from restir_engine.kernels.lights import light_sample
from restir_engine.scene.scene import Scene

SIZE = 16
EXTENT = 4.0  # of the plane that the camera sees


@kernel
def plane_kernel(scene, scratch, size, extent, samples, out):
    """Store the irradiance / pi, red, at size × size pixels of the plane z = 0 around the origin."""
    sp = shading_point_at(scratch + SCRATCH_POINT, 0)
    ls = light_sample_at(scratch + SCRATCH_LIGHT_SAMPLE, 0)
    for pixel in range(size * size):
        total = 0.0
        for i in range(samples):
            a, b = rng.sample2(pixel, i, 0)
            x = ((pixel % size + a) / size - 0.5) * extent
            y = ((pixel // size + b) / size - 0.5) * extent
            put(sp.p, (x, y, 0.0))
            u0, u1 = rng.sample2(pixel, i, 1)
            if light_sample(scene, sp, scratch, u0, u1, rng.sample1(pixel, i, 2)) and ls.wi[2] > 0.0:
                total += ls.radiance[0] * ls.wi[2] / (ls.pdf * 3.141592653589793)
        store_f64(out, pixel, total / samples)


def plane_irradiance(scene: Scene, samples: int) -> np.ndarray:
    """What a white diffuse plane would show, red, bottom row first; nothing casts shadows."""
    memory = np.zeros(SCRATCH_BYTES, np.uint8)
    out = np.zeros((SIZE, SIZE))
    plane_kernel(scene.record, address(memory), SIZE, EXTENT, samples, address(out))
    return out


def cycles(folder) -> np.ndarray:
    """The red channel of Cycles' picture, bottom row first."""
    scene = bpy.context.scene
    scene.render.filepath = str(folder / "cycles.exr")
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(scene.render.filepath)
    pixels = np.empty(SIZE * SIZE * 4, np.float32)
    image.pixels.foreach_get(pixels)
    bpy.data.images.remove(image)
    return pixels.reshape(SIZE, SIZE, 4)[:, :, 0].astype(float)


def stage() -> bpy.types.Scene:
    """A white diffuse plane seen from above by an orthographic camera; direct light only."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    render, settings = scene.render, scene.cycles
    render.engine = "CYCLES"
    render.resolution_x = render.resolution_y = SIZE
    render.resolution_percentage = 100
    render.image_settings.file_format = "OPEN_EXR"
    render.image_settings.color_depth = "32"
    settings.samples, settings.seed = 1024, 5
    settings.use_adaptive_sampling = settings.use_denoising = False
    settings.max_bounces = 0
    settings.sample_clamp_direct = settings.sample_clamp_indirect = 0.0
    settings.light_sampling_threshold = 0.0
    settings.pixel_filter_type = "BOX"
    mesh = bpy.data.meshes.new("plane")
    mesh.from_pydata([(-9, -9, 0), (9, -9, 0), (9, 9, 0), (-9, 9, 0)], [], [(0, 1, 2, 3)])
    material = bpy.data.materials.new("white")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)
        material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    diffuse, output = tree.nodes.new("ShaderNodeBsdfDiffuse"), tree.nodes.new("ShaderNodeOutputMaterial")
    diffuse.inputs["Color"].default_value = (1.0, 1.0, 1.0, 1.0)
    tree.links.new(diffuse.outputs[0], output.inputs["Surface"])
    mesh.materials.append(material)
    scene.collection.objects.link(bpy.data.objects.new("plane", mesh))
    camera = bpy.data.cameras.new("camera")
    camera.type, camera.ortho_scale = "ORTHO", EXTENT
    eye = bpy.data.objects.new("camera", camera)
    eye.location = (0.0, 0.0, 9.0)
    scene.collection.objects.link(eye)
    scene.camera = eye
    return scene
