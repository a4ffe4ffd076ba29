"""AOVs beside Cycles: what AOV Output nodes of materials, groups and the world write."""

import bpy
import numpy as np
import pytest

from restir_engine import properties
from testing.blender import kit
from testing.blender.compositor import composited
from testing.blender.render import exact_files, register

SIZE, SAMPLES = 48, 64


def output(node, name: str, value=0.0, color=(0.0, 0.0, 0.0)):
    """An AOV Output node of a tree; value and color: a number or colour, or what is linked."""
    made = node("OutputAOV", Value=value, Color=color)
    made.aov_name = name
    return made


@pytest.fixture(scope="module")
def scene():
    """A veil before a ball, a cube that writes from within a group, a floor without AOVs, and the world."""
    register()
    scene = kit.reset()

    def veil(node):
        output(node, "value", 3.0)
        return node("MixShader", {0: 0.3, 1: node("BsdfTransparent"), 2: node("BsdfDiffuse")})

    def textured(node):
        place = node("TexCoord").outputs["Generated"]
        output(node, "color", color=place)
        output(node, "value", place)
        output(node, "nobody asks", 5.0)
        return node("BsdfDiffuse")

    def grouped(node):
        group = bpy.data.node_groups.new("writes", "ShaderNodeTree")
        inside = kit.make_nodes(group)
        output(inside, "value", 7.0)
        node("ShaderNodeGroup", node_tree=group)
        return node("BsdfGlossy", Roughness=0.2)

    kit.floor(kit.diffuse())
    kit.put("ball", kit.material(textured), (-0.8, 0.0, 0.7), 0.7)
    kit.put("cube", kit.material(grouped), (1.0, 0.3, 0.5), 0.5)
    kit.put("plane", kit.material(veil), (-0.8, -1.8, 0.7), 0.5, rotation=(1.4, 0.0, 0.0))
    kit.camera((0.0, -6.0, 1.2), (0.0, 0.0, 0.9))
    kit.lamp()

    def sky(node):
        output(node, "value", 11.0)
        return node("Background", Color=(0.2, 0.3, 0.4))

    kit.world(sky)
    layer = scene.view_layers[0]
    for name, kind in (("value", "VALUE"), ("color", "COLOR")):
        aov = layer.aovs.add()
        aov.name, aov.type = name, kind
    scene.render.resolution_x = scene.render.resolution_y = SIZE
    exact_files(scene)
    scene.cycles.use_adaptive_sampling = False
    for settings in (scene.cycles, scene.restir):
        settings.samples, settings.use_denoising = SAMPLES, False
    return scene


def shown(name: str, channel: int | None = None):
    """What `composited` shows: an AOV, or a channel of it."""

    def wire(nodes):
        found = nodes.new("CompositorNodeRLayers").outputs[name]
        if channel is None:
            return found
        split = nodes.new("CompositorNodeSeparateColor")
        split.id_data.links.new(found, split.inputs[0])
        return split.outputs[channel]

    return wire


@pytest.mark.parametrize("integrator", ["PATH", "RESTIR"])
@pytest.mark.parametrize(("name", "channel"), [("value", None), ("color", 0), ("color", 3)])
def test_as_cycles(scene, tmp_path, integrator, name, channel):
    scene.restir.integrator = integrator
    theirs, ours = (composited(scene, engine, shown(name, channel), tmp_path) for engine in ("CYCLES", "RESTIR"))
    assert theirs.max() > 0.9
    # Rays through a pixel differ, so what its edges hold of each surface does.
    assert np.abs(ours - theirs).mean() < 0.02 * theirs.max()
    assert abs(ours.mean() - theirs.mean()) < 0.003 * theirs.max()


def test_names_that_mean_something_else_are_no_aovs(scene):
    layer = scene.view_layers[0]
    aov = layer.aovs.add()
    aov.name = "Depth"
    layer.use_pass_z = True
    names = [found.name for found in properties.enabled_aovs(layer)]
    layer.aovs.remove(aov)
    assert names == ["value", "color"]
