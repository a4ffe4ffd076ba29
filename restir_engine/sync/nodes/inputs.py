"""Nodes that read the shading point, the object or the ray."""

from __future__ import annotations

from .registry import node


@node("ShaderNodeValue")
def value(c, node):
    return {"Value": c.constant(node.outputs[0].default_value)}


@node("ShaderNodeRGB")
def rgb(c, node):
    return {"Color": c.constant(tuple(node.outputs[0].default_value)[:3])}
