"""Next event estimation: a light sample, how a vertex scatters it, MIS, its shadow ray, and its contribution.

What scatters is the BSDF of a surface here, and the phase function of a medium in `volume.segment`; all else is one.
"""

from ..core import rng
from ..core.jit import device, inlined
from ..core.records import (
    LIGHT_SAMPLE_DELTA,
    RAY_DIFFUSE,
    RAY_GLOSSY,
    RAY_TRANSMIT,
    SCRATCH_LIGHT_SAMPLE,
    closure_at,
    light_sample_at,
)
from ..core.vec import is_black, mul, scale, vec
from ..film.contribute import contribute, lit, lit_by_several
from ..lights import light_sample
from ..lights.mean_visibility import LATER, learn, mean_visibility
from ..lobes import bsdf_eval, bsdf_has_eval, glass_eval
from ..lobes.classes import NO_LOBES, Lobes, lobe_add, lobe_scale, lobe_sum, share
from ..lobes.closure import CLASS_DIFFUSE, CLASS_GLASS, CLASS_GLOSSY, CLASS_TRANSMISSION, pass_class
from .shadow import light_visibility
from .state import DIM_LIGHT, DIM_LIGHT_POINT, mis_weight

LOBE_RAYS = RAY_DIFFUSE | RAY_GLOSSY | RAY_TRANSMIT

_BLACK = (0.0, 0.0, 0.0)


@inlined
def direct_light(scene, integrator, film, scratch, path, sp, count):
    """Add the mean of `count` light samples at the surface sp. MIS weighs each as if it were alone.

    So light that rays find needs not know of `count`.
    """
    if bsdf_has_eval(sp):
        for i in range(count):
            _light_surface(scene, integrator, film, scratch, path, sp, path.sample * count + i, 1.0 / count)


@device
def _light_surface(scene, integrator, film, scratch, path, sp, index, part):
    """Add the part of one light sample, that of an index of the path's random numbers, and its control variate."""
    found = draw_light(scene, scratch, path, sp, index)
    add_control_variate(integrator, film, scratch, path, sp, part)
    if found:
        ls = light_sample_at(scratch + SCRATCH_LIGHT_SAMPLE, 0)
        f, pdf = lit_bsdf(scene, sp, vec(ls.wi), ls.seen_by)
        add_light_sample(scene, integrator, film, scratch, path, sp, f, pdf, part)


@inlined
def draw_light(scene, scratch, path, sp, index):
    """Fill the scratch's LIGHT_SAMPLE by an index of the path's random numbers; False where there is none."""
    u0 = rng.sample1(path.key, index & 0xFFFFFFFF, path.dimension + DIM_LIGHT)
    u1, u2 = rng.sample2(path.key, index & 0xFFFFFFFF, path.dimension + DIM_LIGHT_POINT)
    return light_sample(scene, sp, scratch, u1, u2, u0)


@inlined
def add_light_sample(scene, integrator, film, scratch, path, sp, f, pdf, part):
    """Add the part of the scratch's LIGHT_SAMPLE that f, whose directions have the density pdf, sends on from sp."""
    c = mul(scale(scattered_light(scratch, f, pdf), part), vec(path.throughput))
    what = lit(path, f, light_sample_at(scratch + SCRATCH_LIGHT_SAMPLE, 0))
    add_unless_shadowed(scene, integrator, film, scratch, path, sp, c, what)


@inlined
def scattered_light(scratch, f, pdf):
    """What f sends on of the scratch's LIGHT_SAMPLE, without shadow, by the sample's density and MIS against pdf."""
    ls = light_sample_at(scratch + SCRATCH_LIGHT_SAMPLE, 0)
    total = lobe_sum(f)
    if total[0] + total[1] + total[2] == 0.0 or ls.pdf <= 0.0:
        return _BLACK
    weight = 1.0 / ls.pdf
    if not ls.flags & LIGHT_SAMPLE_DELTA:
        weight *= mis_weight(ls.mis_pdf, pdf)
    return mul(scale(total, weight), vec(ls.radiance))


@inlined
def add_unless_shadowed(scene, integrator, film, scratch, path, sp, c, what):
    """Contribute c, which the scratch's LIGHT_SAMPLE brings to sp, as far as its shadow ray is free."""
    if is_black(c):
        return
    v = light_visibility(scene, integrator, scratch, path, sp)
    learn(path.mean_visibility, LATER, v)
    contribute(integrator, film, path, mul(c, v), what)


@inlined
def sampled_light(scene, scratch, sp, u0, u1, u2, alone):
    """(rgb, BSDF by class of lobes): what one light sample, by MIS, brings at the surface sp without shadow.

    u0 chooses the light, u1 and u2 the point, which stays in the scratch's LIGHT_SAMPLE. alone: whether nothing else
    finds that light, so that the sample has all the weight.
    """
    if not light_sample(scene, sp, scratch, u1, u2, u0):
        return _BLACK, NO_LOBES
    ls = light_sample_at(scratch + SCRATCH_LIGHT_SAMPLE, 0)
    f, pdf = lit_bsdf(scene, sp, vec(ls.wi), ls.seen_by)
    return scattered_light(scratch, f, 0.0 if alone else pdf), f


@inlined
def lit_bsdf(scene, sp, wi, seen_by):
    """bsdf_eval towards a light, without the classes of lobes that the light does not reach.

    Glass, which is of two classes, every light of a visible object or lamp reaches, as in Cycles.
    """
    f, pdf = bsdf_eval(scene, sp, wi)
    if seen_by & LOBE_RAYS != LOBE_RAYS:
        glass = glass_eval(sp, wi) if seen_by != 0 else NO_LOBES
        f = Lobes(
            f.diffuse if seen_by & RAY_DIFFUSE else _BLACK,
            f.glossy if seen_by & RAY_GLOSSY else glass.glossy,
            f.transmission if seen_by & RAY_TRANSMIT else glass.transmission,
        )
    return f, pdf


@inlined
def add_control_variate(integrator, film, scratch, path, sp, part):
    """Add the part of the LIGHT_SAMPLE's control variate, whether or not there is a sample."""
    variate = vec(light_sample_at(scratch + SCRATCH_LIGHT_SAMPLE, 0).control_variate)
    if is_black(variate):
        return
    c = scale(mul(variate, vec(path.throughput)), part * mean_visibility(path.mean_visibility, LATER))
    contribute(integrator, film, path, c, lit_by_several(path, control_variate_class(sp)))


@device
def control_variate_class(sp):
    """The shares of the classes of lobes to which the control variate of light tiles goes.

    Its mean is 0, so that any shares will do, as long as the sample has no say in them and a channel of a class
    without colour gets nothing: these are the weights' shares, glass counting as glossy.
    """
    f = NO_LOBES
    for i in range(sp.n_closures):
        c = closure_at(sp.closures, i)
        kind = pass_class(c.kind)
        if kind == CLASS_DIFFUSE:
            f = lobe_add(f, Lobes(vec(c.weight), _BLACK, _BLACK))
        elif kind == CLASS_TRANSMISSION:
            f = lobe_add(f, Lobes(_BLACK, _BLACK, vec(c.weight)))
        elif kind in (CLASS_GLOSSY, CLASS_GLASS):
            f = lobe_add(f, Lobes(_BLACK, vec(c.weight), _BLACK))
    total = lobe_sum(f)
    return lobe_scale(f, (share(1.0, total[0]), share(1.0, total[1]), share(1.0, total[2])))
