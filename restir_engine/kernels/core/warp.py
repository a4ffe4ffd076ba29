"""Maps from the unit square to disks and spheres and back, and picks from alias tables."""

import math

from .jit import device, inlined
from .memory import load_f32, load_i32
from .vec import dot, frame, normalize, sub, to_world


@device
def disk(u0, u1):
    """A point of the unit disk, uniform by area (Shirley and Chiu's concentric map)."""
    a = 2.0 * u0 - 1.0
    b = 2.0 * u1 - 1.0
    if a == 0.0 and b == 0.0:
        return 0.0, 0.0
    if abs(a) > abs(b):
        phi = 0.25 * math.pi * b / a
        return a * math.cos(phi), a * math.sin(phi)
    phi = 0.5 * math.pi - 0.25 * math.pi * a / b
    return b * math.cos(phi), b * math.sin(phi)


@device
def cone(axis, one_minus_cos, u0, u1):
    """A direction uniform in the cone about the unit `axis` whose half angle has cosine 1 - one_minus_cos (at most 2).

    The density is 1 / (2 pi one_minus_cos). For 2 it is the whole sphere.
    """
    x, y = disk(u0, u1)
    return cone_at(axis, one_minus_cos, x, y)


@device
def cone_at(axis, one_minus_cos, x, y):
    """The direction in that cone for a point of the unit disk: equal areas are equal solid angles."""
    r2 = x * x + y * y
    drop = one_minus_cos * r2  # 1 - cos of the direction
    s = math.sqrt(max(one_minus_cos * (2.0 - drop), 0.0))  # sine over disk radius
    t, b = frame(axis)
    return to_world((x * s, y * s, 1.0 - drop), t, b, axis)


@device
def cone_disk(axis, one_minus_cos, d):
    """The point of the unit disk for which `cone_at` gives the direction d."""
    off = sub(d, axis)
    s2 = one_minus_cos * (2.0 - 0.5 * dot(off, off))
    if s2 <= 0.0:
        return 1.0, 0.0  # opposite to the axis: all of the rim
    t, b = frame(axis)
    s = 1.0 / math.sqrt(s2)
    return dot(d, t) * s, dot(d, b) * s


@device
def octahedral(d):
    """A unit vector as a point of the square [-1, 1]² (Meyer et al. 2010); single precision keeps 1e-7 of its angle."""
    s = 1.0 / (abs(d[0]) + abs(d[1]) + abs(d[2]))
    x = d[0] * s
    y = d[1] * s
    if d[2] >= 0.0:
        return x, y
    return math.copysign(1.0 - abs(y), x), math.copysign(1.0 - abs(x), y)


@device
def octahedral_direction(x, y):
    """The unit vector of a point of the square."""
    z = 1.0 - abs(x) - abs(y)
    if z >= 0.0:
        return normalize((x, y, z))
    return normalize((math.copysign(1.0 - abs(y), x), math.copysign(1.0 - abs(x), y), z))


@device
def one_minus_cos(sin2):
    """1 - cos of an angle below a right one, from the square of its sine, without cancellation."""
    sin2 = min(sin2, 1.0)
    return sin2 / (1.0 + math.sqrt(1.0 - sin2))


@device
def alias_pick(table, n, u):
    """An index of an alias table with n bins, and u made uniform again."""
    x = u * n
    i = min(int(x), n - 1)
    x -= i
    threshold = load_f32(table, 2 * i)
    if x < threshold:
        return i, min(x / threshold, 0.99999999)
    return load_i32(table, 2 * i + 1), min((x - threshold) / (1.0 - threshold), 0.99999999)


@inlined
def stream_choice(u, p):
    """(whether the newest of a stream is chosen, which has the share p of it so far; u made uniform again)."""
    if u < p:
        return True, u / p
    return False, min((u - p) / (1.0 - p), 0.99999999)
