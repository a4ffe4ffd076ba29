"""The integrand of direct light and the target p̂ that resampling strives for, of a light's point at any vertex."""

import math

from ....kernels.core.jit import device, entry, inlined
from ....kernels.core.memory import copy_words, record_address
from ....kernels.core.records import (
    PATH,
    SCENE_HAS_MEDIA,
    SCRATCH_LIGHT_SAMPLE,
    SCRATCH_PATH,
    integrator_at,
    light_sample_at,
    path_at,
)
from ....kernels.core.vec import is_black, load3_f32, vec
from ....kernels.lights import light_point
from ....kernels.lobes.classes import NO_LOBES, lobe_scale, lobe_sum
from ....kernels.path.direct import control_variate_class, lit_bsdf
from ....kernels.path.shadow import light_visibility
from ....kernels.volume.calls import media_around
from ...resampling.frame import frame_at
from ...resampling.inputs import point_at, scene_of
from ...resampling.options import TARGET, reuse_at
from ...resampling.technique import domain_at, shifted_at, store_f
from .sample import direct_reservoir_at, keep

PATH_WORDS = PATH.itemsize // 8


@device
def light_integrand(scene, sp, scratch, source, primitive, u, v):
    """f without visibility at sp of a light's point (kernels.lights.points): by class of lobes.

    By the measure of these coordinates. Leaves the LIGHT_SAMPLE in scratch, for `transmittance_to_light`.
    """
    if not light_point(scene, sp, scratch, source, primitive, u, v):
        return NO_LOBES
    ls = light_sample_at(scratch + SCRATCH_LIGHT_SAMPLE, 0)
    f, _ = lit_bsdf(scene, sp, vec(ls.wi), ls.seen_by)
    return integrand(ls, f)


@inlined
def integrand(ls, f):
    """f of a LIGHT_SAMPLE from light_point or a tile, from the BSDF towards it."""
    pdf = ls.point_pdf
    f = lobe_scale(f, (ls.radiance[0] / pdf, ls.radiance[1] / pdf, ls.radiance[2] / pdf))
    rgb = lobe_sum(f)
    return f if math.isfinite(rgb[0] + rgb[1] + rgb[2]) else NO_LOBES


@device
def transmittance_to_light(scene, integrator, frame, scratch, pixel):
    """V by channel between a pixel's vertex and the LIGHT_SAMPLE in scratch: the shadow ray of a light sample.

    scene, integrator: of the frame, which may be the one before.
    """
    path = path_at(frame.paths, pixel)
    sp = point_at(frame, pixel)
    if scene.flags & SCENE_HAS_MEDIA:  # whose code takes the path from working memory
        copy_words(scratch + SCRATCH_PATH, record_address(path), PATH_WORDS)
    media_around(scene, integrator, scratch, path, sp)
    return light_visibility(scene, integrator, scratch, path, sp)


@inlined
def _integrand_at(domain, shifted):
    """f without V of the shifted sample in a domain."""
    d = domain_at(domain, 0)
    r = direct_reservoir_at(shifted, 0)
    sp = point_at(frame_at(d.frame, 0), d.pixel)
    return light_integrand(scene_of(d), sp, d.scratch, int(r.source), int(r.primitive), float(r.u), float(r.v))


@inlined
def _trace(domain):
    """V between the domain's vertex and the LIGHT_SAMPLE in its scratch."""
    d = domain_at(domain, 0)
    return transmittance_to_light(scene_of(d), integrator_at(d.integrator, 0), frame_at(d.frame, 0), d.scratch, d.pixel)


@entry
def target_light(domain, shifted, a, b, c):
    """f and p̂ of a shifted sample (see resampling.technique); V is a part of both where `visibility` is TARGET."""
    reuse = reuse_at(domain_at(domain, 0).reuse, 0)
    f = _integrand_at(domain, shifted)
    p = target_of_light(reuse, f)
    if p > 0.0 and reuse.visibility == TARGET:
        v = _trace(domain)
        keep(direct_reservoir_at(shifted, 0), v)
        f = lobe_scale(f, v)
        p = target_of_light(reuse, f)
    shifted_at(shifted, 0).target = p
    store_f(shifted, f)


@device
def trace_visibility(domain, shifted):
    """V of a shifted sample in a domain, by a shadow ray."""
    _integrand_at(domain, shifted)
    return _trace(domain)


@entry
def light_control_variate(domain, shifted, a, b, c):
    """The control variate that a pixel's candidates have left (see resampling.technique)."""
    d = domain_at(domain, 0)
    store_f(shifted, control_variate_at(frame_at(d.frame, 0), d.pixel))


@inlined
def brightness(reuse, rgb):
    """p̂ of light: its channels by REUSE.weights; light that is taken away counts as much as light given."""
    return reuse.weights[0] * abs(rgb[0]) + reuse.weights[1] * abs(rgb[1]) + reuse.weights[2] * abs(rgb[2])


@inlined
def target_of_light(reuse, f):
    """p̂ of light by class of lobes."""
    return brightness(reuse, lobe_sum(f))


@inlined
def control_variate_at(frame, pixel):
    """The control variate that a pixel's candidates have left, to be added to what lights it."""
    variate = load3_f32(frame.control_variates, pixel)
    if is_black(variate):
        return NO_LOBES
    return lobe_scale(control_variate_class(point_at(frame, pixel)), variate)
