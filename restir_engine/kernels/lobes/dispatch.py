"""The BSDF of a shading point: the mixture of its closures, evaluated and sampled.

A direction is sampled from one closure, chosen by its sampling weight; value and density are the whole mixture's
(one-sample multiple importance sampling).
"""

import math

from ..core.jit import device, inlined
from ..core.records import closure_at
from ..core.vec import dot, madd, neg, scale, vec
from .ashikhmin import ashikhmin_eval, ashikhmin_sample, ashikhmin_singular
from .classes import NO_LOBES, Lobes, lobe_add
from .closure import (
    CLASS_DIFFUSE,
    CLASS_GLASS,
    CLASS_GLOSSY,
    LABEL_DIFFUSE,
    LABEL_GLOSSY,
    LABEL_REFLECT,
    LABEL_SINGULAR,
    LABEL_SUBSURFACE,
    LABEL_TRANSMIT,
    LABEL_TRANSPARENT,
    LOBE_ASHIKHMIN_SHIRLEY,
    LOBE_LAMBERT,
    LOBE_OREN_NAYAR,
    LOBE_ROUGH_TRANSLUCENT,
    LOBE_SHEEN,
    LOBE_SUBSURFACE,
    LOBE_THIN_TRANSMISSION,
    LOBE_TOON_DIFFUSE,
    LOBE_TOON_GLOSSY,
    LOBE_TRANSLUCENT,
    LOBE_TRANSPARENT,
    LOBE_VELVET,
    bump_shadowing,
    is_fibre,
    is_microfacet,
    pass_class,
    terminator_offset,
)
from .diffuse import diffuse_sample, lambert_eval, oren_nayar_eval
from .fibre import fibre_eval, fibre_label, fibre_sample
from .microfacet import microfacet_eval, microfacet_sample
from .sheen import sheen_eval, sheen_sample, velvet_eval, velvet_sample
from .thin import thin_eval, thin_sample
from .toon import toon_eval, toon_sample

_NONE = (0.0, 0.0, 0.0)


@device
def closure_eval(c, wo, wi):
    """(value rgb without the weight, times the absolute cosine; pdf by solid angle) of one closure."""
    kind = c.kind
    value = pdf = 0.0
    if kind == LOBE_LAMBERT:
        value = pdf = lambert_eval(c, wi, 1.0)
    elif is_microfacet(kind):
        return microfacet_eval(c, wo, wi)
    elif kind == LOBE_OREN_NAYAR:
        return oren_nayar_eval(c, wo, wi)
    elif is_fibre(kind):
        return fibre_eval(c, wi)
    elif kind == LOBE_SHEEN:
        value = pdf = sheen_eval(c, wi)
    elif kind == LOBE_TRANSLUCENT:
        value = pdf = lambert_eval(c, wi, -1.0)
    elif kind in (LOBE_TOON_DIFFUSE, LOBE_TOON_GLOSSY):
        value, pdf = toon_eval(c, wo, wi)
    elif kind == LOBE_VELVET:
        value, pdf = velvet_eval(c, wo, wi)
    elif kind == LOBE_ASHIKHMIN_SHIRLEY:
        value, pdf = ashikhmin_eval(c, wo, wi)
    elif kind == LOBE_THIN_TRANSMISSION:
        value, pdf = thin_eval(c, wo, wi)
    elif kind == LOBE_ROUGH_TRANSLUCENT:
        n = vec(c.n)
        return oren_nayar_eval(c, madd(wo, n, -2.0 * dot(n, wo)), wi)
    return value, value, value, pdf


@inlined
def _weighted(sp, c, wo, wi, sampled):
    """`closure_eval` times the closure's weight and what shadows it; sampled: whether it chose wi."""
    r, g, b, p = closure_eval(c, wo, wi)
    shadowing = 1.0
    if p > 0.0 and not is_fibre(c.kind):
        shadowing = bump_shadowing(sp, c, wi, sampled) * terminator_offset(sp, c, wi)
    return r * c.weight[0] * shadowing, g * c.weight[1] * shadowing, b * c.weight[2] * shadowing, p


@device
def _mixture(sp, wi, sampled):
    """(value by class of lobes, pdf) of all closures for wi; `sampled`: the index of the one that chose it, else -1."""
    wo = vec(sp.wo)
    dr = dg = db = gr = gg = gb = tr = tg = tb = 0.0
    pdf = total = 0.0
    for i in range(sp.n_closures):
        c = closure_at(sp.closures, i)
        total += c.sample_weight
        r, g, b, p = _weighted(sp, c, wo, wi, i == sampled)
        if p <= 0.0:
            continue
        pdf += p * c.sample_weight
        kind = pass_class(c.kind)
        if kind == CLASS_DIFFUSE:
            dr, dg, db = dr + r, dg + g, db + b
        elif kind == CLASS_GLOSSY or (kind == CLASS_GLASS and dot(vec(c.n), wi) > 0.0):
            gr, gg, gb = gr + r, gg + g, gb + b
        else:
            tr, tg, tb = tr + r, tg + g, tb + b
    if total <= 0.0:
        return NO_LOBES, 0.0
    return Lobes((dr, dg, db), (gr, gg, gb), (tr, tg, tb)), pdf / total


@device
def bsdf_eval(scene, sp, wi):
    """(value by class of lobes, times the absolute cosine; pdf by solid angle).

    Singular lobes are left out of the value, and count in the pdf as a chance that is lost.
    """
    if sp.n_closures == 1:
        c = closure_at(sp.closures, 0)
        if c.kind == LOBE_LAMBERT:
            pdf = lambert_eval(c, wi, 1.0)
            value = pdf * bump_shadowing(sp, c, wi, False) * terminator_offset(sp, c, wi)
            r, g, b = value * c.weight[0], value * c.weight[1], value * c.weight[2]
            return Lobes((r, g, b), _NONE, _NONE), pdf
    return _mixture(sp, wi, -1)


@device
def glass_eval(sp, wi):
    """What of `bsdf_eval` is glass, which mirrors and refracts at once."""
    f = NO_LOBES
    for i in range(sp.n_closures):
        c = closure_at(sp.closures, i)
        if pass_class(c.kind) == CLASS_GLASS:
            r, g, b, pdf = _weighted(sp, c, vec(sp.wo), wi, False)
            if pdf > 0.0:
                mirrors = dot(vec(c.n), wi) > 0.0
                f = lobe_add(f, Lobes(_NONE, (r, g, b) if mirrors else _NONE, _NONE if mirrors else (r, g, b)))
    return f


@device
def _label(c, reflects):
    """The label of a direction that a closure with a density samples on that side, 0 where it samples none there."""
    kind = c.kind
    if is_fibre(kind):
        return fibre_label(kind)
    if kind in (LOBE_TRANSLUCENT, LOBE_ROUGH_TRANSLUCENT):
        return 0 if reflects else LABEL_TRANSMIT | LABEL_DIFFUSE
    side = LABEL_REFLECT if reflects else LABEL_TRANSMIT
    if is_microfacet(kind) or kind == LOBE_THIN_TRANSMISSION:
        return side | LABEL_GLOSSY
    if not reflects:
        return 0
    return side | (LABEL_GLOSSY if kind in (LOBE_ASHIKHMIN_SHIRLEY, LOBE_TOON_GLOSSY) else LABEL_DIFFUSE)


@device
def label_pdf(sp, wi, label):
    """Solid-angle density with which bsdf_sample returns wi with this label; of labels that are not singular."""
    reflects = dot(vec(sp.ng), wi) > 0.0
    wo = vec(sp.wo)
    pdf = total = 0.0
    for i in range(sp.n_closures):
        c = closure_at(sp.closures, i)
        total += c.sample_weight
        if _label(c, reflects) == label:
            _r, _g, _b, p = closure_eval(c, wo, wi)
            pdf += max(p, 0.0) * c.sample_weight
    return pdf / total if total > 0.0 else 0.0


@device
def pick_closure(sp, u):
    """(index of a closure chosen by sampling weight or -1, its probability, u stretched to be used again)."""
    total = 0.0
    for i in range(sp.n_closures):
        total += closure_at(sp.closures, i).sample_weight
    if not total > 0.0:
        return -1, 0.0, u
    left = u * total
    last = -1
    for i in range(sp.n_closures):
        w = closure_at(sp.closures, i).sample_weight
        if w > 0.0:
            last = i
            if left < w:
                return i, w / total, min(left / w, 1.0 - 1e-12)
        left -= w
    return last, closure_at(sp.closures, last).sample_weight / total, 1.0 - 1e-12


@device
def _side(sp, label, wi):
    """The label if wi is on its side of the surface, else 0."""
    cosine = dot(vec(sp.ng), wi)
    return label if (cosine > 0.0 if label & LABEL_REFLECT else cosine < 0.0) else 0


@device
def closure_sample(c, sp, u0, u1, u2):
    """(label, wi, throughput rgb without the weight and probability, both for singular labels) of one closure."""
    kind = c.kind
    wo = vec(sp.wo)
    if is_microfacet(kind):
        return microfacet_sample(c, sp, u0, u1, u2)
    if is_fibre(kind):
        label, wi = fibre_sample(c, u0, u1, u2)
        return label, wi, _NONE, 0.0
    diffuse = LABEL_REFLECT | LABEL_DIFFUSE
    glossy = LABEL_REFLECT | LABEL_GLOSSY
    if kind <= LOBE_OREN_NAYAR:
        wi = diffuse_sample(c, 1.0, u0, u1)
        return _side(sp, diffuse, wi), wi, _NONE, 0.0
    if kind in (LOBE_TRANSLUCENT, LOBE_ROUGH_TRANSLUCENT):
        wi = diffuse_sample(c, -1.0 if kind == LOBE_TRANSLUCENT else 1.0, u0, u1)
        return _side(sp, LABEL_TRANSMIT | LABEL_DIFFUSE, wi), wi, _NONE, 0.0
    if kind == LOBE_TRANSPARENT:
        return LABEL_TRANSMIT | LABEL_SINGULAR | LABEL_TRANSPARENT, neg(wo), (1.0, 1.0, 1.0), 1.0
    if kind == LOBE_SHEEN:
        wi = sheen_sample(c, u0, u1)
        return _side(sp, diffuse, wi), wi, _NONE, 0.0
    if kind == LOBE_VELVET:
        wi = velvet_sample(c, u0, u1)
        return _side(sp, diffuse, wi), wi, _NONE, 0.0
    if kind in (LOBE_TOON_DIFFUSE, LOBE_TOON_GLOSSY):
        wi = toon_sample(c, wo, u0, u1)
        return _side(sp, diffuse if kind == LOBE_TOON_DIFFUSE else glossy, wi), wi, _NONE, 0.0
    if kind == LOBE_ASHIKHMIN_SHIRLEY:
        wi = ashikhmin_sample(c, wo, u0, u1)
        label = LABEL_REFLECT | (LABEL_SINGULAR if ashikhmin_singular(c) else LABEL_GLOSSY)
        return _side(sp, label, wi), wi, (1.0, 1.0, 1.0), 1.0
    if kind == LOBE_THIN_TRANSMISSION:
        label, wi, energy = thin_sample(c, sp, u0, u1)
        return label, wi, (energy, energy, energy), 1.0
    return 0, wo, _NONE, 0.0


@device
def bsdf_sample(scene, sp, u0, u1, u2):
    """(label, wi, value, pdf); u0 picks the closure, u1 and u2 the direction.

    `value` is the mixture's, by class of lobes, times the absolute cosine, `pdf` its density by solid angle.
    With LABEL_SINGULAR they are of the one lobe: value / pdf is the throughput. Label 0: no sample. So they are with
    LABEL_SUBSURFACE, which has no direction: `sp.scatterer` is the closure that scatters. Where closures were picked
    from, `sp.sampled_alpha_squared` tells the roughness of the chosen one.
    """
    if sp.n_closures == 1:
        c = closure_at(sp.closures, 0)
        if c.kind == LOBE_LAMBERT:
            wi = diffuse_sample(c, 1.0, u1, u2)
            pdf = lambert_eval(c, wi, 1.0)
            if dot(vec(sp.ng), wi) <= 0.0 or pdf <= 0.0:
                return 0, wi, NO_LOBES, 0.0
            value = pdf * bump_shadowing(sp, c, wi, True) * terminator_offset(sp, c, wi)
            r, g, b = scale(vec(c.weight), value)
            return LABEL_REFLECT | LABEL_DIFFUSE, wi, Lobes((r, g, b), _NONE, _NONE), pdf
    chosen, probability, u = pick_closure(sp, u0)
    if chosen < 0:
        return 0, _NONE, NO_LOBES, 0.0
    c = closure_at(sp.closures, chosen)
    has_alpha = is_microfacet(c.kind) or c.kind == LOBE_THIN_TRANSMISSION
    sp.sampled_alpha_squared = c.alpha_x * c.alpha_y if has_alpha else math.inf
    if c.kind == LOBE_SUBSURFACE:
        sp.scatterer = chosen
        r, g, b = vec(c.weight)
        return LABEL_SUBSURFACE, _NONE, Lobes((r, g, b), _NONE, _NONE), probability
    label, wi, throughput, side = closure_sample(c, sp, u1, u2, u)
    if label == 0:
        return 0, wi, NO_LOBES, 0.0
    if label & LABEL_SINGULAR:
        r, g, b = throughput[0] * c.weight[0], throughput[1] * c.weight[1], throughput[2] * c.weight[2]
        if label & LABEL_REFLECT:
            r, g, b = scale((r, g, b), terminator_offset(sp, c, wi))
            return label, wi, Lobes(_NONE, (r, g, b), _NONE), side * probability
        return label, wi, Lobes(_NONE, _NONE, (r, g, b)), side * probability
    value, pdf = _mixture(sp, wi, chosen)
    if pdf <= 0.0:
        return 0, wi, NO_LOBES, 0.0
    return label, wi, value, pdf
