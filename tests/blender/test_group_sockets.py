"""Values through the sockets of groups against Cycles: every pair of socket types, each with its own conversion."""

import itertools

import bpy
import pytest

from testing.blender.nodes import add_node, compare

TYPES = ("Int", "Bool", "Float", "Color", "Vector")
SOURCES = {
    "ShaderNodeValue": (0.7, 0.2, 2.999, -1.4, 0.0),
    "ShaderNodeRGB": ((0.9, 0.1, 0.2, 1.0), (0.0, 0.0, 0.0, 1.0), (3.2, 1.8, 0.4, 1.0)),
    "ShaderNodeCombineXYZ": ((1.7, 0.2, 0.2), (0.0, 0.0, 0.2), (-4.3, 0.5, 0.1)),
}


def group(inner, outer):
    """A group whose one input of type `inner` is linked to its one output of type `outer`."""
    tree = bpy.data.node_groups.new("Group", "ShaderNodeTree")
    tree.interface.new_socket("In", in_out="INPUT", socket_type=f"NodeSocket{inner}")
    tree.interface.new_socket("Out", in_out="OUTPUT", socket_type=f"NodeSocket{outer}")
    tree.links.new(tree.nodes.new("NodeGroupInput").outputs[0], tree.nodes.new("NodeGroupOutput").inputs[0])
    return tree


def through(inner, outer, source, value):
    """The output of a group into which a node's constant output goes, or whose input has a value of its own."""

    def build(tree):
        node = add_node(tree, "ShaderNodeGroup", node_tree=group(inner, outer))
        if source is None:
            node.inputs[0].default_value = value
            return node.outputs[0]
        given = tree.nodes.new(source)
        if source == "ShaderNodeCombineXYZ":
            for socket, number in zip(given.inputs, value, strict=True):
                socket.default_value = number
        else:
            given.outputs[0].default_value = value
        tree.links.new(given.outputs[0], node.inputs[0])
        return node.outputs[0]

    return build


def into_number(build):
    """The same into an input that takes a number."""

    def outer(tree):
        return add_node(
            tree, "ShaderNodeMath", operation="ADD", inputs={"Value_001": 0.25, "Value": build(tree)}
        ).outputs[0]

    return outer


@pytest.mark.parametrize("end", [lambda build: build, into_number], ids=["colour", "number"])
def test_every_pair_of_types(end):
    cases = {}
    for inner, outer in itertools.product(TYPES, TYPES):
        for source, values in SOURCES.items():
            for value in values:
                cases[f"{source} {value} into {inner}, {outer}"] = end(through(inner, outer, source, value))
    wrong = {name: (p.cycles[4, 4], p.ours[4, 4]) for name, p in compare(cases).items() if not p.error <= 1e-4}
    assert not wrong, "\n".join(f"{name}: {values}" for name, values in wrong.items())


def test_values_of_the_sockets_themselves():
    values = {"Int": 2, "Bool": True, "Float": 1.7, "Color": (0.9, 0.1, 0.1, 1.0), "Vector": (0.3, 1.2, 0.1)}
    cases = {}
    for inner, outer in itertools.product(TYPES, TYPES):
        cases[f"{inner}, {outer}"] = through(inner, outer, None, values[inner])
    wrong = {name: (p.cycles[4, 4], p.ours[4, 4]) for name, p in compare(cases).items() if not p.error <= 1e-4}
    assert not wrong, "\n".join(f"{name}: {values}" for name, values in wrong.items())


def test_values_that_vary():
    def texture(kind):
        def source(tree):
            coordinates = add_node(tree, "ShaderNodeTexCoord").outputs["UV"]
            inputs = {"Vector": coordinates, "Vector_001": (7.0, -5.0, 0.0), "Vector_002": (0.3, 0.1, 0.6)}
            scaled = add_node(tree, "ShaderNodeVectorMath", operation="MULTIPLY_ADD", inputs=inputs).outputs[0]
            if kind == "value":
                return add_node(tree, "ShaderNodeSeparateXYZ", inputs={"Vector": scaled}).outputs["X"]
            return scaled

        return source

    def varying(inner, outer, source):
        def build(tree):
            node = add_node(tree, "ShaderNodeGroup", node_tree=group(inner, outer))
            tree.links.new(source(tree), node.inputs[0])
            return node.outputs[0]

        return build

    cases = {}
    for inner, outer in itertools.product(TYPES, TYPES):
        for kind in ("value", "vector"):
            cases[f"{kind} into {inner}, {outer}"] = varying(inner, outer, texture(kind))
    wrong = {}
    for name, parity in compare(cases).items():
        # Where a number jumps to the next, the points beside the middle of a pixel may differ.
        differs = abs(parity.cycles - parity.ours).max(-1) > 2e-3
        if differs.mean() > 0.05:
            wrong[name] = parity.cycles[3, 3:5], parity.ours[3, 3:5]
    assert not wrong, "\n".join(f"{name}: {values}" for name, values in wrong.items())
