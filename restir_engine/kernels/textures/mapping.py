"""The mapping that a texture node itself carries: a matrix, a range, and for normals a unit length."""

from ..jit import device
from ..memory import load_f32, load_i32
from ..vec import normalize
from .registers import vector, write

NORMALIZE, USE_MINIMUM, USE_MAXIMUM = 1, 2, 4


@device
def _row(table, row, p):
    return (
        load_f32(table, row) * p[0]
        + load_f32(table, row + 1) * p[1]
        + load_f32(table, row + 2) * p[2]
        + load_f32(table, row + 3)
    )


@device
def texture_mapping_op(scene, registers, code, at):
    """See opcodes.TEXTURE_MAPPING; the table: a row-major 3x4 matrix, the minimum, the maximum."""
    table = scene.tables + 4 * load_i32(code, at + 2)
    flags = load_i32(code, at + 3)
    p = vector(registers, code, at + 1)
    p = (_row(table, 0, p), _row(table, 4, p), _row(table, 8, p))
    if flags & NORMALIZE:
        p = normalize(p)
    if flags & USE_MINIMUM:
        p = (max(p[0], load_f32(table, 12)), max(p[1], load_f32(table, 13)), max(p[2], load_f32(table, 14)))
    if flags & USE_MAXIMUM:
        p = (min(p[0], load_f32(table, 15)), min(p[1], load_f32(table, 16)), min(p[2], load_f32(table, 17)))
    write(registers, load_i32(code, at), p)
