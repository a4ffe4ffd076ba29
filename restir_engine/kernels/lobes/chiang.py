"""Hair as dielectric cylinders with a rough, scaly cuticle: near-field, with a closed form.

Chiang, Bitterli, Tappan, Burley 2016, "A Practical and Controllable Hair and Fur Model for Production Path Tracing":
the lobes R, TT, TRT and one for all that follow, each a product of attenuation A_p (§3.2), a longitudinal part M_p
(d'Eon et al. 2011, "An Energy-Conserving Hair Reflectance Model", eq. 7) and an azimuthal part N_p, a logistic
distribution that is cut off at ±π (§4.1). Widths are those of the artist's roughnesses β_M and β_N (eqs. 7 and 8).

    f(wo, wi) = Σ_p A_p(h, wo) M_p(θo, θi) N_p(h, φ)

Light that goes through the fibre loses exp(-2 σ cos γ_t / cos θ_t) on each way, γ_t being the refracted angle in the
plane across the strand, where Bravais' index √(η² - sin² θo) / cos θo stands for η. The cuticle's scales tilt R, TT and
TRT by -2 α, α, 4 α. All A_p add up to 1 where nothing is absorbed.
"""

import math

from ..core.jit import device, entry
from ..core.records import closure_at
from ..core.vec import vec
from .fibre import (
    EVALUATE,
    P_OFFSET,
    P_SIGMA,
    P_SIN_O,
    P_TILT,
    P_WIDTH_R,
    answer,
    answer_direction,
    around,
    direction_around,
)
from .fresnel import dielectric

_LOBES = 4
_TWO_PI = 2.0 * math.pi
_LOGISTIC_SCALE = math.sqrt(math.pi / 8.0)


@device
def longitudinal_variance(beta):
    """v of the longitudinal lobes by β_M, eq. 7."""
    root = 0.726 * beta + 0.812 * beta * beta + 3.7 * beta**20
    return root * root


@device
def logistic_scale(beta):
    """s of the azimuthal lobes by β_N, eq. 8."""
    return _LOGISTIC_SCALE * (0.265 * beta + 1.194 * beta * beta + 5.372 * beta**22)


@device
def albedo_roughness_factor(beta):
    """What relates absorption to the colour of a mass of hair: √σ = ln C / this, eq. 9."""
    return ((((0.245 * beta + 5.574) * beta - 10.73) * beta + 2.532) * beta - 0.215) * beta + 5.969


@device
def _log_bessel_i0(x):
    """log I₀(x), the modified Bessel function: its series, from 12 on the asymptotic expansion."""
    if x > 12.0:
        return x + 0.5 * (-math.log(_TWO_PI) - math.log(x) + 1.0 / (8.0 * x))
    term = total = 1.0
    quarter = 0.25 * x * x
    for k in range(1, 40):
        term *= quarter / (k * k)
        total += term
        if term < 1e-12 * total:
            break
    return math.log(total)


@device
def longitudinal(sin_i, cos_i, sin_o, cos_o, v):
    """M(θo, θi) by solid angle: over dω = cos θi dθi dφ it is 1 / 2π times a density."""
    a, b = cos_i * cos_o / v, sin_i * sin_o / v
    # 1 / (2 v sinh(1 / v)) = exp(-1 / v) / (v (1 - exp(-2 / v)))
    return math.exp(_log_bessel_i0(a) - b - 1.0 / v) / (v * (1.0 - math.exp(-2.0 / v)))


@device
def sample_longitudinal(sin_o, cos_o, v, u0, u1):
    """sin θi by `longitudinal` (d'Eon 2013, "Importance Sampling for Physically-Based Hair Fiber Models")."""
    u0 = max(u0, 1e-9)
    cosine = 1.0 + v * math.log(u0 + (1.0 - u0) * math.exp(-2.0 / v))
    sine = math.sqrt(max(1.0 - cosine * cosine, 0.0))
    return min(max(-cosine * sin_o + sine * math.cos(_TWO_PI * u1) * cos_o, -1.0), 1.0)


@device
def _logistic_cdf(x, s):
    return 1.0 / (1.0 + math.exp(min(-x / s, 500.0)))


@device
def _azimuthal(x, s):
    """The logistic density of an angle x, wrapped to ±π, cut off there."""
    x -= _TWO_PI * math.floor((x + math.pi) / _TWO_PI)
    e = math.exp(-abs(x) / s)
    return e / (s * (1.0 + e) * (1.0 + e)) / (1.0 - 2.0 * _logistic_cdf(-math.pi, s))


@device
def _sample_azimuthal(u, s):
    edge = _logistic_cdf(-math.pi, s)
    u = min(max(u * (1.0 - 2.0 * edge) + edge, 1e-12), 1.0 - 1e-12)
    return min(max(-s * math.log(1.0 / u - 1.0), -math.pi), math.pi)


@device
def _refracted(c):
    """(γo, γt, cos θo, transmittance rgb of one way through the fibre, Fresnel reflectance)."""
    sin_o, h, eta = c.p[P_SIN_O], c.p[P_OFFSET], c.ior
    cos_o = math.sqrt(max(1.0 - sin_o * sin_o, 0.0))
    cos_t = math.sqrt(max(1.0 - sin_o * sin_o / (eta * eta), 1e-12))
    cos_gamma = math.sqrt(max(1.0 - h * h, 0.0))
    sin_gamma_t = min(max(h * cos_o / math.sqrt(max(eta * eta - sin_o * sin_o, 1e-12)), -1.0), 1.0)
    way = -2.0 * math.sqrt(max(1.0 - sin_gamma_t * sin_gamma_t, 0.0)) / cos_t
    t = (math.exp(way * c.p[P_SIGMA]), math.exp(way * c.p[P_SIGMA + 1]), math.exp(way * c.p[P_SIGMA + 2]))
    reflectance, _cos = dielectric(cos_o * cos_gamma, eta)
    return math.asin(h), math.asin(sin_gamma_t), cos_o, t, reflectance


@device
def _attenuation(p, t, f):
    """A_p of one channel: transmittance t, reflectance f (§3.2; the last lobe is the rest of the geometric series)."""
    if p == 0:
        return f
    a = (1.0 - f) * (1.0 - f) * t
    if p == 1:
        return a
    a *= t * f
    return a if p == 2 else a * t * f / max(1.0 - t * f, 1e-12)


@device
def _mean_attenuation(p, t, f):
    return (_attenuation(p, t[0], f) + _attenuation(p, t[1], f) + _attenuation(p, t[2], f)) / 3.0


@device
def _tilted(c, p, cos_o):
    """(sine, cosine) of wo's elevation as lobe p has it: moved by the scales' tilt, in Cycles' sense."""
    sin_o = c.p[P_SIN_O]
    if p == 3:
        return sin_o, cos_o
    angle = c.p[P_TILT] * (2.0 if p == 0 else -1.0 if p == 1 else -4.0)
    s, k = math.sin(angle), math.cos(angle)
    return sin_o * k + cos_o * s, abs(cos_o * k - sin_o * s)


@device
def _variance(c, p):
    return c.p[P_WIDTH_R] if p == 0 else c.alpha_x * (0.25 if p == 1 else 4.0)


@device
def _azimuth(p, gamma_o, gamma_t):
    """The azimuth of light that has gone p times through the fibre (Φ of d'Eon et al. 2011)."""
    return 2.0 * p * gamma_t - 2.0 * gamma_o + p * math.pi


@device
def _evaluate(c):
    gamma_o, gamma_t, cos_o, t, f = _refracted(c)
    sin_i, phi = around(c, vec(c.asked))
    cos_i = math.sqrt(max(1.0 - sin_i * sin_i, 0.0))
    r = g = b = pdf = total = 0.0
    for p in range(_LOBES):
        sin_p, cos_p = _tilted(c, p, cos_o)
        n = 1.0 / _TWO_PI if p == 3 else _azimuthal(phi - _azimuth(p, gamma_o, gamma_t), c.alpha_y)
        mn = longitudinal(sin_i, cos_i, sin_p, cos_p, _variance(c, p)) * n
        share = _mean_attenuation(p, t, f)
        r += mn * _attenuation(p, t[0], f)
        g += mn * _attenuation(p, t[1], f)
        b += mn * _attenuation(p, t[2], f)
        pdf += mn * share
        total += share
    answer(c, (r, g, b), pdf / total if total > 0.0 else 0.0)


@device
def _sample(c):
    gamma_o, gamma_t, cos_o, t, f = _refracted(c)
    u0, u1, u2 = vec(c.asked)
    total = 0.0
    for p in range(_LOBES):
        total += _mean_attenuation(p, t, f)
    left = u0 * total
    chosen = _LOBES - 1
    for p in range(_LOBES):
        share = _mean_attenuation(p, t, f)
        if left < share:
            chosen, u0 = p, left / share
            break
        left -= share
    sin_p, cos_p = _tilted(c, chosen, cos_o)
    sine = sample_longitudinal(sin_p, cos_p, _variance(c, chosen), u1, u2)
    phi = _TWO_PI * u0
    if chosen < 3:
        phi = _azimuth(chosen, gamma_o, gamma_t) + _sample_azimuthal(u0, c.alpha_y)
    answer_direction(c, direction_around(c, sine, phi))


@entry
def chiang_lobe(closure, request, _a, _b, _c):
    """See `fibre`."""
    c = closure_at(closure, 0)
    if request == EVALUATE:
        _evaluate(c)
    else:
        _sample(c)


@device
def mass_albedo(c, beta, reflected):
    """What a mass of hair of the closure's absorption reflects, beside what it does at the surface (eq. 9)."""
    k = albedo_roughness_factor(beta)
    return (
        math.exp(-math.sqrt(c.p[P_SIGMA]) * k) + reflected,
        math.exp(-math.sqrt(c.p[P_SIGMA + 1]) * k) + reflected,
        math.exp(-math.sqrt(c.p[P_SIGMA + 2]) * k) + reflected,
    )


@device
def chiang_albedo(c, beta):
    """About what a mass of such hair reflects, for colour passes: as Cycles, by eq. 9 and the first reflection."""
    _go, _gt, _cos, _t, f = _refracted(c)
    return mass_albedo(c, beta, f)
