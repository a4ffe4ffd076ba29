"""The Hair BSDF's two lobes: light that a strand reflects, and light that passes it.

Cycles' closures, after Marschner et al. 2003, "Light Scattering from Human Hair Fibers": a Cauchy distribution of the
half angle (θi + θo) / 2 about an offset, of scale a, times one of the azimuth φ between the directions about the
strand: a cosine of φ / 2b for reflection, a Cauchy distribution of φ - π, of scale b, for transmission, which is 1 in
all from φ = π / 2 on. As in Cycles nothing is reflected through the surface, or transmitted on its own side.
"""

import math

from ..core.jit import device, entry
from ..core.records import closure_at
from ..core.vec import dot, vec
from .closure import LOBE_FIBRE_REFLECTION
from .fibre import EVALUATE, P_MODEL, P_SIN_O, P_TILT, answer, answer_direction, around, direction_around

P_SIDE = P_MODEL  # the normal that tells the sides

_QUARTER = 0.5 * math.pi
_POLE = 0.001  # radians from the tangent within which Cycles has nothing


@device
def _limits(c):
    """(elevation of wo, arctangents of the lowest and the highest half angle over the scale a)."""
    theta_o = math.asin(c.p[P_SIN_O])
    low = math.atan((0.5 * (theta_o - _QUARTER) - c.p[P_TILT]) / c.alpha_x)
    return theta_o, low, math.atan((0.5 * (theta_o + _QUARTER) - c.p[P_TILT]) / c.alpha_x)


@device
def _on_side(c, wi):
    """Whether wi is on the side of the surface that the lobe scatters to."""
    cosine = dot((c.p[P_SIDE], c.p[P_SIDE + 1], c.p[P_SIDE + 2]), wi)
    return cosine > 0.0 if c.kind == LOBE_FIBRE_REFLECTION else cosine < 0.0


@device
def _evaluate(c, wi):
    """(value, pdf)."""
    sin_i, phi = around(c, wi)
    theta_o, low, high = _limits(c)
    theta_i = math.asin(sin_i)
    phi = abs(phi)
    if _QUARTER - abs(theta_i) < _POLE or not _on_side(c, wi):
        return 0.0, 0.0
    a, b = c.alpha_x, c.alpha_y
    t = 0.5 * (theta_i + theta_o) - c.p[P_TILT]
    along = a / (2.0 * (t * t + a * a) * (high - low) * math.cos(theta_i))
    if c.kind == LOBE_FIBRE_REFLECTION:
        value = along * 0.25 / b * math.cos(0.5 * phi / b) if phi < min(math.pi * b, _QUARTER) else 0.0
        return value, value
    p = math.pi - phi
    along *= 0.5 * b / (p * p + b * b)
    return along / math.atan(_QUARTER / b), along / math.atan(math.pi / b)


@device
def _sample(c):
    u, v, _w = vec(c.asked)
    theta_o, low, high = _limits(c)
    half = c.p[P_TILT] + c.alpha_x * math.tan(low + u * (high - low))
    theta_i = min(max(2.0 * half - theta_o, -_QUARTER), _QUARTER)
    b = c.alpha_y
    if c.kind == LOBE_FIBRE_REFLECTION:
        phi = 2.0 * b * math.asin(min(max(2.0 * v - 1.0, -1.0), 1.0))
    else:
        phi = math.pi + b * math.tan((2.0 * v - 1.0) * math.atan(math.pi / b))
    wi = direction_around(c, math.sin(theta_i), phi)
    answer_direction(c, wi)
    if not _on_side(c, wi):
        c.answer[3] = 0.0


@entry
def hair_lobe(closure, request, _a, _b, _c):
    """See `fibre`."""
    c = closure_at(closure, 0)
    if request == EVALUATE:
        value, pdf = _evaluate(c, vec(c.asked))
        answer(c, (value, value, value), pdf)
    else:
        _sample(c)
