"""What passes and filters ask of the closures: colours, roughness, normals, the denoiser's features, glossy blur."""

import math

from ..core.jit import device, inlined
from ..core.records import closure_at
from ..core.vec import add, average, is_black, madd, normalize, scale, vec
from .albedo import microfacet_albedo
from .classes import Lobes
from .closure import (
    CLASS_DIFFUSE,
    CLASS_GLASS,
    CLASS_GLOSSY,
    CLASS_TRANSMISSION,
    LOBE_ASHIKHMIN_SHIRLEY,
    LOBE_FIBRE,
    LOBE_OREN_NAYAR,
    LOBE_ROUGH_TRANSLUCENT,
    LOBE_SUBSURFACE,
    LOBE_THIN_TRANSMISSION,
    LOBE_TRANSPARENT,
    is_fibre,
    is_microfacet,
    is_singular,
    pass_class,
)
from .fibre import blur_fibre

# Lobes rougher than this count as diffuse to the denoiser.
_FEATURE_ALPHA_SQUARED = 0.075**2
_GRADED_ALPHA = 0.15


@device
def _has_alpha(kind):
    """Whether a lobe has α."""
    return is_microfacet(kind) or kind in (LOBE_ASHIKHMIN_SHIRLEY, LOBE_THIN_TRANSMISSION)


@device
def _albedo(scene, sp, c):
    """(reflected rgb, transmitted rgb) of a closure with its weight; light that passes straight counts as reflected."""
    w = vec(c.weight)
    if c.kind == LOBE_THIN_TRANSMISSION:
        return 0.0, 0.0, 0.0, w[0], w[1], w[2]
    if is_microfacet(c.kind):
        r0, r1, r2, t0, t1, t2 = microfacet_albedo(scene.lobe_tables, c, vec(sp.wo))
        return w[0] * r0, w[1] * r1, w[2] * r2, w[0] * t0, w[1] * t1, w[2] * t2
    if is_fibre(c.kind):
        a = vec(c.albedo)
        return w[0] * a[0], w[1] * a[1], w[2] * a[2], 0.0, 0.0, 0.0
    return w[0], w[1], w[2], 0.0, 0.0, 0.0


@device
def bsdf_color(scene, sp):
    """Directional albedos by class of lobes."""
    diffuse = glossy = transmission = (0.0, 0.0, 0.0)
    for i in range(sp.n_closures):
        c = closure_at(sp.closures, i)
        r0, r1, r2, t0, t1, t2 = _albedo(scene, sp, c)
        kind = pass_class(c.kind)
        if kind == CLASS_DIFFUSE:
            diffuse = add(diffuse, (r0, r1, r2))
        elif kind in (CLASS_GLOSSY, CLASS_GLASS):
            glossy = add(glossy, (r0, r1, r2))
        if kind in (CLASS_TRANSMISSION, CLASS_GLASS):
            transmission = add(transmission, (t0, t1, t2))
    return Lobes(diffuse, glossy, transmission)


@device
def bsdf_roughness(sp):
    """The roughness of the closures that have one, averaged by weight; 1 without any."""
    total = result = 0.0
    for i in range(sp.n_closures):
        c = closure_at(sp.closures, i)
        if _has_alpha(c.kind):
            value = math.sqrt(math.sqrt(c.alpha_x * c.alpha_y))
        elif c.kind in (LOBE_OREN_NAYAR, LOBE_ROUGH_TRANSLUCENT):
            value = c.p[5]
        elif c.kind == LOBE_TRANSPARENT or pass_class(c.kind) == CLASS_DIFFUSE:
            continue
        else:
            value = 1.0
        weight = average(vec(c.weight))
        result += weight * value
        total += weight
    return result / total if total > 0.0 else 1.0


@device
def bsdf_normal(sp):
    """The normals of the closures averaged by weight; the smooth normal without any."""
    n = (0.0, 0.0, 0.0)
    for i in range(sp.n_closures):
        c = closure_at(sp.closures, i)
        n = madd(n, vec(c.n), average(vec(c.weight)))
    n = normalize(n)
    return vec(sp.n) if is_black(n) else n


@device
def bsdf_has_eval(sp):
    """Whether any closure can be evaluated, so that light sampling is of use."""
    for i in range(sp.n_closures):
        c = closure_at(sp.closures, i)
        if c.kind != LOBE_TRANSPARENT and c.kind != LOBE_SUBSURFACE and not (_has_alpha(c.kind) and is_singular(c)):
            return True
    return False


@device
def bsdf_blur(sp, roughness):
    """Filter glossy: no microfacets smoother than α = roughness. Energy compensation stays as it was, as in Cycles."""
    for i in range(sp.n_closures):
        c = closure_at(sp.closures, i)
        if _has_alpha(c.kind):
            c.alpha_x = max(c.alpha_x, roughness)
            c.alpha_y = max(c.alpha_y, roughness)
        elif c.kind == LOBE_FIBRE:
            blur_fibre(c, roughness)


@device
def is_blurred(sp):
    """Whether `bsdf_blur` may have a say, for whatever path: roughness goes up to α = 0.5."""
    for i in range(sp.n_closures):
        c = closure_at(sp.closures, i)
        if c.kind == LOBE_FIBRE or (_has_alpha(c.kind) and min(c.alpha_x, c.alpha_y) < 0.5):
            return True
    return False


@device
def denoise_features(scene, sp):
    """(albedo of diffuse-like lobes, normal, albedo of mirror-like lobes, whether the surface is diffuse-like).

    A surface whose lobes are smoother than α = 0.075 by three quarters of the sampling weight or more is mirror-like:
    its features are those of what is seen in it, times the third value.
    """
    albedo = specular = normal = (0.0, 0.0, 0.0)
    total = rough = 0.0
    for i in range(sp.n_closures):
        c = closure_at(sp.closures, i)
        normal = madd(normal, vec(c.n), c.sample_weight)
        total += c.sample_weight
        r0, r1, r2, t0, t1, t2 = _albedo(scene, sp, c)
        a = (r0 + t0, r1 + t1, r2 + t2)
        smooth = c.kind == LOBE_TRANSPARENT or (_has_alpha(c.kind) and c.alpha_x * c.alpha_y <= _FEATURE_ALPHA_SQUARED)
        if smooth:
            specular = add(specular, a)
        else:
            albedo = add(albedo, a)
            rough += c.sample_weight
    if total > 0.0:
        normal = scale(normal, 1.0 / total)
    return albedo, normal, specular, total == 0.0 or 4.0 * rough > total


@device
def graded_features(scene, sp):
    """(albedo, normal, mirror-like albedo, what a path goes on with, roughness): a lobe is mirror-like by degrees.

    The smoother it is, from α = 0.15 down, the more; and the more of the surface's lobes are, by sampling weight, the
    less is told of the surface and the more of what is seen in it. What lies behind counts by what the surface lets
    through. As Cycles from Blender 5.2 on.
    """
    albedo = specular = through = normal = (0.0, 0.0, 0.0)
    total = opaque = smooth = rough = 0.0
    for i in range(sp.n_closures):
        c = closure_at(sp.closures, i)
        total += c.sample_weight
        r0, r1, r2, t0, t1, t2 = _albedo(scene, sp, c)
        a = (r0 + t0, r1 + t1, r2 + t2)
        if c.kind == LOBE_TRANSPARENT:
            through = add(through, a)
            continue
        alpha = 1.0
        if _has_alpha(c.kind):
            alpha = math.sqrt(c.alpha_x * c.alpha_y)
        mirrors = 1.0 - _smooth_step(alpha / _GRADED_ALPHA)
        specular = madd(specular, a, mirrors)
        albedo = madd(albedo, a, 1.0 - mirrors)
        normal = madd(normal, vec(c.n), c.sample_weight)
        opaque += c.sample_weight
        smooth += mirrors * c.sample_weight
        rough += math.sqrt(alpha) * c.sample_weight
    if opaque <= 0.0:
        return albedo, normal, specular, through, 0.0
    seen_in_it = _smooth_step(2.0 * smooth / opaque - 1.0)
    told = 1.0 - seen_in_it
    onward = madd(through, specular, seen_in_it)
    return scale(albedo, told), scale(normal, told / total), specular, onward, rough / opaque


@inlined
def _smooth_step(x):
    x = min(max(x, 0.0), 1.0)
    return x * x * (3.0 - 2.0 * x)
