"""The integrand of direct light and the target p̂ that resampling strives for, of a light's point at any vertex."""

import math

from ....kernels.core.jit import device, inlined
from ....kernels.core.memory import copy_words, record_address, store_f32
from ....kernels.core.records import (
    LIGHT_SAMPLE_NO_SHADOW,
    SCENE_HAS_MEDIA,
    SCRATCH_LIGHT_SAMPLE,
    SCRATCH_PATH,
    light_sample_at,
    path_at,
    shading_point_at,
)
from ....kernels.core.vec import is_black, load3_f32, scale, vec
from ....kernels.lights import light_point
from ....kernels.lobes.classes import NO_LOBES, Lobes, lobe_scale, lobe_sum
from ....kernels.path.direct import control_variate_class, lit_bsdf
from ....kernels.path.shadow import transmittance
from ....kernels.volume.calls import media_around
from ...resampling.reservoir import NOTHING
from ...restir.gbuffer import PATH_WORDS


@inlined
def point_at(frame, pixel):
    """The SHADING_POINT of a pixel; its instance is -1 where there is none."""
    return shading_point_at(frame.points, pixel)


@device
def unshadowed(scene, sp, scratch, source, primitive, u, v):
    """f without visibility at sp of a light's point (kernels.lights.points): by class of lobes.

    By the measure of these coordinates. Leaves the LIGHT_SAMPLE in scratch, for `visibility`.
    """
    if primitive == NOTHING or not light_point(scene, sp, scratch, source, primitive, u, v):
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
def visibility(scene, integrator, frame, scratch, pixel):
    """V by channel between a pixel's vertex and the LIGHT_SAMPLE in scratch.

    scene, integrator: of the frame, which may be the one before.
    """
    ls = light_sample_at(scratch + SCRATCH_LIGHT_SAMPLE, 0)
    if ls.flags & LIGHT_SAMPLE_NO_SHADOW:
        return (1.0, 1.0, 1.0)
    path = path_at(frame.paths, pixel)
    sp = point_at(frame, pixel)
    if scene.flags & SCENE_HAS_MEDIA:  # whose code takes the path from working memory
        copy_words(scratch + SCRATCH_PATH, record_address(path), PATH_WORDS)
    media_around(scene, integrator, scratch, path, sp)
    return transmittance(scene, integrator, scratch, path, sp, vec(ls.wi), ls.distance, vec(ls.p))


@inlined
def brightness(reuse, rgb):
    """p̂ of a contribution: its channels by REUSE.weights; light that is taken away counts as much as light given."""
    return reuse.weights[0] * abs(rgb[0]) + reuse.weights[1] * abs(rgb[1]) + reuse.weights[2] * abs(rgb[2])


@inlined
def target_of_light(reuse, f):
    """p̂ of light by class of lobes."""
    return brightness(reuse, lobe_sum(f))


@inlined
def load_light(frame, pixel):
    """frame.light of a pixel, by class of lobes."""
    light = frame.light + 36 * pixel
    return Lobes(load3_f32(light, 0), load3_f32(light, 1), load3_f32(light, 2))


@inlined
def control_variate_at(frame, pixel, share):
    """A share of the variate that a pixel's candidates have left, to be added to what lights it."""
    variate = load3_f32(frame.control_variates, pixel)
    if is_black(variate):
        return NO_LOBES
    return lobe_scale(control_variate_class(point_at(frame, pixel)), scale(variate, share))


@inlined
def store_light(frame, reuse, pixel, f):
    """Set frame.light of a pixel, in the channels that the reservoirs are for."""
    light = frame.light + 36 * pixel
    for k in range(3):
        if reuse.channel < 0 or k == reuse.channel:
            store_f32(light, k, f.diffuse[k])
            store_f32(light, 3 + k, f.glossy[k])
            store_f32(light, 6 + k, f.transmission[k])
