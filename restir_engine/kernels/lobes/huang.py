"""Hair as rough dielectric cylinders made of microfacets.

Huang, Hullin, Hanika 2022, "A Microfacet-based Hair Scattering Model". The fibre's surface is a GGX distribution of
microfacets about normals that the cuticle's scales tilt along the strand. What a fibre sends from wo to wi is the mean
over its width, of rays that are mirrored (R), refracted in and out (TT), or mirrored once inside on the way (TRT):

    f(wo, wi) = Σ_i w_i Σ_p A_p,i T(wi | d_p,i),   w_i ∝ wo · m_i,   Σ_i w_i = 1   (eqs. 9 to 12)

i runs over normals m_i at azimuths γ_i of the surface that is seen, stratified and jittered: all of it in the far
field, which meshes have. Strands have the near field, a narrow part of the width about the place that the ray has
hit; a pixel's rays are the mean over the rest. Where a refraction or reflection is followed by another one, one
visible microfacet is taken for each γ_i; the last one on a way is summed up over all microfacets, T being its density
D G₂ and Jacobian. So the sum is a mixture of densities: it is sampled by choosing i, then p, then a visible
microfacet, and the pdf is exact. The jitter and the microfacets on the way come from a hash of the point, the same
whenever the lobe is evaluated there; their mean over points is the integral. Light that stays in longer is one smooth
lobe, as Chiang et al. 2016 have it.
"""

import math

from ..core import rng
from ..core.jit import device, entry
from ..core.memory import float_bits
from ..core.records import closure_at
from ..core.vec import add, dot, frame, madd, neg, normalize, scale, to_world, vec
from .albedo import interface_energy
from .chiang import longitudinal, mass_albedo, sample_longitudinal
from .fibre import (
    EVALUATE,
    P_MODEL,
    P_OFFSET,
    P_SIGMA,
    P_SIN_O,
    P_TILT,
    answer,
    answer_direction,
    around,
    direction_around,
)
from .fresnel import dielectric
from .microfacet import ggx_visible_normal

P_R, P_TT, P_TRT = P_MODEL, P_MODEL + 1, P_MODEL + 2  # what the artist scales the lobes by
P_SPAN = P_MODEL + 3  # half of the width about the place that was hit, in radii; 1: all of it
P_SEED = P_MODEL + 4

_TWO_PI = 2.0 * math.pi
_STEP = 0.8  # strata of γ, in roughnesses
_FEWEST = 6
_EDGE = 1e-3  # radians at the rims of the fibre that are left out
# Generators of a six-dimensional Kronecker sequence: powers of the inverse of the root of x⁷ = x + 1.
_G1, _G2, _G3 = 0.8986537126286992, 0.8075784952213447, 0.7257334129697597
_G4, _G5, _G6 = 0.6521830259439715, 0.5860866975779693, 0.5266889867007357
_CERTAIN = 0.05  # least share of light that is taken to leave, where only chances are concerned


@device
def set_seed(c, sp):
    """Make the numbers that quadrature takes in the place of random ones a hash of the ray that has hit."""
    h = 0
    for k in range(3):
        h = rng.hash_combine(rng.hash_combine(h, float_bits(sp.p[k])), float_bits(sp.wo[k]))
    c.p[P_SEED] = float(h)


@device
def _normal(tilt, gamma):
    """A normal of the surface in the frame (strand, across, towards the plane of wo)."""
    k = math.cos(tilt)
    return math.sin(tilt), k * math.sin(gamma), k * math.cos(gamma)


@device
def _lambda(cosine, alpha):
    """Smith's Λ of GGX."""
    c2 = max(cosine * cosine, 1e-12)
    return 0.5 * (math.sqrt(1.0 + alpha * alpha * max(1.0 / c2 - 1.0, 0.0)) - 1.0)


@device
def _shadowing(cos_o, cos_i, alpha):
    """G₂ / G₁, the chance that what a microfacet seen from o sends to i leaves the surface."""
    o = _lambda(cos_o, alpha)
    return (1.0 + o) / (1.0 + o + _lambda(cos_i, alpha))


@device
def _ggx(cosine, alpha):
    a2 = alpha * alpha
    t = 1.0 + (a2 - 1.0) * cosine * cosine
    return a2 / (math.pi * t * t)


@device
def _visible(v, m, alpha, u0, u1):
    """A microfacet's normal as seen from v, of a surface of normal m."""
    x, y = frame(m)
    return to_world(ggx_visible_normal((dot(x, v), dot(y, v), dot(m, v)), alpha, alpha, u0, u1), x, y, m)


@device
def _range(c):
    """(first γ, last γ) of the surface that wo sees."""
    sin_o = c.p[P_SIN_O]
    cos_o = math.sqrt(max(1.0 - sin_o * sin_o, 1e-12))
    rim = math.acos(min(max(-math.tan(c.p[P_TILT]) * sin_o / cos_o, 0.0), 1.0)) - _EDGE
    span = c.p[P_SPAN]
    if span >= 1.0:
        return -rim, rim
    low, high = max(-c.p[P_OFFSET] - span, -1.0), min(-c.p[P_OFFSET] + span, 1.0)
    return max(math.asin(low), -rim), min(math.asin(high), rim)


@device
def _strata(c, first, last):
    return max(math.ceil((last - first) / (_STEP * c.alpha_x)), _FEWEST)


@device
def _fraction(x):
    return x - math.floor(x)


@device
def _jitter(c):
    """Where in its stratum each γ lies, 0 … 1."""
    return rng.hash_combine(int(c.p[P_SEED]), 1) / 4294967296.0


@device
def _number(c, k, generator, i):
    """The i-th number of dimension k for the microfacets on the way."""
    return _fraction(rng.hash_combine(int(c.p[P_SEED]), 2 + k) / 4294967296.0 + generator * i)


@device
def _attenuated(c, length):
    """What a way through the fibre leaves of light."""
    return math.exp(-length * c.p[P_SIGMA]), math.exp(-length * c.p[P_SIGMA + 1]), math.exp(-length * c.p[P_SIGMA + 2])


@device
def _mean(a, s):
    return (a[0] + a[1] + a[2]) * (s / 3.0)


_NOTHING = (0.0, 0.0, 0.0)


@device
def _ways(c, wo, gamma, i):
    """What becomes of light at azimuth γ.

    (m, k, e_r; v and m of TT's exit, its attenuation, e_tt; those of TRT's, e_trt; that of what follows, e_rest):
    normals of the surface there, directions back along the ray inside, and about how much each lobe sends (without
    w_i): their chances to be sampled. k and all attenuations hold what makes up for light that single scattering loses
    (Turquin 2019, "Practical multiple scattering compensation for microfacet models", §2.5).
    """
    alpha, eta, tilt = c.alpha_x, c.ior, c.p[P_TILT]
    m = _normal(tilt, gamma)
    h = _visible(wo, m, alpha, _number(c, 0, _G1, i), _number(c, 1, _G2, i))
    cos_h = dot(wo, h)
    f, cos_t = dielectric(cos_h, eta)
    rough = math.sqrt(alpha)
    k = 1.0 / interface_energy(c.film_table, dot(wo, m), rough, eta)
    e_r = c.p[P_R] * f * k
    none = (m, k, e_r, m, m, _NOTHING, 0.0, m, m, _NOTHING, 0.0, _NOTHING, 0.0)
    if cos_h <= 0.0 or cos_t == 0.0:
        return none
    wt = normalize(madd(scale(wo, -1.0 / eta), h, cos_h / eta + cos_t))
    cos_i = -dot(wt, m)
    if cos_i <= 0.0:
        return none
    phi = math.atan2(wt[1], wt[2])
    m_t, v = _normal(-tilt, 2.0 * phi - gamma), neg(wt)
    cos_v = dot(v, m_t)
    if cos_v <= 0.0:
        return none
    length = 2.0 * abs(math.cos(phi - gamma)) / math.sqrt(max(1.0 - wt[0] * wt[0], 1e-12))
    a = scale(_attenuated(c, length), (1.0 - f) * k * _shadowing(dot(wo, m), cos_i, alpha))
    a = scale(a, 1.0 / interface_energy(c.film_table, cos_v, rough, 1.0 / eta))
    leaves, _cos = dielectric(cos_v, 1.0 / eta)
    e_tt = c.p[P_TT] * _mean(a, max(1.0 - leaves, _CERTAIN))

    h = _visible(v, m_t, alpha, _number(c, 2, _G3, i), _number(c, 3, _G4, i))
    cos_h = dot(v, h)
    wr = madd(wt, h, 2.0 * cos_h)
    cos_i = dot(wr, m_t)
    if cos_h <= 0.0 or cos_i <= 0.0:
        return m, k, e_r, v, m_t, a, e_tt, m, m, _NOTHING, 0.0, _NOTHING, 0.0
    f, _cos = dielectric(cos_h, 1.0 / eta)
    phi_r = math.atan2(wr[1], wr[2])
    length = 2.0 * abs(math.cos(phi_r - 2.0 * phi + gamma)) / math.sqrt(max(1.0 - wr[0] * wr[0], 1e-12))
    again = _attenuated(c, length)
    b = scale((a[0] * again[0], a[1] * again[1], a[2] * again[2]), f * _shadowing(cos_v, cos_i, alpha))
    m_r, v_r = _normal(-tilt, gamma - 2.0 * (phi - phi_r) + math.pi), neg(wr)
    cos_r = dot(v_r, m_r)
    if cos_r <= 0.0:
        return m, k, e_r, v, m_t, a, e_tt, m, m, _NOTHING, 0.0, _NOTHING, 0.0
    b = scale(b, 1.0 / interface_energy(c.film_table, cos_r, rough, 1.0 / eta))
    h = _visible(v_r, m_r, alpha, _number(c, 4, _G5, i), _number(c, 5, _G6, i))
    cos_h = dot(v_r, h)
    f, _cos = dielectric(cos_h, 1.0 / eta)
    cos_i = max(2.0 * cos_h * dot(h, m_r) - cos_r, 0.0)
    e_trt = c.p[P_TRT] * _mean(b, max(1.0 - f, _CERTAIN))
    kept = min(f, 1.0 - _CERTAIN)
    f *= _shadowing(cos_r, cos_i, alpha) if cos_i > 0.0 else 0.0
    rest = (
        b[0] * f * again[0] * (1.0 - kept) / (1.0 - again[0] * kept),
        b[1] * f * again[1] * (1.0 - kept) / (1.0 - again[1] * kept),
        b[2] * f * again[2] * (1.0 - kept) / (1.0 - again[2] * kept),
    )
    return m, k, e_r, v, m_t, a, e_tt, v_r, m_r, b, e_trt, rest, _mean(rest, c.p[P_TRT])


@device
def _reflected(c, wo, m, wi):
    """(value, pdf) of what the microfacets of a surface mirror."""
    cos_o, cos_i = dot(wo, m), dot(wi, m)
    h = normalize(add(wo, wi))
    cos_h = dot(h, m)
    if cos_o <= 0.0 or cos_i <= 0.0 or cos_h <= 0.0:
        return 0.0, 0.0
    f, _cos = dielectric(dot(h, wo), c.ior)
    o = _lambda(cos_o, c.alpha_x)
    d = 0.25 * _ggx(cos_h, c.alpha_x) / cos_o
    return f * d / (1.0 + o + _lambda(cos_i, c.alpha_x)), d / (1.0 + o)


@device
def _left(c, v, m, wi):
    """(value, pdf) of what leaves the fibre towards wi of a ray inside, v pointing back along it."""
    ior = 1.0 / c.ior
    cos_v, cos_i = dot(v, m), dot(wi, m)
    if cos_v <= 0.0 or cos_i >= 0.0:
        return 0.0, 0.0
    h = madd(v, wi, ior)
    length2 = dot(h, h)
    if length2 <= 0.0:
        return 0.0, 0.0
    h = scale(h, math.copysign(1.0 / math.sqrt(length2), dot(h, m)))
    cos_hv, cos_hi = dot(h, v), dot(h, wi)
    if cos_hv <= 0.0 or cos_hi >= 0.0:
        return 0.0, 0.0
    f, _cos = dielectric(cos_hv, ior)
    o = _lambda(cos_v, c.alpha_x)
    d = _ggx(dot(h, m), c.alpha_x) / cos_v * ior * ior / length2 * abs(cos_hv * cos_hi)
    return (1.0 - f) * d / (1.0 + o + _lambda(cos_i, c.alpha_x)), d / (1.0 + o)


@device
def _rest(c, wo, sin_i):
    """The density of light that has stayed in the fibre for long."""
    cos_i = math.sqrt(max(1.0 - sin_i * sin_i, 0.0))
    return longitudinal(sin_i, cos_i, wo[0], wo[2], 4.0 * c.alpha_x) / _TWO_PI


@device
def _outgoing(c):
    """wo in the frame of the strand."""
    sin_o = c.p[P_SIN_O]
    return sin_o, 0.0, math.sqrt(max(1.0 - sin_o * sin_o, 1e-12))


@device
def _evaluate(c):
    wo = _outgoing(c)
    sin_i, phi = around(c, vec(c.asked))
    cos_i = math.sqrt(max(1.0 - sin_i * sin_i, 0.0))
    wi = (sin_i, cos_i * math.sin(phi), cos_i * math.cos(phi))
    first, last = _range(c)
    count = _strata(c, first, last)
    step, jitter, rest_density = (last - first) / count, _jitter(c), _rest(c, wo, sin_i)
    r = g = b = pdf = total = 0.0
    for i in range(count):
        gamma = first + (i + jitter) * step
        ways = _ways(c, wo, gamma, i)
        m, k, e_r, v, m_t, a, e_tt, v_r, m_r, a_r, e_trt, rest, e_rest = ways
        w = max(dot(wo, m), 0.0)
        total += w
        e = e_r + e_tt + e_trt + e_rest
        if e <= 0.0:
            continue
        value, density = _reflected(c, wo, m, wi)
        mirrored = c.p[P_R] * k * value
        density *= e_r
        tt = trt = 0.0
        if e_tt > 0.0:
            tt, p = _left(c, v, m_t, wi)
            density += e_tt * p
            tt *= c.p[P_TT]
        if e_trt > 0.0:
            trt, p = _left(c, v_r, m_r, wi)
            density += e_trt * p
            trt *= c.p[P_TRT]
        density += e_rest * rest_density
        stays = c.p[P_TRT] * rest_density
        r += w * (mirrored + tt * a[0] + trt * a_r[0] + stays * rest[0])
        g += w * (mirrored + tt * a[1] + trt * a_r[1] + stays * rest[1])
        b += w * (mirrored + tt * a[2] + trt * a_r[2] + stays * rest[2])
        pdf += w * density / e
    s = 1.0 / total if total > 0.0 else 0.0
    answer(c, (s * r, s * g, s * b), s * pdf)


@device
def _sample(c):
    wo = _outgoing(c)
    u, u1, u2 = vec(c.asked)
    first, last = _range(c)
    count = _strata(c, first, last)
    step, jitter = (last - first) / count, _jitter(c)
    total = 0.0
    for i in range(count):
        total += max(dot(wo, _normal(c.p[P_TILT], first + (i + jitter) * step)), 0.0)
    left, chosen = u * total, count - 1
    for i in range(count):
        w = max(dot(wo, _normal(c.p[P_TILT], first + (i + jitter) * step)), 0.0)
        if left < w:
            chosen, left = i, left / w
            break
        left -= w
    c.answer[3] = 0.0
    gamma = first + (chosen + jitter) * step
    m, _k, e_r, v, m_t, _a, e_tt, v_r, m_r, _b, e_trt, _rest_colour, e_rest = _ways(c, wo, gamma, chosen)
    e = e_r + e_tt + e_trt + e_rest
    if e <= 0.0:
        return
    pick = min(left, 1.0) * e
    if pick < e_r:
        h = _visible(wo, m, c.alpha_x, u1, u2)
        wi = madd(neg(wo), h, 2.0 * dot(wo, h))
        found = dot(wi, m) > 0.0
    elif pick >= e_r + e_tt + e_trt:
        sine = sample_longitudinal(wo[0], wo[2], 4.0 * c.alpha_x, u1, u2)
        phi = _TWO_PI * (pick - e_r - e_tt - e_trt) / max(e_rest, 1e-300)
        cosine = math.sqrt(max(1.0 - sine * sine, 0.0))
        wi = (sine, cosine * math.sin(phi), cosine * math.cos(phi))
        found = True
    else:
        if pick >= e_r + e_tt:
            v, m_t = v_r, m_r
        h = _visible(v, m_t, c.alpha_x, u1, u2)
        cos_h = dot(v, h)
        _f, cos_t = dielectric(cos_h, 1.0 / c.ior)
        wi = normalize(madd(scale(v, -c.ior), h, c.ior * cos_h + cos_t))
        found = cos_h > 0.0 and cos_t < 0.0 and dot(wi, m_t) < 0.0
    if found:
        answer_direction(c, direction_around(c, min(max(wi[0], -1.0), 1.0), math.atan2(wi[1], wi[2])))


@entry
def huang_lobe(closure, request, _a, _b, _c):
    """See `fibre`."""
    c = closure_at(closure, 0)
    if request == EVALUATE:
        _evaluate(c)
    else:
        _sample(c)


@device
def huang_albedo(c, roughness):
    """About what a mass of such hair reflects, for colour passes."""
    cosine = math.sqrt(max(1.0 - c.p[P_OFFSET] * c.p[P_OFFSET], 0.0)) * math.sqrt(max(1.0 - c.p[P_SIN_O] ** 2, 0.0))
    f, _cos = dielectric(cosine, c.ior)
    return mass_albedo(c, roughness, f)
