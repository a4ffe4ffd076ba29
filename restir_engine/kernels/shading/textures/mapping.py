"""The mapping that a texture node itself carries: a matrix, and for normals a unit length."""

from ...core.jit import device, entry
from ...core.memory import load_f32, load_i32
from ...core.records import scene_at
from ...core.vec import normalize, store3_f64
from ..operands import triple


@device
def _row(table, row, p):
    return (
        load_f32(table, row) * p[0]
        + load_f32(table, row + 1) * p[1]
        + load_f32(table, row + 2) * p[2]
        + load_f32(table, row + 3)
    )


@entry
def texture_mapping_op(scene, _sp, registers, code, at):
    """See opcodes.TEXTURE_MAPPING; the table is a row-major 3x4 matrix."""
    scene = scene_at(scene, 0)
    table = scene.tables + 4 * load_i32(code, at + 2)
    p = triple(registers, code, at + 1)
    p = (_row(table, 0, p), _row(table, 4, p), _row(table, 8, p))
    store3_f64(registers, load_i32(code, at), normalize(p) if load_i32(code, at + 3) else p)
