"""White Noise Texture: hashes of the coordinates' float32 bits."""

from ...core.jit import entry
from ...core.memory import load_i32, store_f64
from ...core.vec import store3_f64
from ..operands import number, triple
from .hashing import cell_color


@entry
def white_noise_op(_scene, _sp, registers, code, at):
    """White Noise Texture: see opcodes.WHITE_NOISE. The value is the colour's first component."""
    out = load_i32(code, at)
    p = triple(registers, code, at + 1)
    w = number(registers, code, at + 2)
    dimensions = load_i32(code, at + 3)
    color = cell_color(dimensions, w if dimensions == 1 else p[0], p[1], p[2], w)
    store_f64(registers, out, color[0])
    store3_f64(registers, out + 1, color)
