"""The integrand of direct light and the target p̂ that resampling strives for, of a light's point at any vertex."""

import math

from ....kernels.core.jit import device, inlined
from ....kernels.core.memory import copy_words, load_f32, load_f64, record_address, store_f32, store_f64
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
from ....kernels.path.direct import control_variate_class, lit_bsdf, lobe_sum
from ....kernels.path.shadow import transmittance
from ....kernels.volume.calls import media_around
from ...resampling.reservoir import NOTHING
from ...restir.gbuffer import PATH_WORDS

DARK = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)  # by class of lobes


@inlined
def point_at(frame, pixel):
    """The SHADING_POINT of a pixel; its instance is -1 where there is none."""
    return shading_point_at(frame.points, pixel)


@device
def unshadowed(scene, sp, scratch, source, primitive, u, v):
    """f without visibility at sp of a light's point (kernels.lights.points): 9 floats by class of lobes.

    By the measure of these coordinates. Leaves the LIGHT_SAMPLE in scratch, for `visibility`.
    """
    if primitive == NOTHING or not light_point(scene, sp, scratch, source, primitive, u, v):
        return DARK
    ls = light_sample_at(scratch + SCRATCH_LIGHT_SAMPLE, 0)
    f, _ = lit_bsdf(scene, sp, vec(ls.wi), ls.seen_by)
    return integrand(ls, f)


@inlined
def integrand(ls, f):
    """f of a LIGHT_SAMPLE from light_point or a tile, from the BSDF towards it."""
    r = ls.radiance[0] / ls.point_pdf
    g = ls.radiance[1] / ls.point_pdf
    b = ls.radiance[2] / ls.point_pdf
    f = (f[0] * r, f[1] * g, f[2] * b, f[3] * r, f[4] * g, f[5] * b, f[6] * r, f[7] * g, f[8] * b)
    rgb = lobe_sum(f)
    return f if math.isfinite(rgb[0] + rgb[1] + rgb[2]) else DARK


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
def masked(f, v):
    """Nine floats by class of lobes, times V by channel."""
    return (
        f[0] * v[0], f[1] * v[1], f[2] * v[2], f[3] * v[0], f[4] * v[1], f[5] * v[2], f[6] * v[0], f[7] * v[1],
        f[8] * v[2],
    )  # fmt: skip


@inlined
def add9(f, g):
    """The sum of nine floats each."""
    return (
        f[0] + g[0], f[1] + g[1], f[2] + g[2], f[3] + g[3], f[4] + g[4], f[5] + g[5], f[6] + g[6], f[7] + g[7],
        f[8] + g[8],
    )  # fmt: skip


@inlined
def brightness(reuse, rgb):
    """p̂ of a contribution: its channels by REUSE.weights; light that is taken away counts as much as light given."""
    return reuse.weights[0] * abs(rgb[0]) + reuse.weights[1] * abs(rgb[1]) + reuse.weights[2] * abs(rgb[2])


@inlined
def target_of_light(reuse, f):
    """p̂ of nine floats by class of lobes."""
    return brightness(reuse, lobe_sum(f))


@inlined
def load9(address, index):
    """The index-th nine float64 at an address."""
    i = 9 * index
    return (
        load_f64(address, i), load_f64(address, i + 1), load_f64(address, i + 2), load_f64(address, i + 3),
        load_f64(address, i + 4), load_f64(address, i + 5), load_f64(address, i + 6), load_f64(address, i + 7),
        load_f64(address, i + 8),
    )  # fmt: skip


@inlined
def store9(address, index, f):
    i = 9 * index
    store_f64(address, i, f[0])
    store_f64(address, i + 1, f[1])
    store_f64(address, i + 2, f[2])
    store_f64(address, i + 3, f[3])
    store_f64(address, i + 4, f[4])
    store_f64(address, i + 5, f[5])
    store_f64(address, i + 6, f[6])
    store_f64(address, i + 7, f[7])
    store_f64(address, i + 8, f[8])


@inlined
def load_light(frame, pixel):
    """frame.light of a pixel."""
    light = frame.light + 36 * pixel
    return (
        load_f32(light, 0), load_f32(light, 1), load_f32(light, 2), load_f32(light, 3), load_f32(light, 4),
        load_f32(light, 5), load_f32(light, 6), load_f32(light, 7), load_f32(light, 8),
    )  # fmt: skip


@inlined
def control_variate_at(frame, pixel, share):
    """A share of the variate that a pixel's candidates have left, to be added to what lights it: nine floats."""
    variate = load3_f32(frame.control_variates, pixel)
    if is_black(variate):
        return DARK
    return masked(control_variate_class(point_at(frame, pixel)), scale(variate, share))


@inlined
def store_light(frame, reuse, pixel, f):
    """Set frame.light of a pixel, in the channels that the reservoirs are for."""
    light = frame.light + 36 * pixel
    for k in range(9):
        if reuse.channel < 0 or k % 3 == reuse.channel:
            store_f32(light, k, f[k])
