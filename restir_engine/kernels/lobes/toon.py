"""Toon lobes: a soft-edged cone of even brightness about the normal (diffuse) or the mirror direction (glossy)."""

import math

from ..core.jit import device
from ..core.records import closure_at
from ..core.vec import dot, frame, reflect, to_world, vec
from .closure import LOBE_TOON_DIFFUSE, LOBE_TOON_GLOSSY, add_closure

_HALF_PI = 0.5 * math.pi


@device
def add_toon(sp, weight, n, size, smooth, glossy):
    """`size` is the cone's half angle and `smooth` the width of its rim, both in right angles."""
    i = add_closure(sp, LOBE_TOON_GLOSSY if glossy else LOBE_TOON_DIFFUSE, weight, n)
    if i >= 0:
        c = closure_at(sp.closures, i)
        c.p[0] = min(max(size, 1e-5), 1.0) * _HALF_PI
        c.p[1] = min(max(smooth, 0.0), 1.0) * _HALF_PI


@device
def toon_axis(c, wo):
    """The axis of the cone."""
    n = vec(c.n)
    return reflect(wo, n) if c.kind == LOBE_TOON_GLOSSY else n


@device
def _cone(c):
    """1 - cos of the half angle that is sampled."""
    s = math.sin(0.5 * min(c.p[0] + c.p[1], _HALF_PI))
    return 2.0 * s * s


@device
def toon_eval(c, wo, wi):
    """(value without the weight, pdf)."""
    n = vec(c.n)
    glossy = c.kind == LOBE_TOON_GLOSSY
    if dot(n, wi) < 0.0 or (glossy and (dot(n, wo) <= 0.0 or dot(n, wi) <= 0.0)):
        return 0.0, 0.0
    angle = math.acos(min(max(dot(toon_axis(c, wo), wi), 0.0), 1.0))
    if angle >= min(c.p[0] + c.p[1], _HALF_PI):
        return 0.0, 0.0
    pdf = 1.0 / (2.0 * math.pi * _cone(c))
    return pdf if angle < c.p[0] else pdf * (1.0 - (angle - c.p[0]) / c.p[1]), pdf


@device
def toon_sample(c, wo, u0, u1):
    """A direction, uniform in the cone; below the surface for some when it is glossy."""
    axis = toon_axis(c, wo)
    x, y = frame(axis)
    h = u0 * _cone(c)
    r = math.sqrt(max(h * (2.0 - h), 0.0))
    phi = 2.0 * math.pi * u1
    return to_world((r * math.cos(phi), r * math.sin(phi), 1.0 - h), x, y, axis)
