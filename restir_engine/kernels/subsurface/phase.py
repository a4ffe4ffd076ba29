"""The phase function of Henyey and Greenstein, by mean cosine g in (-1, 1).

Directions are those in which light travels, before and after: g > 0 scatters forwards.
"""

import math

from ..core.fastmath import circle
from ..core.jit import inlined
from ..core.vec import frame, to_world

_INV_FOUR_PI = 0.25 / math.pi


@inlined
def hg(cosine, g):
    """Value of the phase function, and its sampler's density, by steradian, for the cosine between two directions."""
    d = 1.0 + g * g - 2.0 * g * cosine
    return _INV_FOUR_PI * (1.0 - g * g) / max(d * math.sqrt(d), 1.0e-30)


@inlined
def hg_cosine(g, u):
    """A cosine with that density.

    The usual inverse distribution with its terms gathered by powers of g, so that it neither divides by g nor loses
    digits where g is small; s = 2 u - 1 is the cosine for g = 0.
    """
    s = 2.0 * u - 1.0
    d = 1.0 + g * s
    cosine = (s + g * (1.5 + 0.5 * s * s) + g * g * s + 0.5 * g * g * g * (s * s - 1.0)) / (d * d)
    return min(max(cosine, -1.0), 1.0)


@inlined
def around(axis, cosine, u):
    """The unit direction at that cosine with a unit axis whose azimuth is 2 pi u."""
    s = math.sqrt(max(1.0 - cosine * cosine, 0.0))
    x, y = circle(u)
    t, b = frame(axis)
    return to_world((s * x, s * y, cosine), t, b, axis)


@inlined
def hg_sample(d, g, u0, u1):
    """(direction, density by steradian) after scattering; the density is the phase function's value."""
    if g == 0.0:  # any direction, whatever d is
        return around((0.0, 0.0, 1.0), 2.0 * u0 - 1.0, u1), _INV_FOUR_PI
    cosine = hg_cosine(g, u0)
    return around(d, cosine, u1), hg(cosine, g)
