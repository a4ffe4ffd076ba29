"""Diffuse lobes: Lambert, the energy-preserving Oren–Nayar, and diffuse transmission."""

import math

from ..core.jit import device, inlined
from ..core.records import closure_at
from ..core.vec import dot, frame, neg, to_world, vec
from .closure import LOBE_LAMBERT, LOBE_OREN_NAYAR, add_closure

_A = math.pi / 2.0 - 2.0 / 3.0
_INV_PI = 1.0 / math.pi

# Places in CLOSURE.p of Oren–Nayar.
_P_A, _P_B, _P_MULTIPLE, _P_ROUGHNESS = 0, 1, 2, 5


@inlined
def concentric_disk(u0, u1):
    """A point on the unit disk, areas kept (Shirley and Chiu 1997)."""
    a, b = 2.0 * u0 - 1.0, 2.0 * u1 - 1.0
    if a == 0.0 and b == 0.0:
        return 0.0, 0.0
    if a * a > b * b:
        phi = 0.25 * math.pi * b / a
        return a * math.cos(phi), a * math.sin(phi)
    phi = 0.25 * math.pi * a / b
    return b * math.sin(phi), b * math.cos(phi)


@inlined
def cosine_direction(n, u0, u1):
    """A direction about n with the density cos θ / π."""
    x, y = concentric_disk(u0, u1)
    t, b = frame(n)
    return to_world((x, y, math.sqrt(max(1.0 - x * x - y * y, 0.0))), t, b, n)


@device
def _g(cosine):
    """G of Fujii's model: ∫ of its directional term; a Taylor series where the closed form loses digits."""
    if cosine < 1e-6:
        return _A - cosine
    c = min(cosine, 1.0)
    s = math.sqrt(1.0 - c * c)
    return s * (math.acos(c) - 2.0 / 3.0 - s * c) + 2.0 / 3.0 * (s / c) * (1.0 - s * s * s)


@device
def add_diffuse(sp, weight, n, roughness, color):
    """A diffuse reflection: Lambert, or Oren–Nayar from a roughness of 1e-5 on; light in crevices takes on `color`.

    Single scattering by Fujii's "improved Oren–Nayar", multiple scattering as in OpenPBR: (1 - E(wo)) (1 - E(wi)) times
    albedo² (E/(1 - E)) / (1 - albedo (1 - E)) / π, with E the average of the directional albedo.
    """
    i = add_closure(sp, LOBE_LAMBERT if roughness < 1e-5 else LOBE_OREN_NAYAR, weight, n)
    if i < 0 or roughness < 1e-5:
        return
    c = closure_at(sp.closures, i)
    sigma = min(roughness, 1.0)
    a = 1.0 / (math.pi + sigma * _A)
    b = sigma * a
    average = a * math.pi + (2.0 * math.pi - 5.6) / 3.0 * b
    missing = 1.0 - (a * math.pi + b * _g(max(dot(n, vec(sp.wo)), 0.0)))
    c.p[_P_A] = a
    c.p[_P_B] = b
    c.p[_P_ROUGHNESS] = sigma
    for k in range(3):
        albedo = min(max(color[k], 0.0), 1.0)
        ratio = average / (1.0 - average) / (1.0 - albedo * (1.0 - average))
        c.p[_P_MULTIPLE + k] = _INV_PI * albedo * albedo * ratio * missing


@device
def oren_nayar_eval(c, wo, wi):
    """(value rgb without the weight, pdf)."""
    n = vec(c.n)
    cos_i = dot(n, wi)
    if cos_i <= 0.0:
        return 0.0, 0.0, 0.0, 0.0
    cos_o = max(dot(n, wo), 0.0)
    t = dot(wi, wo) - cos_i * cos_o
    if t > 0.0:
        t /= max(cos_i, cos_o) + 1e-37
    a, b = c.p[_P_A], c.p[_P_B]
    single = a + b * t
    missing = 1.0 - (a * math.pi + b * _g(cos_i))
    return (
        cos_i * (single + c.p[_P_MULTIPLE] * missing),
        cos_i * (single + c.p[_P_MULTIPLE + 1] * missing),
        cos_i * (single + c.p[_P_MULTIPLE + 2] * missing),
        cos_i * _INV_PI,
    )


@inlined
def lambert_eval(c, wi, side):
    """(value, pdf) of cosine-distributed light about n (side 1) or -n (side -1): both cos θ / π."""
    cosine = side * dot(vec(c.n), wi)
    return max(cosine, 0.0) * _INV_PI


@inlined
def diffuse_sample(c, side, u0, u1):
    """A cosine-distributed direction about n (side 1) or -n (side -1)."""
    n = vec(c.n)
    return cosine_direction(n if side > 0.0 else neg(n), u0, u1)
