"""Nodes that shader trees share with other kinds of trees (Blender 5): constants, Menu Switch, Implicit Conversion."""

from __future__ import annotations

from .registry import closure, node


@node("FunctionNodeInputBool")
def boolean(c, node):
    return {"Boolean": c.constant(float(node.boolean))}


@node("FunctionNodeInputInt")
def integer(c, node):
    return {"Integer": c.constant(float(node.integer))}


@node("FunctionNodeInputVector")
def vector(c, node):
    return {"Vector": c.constant((*tuple(node.vector), 0.0, 0.0)[:3])}


@node("NodeImplicitConversion")
def implicit_conversion(c, node):
    return {"Value": lambda: c.converted(node, node.inputs[0].identifier, node.outputs[0])}


def _chosen(c, node) -> str | None:
    """The input that a Menu Switch passes on. A link to the menu is not followed."""
    choice = c.look_at(node.inputs[0])
    return next((socket.identifier for socket in node.inputs[1:] if socket.name == choice), None)


@node("GeometryNodeMenuSwitch")
def menu_switch(c, node):
    chosen = _chosen(c, node)
    if chosen is None:
        return {}
    flags = {output.identifier: c.constant(float(output.identifier == chosen)) for output in node.outputs[1:]}
    return flags | {"Output": lambda: c.converted(node, chosen, node.outputs[0])}


@closure("GeometryNodeMenuSwitch")
def menu_switch_shader(c, node, weight):
    chosen = _chosen(c, node)
    if chosen is not None:
        c.closure(node, chosen, weight)
