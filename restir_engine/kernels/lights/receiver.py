"""What receives light, in so few numbers that many points of lights can be weighed against it at once.

A diffuse part about one normal, which may let light through, and one lobe of GGX that stands for all glossy closures.
It only guides resampling and must not be 0 where the BSDF is not.
"""

import math
from typing import NamedTuple

from ..core.jit import device, inlined
from ..core.records import closure_at
from ..core.vec import add, dot, madd, scale, vec
from ..lobes.closure import (
    CLASS_GLOSSY,
    LOBE_GLASS,
    LOBE_ROUGH_TRANSLUCENT,
    LOBE_SUBSURFACE,
    LOBE_TRANSLUCENT,
    LOBE_TRANSPARENT,
    is_fibre,
    is_microfacet,
    is_singular,
    pass_class,
)

_INV_PI = 1.0 / math.pi
_SAME = 0.9999  # cosine of normals that are taken for one
_ASIDE = 0.05  # where closures have unlike normals, what all cosines count as at least
_SMOOTHEST = 0.02  # roughness α: narrower lobes are left to rays by the BSDF


class Receiver(NamedTuple):
    """See the module; colours are rgb without the cosine."""

    n: tuple[float, float, float]
    both: float  # 1.0: light from behind counts too
    least: float  # that the cosine counts as
    diffuse: tuple[float, float, float]
    gloss: tuple[float, float, float]  # black: no glossy lobe
    gloss_n: tuple[float, float, float]
    alpha2: float
    gloss_scale: float
    wo: tuple[float, float, float]


@inlined
def _volume(wo):
    """A point of a medium: all directions alike."""
    p = 0.25 * _INV_PI
    zero = (0.0, 0.0, 0.0)
    return Receiver(zero, 0.0, 1.0, (p, p, p), zero, zero, 1.0, 0.0, wo)


@device
def receiver_of(sp):
    """The Receiver at a SHADING_POINT; without closures it is in a medium."""
    wo = vec(sp.wo)
    zero = (0.0, 0.0, 0.0)
    if sp.n_closures == 0:
        return _volume(wo)
    n, gloss_n, diffuse, gloss = zero, zero, zero, zero
    both, least, alpha, total = 0.0, 0.0, 0.0, 0.0
    for i in range(sp.n_closures):
        c = closure_at(sp.closures, i)
        kind = c.kind
        if kind in (LOBE_TRANSPARENT, LOBE_SUBSURFACE) or (is_microfacet(kind) and is_singular(c)):
            continue
        cn = vec(c.n)
        if n[0] == 0.0 and n[1] == 0.0 and n[2] == 0.0:
            n = cn
        elif dot(n, cn) < _SAME:
            least = _ASIDE
        w = vec(c.weight)
        average = (w[0] + w[1] + w[2]) / 3.0
        w = scale(w, c.sample_weight / average if average > 0.0 else 0.0)
        if is_fibre(kind):
            diffuse, both, least = madd(diffuse, w, 0.25 * _INV_PI), 1.0, 1.0
            continue
        category = pass_class(kind)
        if category == CLASS_GLOSSY or kind == LOBE_GLASS:
            gloss = add(gloss, w)
            gloss_n = madd(gloss_n, cn, c.sample_weight)
            alpha += math.sqrt(c.alpha_x * c.alpha_y) * c.sample_weight
            total += c.sample_weight
        if category != CLASS_GLOSSY:
            diffuse = madd(diffuse, w, _INV_PI)
        if kind in (LOBE_TRANSLUCENT, LOBE_ROUGH_TRANSLUCENT) or category > CLASS_GLOSSY:
            both = 1.0
    if total <= 0.0:
        return Receiver(n, both, least, diffuse, zero, zero, 1.0, 0.0, wo)
    s = 1.0 / math.sqrt(max(dot(gloss_n, gloss_n), 1e-30))
    a = max(alpha / total, _SMOOTHEST)
    a2 = a * a
    # D / (4 (h · d)² (α + ½)) with |h|² = 4 (h · d)² for the sum h of two unit vectors
    return Receiver(n, both, least, diffuse, gloss, scale(gloss_n, s), a2, a2 * _INV_PI / (a + 0.5), wo)
