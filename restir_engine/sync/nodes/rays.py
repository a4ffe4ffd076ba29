"""Nodes that trace rays of their own."""

from __future__ import annotations

from ...kernels.shading import opcodes as ops
from .registry import node


@node("ShaderNodeAmbientOcclusion")
def ambient_occlusion(c, node):
    free = c.allocate(1)
    distance = c.value(node, "Distance")
    if node.samples < 1:
        return {"AO": c.constant(1.0), "Color": c.vector(node, "Color")}
    c.emit(ops.AMBIENT_OCCLUSION, free, distance, node.samples, node.inside, node.only_local, c.normal(node))

    def color() -> int:
        grey, out = c.allocate(3), c.allocate(3)
        c.emit(ops.SPLAT, grey, free)
        c.emit(ops.MULTIPLY, out, 3, c.vector(node, "Color"), grey)
        return out

    return {"AO": free, "Color": color}


@node("ShaderNodeBevel")
def bevel(c, node):
    out = c.allocate(3)
    c.emit(ops.BEVEL, out, c.value(node, "Radius"), node.samples, c.normal(node))
    return {"Normal": out}


@node("ShaderNodeRaycast")
def raycast(c, node):
    out = c.allocate(9)
    operands = c.vector(node, "Position"), c.vector(node, "Direction"), c.value(node, "Length")
    c.emit(ops.RAYCAST, out, *operands, node.only_local)
    if len(node.sample_attribute_items):
        c.warn("attributes of what a Raycast hits are left out")
    names = ("Is Hit", "Self Hit", "Hit Distance", "Hit Position", "Hit Normal")
    return dict(zip(names, (out, out + 1, out + 2, out + 3, out + 6), strict=True))
