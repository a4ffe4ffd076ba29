"""Where texture nodes take their coordinates from, and the mapping that the nodes themselves carry."""

from __future__ import annotations

import numpy as np
from mathutils import Euler, Matrix, Vector

from ...kernels import opcodes as vm
from ...kernels.textures import mapping
from ...kernels.textures import opcodes as ops
from .inputs import point_value, uv_map

_AXES = {"X": 0, "Y": 1, "Z": 2}


def texture_vector(c, node, unlinked: int = vm.POINT_GENERATED) -> int:
    """The register of a texture's coordinates: what is linked, or POINT_* of the shading point; mapped by the node."""
    if c.is_linked(node, "Vector"):
        vector = c.vector(node, "Vector")
    else:
        vector = point_value(c, unlinked)
    return _mapped(c, node.texture_mapping, vector)


def texture_uv(c, node) -> int:
    """As `texture_vector`, for textures that are laid on by the render UV map."""
    vector = c.vector(node, "Vector") if c.is_linked(node, "Vector") else uv_map(c, "")
    return _mapped(c, node.texture_mapping, vector)


def _mapped(c, texture_mapping, vector: int) -> int:
    table = mapping_table(texture_mapping)
    if table is None:
        return vector
    flags = mapping.NORMALIZE if texture_mapping.vector_type == "NORMAL" else 0
    flags |= mapping.USE_MINIMUM if texture_mapping.use_min else 0
    flags |= mapping.USE_MAXIMUM if texture_mapping.use_max else 0
    out = c.allocate(3)
    c.emit(ops.TEXTURE_MAPPING, out, vector, c.table(table), flags)
    return out


def _projection(texture_mapping) -> Matrix:
    """The matrix that picks a coordinate, or nothing, for each axis."""
    rows = Matrix.Diagonal(Vector((0.0, 0.0, 0.0, 1.0)))
    for axis, choice in enumerate((texture_mapping.mapping_x, texture_mapping.mapping_y, texture_mapping.mapping_z)):
        if choice in _AXES:
            rows[axis][_AXES[choice]] = 1.0
    return rows


def mapping_table(texture_mapping) -> np.ndarray | None:
    """Rows of the 3x4 matrix, minimum and maximum of a TexMapping; None where it changes nothing."""
    kind = texture_mapping.vector_type
    scale = Vector(texture_mapping.scale)
    if kind in ("TEXTURE", "NORMAL"):  # they divide by it
        scale = Vector([s if abs(s) >= 1e-5 else (-1e-5 if s < 0.0 else 1e-5) for s in scale])
    turn = Euler(texture_mapping.rotation).to_matrix().to_4x4() @ Matrix.Diagonal((*scale, 1.0))
    moved = Matrix.Translation(texture_mapping.translation) @ turn
    if kind == "TEXTURE":
        matrix = moved.inverted()
    elif kind == "POINT":
        matrix = moved
    elif kind == "VECTOR":
        matrix = turn
    else:
        matrix = turn.inverted().transposed()
    matrix = matrix @ _projection(texture_mapping)
    limited = texture_mapping.use_min or texture_mapping.use_max
    if kind != "NORMAL" and not limited and matrix == Matrix.Identity(4):
        return None
    rows = [matrix[row][column] for row in range(3) for column in range(4)]
    return np.array([*rows, *texture_mapping.min, *texture_mapping.max], np.float32)
