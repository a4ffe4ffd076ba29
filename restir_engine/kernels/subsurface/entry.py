"""How light enters a medium: the direction of the first segment of a walk, by the material's ENTRY_*.

As in Cycles the direction alone is sampled, without a factor of the boundary's own: what the boundary reflects is a
lobe of the surface.
"""

import math

from ..core import rng
from ..core.jit import device, inlined
from ..core.vec import dot, frame, madd, neg, scale, to_world, vec
from ..lobes.closure import ENTRY_DIFFUSE, ENTRY_SKIN, P_ENTRY
from ..lobes.diffuse import cosine_direction
from ..lobes.microfacet import ggx_visible_normal
from ..path.state import DIM_DIRECTION, DIMENSIONS


@inlined
def enter(path, sp, c):
    """`entry_direction` by the path's next random numbers."""
    u0, u1 = rng.sample2(path.key, path.sample, path.dimension + DIM_DIRECTION)
    path.dimension += DIMENSIONS
    return entry_direction(sp, c, u0, u1)


@device
def entry_direction(sp, c, u0, u1):
    """(whether light enters, its unit direction) at `sp` through the closure `c`.

    Diffuse: cosine-distributed about the inward normal. Refractive: through a visible normal of GGX microfacets of the
    closure's roughness and index of refraction. Skin: either, with a roughness of 1.
    """
    n, wo = vec(c.n), vec(sp.wo)
    kind = c.p[P_ENTRY]
    alpha = c.alpha_x
    diffuse = kind == ENTRY_DIFFUSE
    if kind == ENTRY_SKIN:
        alpha = 1.0
        diffuse = u0 < 0.5
        u0 = 2.0 * u0 if diffuse else 2.0 * u0 - 1.0
    if diffuse:
        d = cosine_direction(neg(n), u0, u1)
    else:
        if dot(n, wo) <= 0.0:
            return False, wo
        d = _refract(n, wo, alpha, 1.0 / c.ior, u0, u1)
    return dot(vec(sp.ng), d) < 0.0, d


@device
def _refract(n, wo, alpha, eta, u0, u1):
    """The direction into which microfacets seen from wo refract; eta is the outer by the inner index, at most 1."""
    x, y = frame(n)
    h = to_world(ggx_visible_normal((dot(x, wo), dot(y, wo), dot(n, wo)), alpha, alpha, u0, u1), x, y, n)
    cosine = dot(h, wo)
    inside = math.sqrt(max(1.0 - eta * eta * (1.0 - cosine * cosine), 1.0e-14))
    return madd(scale(wo, -eta), h, eta * cosine - inside)
