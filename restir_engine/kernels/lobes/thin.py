"""Thin sheets (OpenPBR's thin-walled case).

Glass is a mirror lobe and one mirrored through the sheet; what scatters light is a diffuse lobe on each side.
"""

import math

from ..core.jit import device
from ..core.records import RAY_CAMERA, closure_at
from ..core.vec import dot, is_black, madd, mul, neg, put, scale, vec
from ..shading.math_ops import clamp
from .albedo import preserve_energy
from .closure import (
    LABEL_GLOSSY,
    LABEL_SINGULAR,
    LABEL_TRANSMIT,
    LOBE_OREN_NAYAR,
    LOBE_REFLECTION,
    LOBE_ROUGH_TRANSLUCENT,
    LOBE_THIN_TRANSMISSION,
    LOBE_TRANSLUCENT,
    P_ENERGY,
    SINGULAR_ALPHA_SQUARED,
    is_singular,
)
from .diffuse import add_diffuse
from .fresnel import f0_from_ior, microfacet_fresnel
from .microfacet import microfacet_eval, microfacet_normal
from .nodes import GGX
from .setup import add_microfacets, add_transparent, set_schlick
from .thin_film import put_film


@device
def _balance(r, color, depth):
    """(reflected, transmitted) of one channel: the sums over all inner reflections, r being that of one side."""
    c = color**depth
    through = c * (1.0 - r) * (1.0 - r) / max(1.0 - r * r * c * c, 1e-12)
    return r + through * r * c, through


@device
def add_thin_glass(scene, sp, registers, code, film, weight, n, alpha, ior, tint, color):
    """The two lobes; a smooth sheet is plainly transparent to all rays but the camera's.

    `color` is what passes at normal incidence; `film`: where the operand of a thin film stands, on both sides alike.
    """
    wo, tables = vec(sp.wo), scene.lobe_tables
    i = add_microfacets(sp, LOBE_REFLECTION, weight, n, n, alpha, alpha, ior, GGX)
    if i < 0:
        return
    c = closure_at(sp.closures, i)
    put_film(scene, c, registers, code, film, 1.0)
    set_schlick(tables, c, wo, scale(tint, f0_from_ior(ior)), (1.0, 1.0, 1.0), (0.0, 0.0, 0.0), False)
    r0, r1, r2, _t0, _t1, _t2, cos_t = microfacet_fresnel(c, dot(n, wo), True, False)
    sp.n_closures = i
    if cos_t >= 0.0:
        reflected, transmitted = (1.0, 1.0, 1.0), (0.0, 0.0, 0.0)
    else:
        depth = -1.0 / cos_t
        r0, t0 = _balance(r0, color[0], depth)
        r1, t1 = _balance(r1, color[1], depth)
        r2, t2 = _balance(r2, color[2], depth)
        reflected, transmitted = (r0, r1, r2), (t0, t1, t2)
    i = add_microfacets(sp, LOBE_REFLECTION, mul(reflected, weight), n, n, alpha, alpha, 1.0, GGX)
    if i >= 0:
        preserve_energy(tables, closure_at(sp.closures, i), wo, tint)
    if is_black(transmitted):
        return
    # Two refractions widen the lobe (Kulla and Conty 2017).
    wide = alpha * math.sqrt(max(3.4 * (ior - 1.0) * (ior - 0.5) ** 2 / (ior * ior * ior), 0.0))
    wide = min(wide, 1.0)
    if not sp.ray_flags & RAY_CAMERA and wide * wide <= SINGULAR_ALPHA_SQUARED:
        add_transparent(sp, mul(transmitted, weight))
        return
    i = add_microfacets(sp, LOBE_THIN_TRANSMISSION, mul(transmitted, weight), n, n, wide, wide, 1.0, GGX)
    if i >= 0:
        preserve_energy(tables, closure_at(sp.closures, i), wo, (1.0, 1.0, 1.0))


@device
def add_thin_subsurface(sp, weight, n, g, roughness, color):
    """A sheet of dense matter: what is scattered backwards and forwards, by the anisotropy g, is diffuse."""
    back, through = scale(weight, clamp(0.5 - 0.5 * g, 0.0, 1.0)), scale(weight, clamp(0.5 + 0.5 * g, 0.0, 1.0))
    add_diffuse(sp, back, n, roughness, color)
    i = sp.n_closures
    add_diffuse(sp, through, n, roughness, color)
    if sp.n_closures == i:
        return
    c = closure_at(sp.closures, i)
    if c.kind == LOBE_OREN_NAYAR:
        c.kind = LOBE_ROUGH_TRANSLUCENT
        put(c.n, neg(n))
    else:
        c.kind = LOBE_TRANSLUCENT


@device
def thin_eval(c, wo, wi):
    """(value without the weight, pdf)."""
    n = vec(c.n)
    cosine = dot(n, wi)
    if cosine >= 0.0:
        return 0.0, 0.0
    value, _g, _b, pdf = microfacet_eval(c, wo, madd(wi, n, -2.0 * cosine))
    return value, pdf


@device
def thin_sample(c, sp, u0, u1):
    """(label, wi, throughput without the weight)."""
    wo, n = vec(sp.wo), vec(c.n)
    if is_singular(c):
        return LABEL_TRANSMIT | LABEL_SINGULAR, neg(wo), c.p[P_ENERGY]
    h = microfacet_normal(c, wo, u0, u1)
    mirror = madd(neg(wo), h, 2.0 * dot(h, wo))
    cosine = dot(n, mirror)
    wi = madd(mirror, n, -2.0 * cosine)
    if cosine <= 0.0 or dot(n, wo) <= 0.0 or dot(vec(sp.ng), wi) >= 0.0:
        return 0, wi, 0.0
    return LABEL_TRANSMIT | LABEL_GLOSSY, wi, c.p[P_ENERGY]
