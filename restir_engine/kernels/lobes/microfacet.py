"""Microfacets: GGX and Beckmann distributions with Smith masking, for reflection, refraction and both (glass).

Walter et al. 2007 for rough refraction; Heitz 2014 for height-correlated masking and anisotropy.
"""

import math

from ..core.jit import device
from ..core.vec import add, dot, madd, neg, normalize, scale, to_world, vec
from .closure import (
    LABEL_GLOSSY,
    LABEL_REFLECT,
    LABEL_SINGULAR,
    LABEL_TRANSMIT,
    P_DISTRIBUTION,
    P_ENERGY,
    closure_frame,
    has_reflection,
    has_transmission,
    is_singular,
)
from .fresnel import microfacet_fresnel

_INV_SQRT_PI = 1.0 / math.sqrt(math.pi)


@device
def smith_lambda(beckmann, s):
    """Smith's Λ for s = (α tan θ)² along the direction's azimuth; Beckmann's by Walter's fit, as Cycles does."""
    if not beckmann:
        return 0.5 * (math.sqrt(1.0 + s) - 1.0)
    if s < 0.39:
        return 0.0
    a = 1.0 / math.sqrt(s)
    return (1.0 - 1.259 * a + 0.396 * a * a) / (3.535 * a + 2.181 * a * a)


@device
def _beckmann_lambda(s):
    """Beckmann's exact Λ: the density of visible normals needs it, the fit is wrong by up to 0.4 %."""
    if s < 1e-4:
        return 0.0
    a = 1.0 / math.sqrt(s)
    return 0.5 * (math.erf(a) - 1.0 + math.exp(-a * a) * _INV_SQRT_PI / a)


@device
def _slope_variance(c, x, y, v, cosine):
    """(α tan θ)² of a direction v; x, y is the closure's frame, used when it is anisotropic."""
    c2 = max(cosine * cosine, 1e-30)
    if c.alpha_x == c.alpha_y:
        return c.alpha_x * c.alpha_x * max(1.0 / c2 - 1.0, 0.0)
    a, b = c.alpha_x * dot(x, v), c.alpha_y * dot(y, v)
    return (a * a + b * b) / c2


@device
def distribution(c, x, y, h, cosine):
    """D(h) per steradian."""
    c2 = min(max(cosine * cosine, 1e-30), 1.0)
    if c.alpha_x == c.alpha_y:
        t = (1.0 - c2) / (c.alpha_x * c.alpha_x)
    else:
        a, b = dot(x, h) / c.alpha_x, dot(y, h) / c.alpha_y
        t = a * a + b * b
    norm = math.pi * c.alpha_x * c.alpha_y
    if c.p[P_DISTRIBUTION] == 1.0:
        return math.exp(-t / c2) / (norm * c2 * c2)
    t += c2
    return 1.0 / (norm * t * t)


@device
def microfacet_eval(c, wo, wi):
    """(value rgb without the weight, times |n · wi|; pdf) of a closure of microfacets; 0 where it is singular."""
    n = vec(c.n)
    cos_o, cos_i = dot(n, wo), dot(n, wi)
    transmission = cos_i < 0.0
    reflects, transmits = has_reflection(c), has_transmission(c)
    if cos_o <= 0.0 or is_singular(c) or cos_i == 0.0 or not (transmits if transmission else reflects):
        return 0.0, 0.0, 0.0, 0.0
    h = neg(madd(wo, wi, c.ior)) if transmission else add(wo, wi)
    length2 = dot(h, h)
    if length2 <= 0.0:
        return 0.0, 0.0, 0.0, 0.0
    h = scale(h, math.copysign(1.0 / math.sqrt(length2), dot(n, h)))
    cos_ho, cos_hi, cos_h = dot(h, wo), dot(h, wi), dot(n, h)
    if cos_ho <= 0.0 or cos_h <= 0.0 or (transmission and cos_hi >= 0.0):
        return 0.0, 0.0, 0.0, 0.0
    r0, r1, r2, t0, t1, t2, _cos_t = microfacet_fresnel(c, cos_ho, reflects, transmits)
    reflected, transmitted = r0 + r1 + r2, t0 + t1 + t2
    if reflected + transmitted <= 0.0:
        return 0.0, 0.0, 0.0, 0.0
    probability = reflected / (reflected + transmitted)
    x = y = n
    if c.alpha_x != c.alpha_y:
        x, y = closure_frame(c)
    jacobian = 0.25
    if transmission:
        jacobian = c.ior * c.ior / length2 * abs(cos_ho * cos_hi)
        probability = 1.0 - probability
        r0, r1, r2 = t0, t1, t2
    beckmann = c.p[P_DISTRIBUTION] == 1.0
    variance = _slope_variance(c, x, y, wo, cos_o)
    lambda_o = smith_lambda(beckmann, variance)
    lambda_i = smith_lambda(beckmann, _slope_variance(c, x, y, wi, cos_i))
    common = distribution(c, x, y, h, cos_h) / cos_o * jacobian
    value = common / (1.0 + lambda_o + lambda_i) * c.p[P_ENERGY]
    if beckmann:
        lambda_o = _beckmann_lambda(variance)
    return r0 * value, r1 * value, r2 * value, common * probability / (1.0 + lambda_o)


@device
def ggx_visible_normal(v, alpha_x, alpha_y, u0, u1):
    """A normal seen from v (local frame), by spherical caps (Dupuy and Benyoub 2023)."""
    s = normalize((v[0] * alpha_x, v[1] * alpha_y, v[2]))
    phi = 2.0 * math.pi * u0
    z = (1.0 - u1) * (1.0 + s[2]) - s[2]
    r = math.sqrt(max(1.0 - z * z, 0.0))
    h = add((r * math.cos(phi), r * math.sin(phi), z), s)
    return normalize((h[0] * alpha_x, h[1] * alpha_y, max(h[2], 0.0)))


@device
def _inverse_erf(x):
    """erf⁻¹: Winitzki's closed form and two steps of Newton's method."""
    x = min(max(x, -1.0 + 1e-12), 1.0 - 1e-12)
    log = math.log(1.0 - x * x)
    a = 4.330746750799873 + 0.5 * log
    y = math.copysign(math.sqrt(math.sqrt(a * a - log * 6.802721088435375) - a), x)
    for _ in range(2):
        y -= (math.erf(y) - x) * (0.5 * math.sqrt(math.pi)) * math.exp(y * y)
    return y


@device
def _beckmann_visible_normal(v, alpha_x, alpha_y, u0, u1):
    """A normal seen from v (local frame): slopes of a Gaussian surface (Heitz and d'Eon 2014).

    The slope along v has the distribution function F(x) ∝ 1 + erf(x) + k exp(-x²), k = tan θ / sqrt(π), below cot θ; it
    is inverted by Newton's method kept inside a shrinking interval.
    """
    s = normalize((v[0] * alpha_x, v[1] * alpha_y, v[2]))
    across = _inverse_erf(2.0 * u1 - 1.0)
    sine = math.sqrt(max(1.0 - s[2] * s[2], 0.0))
    if sine < 1e-6:
        along = _inverse_erf(2.0 * u0 - 1.0)
        return normalize((-alpha_x * along, -alpha_y * across, 1.0))
    tangent = sine / max(s[2], 1e-9)
    k = tangent * _INV_SQRT_PI
    low, high = -6.0, min(1.0 / tangent, 6.0)
    total = u0 * (1.0 + math.erf(high) + k * math.exp(-high * high))
    along = 0.5 * (max(low, -1.0) + min(high, 1.0))
    for _ in range(30):
        e = math.exp(-along * along)
        excess = 1.0 + math.erf(along) + k * e - total
        if abs(excess) < 1e-9 * (1.0 + k):
            break
        if excess > 0.0:
            high = along
        else:
            low = along
        slope = 2.0 * _INV_SQRT_PI * e * (1.0 - along * tangent)
        step = along - excess / max(slope, 1e-30)
        along = step if low < step < high else 0.5 * (low + high)
    cosine, sine = s[0] / sine, s[1] / sine
    x = cosine * along - sine * across
    y = sine * along + cosine * across
    return normalize((-alpha_x * x, -alpha_y * y, 1.0))


@device
def microfacet_normal(c, wo, u0, u1):
    """A normal of the surface of microfacets as seen from wo; the closure's own normal where it is singular."""
    n = vec(c.n)
    if is_singular(c):
        return n
    x, y = closure_frame(c)
    local = (dot(x, wo), dot(y, wo), dot(n, wo))
    if c.p[P_DISTRIBUTION] == 1.0:
        h = _beckmann_visible_normal(local, c.alpha_x, c.alpha_y, u0, u1)
    else:
        h = ggx_visible_normal(local, c.alpha_x, c.alpha_y, u0, u1)
    return to_world(h, x, y, n)


@device
def microfacet_sample(c, sp, u0, u1, u2):
    """(label, wi, throughput rgb without the weight, probability): a direction, reflected or refracted by its energy.

    Throughput and probability of the side are meant for singular labels; 0 is no sample.
    """
    wo, n = vec(sp.wo), vec(c.n)
    none = (0.0, 0.0, 0.0)
    if dot(n, wo) <= 0.0:
        return 0, none, none, 0.0
    h = microfacet_normal(c, wo, u0, u1)
    cos_ho = dot(h, wo)
    r0, r1, r2, t0, t1, t2, cos_t = microfacet_fresnel(c, cos_ho, has_reflection(c), has_transmission(c))
    reflected, transmitted = r0 + r1 + r2, t0 + t1 + t2
    if reflected + transmitted <= 0.0 or cos_ho <= 0.0:
        return 0, none, none, 0.0
    probability = reflected / (reflected + transmitted)
    refract = u2 >= probability
    if refract:
        inverse = 1.0 / c.ior
        wi = normalize(madd(scale(wo, -inverse), h, inverse * cos_ho + cos_t))
    else:
        wi = madd(neg(wo), h, 2.0 * cos_ho)
    if (dot(vec(sp.ng), wi) < 0.0) != refract or (dot(n, wi) < 0.0) != refract:
        return 0, none, none, 0.0
    singular = is_singular(c)
    energy = c.p[P_ENERGY]
    if refract:
        label = LABEL_TRANSMIT | (LABEL_SINGULAR if singular or abs(c.ior - 1.0) < 1e-4 else LABEL_GLOSSY)
        return label, wi, (t0 * energy, t1 * energy, t2 * energy), 1.0 - probability
    label = LABEL_REFLECT | (LABEL_SINGULAR if singular else LABEL_GLOSSY)
    return label, wi, (r0 * energy, r1 * energy, r2 * energy), probability
