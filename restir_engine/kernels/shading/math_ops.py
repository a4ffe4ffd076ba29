"""Shader instructions 20–39: numbers and vectors to others, as Cycles' nodes define them."""

import math

from ..core.jit import device, entry
from ..core.memory import load_f64, load_i32, store_f64
from ..core.vec import add, cross, dot, length, load3_f64, madd, neg, normalize, scale, store3_f64, sub
from . import opcodes as ops
from .operands import number, opcode, triple


@device
def divide(a, b):
    """a / b, 0 where b is 0."""
    return a / b if b != 0.0 else 0.0


@device
def divide3(a, b):
    return (divide(a[0], b[0]), divide(a[1], b[1]), divide(a[2], b[2]))


@device
def clamp(x, low, high):
    return min(max(x, low), high)


@device
def floor(x):
    """The integer at or below x, as a float; numbers too large for a fraction are their own floor."""
    return float(math.floor(x)) if abs(x) < 4.0e15 else x


@device
def _truncate(x):
    return floor(x) if x >= 0.0 else -floor(-x)


@device
def _power(a, b):
    if (a < 0.0 and b != floor(b)) or (a == 0.0 and b < 0.0):
        return 0.0
    return a**b


@device
def _smooth_minimum(a, b, k):
    if k == 0.0:
        return min(a, b)
    h = max(k - abs(a - b), 0.0) / k
    return min(a, b) - h * h * h * k * (1.0 / 6.0)


@device
def _wrap(x, high, low):
    span = high - low
    return x - span * floor((x - low) / span) if span != 0.0 else low


@device
def _ping_pong(x, length):
    if length == 0.0:
        return 0.0
    turns = (x - length) / (2.0 * length)
    return abs((turns - floor(turns)) * 2.0 * length - length)


@device
def _arithmetic(mode, a, b, c):
    """The first 16 of MATH_OPERATIONS."""
    if mode == 0:
        return a + b
    if mode == 1:
        return a - b
    if mode == 2:
        return a * b
    if mode == 3:
        return divide(a, b)
    if mode == 4:
        return a * b + c
    if mode == 5:
        return _power(a, b)
    if mode == 6:
        return divide(math.log(a), math.log(b)) if a > 0.0 and b > 0.0 else 0.0
    if mode == 7:
        return math.sqrt(max(a, 0.0))
    if mode == 8:
        return 1.0 / math.sqrt(a) if a > 0.0 else 0.0
    if mode == 9:
        return abs(a)
    if mode == 10:
        return math.exp(min(a, 80.0))
    if mode == 11:
        return min(a, b)
    if mode == 12:
        return max(a, b)
    if mode == 13:
        return 1.0 if a < b else 0.0
    if mode == 14:
        return 1.0 if a > b else 0.0
    return 0.0 if a == 0.0 else (-1.0 if a < 0.0 else 1.0)


@device
def _rounding(mode, a, b, c):
    """MATH_OPERATIONS 16 to 28."""
    if mode == 16:
        return 1.0 if abs(a - b) <= max(c, 1.1920929e-7) else 0.0
    if mode == 17:
        return _smooth_minimum(a, b, c)
    if mode == 18:
        return -_smooth_minimum(-a, -b, c)
    if mode == 19:
        return floor(a + 0.5)
    if mode == 20:
        return floor(a)
    if mode == 21:
        return -floor(-a)
    if mode == 22:
        return _truncate(a)
    if mode == 23:
        return a - floor(a)
    if mode == 24:
        return a - _truncate(a / b) * b if b != 0.0 else 0.0
    if mode == 25:
        return a - floor(a / b) * b if b != 0.0 else 0.0
    if mode == 26:
        return _wrap(a, b, c)
    if mode == 27:
        return floor(divide(a, b)) * b
    return _ping_pong(a, b)


@device
def _trigonometry(mode, a, b):
    """MATH_OPERATIONS from 29 on."""
    if mode < 32:
        return math.sin(a) if mode == 29 else math.cos(a) if mode == 30 else math.tan(a)
    if mode < 34:
        x = clamp(a, -1.0, 1.0)
        return math.asin(x) if mode == 32 else math.acos(x)
    if mode == 34:
        return math.atan(a)
    if mode == 35:
        return math.atan2(a, b) if a != 0.0 or b != 0.0 else 0.0
    if mode < 38:
        x = clamp(a, -80.0, 80.0)
        return math.sinh(x) if mode == 36 else math.cosh(x)
    if mode == 38:
        return math.tanh(a)
    return a * (math.pi / 180.0 if mode == 39 else 180.0 / math.pi)


@device
def math_value(mode, a, b, c):
    """One of MATH_OPERATIONS, finite for finite inputs."""
    if mode < 16:
        return _arithmetic(mode, a, b, c)
    if mode < 29:
        return _rounding(mode, a, b, c)
    return _trigonometry(mode, a, b)


@device
def _refract(i, n, eta):
    cosine = dot(n, i)
    k = 1.0 - eta * eta * (1.0 - cosine * cosine)
    if k < 0.0:
        return (0.0, 0.0, 0.0)
    return madd(scale(i, eta), n, -(eta * cosine + math.sqrt(k)))


@device
def _vector_value(mode, a, b, c, s):
    """One of VECTOR_OPERATIONS; numbers stand in the first component."""
    if mode == 0:
        return cross(a, b)
    if mode == 1:
        return scale(b, divide(dot(a, b), dot(b, b)))
    if mode == 2:
        n = normalize(b)
        return madd(a, n, -2.0 * dot(a, n))
    if mode == 3:
        return _refract(a, normalize(b), s)
    if mode == 4:
        return a if dot(c, b) < 0.0 else neg(a)
    if mode == 5:
        return (dot(a, b), 0.0, 0.0)
    if mode == 6:
        return (length(sub(a, b)), 0.0, 0.0)
    if mode == 7:
        return (length(a), 0.0, 0.0)
    return normalize(a)


@device
def _map_range(mode, of_vector, value, from_min, from_max, to_min, to_max, steps):
    if from_min == from_max:
        return to_min if of_vector else 0.0
    t = (value - from_min) / (from_max - from_min)
    if mode == 1:
        t = floor(t * (steps + 1.0)) / steps if steps > 0.0 else 0.0
    elif mode >= 2:
        t = clamp(t, 0.0, 1.0)
        t = t * t * (3.0 - 2.0 * t) if mode == 2 else t * t * t * (t * (t * 6.0 - 15.0) + 10.0)
    return to_min + t * (to_max - to_min)


@device
def rotate_euler(v, angles, inverse):
    """v turned by XYZ Euler angles, or by the inverse of that rotation."""
    cx, sx = math.cos(angles[0]), math.sin(angles[0])
    cy, sy = math.cos(angles[1]), math.sin(angles[1])
    cz, sz = math.cos(angles[2]), math.sin(angles[2])
    x = (cy * cz, cy * sz, -sy)
    y = (sy * sx * cz - cx * sz, sy * sx * sz + cx * cz, cy * sx)
    z = (sy * cx * cz + sx * sz, sy * cx * sz - sx * cz, cy * cx)
    if inverse:
        return (dot(x, v), dot(y, v), dot(z, v))
    return madd(madd(scale(x, v[0]), y, v[1]), z, v[2])


@device
def _mapping(mode, v, location, rotation, size):
    if mode == 1:
        return divide3(rotate_euler(sub(v, location), rotation, True), size)
    if mode == 3:
        return normalize(rotate_euler(divide3(v, size), rotation, False))
    scaled = rotate_euler((v[0] * size[0], v[1] * size[1], v[2] * size[2]), rotation, False)
    return add(scaled, location) if mode == 0 else scaled


@device
def _rotate_axis(v, center, axis, angle):
    """v turned about an axis through `center` (Rodrigues' formula); unchanged for a zero axis."""
    k = normalize(axis)
    if dot(k, k) == 0.0:
        return v
    p = sub(v, center)
    cosine, sine = math.cos(angle), math.sin(angle)
    turned = madd(madd(scale(p, cosine), cross(k, p), sine), k, dot(k, p) * (1.0 - cosine))
    return add(turned, center)


@device
def affine(registers, matrix, p):
    """A point by the 3x4 matrix in 12 registers."""
    x = dot(load3_f64(registers, matrix), p) + load_f64(registers, matrix + 3)
    y = dot(load3_f64(registers, matrix + 4), p) + load_f64(registers, matrix + 7)
    z = dot(load3_f64(registers, matrix + 8), p) + load_f64(registers, matrix + 11)
    return (x, y, z)


@device
def _number_op(op, registers, code, at):
    """Instructions that leave one number."""
    if op == ops.MATH:
        return math_value(
            load_i32(code, at + 1),
            number(registers, code, at + 2),
            number(registers, code, at + 3),
            number(registers, code, at + 4),
        )
    if op == ops.CLAMP:
        low, high = number(registers, code, at + 2), number(registers, code, at + 3)
        if load_i32(code, at + 4) and low > high:
            low, high = high, low
        return clamp(number(registers, code, at + 1), low, high)
    return _map_range(
        load_i32(code, at + 1),
        load_i32(code, at + 2) != 0,
        number(registers, code, at + 3),
        number(registers, code, at + 4),
        number(registers, code, at + 5),
        number(registers, code, at + 6),
        number(registers, code, at + 7),
        number(registers, code, at + 8),
    )


@device
def _triple_op(op, registers, code, at):
    """Instructions that leave a vector."""
    if op == ops.AFFINE:
        return affine(registers, load_i32(code, at + 2), triple(registers, code, at + 1))
    if op == ops.NORMALIZE:
        return normalize(triple(registers, code, at + 1))
    mode = load_i32(code, at + 1)
    a, b = triple(registers, code, at + 2), triple(registers, code, at + 3)
    c = triple(registers, code, at + 4)
    if op == ops.MATH3:
        x = math_value(mode, a[0], b[0], c[0])
        return (x, math_value(mode, a[1], b[1], c[1]), math_value(mode, a[2], b[2], c[2]))
    if op == ops.VECTOR_MATH:
        return _vector_value(mode, a, b, c, number(registers, code, at + 5))
    if op == ops.MAPPING:
        return _mapping(mode, a, b, c, triple(registers, code, at + 5))
    return (0.0, 0.0, 0.0)


@device
def _rotation_op(op, registers, code, at):
    if op == ops.ROTATE_AXIS:
        center, axis = triple(registers, code, at + 2), triple(registers, code, at + 3)
        return _rotate_axis(triple(registers, code, at + 1), center, axis, number(registers, code, at + 4))
    center = triple(registers, code, at + 3)
    v = sub(triple(registers, code, at + 2), center)
    return add(rotate_euler(v, triple(registers, code, at + 4), load_i32(code, at + 1) != 0), center)


@entry
def math_op(_scene, _sp, registers, code, at):
    """Run one instruction of this family."""
    op = opcode(code, at)
    out = load_i32(code, at)
    if op <= ops.MAP_RANGE:
        store_f64(registers, out, _number_op(op, registers, code, at))
    elif op >= ops.ROTATE_AXIS:
        store3_f64(registers, out, _rotation_op(op, registers, code, at))
    else:
        store3_f64(registers, out, _triple_op(op, registers, code, at))
