"""The coordinates of a texture node: what is linked or the default, through the mapping that the node carries."""

from __future__ import annotations

import numpy as np
from mathutils import Euler, Matrix, Vector

from ...kernels.shading.textures import opcodes as ops

_AXES = {"X": 0, "Y": 1, "Z": 2}


def texture_vector(c, node) -> int:
    """The register of a texture's coordinates."""
    vector = c.vector(node, "Vector")
    table = mapping_table(node.texture_mapping)
    if table is None:
        return vector
    out = c.allocate(3)
    c.emit(ops.TEXTURE_MAPPING, out, vector, c.table(table), int(node.texture_mapping.vector_type == "NORMAL"))
    return out


def _projection(texture_mapping) -> Matrix:
    """The matrix that picks a coordinate, or nothing, for each axis."""
    rows = Matrix.Diagonal(Vector((0.0, 0.0, 0.0, 1.0)))
    for axis, choice in enumerate((texture_mapping.mapping_x, texture_mapping.mapping_y, texture_mapping.mapping_z)):
        if choice in _AXES:
            rows[axis][_AXES[choice]] = 1.0
    return rows


def _changes_nothing(texture_mapping) -> bool:
    """Whether all is as in a new node, which is so in nearly all."""
    return (
        texture_mapping.vector_type == "POINT"
        and texture_mapping.translation[:] == texture_mapping.rotation[:] == (0.0, 0.0, 0.0)
        and texture_mapping.scale[:] == (1.0, 1.0, 1.0)
        and (texture_mapping.mapping_x, texture_mapping.mapping_y, texture_mapping.mapping_z) == ("X", "Y", "Z")
    )


def mapping_table(texture_mapping) -> np.ndarray | None:
    """The 3x4 matrix of a TexMapping, None where it changes nothing. Cycles ignores its limits, so we do."""
    if _changes_nothing(texture_mapping):
        return None
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
    if kind != "NORMAL" and matrix == Matrix.Identity(4):
        return None
    return np.array([matrix[row][column] for row in range(3) for column in range(4)], np.float32)
