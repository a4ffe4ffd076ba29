"""IES Texture: the intensities of a luminaire by direction, as its maker has measured them.

A table holds how many horizontal and vertical angles there are, the angles (radians), then the intensities of each
horizontal angle by vertical angle, with one more at each end of either, so that cubic interpolation needs no cases.
"""

import math

from ...core.jit import device, entry
from ...core.memory import load_f32, load_i32, store_f64
from ...core.records import scene_at
from ...core.vec import normalize
from ..operands import number, triple


@device
def _cubic(a, b, c, d, x):
    """Catmull and Rom's spline through b and c."""
    return b + 0.5 * x * (c - a + x * (2.0 * a - 5.0 * b + 4.0 * c - d + x * (3.0 * (b - c) + d - a)))


@device
def _place(tables, start, count, angle):
    """(interval, place in it) of an angle among sorted ones; the last interval holds what lies beyond."""
    i = 0
    while i < count - 2 and load_f32(tables, start + i + 1) < angle:
        i += 1
    low, high = load_f32(tables, start + i), load_f32(tables, start + i + 1)
    return i, (angle - low) / (high - low)


@device
def _column(tables, start, v, y):
    """Interpolated over the vertical angle."""
    at = start + v
    return _cubic(load_f32(tables, at), load_f32(tables, at + 1), load_f32(tables, at + 2), load_f32(tables, at + 3), y)


@entry
def ies_op(scene, _sp, registers, code, at):
    """Out: strength times the intensity towards a direction; 0 outside the vertical angles."""
    tables, table = scene_at(scene, 0).tables, load_i32(code, at + 3)
    d = normalize(triple(registers, code, at + 1))
    vertical = math.acos(min(max(-d[2], -1.0), 1.0))
    horizontal = math.atan2(d[0], d[1]) + math.pi
    n_h, n_v = int(load_f32(tables, table)), int(load_f32(tables, table + 1))
    angles = table + 2
    first, last = load_f32(tables, angles + n_h), load_f32(tables, angles + n_h + n_v - 1)
    value = 0.0
    if first <= vertical < last:
        h, x = _place(tables, angles, n_h, horizontal)
        v, y = _place(tables, angles + n_h, n_v, vertical)
        stride = n_v + 2
        start = angles + n_h + n_v + h * stride
        value = _cubic(
            _column(tables, start, v, y),
            _column(tables, start + stride, v, y),
            _column(tables, start + 2 * stride, v, y),
            _column(tables, start + 3 * stride, v, y),
            x,
        )
    store_f64(registers, load_i32(code, at), number(registers, code, at + 2) * max(value, 0.0))
