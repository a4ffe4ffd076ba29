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

_NARROW = 0.02  # about the angle, in radians, below which refracted directions are as good as one


@inlined
def enter(path, sp, c):
    """`entry_direction` by the path's next random numbers."""
    u0, u1 = rng.sample2(path.key, path.sample, path.dimension + DIM_DIRECTION)
    path.dimension += DIMENSIONS
    return entry_direction(sp, c, u0, u1)


@device
def entry_direction(sp, c, u0, u1):
    """(whether light enters, its unit direction) at `sp` through the closure `c`, by one of its lobes."""
    diffuse, alpha, u0 = entry_lobe(c.p[P_ENTRY], c.alpha_x, u0)
    return lobe_direction(vec(c.n), vec(sp.ng), vec(sp.wo), diffuse, alpha, c.ior, u0, u1)


@inlined
def entry_lobe(kind, alpha, u):
    """(whether the lobe by which light enters is the diffuse one, its roughness, u stretched to be used again).

    Skin, of the ENTRY_*, has both, with a roughness of 1.
    """
    if kind != ENTRY_SKIN:
        return kind == ENTRY_DIFFUSE, alpha, u
    if u < 0.5:
        return True, 1.0, 2.0 * u
    return False, 1.0, 2.0 * u - 1.0


@device
def lobe_direction(n, ng, wo, diffuse, alpha, ior, u0, u1):
    """`entry_direction` by a lobe; n: the closure's normal.

    Diffuse: cosine-distributed about the inward normal. Else refractive: through a visible normal of GGX microfacets of
    the roughness and the index of refraction.
    """
    if diffuse:
        d = cosine_direction(neg(n), u0, u1)
    else:
        if dot(n, wo) <= 0.0:
            return False, wo
        d = _refract(n, wo, alpha, 1.0 / ior, u0, u1)
    return dot(ng, d) < 0.0, d


@inlined
def _roughness(c):
    """α of the microfacets through which light enters."""
    return 1.0 if c.p[P_ENTRY] == ENTRY_SKIN else float(c.alpha_x)


@device
def _refract(n, wo, alpha, eta, u0, u1):
    """The direction into which microfacets seen from wo refract; eta is the outer by the inner index, at most 1."""
    x, y = frame(n)
    h = to_world(ggx_visible_normal((dot(x, wo), dot(y, wo), dot(n, wo)), alpha, alpha, u0, u1), x, y, n)
    cosine = dot(h, wo)
    inside = math.sqrt(max(1.0 - eta * eta * (1.0 - cosine * cosine), 1.0e-14))
    return madd(scale(wo, -eta), h, eta * cosine - inside)


@device
def entry_density(n, ng, wo, kind, alpha, ior, d):
    """Solid-angle density with which `entry_direction` finds d (unit); n: the closure's normal, kind: ENTRY_*.

    0: light does not enter along d. It adds up to less than 1 where n is not the surface's normal ng.
    """
    if dot(ng, d) >= 0.0:
        return 0.0
    diffuse = max(-dot(n, d), 0.0) * (1.0 / math.pi)
    if kind == ENTRY_DIFFUSE:
        return diffuse
    if kind == ENTRY_SKIN:
        return 0.5 * (diffuse + _refracted_density(n, wo, 1.0, ior, d))
    return _refracted_density(n, wo, alpha, ior, d)


@inlined
def spreads(c):
    """Whether light enters through `c` into directions that have a density, and not into one or nearly one."""
    return c.p[P_ENTRY] == ENTRY_DIFFUSE or _roughness(c) * (1.0 - 1.0 / c.ior) > _NARROW


@device
def _refracted_density(n, wo, alpha, ior, d):
    """Density of `_refract`: that of visible normals h, D G₁ (h·wo) / (n·wo), by |dh/dd| (Walter et al. 2007)."""
    h = neg(madd(wo, d, ior))
    length2 = dot(h, h)
    cos_o = dot(n, wo)
    if cos_o <= 0.0 or not length2 > 0.0:
        return 0.0
    h = scale(h, 1.0 / math.sqrt(length2))
    cos_h, cos_ho, cos_hd = dot(n, h), dot(h, wo), -dot(h, d)
    if cos_h <= 0.0 or cos_ho <= 0.0 or cos_hd <= 0.0:
        return 0.0
    a2 = alpha * alpha
    t = 1.0 + (a2 - 1.0) * cos_h * cos_h
    tangent2 = a2 * max(1.0 / (cos_o * cos_o) - 1.0, 0.0)
    visible = 2.0 / (1.0 + math.sqrt(1.0 + tangent2)) * a2 / (math.pi * t * t) * cos_ho / cos_o
    return visible * ior * ior * cos_hd / length2


@inlined
def lobe_density(n, ng, wo, diffuse, alpha, ior, d):
    """The density by solid angle with which `lobe_direction` enters along d.

    Without the boundary's factor it is the integrand of entry, too.
    """
    if dot(ng, d) >= 0.0:
        return 0.0
    return max(-dot(n, d), 0.0) * (1.0 / math.pi) if diffuse else _refracted_density(n, wo, alpha, ior, d)
