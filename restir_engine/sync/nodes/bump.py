"""Nodes that bend the shading normal, tangents and displacement."""

from __future__ import annotations

import bpy

from ...kernels.shading import opcodes as ops
from ...scene import names
from .inputs import point
from .registry import node

DISPLACEMENT_FILTER_WIDTH = 0.1  # Cycles' constant for displacement that is rendered as bump


def _heights(c, width: int, height) -> list[int]:
    """Registers of the three values of `height()`: at the point itself and at the two shifted ones."""
    values = []
    for offset in range(3):
        with c.shifted(offset, width if offset else -1):
            values.append(height())
    return values


@node("ShaderNodeBump")
def bump(c, node):
    normal = c.normal(node)
    if not c.is_linked(node, "Height"):
        return {"Normal": point(c, ops.POINT_NORMAL) if normal < 0 else normal}
    width, strength = c.value(node, "Filter Width", 1.0), c.value(node, "Strength")
    distance = c.value(node, "Distance")
    if node.invert:
        flipped = c.allocate(1)
        c.emit(ops.MULTIPLY, flipped, 1, distance, c.constant(-1.0))
        distance = flipped
    heights = _heights(c, width, lambda: c.value(node, "Height"))
    out = c.allocate(3)
    c.emit(ops.BUMP, out, normal, *heights, strength, distance, width, ops.BUMP_IN_WORLD)
    return {"Normal": out}


@node("ShaderNodeNormalMap")
def normal_map(c, node):
    color = c.vector(node, "Color")
    if getattr(node, "convention", "OPENGL") == "DIRECTX":
        flipped = c.allocate(3)
        c.emit(ops.SUBTRACT, flipped + 1, 1, c.constant(1.0), color + 1)
        c.emit(ops.COMBINE, flipped, color, flipped + 1, color + 2)
        color = flipped
    out = c.allocate(3)
    tangent = c.attribute(names.tangent(node.uv_map)) if node.space == "TANGENT" else 0
    strength, unit = c.value(node, "Strength"), bpy.app.version >= (5, 0, 0)  # Cycles 4.5 leaves its length alone
    c.emit(ops.NORMAL_MAP, out, ops.NORMAL_SPACES.index(node.space), tangent, color, strength, unit)
    return {"Normal": out}


@node("ShaderNodeTangent")
def tangent(c, node):
    out = c.allocate(3)
    if node.direction_type == "UV_MAP":
        c.emit(ops.UV_TANGENT, out, c.attribute(names.tangent(node.uv_map)))
    else:
        c.emit(ops.RADIAL_TANGENT, out, "XYZ".index(node.axis))
    return {"Tangent": out}


@node("ShaderNodeDisplacement")
def displacement(c, node):
    numbers = [c.value(node, name) for name in ("Height", "Midlevel", "Scale")]
    out = c.allocate(3)
    c.emit(ops.DISPLACEMENT, out, node.space == "OBJECT", *numbers, c.normal(node))
    return {"Displacement": out}


@node("ShaderNodeVectorDisplacement")
def vector_displacement(c, node):
    vector, middle, scale = c.vector(node, "Vector"), c.value(node, "Midlevel"), c.value(node, "Scale")
    out = c.allocate(3)
    space = ops.NORMAL_SPACES.index(node.space)
    c.emit(ops.VECTOR_DISPLACEMENT, out, space, c.attribute(names.tangent()), vector, middle, scale)
    return {"Displacement": out}


def displaced_normal(c, output, moves: bool) -> int:
    """The shading normal that a material output's displacement stands for; moves: of vertices that it has displaced."""
    width, one = c.constant(DISPLACEMENT_FILTER_WIDTH), c.constant(1.0)
    zero, dot = c.constant((0.0, 0.0, 0.0)), ops.VECTOR_OPERATIONS.index("DOT_PRODUCT")
    normal = point(c, ops.POINT_NORMAL)
    space = c.attribute(names.UNDISPLACED) if moves else ops.BUMP_IN_WORLD

    def height() -> int:
        out = c.allocate(3)
        c.emit(ops.VECTOR_MATH, out, dot, c.vector(output, "Displacement"), normal, zero, one)
        return out

    out = c.allocate(3)
    c.emit(ops.BUMP, out, -1, *_heights(c, width, height), one, one, width, space)
    return out
