"""Patterns without noise: checker, brick, gradient, magic."""

import math

from ...core.jit import device, entry
from ...core.memory import load_i32, store_f64
from ...core.vec import lerp, scale, store3_f64
from ..operands import number, triple
from .rounding import off_grid, single, wrap

LINEAR, QUADRATIC, EASING, DIAGONAL, RADIAL, QUADRATIC_SPHERE, SPHERICAL = 0, 1, 2, 3, 4, 5, 6
_TURN = 6.2831854820251465  # float32's 2π, whose error counts at far coordinates


@device
def _checker_cell(x):
    """Parity of the unit interval."""
    return math.floor(off_grid(x)) & 1


@entry
def checker_op(_scene, _sp, registers, code, at):
    """Checker Texture: see opcodes.CHECKER."""
    out = load_i32(code, at)
    p = scale(triple(registers, code, at + 1), number(registers, code, at + 4))
    odd = _checker_cell(p[0]) ^ _checker_cell(p[1]) ^ _checker_cell(p[2])
    color = triple(registers, code, at + 2) if odd else triple(registers, code, at + 3)
    store3_f64(registers, out, color)
    store_f64(registers, out + 3, 1.0 if odd else 0.0)


@device
def _brick_tint(n):
    """A number in [0, 1) for a brick: an integer polynomial in 32 bits."""
    n = (n + 1013) & 0x7FFFFFFF
    n = (n >> 13) ^ n
    square = (n * n * 60493 + 19990303) & 0xFFFFFFFF
    return ((n * square + 1376312589) & 0x7FFFFFFF) / 2147483648.0


@device
def _safe(x):
    """A divisor: x, kept away from zero."""
    return x if abs(x) > 1e-12 else 1e-12


@entry
def brick_op(_scene, _sp, registers, code, at):
    """Brick Texture: see opcodes.BRICK."""
    out = load_i32(code, at)
    p = scale(triple(registers, code, at + 1), number(registers, code, at + 5))
    mortar_size = number(registers, code, at + 6)
    mortar_smooth = number(registers, code, at + 7)
    width = number(registers, code, at + 9)
    height = _safe(number(registers, code, at + 10))
    offset_frequency, squash_frequency = load_i32(code, at + 13), load_i32(code, at + 14)
    row = math.floor(single(p[1] / height))
    shift = 0.0
    if offset_frequency != 0 and squash_frequency != 0:
        if row % squash_frequency == 0:
            width *= number(registers, code, at + 12)
        if row % offset_frequency == 0:
            shift = width * number(registers, code, at + 11)
    width = _safe(width)
    brick = math.floor(single((p[0] + shift) / width))
    x = p[0] + shift - width * brick
    y = p[1] - height * row
    tint = _brick_tint((row << 16) + (brick & 0xFFFF)) + number(registers, code, at + 8)
    tint = min(max(tint, 0.0), 1.0)
    distance = min(min(x, y), min(width - x, height - y))
    mortar = 0.0
    if distance < mortar_size:
        mortar = 1.0
        if mortar_smooth != 0.0:
            mortar = min(max((1.0 - distance / mortar_size) / mortar_smooth, 0.0), 1.0)
            mortar = mortar * mortar * (3.0 - 2.0 * mortar)
    color = lerp(triple(registers, code, at + 2), triple(registers, code, at + 3), tint)
    store3_f64(registers, out, lerp(color, triple(registers, code, at + 4), mortar))
    store_f64(registers, out + 3, mortar)


@device
def _gradient(kind, p):
    if kind == LINEAR:
        return p[0]
    if kind == QUADRATIC:
        return max(p[0], 0.0) ** 2.0
    if kind == EASING:
        r = min(max(p[0], 0.0), 1.0)
        return r * r * (3.0 - 2.0 * r)
    if kind == DIAGONAL:
        return 0.5 * (p[0] + p[1])
    if kind == RADIAL:
        return math.atan2(p[1], p[0]) / (2.0 * math.pi) + 0.5
    # Just below 1, so that a point on the unit sphere gives exactly 0.
    r = max(0.999999 - math.sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]), 0.0)
    return r * r if kind == QUADRATIC_SPHERE else r


@entry
def gradient_op(_scene, _sp, registers, code, at):
    """Gradient Texture: see opcodes.GRADIENT."""
    f = _gradient(load_i32(code, at + 2), triple(registers, code, at + 1))
    store_f64(registers, load_i32(code, at), min(max(f, 0.0), 1.0))


@device
def _magic(p, depth, distortion):
    """The waves of Magic Texture: x, y, z replace one another, one of them at each further depth."""
    x = math.sin((p[0] + p[1] + p[2]) * 5.0)
    y = math.cos((-p[0] + p[1] - p[2]) * 5.0)
    z = -math.cos((-p[0] - p[1] + p[2]) * 5.0)
    if depth > 0:
        x, y, z = x * distortion, y * distortion, z * distortion
        y = -math.cos(x - y + z) * distortion
    if depth > 1:
        x = math.cos(x - y - z) * distortion
    if depth > 2:
        z = math.sin(-x - y - z) * distortion
    if depth > 3:
        x = -math.cos(-x + y - z) * distortion
    if depth > 4:
        y = -math.sin(-x + y + z) * distortion
    if depth > 5:
        y = -math.cos(-x + y + z) * distortion
    if depth > 6:
        x = math.cos(x + y + z) * distortion
    if depth > 7:
        z = math.sin(x + y - z) * distortion
    if depth > 8:
        x = -math.cos(-x - y + z) * distortion
    if depth > 9:
        y = -math.sin(x - y + z) * distortion
    if distortion != 0.0:
        half = 0.5 / distortion
        x, y, z = x * half, y * half, z * half
    return (0.5 - x, 0.5 - y, 0.5 - z)


@device
def _turn(p, factor):
    """p · factor modulo a full turn by component."""
    return (
        wrap(single(p[0] * factor), _TURN),
        wrap(single(p[1] * factor), _TURN),
        wrap(single(p[2] * factor), _TURN),
    )


@entry
def magic_op(_scene, _sp, registers, code, at):
    """Magic Texture: see opcodes.MAGIC. Before Blender 5 the coordinates wrap before they are scaled."""
    out = load_i32(code, at)
    p = triple(registers, code, at + 1)
    factor = number(registers, code, at + 2)
    p = _turn(p, factor) if load_i32(code, at + 5) else scale(_turn(p, 1.0), factor)
    color = _magic(p, load_i32(code, at + 4), number(registers, code, at + 3))
    store3_f64(registers, out, color)
    store_f64(registers, out + 3, (color[0] + color[1] + color[2]) / 3.0)
