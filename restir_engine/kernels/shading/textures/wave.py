"""Wave Texture: bands and rings, distorted by fractal noise."""

import math

from ...core.jit import device, entry
from ...core.memory import load_i32, store_f64
from ..operands import number, triple
from .noise import FBM, FLAG_NORMALIZE, fractal_noise
from .rounding import floor, off_grid

BANDS, RINGS = 0, 1
X, Y, Z, DIAGONAL, SPHERICAL = 0, 1, 2, 3, 3
SINE, SAW, TRIANGLE = 0, 1, 2
_NOISE_FLAGS = 3 | FBM << 4 | FLAG_NORMALIZE


@device
def _phase(kind, direction, x, y, z):
    """Phase in radians before distortion."""
    if kind == BANDS:
        if direction == DIAGONAL:
            return (x + y + z) * 10.0
        return 20.0 * (x if direction == X else (y if direction == Y else z))
    if direction == X:
        x = 0.0
    elif direction == Y:
        y = 0.0
    elif direction == Z:
        z = 0.0
    return 20.0 * math.sqrt(x * x + y * y + z * z)


@entry
def wave_op(_scene, _sp, registers, code, at):
    """Wave Texture: see opcodes.WAVE; flags: kind | direction << 4 | profile << 8."""
    p = triple(registers, code, at + 1)
    scale = number(registers, code, at + 2)
    distortion = number(registers, code, at + 3)
    flags = load_i32(code, at + 8)
    x, y, z = off_grid(p[0] * scale), off_grid(p[1] * scale), off_grid(p[2] * scale)
    n = _phase(flags & 15, (flags >> 4) & 15, x, y, z) + number(registers, code, at + 7)
    if distortion != 0.0:
        detail = min(max(number(registers, code, at + 4), 0.0), 15.0)
        s = number(registers, code, at + 5)
        roughness = max(number(registers, code, at + 6), 0.0)
        noise = fractal_noise(_NOISE_FLAGS, x * s, y * s, z * s, 0.0, detail, roughness, 2.0, 0.0, 0.0)
        n += distortion * (2.0 * noise - 1.0)
    profile = (flags >> 8) & 15
    turns = n / (2.0 * math.pi)
    if profile == SINE:
        result = 0.5 - 0.5 * math.cos(n)
    elif profile == SAW:
        result = turns - floor(turns)
    else:
        result = 2.0 * abs(turns - floor(turns + 0.5))
    store_f64(registers, load_i32(code, at), result)
