"""Surfaces that a file says little or too much of, against Cycles: lit by a white world, seen by both engines."""

import bpy
import numpy as np
import pytest

from restir_engine.settings import RenderSettings
from restir_engine.sync.depsgraph import build_scene
from testing.blender.nodes import add_node


def plane(scene, material):
    mesh = bpy.data.meshes.new("Plane")
    mesh.from_pydata([(-4, -4, 0), (4, -4, 0), (4, 4, 0), (-4, 4, 0)], [], [(0, 1, 2, 3)])
    if material != "no slot":
        mesh.materials.append(material)
    scene.collection.objects.link(bpy.data.objects.new("Plane", mesh))
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location, camera.rotation_euler = (0.0, -5.0, 1.5), (1.3, 0.0, 0.0)
    camera.data.lens = 100
    scene.collection.objects.link(camera)
    scene.camera = camera
    world = bpy.data.worlds.new("World")
    if bpy.app.version < (5, 0, 0):
        world.use_nodes = True
    scene.world = world
    background = next(n for n in world.node_tree.nodes if n.bl_idname == "ShaderNodeBackground")
    background.inputs["Color"].default_value = (1.0, 1.0, 1.0, 1.0)
    background.inputs["Strength"].default_value = 1.0


def tree_material(name="Material"):
    material = bpy.data.materials.new(name)
    if bpy.app.version < (5, 0, 0):
        material.use_nodes = True
    material.node_tree.nodes.clear()
    return material


def pictures(scene, folder):
    """(ours, Cycles'): mean colours of the frame."""
    scene.render.resolution_x, scene.render.resolution_y = 32, 24
    scene.view_settings.view_transform = "Standard"
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.image_settings.color_depth = "32"
    scene.restir.samples = scene.cycles.samples = 64
    scene.cycles.use_adaptive_sampling = scene.cycles.use_denoising = scene.restir.use_denoising = False
    scene.cycles.sample_clamp_indirect = scene.restir.clamp_indirect = 0.0
    scene.restir.is_initialized = True
    result = []
    for engine in ("RESTIR", "CYCLES"):
        scene.render.engine = engine
        scene.render.filepath = str(folder / engine)
        bpy.ops.render.render(write_still=True)
        image = bpy.data.images.load(str(folder / f"{engine}.exr"))
        image.colorspace_settings.is_data = True
        pixels = np.empty(image.size[0] * image.size[1] * image.channels, np.float32)
        image.pixels.foreach_get(pixels)
        result.append(pixels.reshape(-1, image.channels)[:, :3])
    return result


@pytest.mark.parametrize("material", ["no slot", None], ids=["no slot", "empty slot"])
def test_without_a_material(scene, material, tmp_path):
    plane(scene, material)
    ours, cycles = pictures(scene, tmp_path)
    assert np.allclose(ours.mean(0), cycles.mean(0), atol=0.004)


@pytest.mark.parametrize("count", [33, 48, 64, 80])
def test_many_closures(scene, count, tmp_path):
    material = tree_material()
    tree, last = material.node_tree, None
    for k in range(count):
        inputs = {"Color": (1.0, 1.0, 1.0, 1.0), "Roughness": k / count}
        shader = add_node(tree, "ShaderNodeBsdfDiffuse", inputs=inputs).outputs[0]
        if last is not None:
            mix = add_node(tree, "ShaderNodeMixShader", inputs={"Fac": 1.0 / (k + 1)})
            tree.links.new(last, mix.inputs[1])
            tree.links.new(shader, mix.inputs[2])
            shader = mix.outputs[0]
        last = shader
    tree.links.new(last, tree.nodes.new("ShaderNodeOutputMaterial").inputs[0])
    plane(scene, material)
    ours, cycles = pictures(scene, tmp_path)
    assert np.allclose(ours.mean(0), cycles.mean(0), atol=0.004)
    from restir_engine import warning_log

    said = [line for line in warning_log.lines(scene.name) if "closures" in line]
    assert bool(said) == (count > 64)


@pytest.mark.parametrize("strength", [np.inf, np.nan, 3e38])
@pytest.mark.parametrize("color", [1.0, 9.0])
def test_emission_that_is_no_number(scene, strength, color, tmp_path):
    material = tree_material()
    tree = material.node_tree
    value = add_node(tree, "ShaderNodeValue")
    value.outputs[0].default_value = strength
    inputs = {"Color": (color, color, color, 1.0), "Strength": value.outputs[0]}
    emission = add_node(tree, "ShaderNodeEmission", inputs=inputs).outputs[0]
    tree.links.new(emission, tree.nodes.new("ShaderNodeOutputMaterial").inputs[0])
    plane(scene, material)
    ours, _ = pictures(scene, tmp_path)
    assert np.isfinite(ours).all()


@pytest.mark.parametrize("shape", ["SQUARE", "RECTANGLE", "DISK", "ELLIPSE"])
def test_area_lamps_without_an_area(scene, shape):
    """Cycles' are black; those of the smallest size are not."""
    light = bpy.data.lights.new("Light", "AREA")
    light.shape = shape
    item = bpy.data.objects.new("Light", light)
    scene.collection.objects.link(item)
    plane(scene, None)

    def lamps():
        return len(build_scene(bpy.context.evaluated_depsgraph_get(), RenderSettings()).lights.lamps)

    assert lamps() == 1
    light.size = 1e-4
    assert lamps() == 1
    light.size = 0.0
    assert lamps() == 0
    light.size = 1.0
    item.scale = (1.0, 0.0, 1.0)
    assert lamps() == 0
