"""Repeat zones, closures, bundles and menu switches against Cycles: materials, worlds and lights of Blender 5."""

import bpy
import numpy as np
import pytest

from restir_engine.settings import RenderSettings
from restir_engine.sync.depsgraph import build_scene
from testing.blender.nodes import add_node, compare

pytestmark = pytest.mark.skipif(bpy.app.version < (5, 0, 0), reason="nodes of Blender 5")


def _paint(tree):
    return add_node(tree, "ShaderNodeVertexColor", layer_name="Paint").outputs["Color"]


def repeated(tree):
    """A colour doubled three times."""
    start, end = tree.nodes.new("GeometryNodeRepeatInput"), tree.nodes.new("GeometryNodeRepeatOutput")
    start.pair_with_output(end)
    end.repeat_items.clear()
    end.repeat_items.new("RGBA", "Colour")
    start.inputs["Iterations"].default_value = 3
    tree.links.new(_paint(tree), start.inputs["Colour"])
    inputs = {"Vector": start.outputs["Colour"], "Scale": 2.0}
    doubled = add_node(tree, "ShaderNodeVectorMath", operation="SCALE", inputs=inputs)
    tree.links.new(doubled.outputs[0], end.inputs["Colour"])
    return end.outputs["Colour"]


def closure(tree):
    """A closure that gives the colour attribute, evaluated."""
    start, end = tree.nodes.new("NodeClosureInput"), tree.nodes.new("NodeClosureOutput")
    start.pair_with_output(end)
    end.output_items.new("RGBA", "Colour")
    tree.links.new(_paint(tree), end.inputs["Colour"])
    evaluated = tree.nodes.new("NodeEvaluateClosure")
    evaluated.output_items.new("RGBA", "Colour")
    tree.links.new(end.outputs[0], evaluated.inputs["Closure"])
    return evaluated.outputs["Colour"]


def bundle(tree):
    """A colour and a number packed and taken out again."""
    packed, taken = tree.nodes.new("NodeCombineBundle"), tree.nodes.new("NodeSeparateBundle")
    for node in (packed, taken):
        node.bundle_items.new("RGBA", "Colour")
        node.bundle_items.new("FLOAT", "Number")
    tree.links.new(_paint(tree), packed.inputs["Colour"])
    packed.inputs["Number"].default_value = 0.3
    tree.links.new(packed.outputs[0], taken.inputs[0])
    inputs = {"Vector": taken.outputs["Colour"], "Scale": taken.outputs["Number"]}
    return add_node(tree, "ShaderNodeVectorMath", operation="SCALE", inputs=inputs).outputs[0]


def bundled_shader(tree):
    packed, taken = tree.nodes.new("NodeCombineBundle"), tree.nodes.new("NodeSeparateBundle")
    for node in (packed, taken):
        node.bundle_items.new("SHADER", "Shader")
    emission = add_node(tree, "ShaderNodeEmission", inputs={"Color": _paint(tree)})
    tree.links.new(emission.outputs[0], packed.inputs["Shader"])
    tree.links.new(packed.outputs[0], taken.inputs[0])
    return taken.outputs["Shader"]


def chosen(choice):
    def build(tree):
        node = tree.nodes.new("GeometryNodeMenuSwitch")
        node.data_type = "RGBA"
        node.inputs["A"].default_value = (0.2, 0.4, 0.1, 1.0)
        tree.links.new(_paint(tree), node.inputs["B"])
        node.inputs["Menu"].default_value = choice
        return node.outputs[0]

    return build


def menu_of_a_group(tree):
    """The menu is a socket of a group that holds the switch."""
    inside = bpy.data.node_groups.new("Switch", "ShaderNodeTree")
    switch = chosen("A")(inside).node
    inside.interface.new_socket("Menu", in_out="INPUT", socket_type="NodeSocketMenu")
    inside.interface.new_socket("Colour", in_out="OUTPUT", socket_type="NodeSocketColor")
    inside.links.new(inside.nodes.new("NodeGroupInput").outputs[0], switch.inputs["Menu"])
    inside.links.new(switch.outputs[0], inside.nodes.new("NodeGroupOutput").inputs[0])
    node = add_node(tree, "ShaderNodeGroup", node_tree=inside)
    node.inputs[0].default_value = "B"
    return node.outputs[0]


def test_materials():
    cases = {case.__name__: case for case in (repeated, closure, bundle, bundled_shader, menu_of_a_group)}
    cases |= {f"menu {choice}": chosen(choice) for choice in "AB"}
    for name, parity in compare(cases).items():
        assert parity.error < 4e-4, (name, parity.cycles[3, 3], parity.ours[3, 3])


@pytest.mark.parametrize("output", ["Seconds", "Frame"])
def test_scene_time(output):
    if not hasattr(bpy.types, "GeometryNodeInputSceneTime"):
        pytest.skip("a node of Blender 5.2")

    def time(tree):
        bpy.context.scene.frame_set(50, subframe=0.25)
        bpy.context.scene.render.fps, bpy.context.scene.render.fps_base = 30, 1.25
        return tree.nodes.new("GeometryNodeInputSceneTime").outputs[output]

    parity = compare({"time": time}, scale=0.01)["time"]
    assert np.ptp(parity.cycles) == 0.0 and parity.error < 1e-4, (parity.cycles[3, 3], parity.ours[3, 3])


def test_worlds_and_lights(scene):
    """Both emit half of blue, by a menu."""

    def emit(tree, identifier):
        switch = chosen("A")(tree).node
        switch.inputs["A"].default_value = (0.0, 0.0, 0.5, 1.0)
        node = next(node for node in tree.nodes if node.bl_idname == identifier)
        tree.links.new(switch.outputs[0], node.inputs["Color"])

    light = bpy.data.lights.new("Light", "POINT")
    light.energy = 100.0
    emit(light.node_tree, "ShaderNodeEmission")
    scene.collection.objects.link(bpy.data.objects.new("Light", light))
    scene.camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    scene.collection.objects.link(scene.camera)
    scene.world = bpy.data.worlds.new("World")
    emit(scene.world.node_tree, "ShaderNodeBackground")
    built = build_scene(bpy.context.evaluated_depsgraph_get(), RenderSettings())
    assert built.warnings.lines() == []
    estimate = built.shaders.materials[built.world.material]["emission_estimate"]
    assert np.allclose(estimate, (0.0, 0.0, 0.5))
    strength = built.lights.lamps[0]["strength"]
    assert strength[2] > 0.0 and not strength[:2].any()
