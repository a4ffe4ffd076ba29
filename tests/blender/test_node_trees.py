"""How the compiler walks trees: groups, reroutes, muted nodes, cycles, conversions, mixing and outputs."""

import bpy
import numpy as np
import pytest

from restir_engine.kernels.core import records as rec
from restir_engine.scene.description import SceneDescription
from restir_engine.settings import RenderSettings
from restir_engine.sync.depsgraph import build_scene
from restir_engine.sync.materials import Materials
from restir_engine.sync.nodes.registry import NODES
from testing.blender.nodes import add_node, compare, emission

TOLERANCE = 2e-4


def _uv(tree):
    return add_node(tree, "ShaderNodeTexCoord").outputs["UV"]


def _group(name, inner, kind="NodeSocketFloat"):
    """A group with one input and one output socket; inner(tree, input socket) → output socket."""
    group = bpy.data.node_groups.new(name, "ShaderNodeTree")
    group.interface.new_socket("In", in_out="INPUT", socket_type=kind)
    group.interface.new_socket("Out", in_out="OUTPUT", socket_type=kind)
    source, sink = group.nodes.new("NodeGroupInput"), group.nodes.new("NodeGroupOutput")
    group.links.new(inner(group, source.outputs[0]), sink.inputs[0])
    return group


def _add_group(tree, group, source=None):
    node = tree.nodes.new("ShaderNodeGroup")
    node.node_tree = group
    if source is not None:
        tree.links.new(source, node.inputs[0])
    return node


def _doubled(tree, socket):
    node = add_node(tree, "ShaderNodeMath", operation="MULTIPLY", inputs={"Value": socket, "Value_001": 2.0})
    return node.outputs[0]


def _nested(tree):
    inner = _group("Inner", _doubled)
    outer = _group("Outer", lambda group, socket: _doubled(group, _add_group(group, inner, socket).outputs[0]))
    return _add_group(tree, outer, _uv(tree)).outputs[0]


def _default_of_group(tree):
    node = _add_group(tree, _group("Default", _doubled))
    node.inputs[0].default_value = 0.3
    return node.outputs[0]


def _color_through_float_group(tree):
    # The colour becomes a float at the group's border.
    color = add_node(tree, "ShaderNodeRGB")
    color.outputs[0].default_value = (0.9, 0.3, 0.1, 1.0)
    return _add_group(tree, _group("Border", lambda group, socket: socket), color.outputs[0]).outputs[0]


def _reroute(tree):
    first, second = tree.nodes.new("NodeReroute"), tree.nodes.new("NodeReroute")
    tree.links.new(_uv(tree), first.inputs[0])
    tree.links.new(first.outputs[0], second.inputs[0])
    return second.outputs[0]


def _muted(tree):
    node = add_node(tree, "ShaderNodeInvert", inputs={"Color": _uv(tree)})
    node.mute = True
    return node.outputs[0]


def _muted_link(tree):
    node = add_node(tree, "ShaderNodeMath", inputs={"Value": 0.25, "Value_001": 0.5})
    tree.links.new(_uv(tree), node.inputs[0]).is_muted = True
    return node.outputs[0]


def _mix_shader(factor):
    def build(tree):
        first, second = add_node(tree, "ShaderNodeEmission"), add_node(tree, "ShaderNodeEmission")
        tree.links.new(_uv(tree), first.inputs["Color"])
        second.inputs["Color"].default_value = (0.1, 0.5, 0.2, 1.0)
        mix = add_node(tree, "ShaderNodeMixShader")
        tree.links.new(first.outputs[0], mix.inputs[1])
        tree.links.new(second.outputs[0], mix.inputs[2])
        if callable(factor):
            tree.links.new(factor(tree), mix.inputs[0])
        else:
            mix.inputs[0].default_value = factor
        return mix.outputs[0]

    return build


def _stripes(tree):
    """0 and 1 in turn, so that branches are skipped at some points and not at others; the coordinates are shared."""
    split = add_node(tree, "ShaderNodeSeparateXYZ", inputs={"Vector": _uv(tree)})
    scaled = add_node(tree, "ShaderNodeMath", operation="MULTIPLY", inputs={0: split.outputs[0], 1: 6.0})
    ping = add_node(tree, "ShaderNodeMath", operation="PINGPONG", inputs={0: scaled.outputs[0], 1: 1.0})
    return add_node(tree, "ShaderNodeMath", operation="GREATER_THAN", inputs={0: ping.outputs[0], 1: 0.5}).outputs[0]


def _shared_between_branches(tree):
    shared = add_node(tree, "ShaderNodeHueSaturation", inputs={"Color": _uv(tree), "Hue": 0.7})
    stripes = _stripes(tree)
    inner = add_node(tree, "ShaderNodeMixShader", inputs={"Fac": stripes})
    outer = add_node(tree, "ShaderNodeMixShader", inputs={"Fac": stripes})
    added = add_node(tree, "ShaderNodeAddShader")
    for target in (inner.inputs[1], inner.inputs[2], outer.inputs[1]):
        node = add_node(tree, "ShaderNodeEmission", inputs={"Color": shared.outputs[0], "Strength": 0.3})
        tree.links.new(node.outputs[0], target)
    tree.links.new(inner.outputs[0], outer.inputs[2])
    tree.links.new(outer.outputs[0], added.inputs[0])
    tree.links.new(inner.outputs[0], added.inputs[1])
    return added.outputs[0]


def _value_as_shader(tree):
    # A value linked to a shader socket is emitted.
    mix = add_node(tree, "ShaderNodeMixShader", inputs={"Fac": 0.25})
    tree.links.new(_uv(tree), mix.inputs[1])
    return mix.outputs[0]


CASES = {
    "nested groups": _nested,
    "default of a group": _default_of_group,
    "conversion at a group's border": _color_through_float_group,
    "reroutes": _reroute,
    "muted node": _muted,
    "muted link": _muted_link,
    "mix 0": _mix_shader(0.0),
    "mix 1": _mix_shader(1.0),
    "mix 0.3": _mix_shader(0.3),
    "mix stripes": _mix_shader(_stripes),
    "shared between branches": _shared_between_branches,
    "value as shader": _value_as_shader,
}


@pytest.fixture(scope="module")
def results():
    return compare(CASES)


@pytest.mark.parametrize("name", CASES)
def test_tree_means_what_it_means_to_cycles(results, name):
    assert results[name].error < TOLERANCE


def _compile(build):
    """(program, warnings) of a material whose surface is the socket that build(tree) returns."""
    material = bpy.data.materials.new("Tree")
    if bpy.app.version < (5, 0, 0):
        material.use_nodes = True
    material.node_tree.nodes.clear()
    output = material.node_tree.nodes.new("ShaderNodeOutputMaterial")
    material.node_tree.links.new(build(material.node_tree), output.inputs["Surface"])
    scene = SceneDescription()
    program = scene.shaders[Materials(scene).index(material)]
    return program, scene.warnings.lines()


def test_a_group_that_contains_itself_ends_with_a_warning():
    def build(tree):
        group = _group("Snake", _doubled)
        inner = group.nodes.new("ShaderNodeGroup")
        inner.node_tree = group  # Blender refuses this here and there, but files with it exist
        if inner.node_tree is not None:
            group.links.new(inner.outputs[0], group.nodes["Group Output"].inputs[0])
        return _add_group(tree, group).outputs[0]

    _, warnings = _compile(build)
    assert all("contains itself" in line for line in warnings)


def test_cyclic_links_end():
    def build(tree):
        first, second = add_node(tree, "ShaderNodeMath"), add_node(tree, "ShaderNodeMath")
        tree.links.new(first.outputs[0], second.inputs[0])
        tree.links.new(second.outputs[0], first.inputs[0])
        return first.outputs[0]

    program, _ = _compile(build)
    assert len(program.code)


@pytest.mark.parametrize("kind", ["ShaderNodeMath", "ShaderNodeAddShader", "NodeReroute"])
def test_thousands_of_nodes_in_a_row(kind):
    """Groups in a row: adding one node to a long tree takes long."""
    inside = bpy.data.node_groups.new("Row", "ShaderNodeTree")
    socket_type = "NodeSocketShader" if kind == "ShaderNodeAddShader" else "NodeSocketFloat"
    for direction in ("INPUT", "OUTPUT"):
        inside.interface.new_socket("Value", in_out=direction, socket_type=socket_type)
    socket = inside.nodes.new("NodeGroupInput").outputs[0]
    for _ in range(150):
        node = inside.nodes.new(kind)
        inside.links.new(socket, node.inputs[0])
        socket = node.outputs[0]
    inside.links.new(socket, inside.nodes.new("NodeGroupOutput").inputs[0])

    def build(tree):
        if kind == "ShaderNodeAddShader":
            socket = add_node(tree, "ShaderNodeEmission").outputs[0]
        else:
            socket = add_node(tree, "ShaderNodeNewGeometry").outputs["Backfacing"]
        for _ in range(20):
            group = add_node(tree, "ShaderNodeGroup", node_tree=inside)
            tree.links.new(socket, group.inputs[0])
            socket = group.outputs[0]
        return socket

    program, warnings = _compile(build)
    assert len(program.code) and warnings == []


def test_a_long_chain_needs_few_registers():
    """Its results together are more than there are registers. Few nodes: adding one to a long tree takes long."""
    length = rec.MAX_REGISTERS // 3 + 20

    def build(tree):
        socket = _uv(tree)
        for _ in range(length):
            inputs = {"Vector": socket, "Vector_001": (0.001, 0.002, 0.003)}
            socket = add_node(tree, "ShaderNodeVectorMath", inputs=inputs).outputs[0]
        return socket

    program, warnings = _compile(build)
    assert not warnings and len(program.code) > length * 5


def test_flags_and_estimate_of_emission():
    def mixed(tree):
        node = add_node(tree, "ShaderNodeEmission", inputs={"Color": (1.0, 0.5, 0.0, 1.0), "Strength": 4.0})
        mix = add_node(tree, "ShaderNodeMixShader", inputs={"Fac": 0.25})
        tree.links.new(node.outputs[0], mix.inputs[1])
        tree.links.new(add_node(tree, "ShaderNodeBsdfTransparent").outputs[0], mix.inputs[2])
        return mix.outputs[0]

    program, _ = _compile(mixed)
    assert program.flags & rec.MATERIAL_EMITS and program.flags & rec.MATERIAL_TRANSPARENT
    assert np.allclose(program.emission_estimate, (3.0, 1.5, 0.0))

    program, _ = _compile(lambda tree: add_node(tree, "ShaderNodeBsdfPrincipled").outputs[0])
    assert program.flags == 0 and program.emission_sampling == 1

    textured, _ = _compile(lambda tree: add_node(tree, "ShaderNodeEmission", inputs={"Color": _uv(tree)}).outputs[0])
    assert textured.flags == rec.MATERIAL_EMITS | rec.MATERIAL_VARYING_EMISSION

    black, _ = _compile(lambda tree: add_node(tree, "ShaderNodeEmission", inputs={"Strength": 0.0}).outputs[0])
    assert not black.flags & rec.MATERIAL_EMITS


def test_a_volume_without_surface_is_the_boundary_of_a_medium():
    material = bpy.data.materials.new("Fog")
    if bpy.app.version < (5, 0, 0):
        material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(add_node(tree, "ShaderNodeVolumeScatter").outputs[0], output.inputs["Volume"])
    scene = SceneDescription()
    program = scene.shaders[Materials(scene).index(material)]
    assert program.flags == rec.MATERIAL_TRANSPARENT | rec.MATERIAL_MEDIUM | rec.MATERIAL_BOUNDARY
    assert program.medium > 0 and not len(scene.warnings)


def test_a_tree_that_defeats_a_converter_is_rendered_plain(monkeypatch):
    def broken(c, node):
        raise KeyError("Surprise")

    monkeypatch.setitem(NODES, "ShaderNodeMath", broken)
    program, warnings = _compile(lambda tree: add_node(tree, "ShaderNodeMath").outputs[0])
    assert len(program.code) and len(warnings) == 1 and "Math" in warnings[0] and "Surprise" in warnings[0]


def _displaced(identifier, space):
    """Facing of a surface whose material output has a displacement."""

    def build(tree):
        facing = add_node(tree, "ShaderNodeLayerWeight", inputs={"Blend": 0.5})
        wave = add_node(tree, "ShaderNodeVectorMath", operation="SINE")
        scaled = add_node(tree, "ShaderNodeVectorMath", operation="SCALE", inputs={"Scale": 12.0})
        tree.links.new(add_node(tree, "ShaderNodeTexCoord").outputs["Generated"], scaled.inputs[0])
        tree.links.new(scaled.outputs[0], wave.inputs[0])
        source = "Height" if identifier == "ShaderNodeDisplacement" else "Vector"
        inputs = {source: wave.outputs[0], "Scale": 0.05, "Midlevel": 0.2}
        node = add_node(tree, identifier, inputs=inputs, space=space)
        output = next(n for n in tree.nodes if n.bl_idname == "ShaderNodeOutputMaterial")
        tree.links.new(node.outputs[0], output.inputs["Displacement"])
        return facing.outputs["Facing"]

    return build


DISPLACEMENTS = {
    f"{identifier} {space}": _displaced(identifier, space)
    for identifier, spaces in (
        ("ShaderNodeDisplacement", ("OBJECT", "WORLD")),
        ("ShaderNodeVectorDisplacement", ("OBJECT", "WORLD", "TANGENT")),
    )
    for space in spaces
}


def test_displacement_bends_the_normal_as_cycles_bends_it():
    for name, result in compare(DISPLACEMENTS).items():
        assert np.ptp(result.cycles) > 0.1, name
        assert result.error < 2e-3, (name, result.error)


def test_light_and_world_trees_compile():
    world = bpy.data.worlds.new("Tree")
    light = bpy.data.lights.new("Tree", "POINT")
    if bpy.app.version < (5, 0, 0):
        world.use_nodes = light.use_nodes = True
    scene = SceneDescription()
    materials = Materials(scene)
    assert materials.compile_light(light) == -1  # an emission of 1 is none of a program's business
    program = scene.shaders[materials.compile_world(world)]
    assert program.flags == rec.MATERIAL_EMITS
    tree = light.node_tree
    falloff = add_node(tree, "ShaderNodeLightFalloff", inputs={"Strength": 3.0})
    emission_node = next(node for node in tree.nodes if node.bl_idname == "ShaderNodeEmission")
    tree.links.new(falloff.outputs["Linear"], emission_node.inputs["Strength"])
    materials = Materials(scene)  # which compiles a light once
    index = materials.compile_light(light)
    assert scene.shaders[index].flags == rec.MATERIAL_EMITS | rec.MATERIAL_VARYING_EMISSION


def test_the_output_for_cycles_is_chosen():
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.mesh.primitive_plane_add(size=4.0)
    material = bpy.data.materials.new("Outputs")
    if bpy.app.version < (5, 0, 0):
        material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    for target, value in (("ALL", 0.1), ("EEVEE", 0.2), ("CYCLES", 0.3)):
        output = add_node(tree, "ShaderNodeOutputMaterial", target=target)
        node = add_node(tree, "ShaderNodeEmission", inputs={"Strength": value})
        tree.links.new(node.outputs[0], output.inputs["Surface"])
    bpy.context.object.data.materials.append(material)
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location.z = 3.0
    bpy.context.scene.collection.objects.link(camera)
    bpy.context.scene.camera = camera
    bpy.context.scene.render.resolution_x = bpy.context.scene.render.resolution_y = 4
    picture = emission(build_scene(bpy.context.evaluated_depsgraph_get(), RenderSettings()))
    assert np.allclose(picture, 0.3)
