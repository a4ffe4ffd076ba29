"""Gabor noise (Lagae et al. 2009) with stratified impulses and Bernoulli weights (Tavernier et al. 2019), as a phasor
so that phase and intensity are known too (Tricard et al. 2019)."""

import math

from ...core.jit import device, entry
from ...core.memory import float_bits, load_i32, store_f64
from ...core.vec import normalize, scale
from ..operands import number, triple
from .hashing import TO_UNIT, lookup3
from .rounding import floor, single

_IMPULSES = 8  # per cell
# Six times the standard deviation, √(impulses · ½ · ∫kernel²), maps practically all values to [-1, 1].
_LIMIT_2D = 6.0 * math.sqrt(_IMPULSES * 0.5 * 0.25)
_LIMIT_3D = 6.0 * math.sqrt(_IMPULSES * 0.5 / (4.0 * math.sqrt(2.0)))


@device
def _window(square):
    """Gaussian envelope with a Hann window, by squared distance below 1."""
    return math.exp(-math.pi * square) * (0.5 + 0.5 * math.cos(math.pi * square))


@device
def _cell_2d(cx, cy, x, y, frequency, isotropy, angle):
    """The phasor that a cell's impulses add at (x, y), relative to the cell's corner."""
    real, imaginary = 0.0, 0.0
    i, j = float_bits(cx), float_bits(cy)
    for n in range(_IMPULSES):
        center = float_bits(3.0 * n + 1.0)
        dx = x - lookup3((i, j, center)) * TO_UNIT
        dy = y - lookup3((center, i, j)) * TO_UNIT
        square = dx * dx + dy * dy
        if square >= 1.0:
            continue
        turn = angle + isotropy * math.pi * (lookup3((i, j, float_bits(3.0 * n))) * TO_UNIT - 0.5)
        phase = 2.0 * math.pi * frequency * (dx * math.cos(turn) + dy * math.sin(turn))
        weight = _window(square)
        if lookup3((i, j, float_bits(3.0 * n + 2.0))) * TO_UNIT < 0.5:
            weight = -weight
        real += weight * math.cos(phase)
        imaginary += weight * math.sin(phase)
    return real, imaginary


@device
def _cell_3d(cx, cy, cz, x, y, z, frequency, isotropy, inclination, azimuth):
    real, imaginary = 0.0, 0.0
    i, j, k = float_bits(cx), float_bits(cy), float_bits(cz)
    for n in range(_IMPULSES):
        center = float_bits(3.0 * n + 1.0)
        dx = x - lookup3((i, j, k, center)) * TO_UNIT
        dy = y - lookup3((k, i, center, j)) * TO_UNIT
        dz = z - lookup3((center, k, j, i)) * TO_UNIT
        square = dx * dx + dy * dy + dz * dz
        if square >= 1.0:
            continue
        seed = float_bits(3.0 * n)
        theta = inclination + isotropy * math.pi * lookup3((i, j, k, seed)) * TO_UNIT
        phi = azimuth + isotropy * math.pi * lookup3((k, i, seed, j)) * TO_UNIT
        along = math.sin(theta) * (dx * math.cos(phi) + dy * math.sin(phi)) + dz * math.cos(theta)
        phase = 2.0 * math.pi * frequency * along
        weight = _window(square)
        if lookup3((i, j, k, float_bits(3.0 * n + 2.0))) * TO_UNIT < 0.5:
            weight = -weight
        real += weight * math.cos(phase)
        imaginary += weight * math.sin(phase)
    return real, imaginary


@device
def _noise_2d(x, y, frequency, isotropy, angle):
    real, imaginary = 0.0, 0.0
    cx, cy = floor(x), floor(y)
    for j in range(-1, 2):
        for i in range(-1, 2):
            a, b = _cell_2d(cx + i, cy + j, x - cx - i, y - cy - j, frequency, isotropy, angle)
            real += a
            imaginary += b
    return real, imaginary


@device
def _noise_3d(x, y, z, frequency, isotropy, o):
    real, imaginary = 0.0, 0.0
    cx, cy, cz = floor(x), floor(y), floor(z)
    inclination, azimuth = math.acos(min(max(o[2], -1.0), 1.0)), math.atan2(o[1], o[0])
    for k in range(-1, 2):
        for j in range(-1, 2):
            for i in range(-1, 2):
                a, b = _cell_3d(
                    cx + i,
                    cy + j,
                    cz + k,
                    x - cx - i,
                    y - cy - j,
                    z - cz - k,
                    frequency,
                    isotropy,
                    inclination,
                    azimuth,
                )
                real += a
                imaginary += b
    return real, imaginary


@entry
def gabor_op(_scene, _sp, registers, code, at):
    """Gabor Texture: see opcodes.GABOR."""
    out = load_i32(code, at)
    p = scale(triple(registers, code, at + 1), number(registers, code, at + 2))
    x, y, z = single(p[0]), single(p[1]), single(p[2])
    frequency = max(number(registers, code, at + 3), 0.001)
    isotropy = 1.0 - min(max(number(registers, code, at + 4), 0.0), 1.0)
    if load_i32(code, at + 7) == 2:
        real, imaginary = _noise_2d(x, y, frequency, isotropy, number(registers, code, at + 5))
        limit = _LIMIT_2D
    else:
        orientation = normalize(triple(registers, code, at + 6))
        real, imaginary = _noise_3d(x, y, z, frequency, isotropy, orientation)
        limit = _LIMIT_3D
    store_f64(registers, out, 0.5 * imaginary / limit + 0.5)
    store_f64(registers, out + 1, (math.atan2(imaginary, real) + math.pi) / (2.0 * math.pi))
    store_f64(registers, out + 2, math.sqrt(real * real + imaginary * imaginary) / limit)
