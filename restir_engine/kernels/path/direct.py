"""Direct light at a shading point, whatever chose the light: the BSDF that it meets, and where it is written."""

from ..core import rng
from ..core.jit import device, inlined
from ..core.records import (
    LIGHT_SAMPLE_DELTA,
    LIGHT_SAMPLE_NO_SHADOW,
    RAY_DIFFUSE,
    RAY_GLOSSY,
    RAY_TRANSMIT,
    SCRATCH_LIGHT_SAMPLE,
    closure_at,
    light_sample_at,
)
from ..core.vec import add, is_black, mul, scale, vec
from ..film.contribute import add3, add_light, add_scattered, clamp_contribution
from ..lights import light_sample
from ..lights.mean_visibility import LATER, learn, mean_visibility
from ..lobes import bsdf_eval, bsdf_has_eval
from ..lobes.closure import CLASS_DIFFUSE, CLASS_GLASS, CLASS_GLOSSY, CLASS_TRANSMISSION, pass_class
from .shadow import transmittance
from .state import DIM_LIGHT, DIM_LIGHT_POINT, mis_weight, share

LOBE_RAYS = RAY_DIFFUSE | RAY_GLOSSY | RAY_TRANSMIT


@inlined
def lit_bsdf(scene, sp, wi, visibility):
    """(9 floats, pdf): bsdf_eval towards a light, without the classes of lobes that the light does not reach."""
    dr, dg, db, gr, gg, gb, tr, tg, tb, pdf = bsdf_eval(scene, sp, wi)
    if visibility & LOBE_RAYS != LOBE_RAYS:
        diffuse = 1.0 if visibility & RAY_DIFFUSE else 0.0
        glossy = 1.0 if visibility & RAY_GLOSSY else 0.0
        through = 1.0 if visibility & RAY_TRANSMIT else 0.0
        dr, dg, db = dr * diffuse, dg * diffuse, db * diffuse
        gr, gg, gb = gr * glossy, gg * glossy, gb * glossy
        tr, tg, tb = tr * through, tg * through, tb * through
    return (dr, dg, db, gr, gg, gb, tr, tg, tb), pdf


@inlined
def lobe_sum(f):
    """The rgb that nine floats by class of lobes add up to."""
    return (f[0] + f[3] + f[6], f[1] + f[4] + f[7], f[2] + f[5] + f[8])


@device
def control_variate_class(sp):
    """Nine floats as `add_direct` wants them, by which the variate of light tiles goes to classes of lobes.

    Its mean is 0, so that any shares will do, as long as the sample has no say in them and a channel of a class
    without colour gets nothing: these are the weights' shares, glass counting as glossy.
    """
    zero = (0.0, 0.0, 0.0)
    diffuse, glossy, through = zero, zero, zero
    for i in range(sp.n_closures):
        c = closure_at(sp.closures, i)
        kind = pass_class(c.kind)
        if kind == CLASS_DIFFUSE:
            diffuse = add(diffuse, vec(c.weight))
        elif kind == CLASS_TRANSMISSION:
            through = add(through, vec(c.weight))
        elif kind in (CLASS_GLOSSY, CLASS_GLASS):
            glossy = add(glossy, vec(c.weight))
    total = add(add(diffuse, glossy), through)
    inverse = (share(1.0, total[0]), share(1.0, total[1]), share(1.0, total[2]))
    return (*mul(diffuse, inverse), *mul(glossy, inverse), *mul(through, inverse))


@inlined
def add_direct(integrator, film, path, c, f):
    """Add light c that arrives at the path's vertex, its passes by the shares of the nine floats f of the BSDF."""
    if c[0] == 0.0 and c[1] == 0.0 and c[2] == 0.0:
        return
    c = clamp_contribution(c, integrator.clamp_indirect if path.bounce > 0 else integrator.clamp_direct)
    add_scattered(film, path, c)
    if path.bounce > 0:
        add_light(film, path.pixel, c, True, vec(path.diffuse_weight), vec(path.glossy_weight))
    elif film.light_passes > 0:
        total = lobe_sum(f)
        diffuse = (share(f[0], total[0]), share(f[1], total[1]), share(f[2], total[2]))
        glossy = (share(f[3], total[0]), share(f[4], total[1]), share(f[5], total[2]))
        add_light(film, path.pixel, c, False, diffuse, glossy)
    else:
        add3(path.pixel, film.combined, c)


@inlined
def direct_light(scene, integrator, film, scratch, path, sp):
    """Next event estimation: one light sample, weighted against the lobes' density, if its shadow ray is free."""
    if bsdf_has_eval(sp):
        _add_light_sample(scene, integrator, film, scratch, path, sp, path.sample, 1.0)


@inlined
def direct_lights(scene, integrator, film, scratch, path, sp, count):
    """The mean of `count` light samples. MIS weighs each as if it were alone: light that rays find needs not know."""
    if bsdf_has_eval(sp):
        for i in range(count):
            _add_light_sample(scene, integrator, film, scratch, path, sp, path.sample * count + i, 1.0 / count)


@device
def _add_light_sample(scene, integrator, film, scratch, path, sp, index, part):
    """Add the part of a light sample, that of an index of the path's random numbers."""
    u0 = rng.sample1(path.key, index & 0xFFFFFFFF, path.dimension + DIM_LIGHT)
    u1, u2 = rng.sample2(path.key, index & 0xFFFFFFFF, path.dimension + DIM_LIGHT_POINT)
    c, f = unshadowed(scene, scratch, sp, u0, u1, u2)
    variate = vec(light_sample_at(scratch + SCRATCH_LIGHT_SAMPLE, 0).control_variate)
    if not is_black(variate):
        variate = mul(variate, vec(path.throughput))
        variate = scale(variate, part * mean_visibility(path.mean_visibility, LATER))
        add_direct(integrator, film, path, variate, control_variate_class(sp))
    add_unless_shadowed(scene, integrator, film, scratch, path, sp, mul(scale(c, part), vec(path.throughput)), f)


@inlined
def unshadowed(scene, scratch, sp, u0, u1, u2):
    """(rgb, 9 floats): what one light sample, by MIS, would add at `sp`, and the BSDF towards it; (0, 0, 0): nothing.

    u0 chooses the light, u1 and u2 the point, which stays in the scratch's LIGHT_SAMPLE.
    """
    black = (0.0, 0.0, 0.0)
    nothing = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    if not light_sample(scene, sp, scratch, u1, u2, u0):
        return black, nothing
    ls = light_sample_at(scratch + SCRATCH_LIGHT_SAMPLE, 0)
    f, pdf = lit_bsdf(scene, sp, vec(ls.wi), ls.seen_by)
    total = lobe_sum(f)
    if total[0] + total[1] + total[2] == 0.0 or ls.pdf <= 0.0:
        return black, nothing
    weight = 1.0 / ls.pdf
    if not ls.flags & LIGHT_SAMPLE_DELTA:
        weight *= mis_weight(ls.mis_pdf, pdf)
    return mul(scale(total, weight), vec(ls.radiance)), f


@inlined
def add_unless_shadowed(scene, integrator, film, scratch, path, sp, c, f):
    """Add c, by the scratch's LIGHT_SAMPLE, as far as its shadow ray from `sp` is free."""
    if is_black(c):
        return
    ls = light_sample_at(scratch + SCRATCH_LIGHT_SAMPLE, 0)
    if not ls.flags & LIGHT_SAMPLE_NO_SHADOW:
        v = transmittance(scene, integrator, scratch, path, sp, vec(ls.wi), ls.distance, vec(ls.p))
        learn(path.mean_visibility, LATER, v)
        c = mul(c, v)
    add_direct(integrator, film, path, c, f)
