"""Cryptomatte and Mist beside Cycles: what Blender's own compositor makes of either engine's passes."""

import bpy
import numpy as np
import pytest

from testing.blender import kit
from testing.blender.compositor import composited
from testing.blender.render import exact_files, register

SIZE, SAMPLES = 48, 64
MATTES = {"Object": "Würfel", "Material": "Häute", "Asset": "Wurzel"}


@pytest.fixture(scope="module")
def scene():
    """Overlapping objects: a half transparent ball before a cube, which has a parent; instances; an empty slot."""
    register()
    scene = kit.reset()
    clear = material("Klar", alpha=0.4)
    solid = material("Häute")
    shapes = bpy.ops.mesh
    add(shapes.primitive_plane_add, "Boden", None, (0, 0, -1), size=8)
    cube = add(shapes.primitive_cube_add, "Würfel", solid, (0, 0, 0))
    add(shapes.primitive_uv_sphere_add, "Ball", clear, (0.8, -1.5, 0.3))
    cube.parent = bpy.data.objects.new("Wurzel", None)
    scene.collection.objects.link(cube.parent)
    group = bpy.data.collections.new("Gruppe")
    ring = add(shapes.primitive_torus_add, "Ring", solid, (0, 0, 0), major_radius=0.6)
    scene.collection.objects.unlink(ring)
    group.objects.link(ring)
    for i in range(3):
        placed = bpy.data.objects.new(f"Ring {i}", None)
        placed.instance_type, placed.instance_collection = "COLLECTION", group
        placed.location, placed.parent = (1.5 * i - 2.0, 0.5, 1.4), cube.parent if i == 1 else None
        scene.collection.objects.link(placed)
    kit.camera((0, -7, 3), (0, 0, 0))
    scene.world = bpy.data.worlds.new("World")
    layer = scene.view_layers[0]
    for kind in MATTES:
        setattr(layer, f"use_pass_cryptomatte_{kind.lower()}", True)
    layer.pass_cryptomatte_depth, layer.use_pass_mist = 4, True
    scene.render.resolution_x = scene.render.resolution_y = SIZE
    exact_files(scene)
    scene.cycles.use_adaptive_sampling = False
    for settings in (scene.cycles, scene.restir):
        settings.samples, settings.use_denoising = SAMPLES, False
    return scene


def material(name: str, alpha: float = 1.0):
    made = bpy.data.materials.new(name)
    if bpy.app.version < (5, 0, 0):
        made.use_nodes = True
    nodes = made.node_tree.nodes
    next(n for n in nodes if n.type == "BSDF_PRINCIPLED").inputs["Alpha"].default_value = alpha
    return made


def add(operator, name: str, surface, location, **options):
    operator(location=location, **options)
    item = bpy.context.object
    item.name = name
    if surface is not None:
        item.data.materials.append(surface)
    return item


@pytest.mark.parametrize("kind", MATTES)
@pytest.mark.parametrize("integrator", ["PATH", "RESTIR"])
def test_keyed_as_cycles(scene, tmp_path, kind, integrator):
    def matte(nodes):
        node = nodes.new("CompositorNodeCryptomatteV2")
        node.source, node.scene = "RENDER", scene
        node.layer_name = f"{scene.view_layers[0].name}.Crypto{kind}"
        node.matte_id = MATTES[kind]
        return node.outputs["Matte"]

    scene.restir.integrator = integrator
    theirs, ours = (composited(scene, engine, matte, tmp_path) for engine in ("CYCLES", "RESTIR"))
    assert 0.02 < theirs.mean() < 0.5
    assert np.abs(ours - theirs).mean() < 1.0 / 255.0
    assert abs(ours.mean() - theirs.mean()) < 0.2 / 255.0


@pytest.mark.parametrize("falloff", ["LINEAR", "QUADRATIC", "INVERSE_QUADRATIC"])
def test_mist_as_cycles(scene, tmp_path, falloff):
    def mist(nodes):
        return nodes.new("CompositorNodeRLayers").outputs["Mist"]

    settings = scene.world.mist_settings
    settings.start, settings.depth, settings.falloff = 5.0, 4.0, falloff
    theirs, ours = (composited(scene, engine, mist, tmp_path) for engine in ("CYCLES", "RESTIR"))
    assert 0.1 < theirs.mean() < 0.9
    assert np.abs(ours - theirs).mean() < 0.01
    assert abs(ours.mean() - theirs.mean()) < 0.001
