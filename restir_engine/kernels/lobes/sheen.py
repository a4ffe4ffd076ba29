"""Sheen: fibres above the surface as a linearly transformed cosine, and Ashikhmin's velvet.

Zeltner, Burley and Chiang 2022, "Practical Multiple-Scattering Sheen Using Linearly Transformed Cosines".
"""

import math

from ..core.jit import device
from ..core.records import closure_at
from ..core.vec import add, cross, dot, frame, normalize, put, to_world, vec
from .albedo import SHEEN_A, SHEEN_ALBEDO, SHEEN_B, SHEEN_SIZE, lookup2
from .closure import LOBE_SHEEN, LOBE_VELVET, add_closure, tangent_frame
from .diffuse import concentric_disk

_INV_PI = 1.0 / math.pi


@device
def add_sheen(sp, tables, weight, n, roughness):
    """Fibres of a roughness; the index of the closure (its weight times its albedo), -1 where nothing is reflected."""
    i = add_closure(sp, LOBE_SHEEN, weight, n)
    if i < 0:
        return -1
    c = closure_at(sp.closures, i)
    wo = vec(sp.wo)
    cosine = dot(n, wo)
    roughness = min(max(roughness, 1e-3), 1.0)
    a = lookup2(tables, SHEEN_A, SHEEN_SIZE, cosine, roughness)
    b = lookup2(tables, SHEEN_B, SHEEN_SIZE, cosine, roughness)
    albedo = lookup2(tables, SHEEN_ALBEDO, SHEEN_SIZE, cosine, roughness)
    if abs(a) < 1e-5 or albedo < 1e-5:
        sp.n_closures = i
        return -1
    x, _y = tangent_frame(n, wo)
    put(c.t, x)
    c.p[0] = a
    c.p[1] = b
    w = vec(c.weight)
    put(c.weight, (w[0] * albedo, w[1] * albedo, w[2] * albedo))
    c.sample_weight *= albedo
    return i


@device
def sheen_eval(c, wi):
    """Value without the weight, which is the pdf too."""
    n, x = vec(c.n), vec(c.t)
    z = dot(n, wi)
    if z <= 0.0:
        return 0.0
    a, b = c.p[0], c.p[1]
    u = a * dot(x, wi) + b * z
    v = a * dot(cross(n, x), wi)
    scale = a / (u * u + v * v + z * z)
    return _INV_PI * z * scale * scale


@device
def sheen_sample(c, u0, u1):
    """A direction with the density of `sheen_eval`: a cosine-distributed one, transformed."""
    n, x = vec(c.n), vec(c.t)
    p, q = concentric_disk(u0, u1)
    z = math.sqrt(max(1.0 - p * p - q * q, 0.0))
    return to_world(normalize((p - z * c.p[1], q, z * c.p[0])), x, cross(n, x), n)


@device
def add_velvet(sp, weight, n, sigma):
    """Ashikhmin's velvet (2000)."""
    i = add_closure(sp, LOBE_VELVET, weight, n)
    if i >= 0:
        c = closure_at(sp.closures, i)
        sigma = max(min(sigma, 1.0), 0.01)
        c.p[0] = 1.0 / (sigma * sigma)


@device
def velvet_eval(c, wo, wi):
    """(value without the weight, pdf): an inverted Gaussian of normals, sampled uniformly over the hemisphere."""
    n = vec(c.n)
    cos_o, cos_i = dot(n, wo), dot(n, wi)
    if cos_o <= 1e-5 or cos_i <= 0.0:
        return 0.0, 0.0
    h = normalize(add(wo, wi))
    cos_h, cos_ho = dot(n, h), abs(dot(wo, h))
    if abs(cos_h) >= 1.0 - 1e-5 or cos_ho <= 1e-5:
        return 0.0, 0.0
    ratio = 2.0 * max(cos_h / cos_ho, 1e-5)
    sin2 = 1.0 - cos_h * cos_h
    d = math.exp(-cos_h * cos_h / sin2 * c.p[0]) * c.p[0] * _INV_PI / (sin2 * sin2)
    g = min(1.0, min(ratio * cos_o, ratio * cos_i))
    return 0.25 * d * g / cos_o, 0.5 * _INV_PI


@device
def velvet_sample(c, u0, u1):
    """A direction, uniform over the hemisphere."""
    n = vec(c.n)
    x, y = frame(n)
    r = math.sqrt(max(1.0 - u0 * u0, 0.0))
    phi = 2.0 * math.pi * u1
    return to_world((r * math.cos(phi), r * math.sin(phi), u0), x, y, n)
