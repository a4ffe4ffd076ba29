"""Vectors as tuples of three floats, frames and small matrices."""

import math

from .jit import device, inlined
from .memory import load_f32, load_f64, store_f32, store_f64

# More than this is no radiance but an overflow: 65,536 samples of it still fit into the film's float32.
LARGEST_RADIANCE = 5e33


@device
def add(a, b):
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


@device
def sub(a, b):
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


@device
def mul(a, b):
    """Product by component."""
    return (a[0] * b[0], a[1] * b[1], a[2] * b[2])


@device
def scale(a, s):
    return (a[0] * s, a[1] * s, a[2] * s)


@device
def madd(a, b, s):
    """a + s b."""
    return (a[0] + b[0] * s, a[1] + b[1] * s, a[2] + b[2] * s)


@device
def neg(a):
    return (-a[0], -a[1], -a[2])


@device
def dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@device
def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


@device
def length(a):
    return math.sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2])


@inlined
def normalize(a):
    """a / |a|; the zero vector stays zero."""
    n = a[0] * a[0] + a[1] * a[1] + a[2] * a[2]
    if n <= 0.0:
        return (0.0, 0.0, 0.0)
    s = 1.0 / math.sqrt(n)
    return (a[0] * s, a[1] * s, a[2] * s)


@device
def lerp(a, b, t):
    return (a[0] + (b[0] - a[0]) * t, a[1] + (b[1] - a[1]) * t, a[2] + (b[2] - a[2]) * t)


@device
def max3(a):
    return max(a[0], max(a[1], a[2]))


@device
def average(a):
    return (a[0] + a[1] + a[2]) * (1.0 / 3.0)


@device
def is_black(a):
    return a[0] == 0.0 and a[1] == 0.0 and a[2] == 0.0


@device
def reflect(i, n):
    """Mirror direction of i (pointing away from the surface) about the unit normal n."""
    return madd(neg(i), n, 2.0 * dot(i, n))


@inlined
def frame(n):
    """Two unit tangents (t, b) so that (t, b, n) is right-handed (Duff et al. 2017)."""
    sign = 1.0 if n[2] >= 0.0 else -1.0
    a = -1.0 / (sign + n[2])
    b = n[0] * n[1] * a
    return (1.0 + sign * n[0] * n[0] * a, sign * b, -sign * n[0]), (b, sign + n[1] * n[1] * a, -n[1])


@device
def to_world(v, t, b, n):
    return (
        v[0] * t[0] + v[1] * b[0] + v[2] * n[0],
        v[0] * t[1] + v[1] * b[1] + v[2] * n[1],
        v[0] * t[2] + v[1] * b[2] + v[2] * n[2],
    )


@device
def vec(a):
    """A record's (3,) field as a tuple."""
    return (float(a[0]), float(a[1]), float(a[2]))


@device
def put(a, v):
    """Store a tuple in a record's (3,) field."""
    a[0] = v[0]
    a[1] = v[1]
    a[2] = v[2]


@device
def load3_f32(address, index):
    """The index-th float32 triple at an address."""
    return (load_f32(address, 3 * index), load_f32(address, 3 * index + 1), load_f32(address, 3 * index + 2))


@device
def load3_f64(address, offset):
    """Three float64 from element `offset` on."""
    return (load_f64(address, offset), load_f64(address, offset + 1), load_f64(address, offset + 2))


@inlined
def store3_f32(address, index, v):
    """Write row `index` of a float32 array of triples."""
    store_f32(address, 3 * index, v[0])
    store_f32(address, 3 * index + 1, v[1])
    store_f32(address, 3 * index + 2, v[2])


@device
def store3_f64(address, offset, v):
    store_f64(address, offset, v[0])
    store_f64(address, offset + 1, v[1])
    store_f64(address, offset + 2, v[2])


@device
def transform_point(m, p):
    """m is a row-major 3x4 matrix, a (12,) record field."""
    return (
        m[0] * p[0] + m[1] * p[1] + m[2] * p[2] + m[3],
        m[4] * p[0] + m[5] * p[1] + m[6] * p[2] + m[7],
        m[8] * p[0] + m[9] * p[1] + m[10] * p[2] + m[11],
    )


@device
def transform_vector(m, v):
    return (
        m[0] * v[0] + m[1] * v[1] + m[2] * v[2],
        m[4] * v[0] + m[5] * v[1] + m[6] * v[2],
        m[8] * v[0] + m[9] * v[1] + m[10] * v[2],
    )


@device
def transform_normal(inverse, n):
    """A normal by the transpose of the inverse matrix; not normalised."""
    m = inverse
    return (dot((m[0], m[4], m[8]), n), dot((m[1], m[5], m[9]), n), dot((m[2], m[6], m[10]), n))
