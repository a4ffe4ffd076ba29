"""Numbers and vectors to others: maths, ranges, Mix, mapping, rotations, transforms, Separate and Combine XYZ."""

from __future__ import annotations

from functools import partial

import numpy as np

from ...kernels.shading import opcodes as ops
from .registry import node


def clamped(c, register: int) -> int:
    """The register of a number limited to 0 … 1."""
    out = c.allocate(1)
    c.emit(ops.CLAMP, out, register, c.constant(0.0), c.constant(1.0), 0)
    return out


_SIMPLE = {"ADD": ops.ADD, "SUBTRACT": ops.SUBTRACT, "MULTIPLY": ops.MULTIPLY}


@node("ShaderNodeMath")
def math(c, node):
    a, b, d = (c.value(node, socket.identifier) for socket in node.inputs)
    out = c.allocate(1)
    if node.operation in _SIMPLE:
        c.emit(_SIMPLE[node.operation], out, 1, a, b)
    else:
        c.emit(ops.MATH, out, ops.MATH_OPERATIONS.index(node.operation), a, b, d)
    return {"Value": clamped(c, out) if node.use_clamp else out}


# Vector operations that act on each component like a number's.
_BY_COMPONENT = {name: name for name in ops.MATH_OPERATIONS} | {"FRACTION": "FRACT"}


@node("ShaderNodeVectorMath")
def vector_math(c, node):
    operation = node.operation
    a, b, d = (c.vector(node, name) for name in ("Vector", "Vector_001", "Vector_002"))
    scale = c.value(node, "Scale", 1.0)
    out = c.allocate(3)
    if operation == "SCALE":
        factor = c.allocate(3)
        c.emit(ops.SPLAT, factor, scale)
        c.emit(ops.MULTIPLY, out, 3, a, factor)
    elif operation in _SIMPLE:
        c.emit(_SIMPLE[operation], out, 3, a, b)
    elif operation in ops.VECTOR_OPERATIONS:
        c.emit(ops.VECTOR_MATH, out, ops.VECTOR_OPERATIONS.index(operation), a, b, d, scale)
    else:
        c.emit(ops.MATH3, out, ops.MATH_OPERATIONS.index(_BY_COMPONENT[operation]), a, b, d)
    return {"Vector": out, "Value": out}


@node("ShaderNodeClamp")
def clamp(c, node):
    out = c.allocate(1)
    limits = c.value(node, "Min"), c.value(node, "Max")
    c.emit(ops.CLAMP, out, c.value(node, "Value"), *limits, node.clamp_type == "RANGE")
    return {"Result": out}


@node("ShaderNodeMapRange")
def map_range(c, node):
    mode = ops.MAP_RANGE_MODES.index(node.interpolation_type)
    of_vector = node.data_type == "FLOAT_VECTOR"
    if of_vector:
        names = ("Vector", "From_Min_FLOAT3", "From_Max_FLOAT3", "To_Min_FLOAT3", "To_Max_FLOAT3", "Steps_FLOAT3")
        operands = [c.vector(node, name) for name in names]
    else:
        names = ("Value", "From Min", "From Max", "To Min", "To Max", "Steps")
        operands = [c.value(node, name) for name in names]
    out = c.allocate(3 if of_vector else 1)
    for k in range(3 if of_vector else 1):
        c.emit(ops.MAP_RANGE, out + k, mode, of_vector, *(operand + k for operand in operands))
        if node.clamp and mode < 2:  # the smooth modes do not leave the range
            c.emit(ops.CLAMP, out + k, out + k, operands[3] + k, operands[4] + k, 1)
    return {"Vector" if of_vector else "Result": out}


@node("ShaderNodeMix")
def mix(c, node):
    if node.data_type == "RGBA":
        factor = c.value(node, "Factor_Float")
        factor = clamped(c, factor) if node.clamp_factor else factor
        return {"Result_Color": mix_color(c, node, factor, "A_Color", "B_Color", node.clamp_result)}
    if node.data_type == "FLOAT":
        factor, a, b = (c.value(node, name) for name in ("Factor_Float", "A_Float", "B_Float"))
        return {"Result_Float": _mix_components(c, node, [factor], a, b, 1)}
    kind = "Rotation" if node.data_type == "ROTATION" else "Vector"
    if kind == "Vector" and node.factor_mode == "NON_UNIFORM":
        factors = [c.vector(node, "Factor_Vector") + k for k in range(3)]
    else:
        factors = [c.value(node, "Factor_Float")]
    a, b = c.vector(node, f"A_{kind}"), c.vector(node, f"B_{kind}")
    return {f"Result_{kind}": _mix_components(c, node, factors, a, b, 3)}


def _mix_components(c, node, factors: list[int], a: int, b: int, count: int) -> int:
    if node.clamp_factor:
        factors = [clamped(c, factor) for factor in factors]
    out = c.allocate(count)
    if len(factors) == 1:
        c.emit(ops.MIX, out, count, a, b, factors[0])
    else:
        for k, factor in enumerate(factors):
            c.emit(ops.MIX, out + k, 1, a + k, b + k, factor)
    return out


def mix_color(c, node, factor: int, first: str, second: str, clamp_result: bool) -> int:
    """Two colour inputs of a node mixed by its blend type."""
    out = c.allocate(3)
    a, b = c.vector(node, first), c.vector(node, second)
    if node.blend_type == "MIX":
        c.emit(ops.MIX, out, 3, a, b, factor)
    else:
        c.emit(ops.MIX_COLOR, out, ops.BLEND_MODES.index(node.blend_type), factor, a, b)
    if clamp_result:
        c.emit(ops.CLAMP_COLOR, out, out)
    return out


@node("ShaderNodeCombineXYZ")
def combine_xyz(c, node):
    out = c.allocate(3)
    c.emit(ops.COMBINE, out, *(c.value(node, name) for name in "XYZ"))
    return {"Vector": out}


@node("ShaderNodeSeparateXYZ")
def separate_xyz(c, node):
    vector = c.vector(node, "Vector")
    return {"X": vector, "Y": vector + 1, "Z": vector + 2}


@node("ShaderNodeMapping")
def mapping(c, node):
    vector = c.vector(node, "Vector")
    parts = [c.vector(node, name) for name in ("Location", "Rotation", "Scale")]
    matrix = c.folded(_MAPPINGS[node.vector_type], *((part, 3) for part in parts))
    out = c.allocate(3)
    if matrix is None:
        c.emit(ops.MAPPING, out, ops.MAPPING_TYPES.index(node.vector_type), vector, *parts)
        return {"Vector": out}
    c.emit(ops.AFFINE, out, vector, matrix)
    if node.vector_type == "NORMAL":
        c.emit(ops.NORMALIZE, out, out)
    return {"Vector": out}


def _mapping_matrix(kind: str, location, rotation, scale) -> tuple[float, ...]:
    """The 3x4 matrix, row by row, of a Mapping node whose inputs are constant."""
    (cx, cy, cz), (sx, sy, sz) = np.cos(rotation).tolist(), np.sin(rotation).tolist()
    turn = np.array(
        [
            [cy * cz, sy * sx * cz - cx * sz, sy * cx * cz + sx * sz],
            [cy * sz, sy * sx * sz + cx * cz, sy * cx * sz - sx * cz],
            [-sy, cy * sx, cy * cx],
        ]
    )
    scale = np.array(scale)
    inverse_scale = np.divide(1.0, scale, out=np.zeros(3), where=scale != 0.0)
    if kind == "TEXTURE":
        matrix = inverse_scale[:, None] * turn.T
        return tuple(np.column_stack([matrix, -matrix @ np.array(location)]).ravel().tolist())
    matrix = turn * (inverse_scale if kind == "NORMAL" else scale)
    return tuple(np.column_stack([matrix, location if kind == "POINT" else np.zeros(3)]).ravel().tolist())


_MAPPINGS = {kind: partial(_mapping_matrix, kind) for kind in ops.MAPPING_TYPES}


@node("ShaderNodeVectorRotate")
def vector_rotate(c, node):
    vector, center = c.vector(node, "Vector"), c.vector(node, "Center")
    out = c.allocate(3)
    if node.rotation_type == "EULER_XYZ":
        c.emit(ops.ROTATE_EULER, out, node.invert, vector, center, c.vector(node, "Rotation"))
        return {"Vector": out}
    axes = {"X_AXIS": (1.0, 0.0, 0.0), "Y_AXIS": (0.0, 1.0, 0.0), "Z_AXIS": (0.0, 0.0, 1.0)}
    known = axes.get(node.rotation_type)
    axis = c.vector(node, "Axis") if known is None else c.constant(known)
    angle = c.value(node, "Angle")
    if node.invert:
        turned = c.allocate(1)
        c.emit(ops.MULTIPLY, turned, 1, angle, c.constant(-1.0))
        angle = turned
    c.emit(ops.ROTATE_AXIS, out, vector, center, axis, angle)
    return {"Vector": out}


@node("ShaderNodeVectorTransform")
def vector_transform(c, node):
    spaces = ops.SPACES.index(node.convert_from), ops.SPACES.index(node.convert_to)
    out = c.allocate(3)
    kind = ops.TRANSFORM_TYPES.index(node.vector_type)
    c.emit(ops.VECTOR_TRANSFORM, out, kind, *spaces, c.vector(node, "Vector"))
    return {"Vector": out}


@node("ShaderNodeNormal")
def normal(c, node):
    direction = c.folded(_unit, (c.parameter(node.outputs["Normal"]), 3))
    zero = c.constant((0.0, 0.0, 0.0))

    def product() -> int:
        unit, out = c.allocate(3), c.allocate(3)
        c.emit(ops.NORMALIZE, unit, c.vector(node, "Normal"))
        dot = ops.VECTOR_OPERATIONS.index("DOT_PRODUCT")
        c.emit(ops.VECTOR_MATH, out, dot, direction, unit, zero, c.constant(1.0))
        return out

    return {"Normal": direction, "Dot": product}


def _unit(vector: tuple[float, ...]) -> tuple[float, ...]:
    direction = np.array(vector)
    length = np.linalg.norm(direction)
    return tuple((direction / length).tolist()) if length > 0.0 else vector
