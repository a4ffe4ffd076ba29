"""White Noise Texture: hashes of the coordinates' float32 bits."""

from ...core.jit import device
from ...core.memory import load_i32, store_f64
from .hashing import cell_color
from .registers import value, vector, write


@device
def white_noise_op(registers, code, at):
    """White Noise Texture: see opcodes.WHITE_NOISE. The value is the colour's first component."""
    out = load_i32(code, at)
    p = vector(registers, code, at + 1)
    w = value(registers, code, at + 2)
    dimensions = load_i32(code, at + 3)
    color = cell_color(dimensions, w if dimensions == 1 else p[0], p[1], p[2], w)
    store_f64(registers, out, color[0])
    write(registers, out + 1, color)
