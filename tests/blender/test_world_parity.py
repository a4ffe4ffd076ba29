"""Worlds and emissive meshes over a diffuse plane: our irradiance against Cycles' picture."""

import warnings

import bpy
import numpy as np
import pytest

from restir_engine.settings import RenderSettings
from restir_engine.sync.depsgraph import build_scene
from testing.blender.plane import SIZE, cycles, plane_irradiance


def world_tree():
    world = bpy.data.worlds.new("world")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)
        world.use_nodes = True
    bpy.context.scene.world = world
    bpy.context.scene.cycles.samples = 256
    tree = world.node_tree
    tree.nodes.clear()
    background, output = tree.nodes.new("ShaderNodeBackground"), tree.nodes.new("ShaderNodeOutputWorld")
    tree.links.new(background.outputs[0], output.inputs["Surface"])
    return tree, background


def ours():
    scene = build_scene(bpy.context.evaluated_depsgraph_get(), RenderSettings())
    return scene, plane_irradiance(scene, 1024)


def environment_image(path, size=(64, 32)):
    """A dim sky with a bright patch, as an EXR file."""
    values = np.full((size[1], size[0], 4), 0.2, np.float32)
    values[20:24, 10:14, :3] = (60.0, 30.0, 10.0)
    values[..., 3] = 1.0
    image = bpy.data.images.new("sky", *size, float_buffer=True)
    image.pixels.foreach_set(values.ravel())
    image.filepath_raw, image.file_format = str(path / "sky.exr"), "OPEN_EXR"
    image.save()
    loaded = bpy.data.images.load(image.filepath_raw)
    loaded.colorspace_settings.name = "Linear Rec.709"  # 5.2 takes another from the file's metadata
    return loaded


def test_environment_image(stage, tmp_path):
    tree, background = world_tree()
    texture = tree.nodes.new("ShaderNodeTexEnvironment")
    texture.image = environment_image(tmp_path)
    mapping, coordinates = tree.nodes.new("ShaderNodeMapping"), tree.nodes.new("ShaderNodeTexCoord")
    mapping.inputs["Rotation"].default_value = (0.2, 0.1, 1.0)
    tree.links.new(coordinates.outputs["Generated"], mapping.inputs["Vector"])
    tree.links.new(mapping.outputs[0], texture.inputs[0])
    tree.links.new(texture.outputs["Color"], background.inputs["Color"])
    reference = cycles(tmp_path)
    scene, mine = ours()
    assert scene.world.sampled
    assert mine.mean() == pytest.approx(reference.mean(), rel=5e-3)


@pytest.mark.parametrize("elevation, method", [(0.6, "AUTOMATIC"), (0.05, "MANUAL")])
def test_sky_with_sun(elevation, method, stage, tmp_path):
    """However coarse the map is that the artist chooses, the sun is found."""
    tree, background = world_tree()
    settings = bpy.context.scene.world.cycles
    settings.sampling_method, settings.sample_map_resolution = method, 64
    sky = tree.nodes.new("ShaderNodeTexSky")
    sky.sky_type = "NISHITA" if bpy.app.version < (5, 0, 0) else "MULTIPLE_SCATTERING"
    sky.sun_elevation, sky.sun_rotation = elevation, 2.0
    tree.links.new(sky.outputs[0], background.inputs["Color"])
    reference = cycles(tmp_path)
    scene, mine = ours()
    assert scene.world.record["sun"] > 0.0
    assert mine.mean() == pytest.approx(reference.mean(), rel=5e-3)


def test_world_that_the_camera_sees_differs(stage, tmp_path):
    """Light Path: the camera sees red, the plane is lit by a gradient of white."""
    tree, background = world_tree()
    path, mix = tree.nodes.new("ShaderNodeLightPath"), tree.nodes.new("ShaderNodeMix")
    mix.data_type = "RGBA"
    coordinates, half = tree.nodes.new("ShaderNodeTexCoord"), tree.nodes.new("ShaderNodeVectorMath")
    half.operation = "MULTIPLY_ADD"
    half.inputs[1].default_value = half.inputs[2].default_value = (0.5, 0.5, 0.5)
    tree.links.new(coordinates.outputs["Generated"], half.inputs[0])
    a, b = (s for s in mix.inputs if s.enabled and s.type == "RGBA")
    b.default_value = (100.0, 0.0, 0.0, 1.0)
    tree.links.new(path.outputs["Is Camera Ray"], mix.inputs[0])
    tree.links.new(half.outputs[0], a)
    result = next(s for s in mix.outputs if s.enabled)
    tree.links.new(result, background.inputs["Color"])
    reference = cycles(tmp_path)
    _, mine = ours()
    assert mine.mean() == pytest.approx(reference.mean(), rel=5e-3)


@pytest.mark.parametrize("textured", [False, True])
def test_emissive_mesh(textured, stage, tmp_path):
    mesh = bpy.data.meshes.new("lamp")
    mesh.from_pydata([(-1, -1, 1), (1, -1, 1), (1, 1, 1.5), (-1, 1, 1.5)], [], [(3, 2, 1, 0)])
    material = bpy.data.materials.new("glow")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)
        material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    emission, output = tree.nodes.new("ShaderNodeEmission"), tree.nodes.new("ShaderNodeOutputMaterial")
    emission.inputs["Strength"].default_value = 3.0
    tree.links.new(emission.outputs[0], output.inputs["Surface"])
    if textured:
        coordinates = tree.nodes.new("ShaderNodeTexCoord")
        tree.links.new(coordinates.outputs["Generated"], emission.inputs["Color"])
    mesh.materials.append(material)
    item = bpy.data.objects.new("lamp", mesh)
    item.scale = (1.5, 0.7, 1.0)
    item.visible_camera = False
    stage.collection.objects.link(item)
    reference = cycles(tmp_path)
    scene, mine = ours()
    assert scene.lights.record["n_emitters"] == 1
    assert mine.mean() == pytest.approx(reference.mean(), rel=5e-3)
    assert mine.shape == (SIZE, SIZE)
