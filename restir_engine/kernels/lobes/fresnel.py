"""Fresnel reflectance of dielectrics and conductors, and the artist's versions of it."""

import math

from ..core.jit import device
from ..core.memory import call_entry, record_address
from ..core.vec import vec
from .closure import P_EDGE, P_F0, P_FRESNEL, P_REFLECTION, P_TRANSMISSION

# P_FRESNEL of a microfacet closure.
FRESNEL_NONE, FRESNEL_DIELECTRIC, FRESNEL_CONDUCTOR, FRESNEL_SCHLICK, FRESNEL_F82 = 0.0, 1.0, 2.0, 3.0, 4.0


@device
def dielectric(cosine, eta):
    """(reflectance, cosine of the refracted ray): unpolarised light from outside on a surface of relative index eta.

    The refracted ray's cosine to the normal is negative; it is 0 and the reflectance 1 in total reflection.
    """
    c = abs(cosine)
    g2 = eta * eta - 1.0 + c * c
    if g2 <= 0.0:
        return 1.0, 0.0
    g = math.sqrt(g2)
    s = (c - g) / (c + g)
    p = (eta * eta * c - g) / (eta * eta * c + g)
    return 0.5 * (s * s + p * p), -g / eta


@device
def f0_from_ior(ior):
    """Reflectance at normal incidence."""
    r = (ior - 1.0) / (ior + 1.0)
    return r * r


@device
def ior_from_f0(f0):
    """The index of refraction above 1 that reflects f0 (at most 0.99) at normal incidence."""
    r = math.sqrt(min(max(f0, 0.0), 0.99))
    return (1.0 + r) / (1.0 - r)


@device
def dielectric_average(eta):
    """Fit of 2 ∫ F(µ) µ dµ (Kulla and Conty 2017, "Revisiting Physically Based Shading at Imageworks")."""
    if eta < 1.0:
        return 0.997118 + eta * (0.1014 - eta * (0.965241 + eta * 0.130607))
    return (eta - 1.0) / (4.08567 + 1.00071 * eta)


@device
def conductor(cosine, n, k):
    """Reflectance of a metal n + ik for unpolarised light, exact (Cycles before 5.0 approximates, within 1 %)."""
    c2 = cosine * cosine
    s2 = 1.0 - c2
    t = n * n - k * k - s2
    m = math.sqrt(t * t + 4.0 * n * n * k * k)
    u = math.sqrt(max(0.5 * (m + t), 0.0))
    twice = 2.0 * u * cosine
    s = (m + c2 - twice) / max(m + c2 + twice, 1e-30)
    twice *= s2
    rest = c2 * m + s2 * s2
    return 0.5 * s * (1.0 + (rest - twice) / max(rest + twice, 1e-30))


_EDGE = 6.0 / 7.0
_EDGE5 = _EDGE**5


@device
def f82_from_tint(f0, tint):
    """b of `f82` so that the reflectance at cosine 1/7 is Schlick's times tint (Kutz et al. 2021)."""
    return (f0 + (1.0 - f0) * _EDGE5) * (7.0 / (_EDGE5 * _EDGE)) * (1.0 - tint)


@device
def f82_from_edge(f0, edge):
    """b of `f82` so that the reflectance at cosine 1/7 is `edge`."""
    return (f0 + (1.0 - f0) * _EDGE5 - edge) * (7.0 / (_EDGE5 * _EDGE))


@device
def f82(cosine, f0, b):
    """Schlick's reflectance with a dip of strength b towards 82 degrees."""
    m = min(max(1.0 - cosine, 0.0), 1.0)
    m5 = m * m * m * m * m
    return min(max(f0 + (1.0 - f0) * m5 - b * cosine * m5 * m, 0.0), 1.0)


@device
def f82_average(f0, b):
    """2 ∫ f82(µ) µ dµ."""
    return f0 + (1.0 - f0) / 21.0 - b / 126.0


@device
def conductor_average(n, k):
    """2 ∫ F(µ) µ dµ of a metal, through the F82 curve that meets it at 0 and 82 degrees."""
    f0 = conductor(1.0, n, k)
    b = f82_from_edge(f0, conductor(1.0 / 7.0, n, k))
    return min(max(f82_average(f0, b), 0.0), 1.0)


@device
def schlick_position(cosine, eta):
    """(where the real reflectance stands between its value at normal incidence and 1, cosine of the refracted ray)."""
    f, cos_t = dielectric(cosine, eta)
    f0 = f0_from_ior(eta)
    return min(max((f - f0) / max(1.0 - f0, 1e-30), 0.0), 1.0), cos_t


@device
def microfacet_fresnel(c, cosine, reflects, transmits):
    """(reflectance rgb, transmittance rgb, cosine of the refracted ray) of a microfacet at an angle.

    `reflects` and `transmits` say which halves the closure has; the others are 0.
    """
    kind = c.p[P_FRESNEL]
    cos_t = 0.0
    r0 = r1 = r2 = 1.0
    t0 = t1 = t2 = 0.0
    if c.film != 0:
        c.film_cosine = cosine
        call_entry(c.film, record_address(c), 0, 0, 0, 0)
        r0, r1, r2 = vec(c.film_reflectance)
        if kind == FRESNEL_SCHLICK:
            _f, cos_t = dielectric(cosine, c.ior)
            if transmits:
                t0 = (1.0 - r0) * c.p[P_TRANSMISSION]
                t1 = (1.0 - r1) * c.p[P_TRANSMISSION + 1]
                t2 = (1.0 - r2) * c.p[P_TRANSMISSION + 2]
            r0, r1, r2 = r0 * c.p[P_REFLECTION], r1 * c.p[P_REFLECTION + 1], r2 * c.p[P_REFLECTION + 2]
    elif kind == FRESNEL_SCHLICK:
        s, cos_t = schlick_position(cosine, c.ior)
        f0, f1, f2 = c.p[P_F0], c.p[P_F0 + 1], c.p[P_F0 + 2]
        f0, f1, f2 = f0 + (1.0 - f0) * s, f1 + (1.0 - f1) * s, f2 + (1.0 - f2) * s
        r0, r1, r2 = f0 * c.p[P_REFLECTION], f1 * c.p[P_REFLECTION + 1], f2 * c.p[P_REFLECTION + 2]
        if transmits:
            t0 = (1.0 - f0) * c.p[P_TRANSMISSION]
            t1 = (1.0 - f1) * c.p[P_TRANSMISSION + 1]
            t2 = (1.0 - f2) * c.p[P_TRANSMISSION + 2]
    elif kind == FRESNEL_F82:
        r0 = f82(cosine, c.p[P_F0], c.p[P_EDGE])
        r1 = f82(cosine, c.p[P_F0 + 1], c.p[P_EDGE + 1])
        r2 = f82(cosine, c.p[P_F0 + 2], c.p[P_EDGE + 2])
    elif kind == FRESNEL_CONDUCTOR:
        r0 = conductor(cosine, c.p[P_F0], c.p[P_EDGE])
        r1 = conductor(cosine, c.p[P_F0 + 1], c.p[P_EDGE + 1])
        r2 = conductor(cosine, c.p[P_F0 + 2], c.p[P_EDGE + 2])
    elif kind == FRESNEL_DIELECTRIC:
        r0, cos_t = dielectric(cosine, c.ior)
        r1 = r2 = r0
        t0 = t1 = t2 = 1.0 - r0 if transmits else 0.0
    elif transmits:
        f, cos_t = dielectric(cosine, c.ior)
        t0 = t1 = t2 = 1.0 if f < 1.0 else 0.0
    if not reflects:
        r0 = r1 = r2 = 0.0
    return r0, r1, r2, t0, t1, t2, cos_t
