"""What a node's output is at every pixel: Cycles' answer as emission, ours where our camera ray hits."""

import tempfile
from contextlib import contextmanager
from pathlib import Path

import bpy
import numpy as np

from restir_engine.context import FrameContext
from restir_engine.kernels.core import records as rec
from restir_engine.kernels.core.jit import device, kernel
from restir_engine.kernels.core.memory import address, store_f64
from restir_engine.kernels.core.records import instance_at
from restir_engine.kernels.core.vec import store3_f64, vec
from restir_engine.kernels.geometry.attributes import attribute, generated
from restir_engine.kernels.geometry.camera import camera_ray
from restir_engine.kernels.geometry.intersect import intersect
from restir_engine.kernels.geometry.surface import surface_point
from restir_engine.settings import RenderSettings
from restir_engine.sync.depsgraph import build_scene

COLUMNS = {
    "instance": 0,
    "primitive": 1,
    "material": 2,
    "backfacing": 3,
    "t": 4,
    "p": slice(5, 8),
    "n": slice(8, 11),
    "ng": slice(11, 14),
    "generated": slice(14, 17),
    "found": 17,
    "attribute": slice(18, 22),
    "random": 22,
    "o": slice(23, 26),
    "d": slice(26, 29),
    "dd": 29,
}
WIDTH = 30


@device
def _store_hit(scene, sp, name, out):
    store3_f64(out, 5, vec(sp.p))
    store3_f64(out, 8, vec(sp.n))
    store3_f64(out, 11, vec(sp.ng))
    store3_f64(out, 14, generated(scene, sp, 0.0, 0.0))
    found, x, y, z, w = attribute(scene, sp, name, 0.0, 0.0)
    store_f64(out, 17, 1.0 if found else 0.0)
    store3_f64(out, 18, (x, y, z))
    store_f64(out, 21, w)
    store_f64(out, 22, instance_at(scene.instances, sp.instance).random)


@kernel
def _trace(scene, camera, sp, scratch, width, height, mask, name, out):
    for y in range(height):
        for x in range(width):
            at = out + 8 * WIDTH * (y * width + x)
            o, d, _, dd = camera_ray(camera, x + 0.5, y + 0.5, 0.5, 0.5)
            t, instance, primitive, u, v = intersect(scene, scratch, o, d, 0.0, 1e30, mask)
            store_f64(at, 0, float(instance))
            store3_f64(at, 23, o)
            store3_f64(at, 26, d)
            store_f64(at, 29, dd)
            if instance >= 0:
                surface_point(scene, sp, instance, primitive, u, v, t, d)
                store_f64(at, 1, float(primitive))
                store_f64(at, 2, float(sp.material))
                store_f64(at, 3, float(sp.backfacing))
                store_f64(at, 4, t)
                _store_hit(scene, sp, name, at)


def ours(scene, attribute_name: str = "", mask: int = rec.RAY_CAMERA, camera=None) -> dict[str, np.ndarray]:
    """COLUMNS for each pixel of a committed scene, (height, width, …) bottom row first; camera: if not the scene's."""
    context = FrameContext(scene, camera)
    width, height = context.camera.film_size
    sp = np.zeros(1, rec.SHADING_POINT)
    scratch = np.zeros(rec.SCRATCH_BYTES + 64, np.uint8)
    start = address(scratch) + -address(scratch) % 64
    out = np.zeros((height, width, WIDTH))
    name = scene.attribute_names.get(attribute_name, -1)
    _trace(context.record, context.camera_record, sp[0], start, width, height, mask, name, address(out))
    return {key: out[..., column] for key, column in COLUMNS.items()}


def emission_material(build, scale: float = 1.0, offset: float = 0.0) -> bpy.types.Material:
    """A material that emits what the socket that build(nodes) returns says, times scale plus offset."""
    material = bpy.data.materials.new("Probe")
    material.use_nodes = True
    material.cycles.emission_sampling = "NONE"  # it lights nothing: nobody need measure it
    tree = material.node_tree
    tree.nodes.clear()
    emission = tree.nodes.new("ShaderNodeEmission")
    multiply_add = tree.nodes.new("ShaderNodeVectorMath")
    multiply_add.operation = "MULTIPLY_ADD"
    multiply_add.inputs[1].default_value = (scale,) * 3
    multiply_add.inputs[2].default_value = (offset,) * 3
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(build(tree.nodes), multiply_add.inputs[0])
    tree.links.new(multiply_add.outputs[0], emission.inputs["Color"])
    tree.links.new(emission.outputs[0], output.inputs["Surface"])
    return material


def cycles() -> np.ndarray:
    """The current scene by Cycles, one sample in the middle of each pixel: (height, width, 4), bottom row first."""
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    settings = scene.cycles
    settings.device = "CPU"
    settings.samples = 1
    settings.use_adaptive_sampling = False
    settings.use_denoising = False
    settings.pixel_filter_type = "BLACKMAN_HARRIS"
    settings.filter_width = 0.01
    settings.max_bounces = 0
    settings.sample_clamp_direct = settings.sample_clamp_indirect = 0.0
    with tempfile.TemporaryDirectory() as folder:
        scene.render.image_settings.file_format = "OPEN_EXR"
        scene.render.image_settings.color_depth = "32"
        scene.render.image_settings.color_mode = "RGBA"
        scene.render.filepath = str(Path(folder) / "probe.exr")
        bpy.ops.render.render(write_still=True)
        image = bpy.data.images.load(scene.render.filepath)
        image.colorspace_settings.is_data = True
        width, height = image.size
        pixels = np.empty((height, width, 4), np.float32)
        image.pixels.foreach_get(pixels.ravel())
        bpy.data.images.remove(image)
    return pixels


def probe(build, low: float = 0.0, high: float = 1.0) -> np.ndarray:
    """Cycles' values (height, width, 3), within low … high, of the socket that build(nodes) returns."""
    scale = 1.0 / (high - low)
    with override(emission_material(build, scale, -low * scale)):
        return cycles()[..., :3] / scale + low


def both(build, name: str = "", low: float = 0.0, high: float = 1.0) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Cycles' values of a socket and `ours`, where every object has a material that uses this socket."""
    scale = 1.0 / (high - low)
    with override(emission_material(build, scale, -low * scale)):
        expected = cycles()[..., :3] / scale + low
        return expected, ours(rendered_scene(), name)


def rendered_scene():
    """Our scene of the current one as a final render gives it: built from the depsgraph of a render."""
    kept = []

    class Recorder(bpy.types.RenderEngine):
        bl_idname = "RESTIR_TEST_RECORDER"
        bl_label = "Recorder"
        bl_use_preview = False

        def __init__(self, *args, **kwargs):
            super().__init__(*args, **kwargs)

        def render(self, depsgraph):
            try:
                kept.append(build_scene(depsgraph, RenderSettings()))
            except Exception as error:
                kept.append(error)

    bpy.utils.register_class(Recorder)
    try:
        bpy.context.scene.render.engine = Recorder.bl_idname
        bpy.ops.render.render()
    finally:
        bpy.context.scene.render.engine = "CYCLES"
        bpy.utils.unregister_class(Recorder)
    if isinstance(kept[0], Exception):
        raise kept[0]
    return kept[0]


@contextmanager
def override(material: bpy.types.Material):
    """Every object of the view layer has this material."""
    bpy.context.view_layer.material_override = material
    try:
        yield
    finally:
        bpy.context.view_layer.material_override = None
