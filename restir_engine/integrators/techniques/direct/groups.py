"""What groups of samples have kept: their light, and what of them becomes the pixel's reservoir.

Each group has a shadow ray for what it has kept, see `candidates`.
"""

import numpy as np

from ....kernels.core.jit import device, inlined
from ....kernels.core.memory import record_at
from ....kernels.core.records import SCRATCH_LIGHT_SAMPLE, light_sample_at, path_at, shared_area
from ....kernels.core.vec import max3, put, vec
from ....kernels.film.contribute import point_group
from ....kernels.lights import light_point
from ....kernels.lights.mean_visibility import FIRST, learn
from ....kernels.lobes.classes import NO_LOBES, lobe_add, lobe_scale, lobes_of, put_lobes
from ...resampling.inputs import clear_groups, note_group, reservoirs_of, store_light
from ...resampling.options import TARGET, reuse_at
from ...resampling.reservoir import accept, clear, contribution_weight, reservoir_at
from .sample import DIRECT_LIGHT, direct_reservoir_at, keep
from .streams import CLEAR, POINT_FIELDS, SAMPLED, STREAM, copy_point, same_point, start, stream_of
from .target import control_variate_at, integrand, target_of_light, transmittance_to_light

# What becomes of the reservoirs: nothing, or the next frame takes them up.
LAST, LAST_OF_FRAME = 1, 2

GROUPS = np.dtype(  # of what groups have kept
    [
        ("total", np.float64),
        ("choice", np.float64),
        *POINT_FIELDS,
        ("f", np.float64, (9,)),  # as p̂ has it
        ("target", np.float64),
        ("visibility", np.float64, (3,)),
        ("light", np.float64, (9,)),  # Σ f V W of all groups
    ]
)
WORK_GROUPS = shared_area(3 * STREAM.itemsize + 3 * GROUPS.itemsize) + 3 * STREAM.itemsize
_groups_at = record_at(GROUPS)


@inlined
def groups_of(scratch, layer):
    """The GROUPS of a layer."""
    return _groups_at(scratch + WORK_GROUPS, layer)


@inlined
def start_groups(frame, reuse, layers, scratch, pixel, u):
    for layer in range(layers):
        clear_groups(frame, reuse_at(reuse, layer), pixel)
        groups = groups_of(scratch, layer)
        start(groups, u)
        groups.target = 0.0
        put_lobes(groups.light, NO_LOBES)


@device
def close_group(scene, integrator, reuse, layers, frame, scratch, pixel, sp, last, at_hand):
    """Light the vertex by the samples that a group has kept, and stream them.

    at_hand: it is one light sample, the LIGHT_SAMPLE in scratch. Where nothing takes the samples up (last: LAST), V is
    that of whichever ray has found the light, as with PATH; reuse needs V to be one function, that of shadow rays.
    """
    f = NO_LOBES
    v = (0.0, 0.0, 0.0)
    known = -1  # the layer whose sample f and V are of
    for layer in range(layers):
        stream = stream_of(scratch, layer)
        if stream.total <= 0.0:
            continue
        if known < 0 or not same_point(stream, stream_of(scratch, known)):
            f = NO_LOBES
            source, primitive = stream.source, stream.primitive
            if at_hand or light_point(scene, sp, scratch, source, primitive, float(stream.u), float(stream.v)):
                f = integrand(light_sample_at(scratch + SCRATCH_LIGHT_SAMPLE, 0), lobes_of(stream.bsdf))
                if last == LAST and stream.origin == CLEAR:
                    v = (1.0, 1.0, 1.0)
                else:
                    v = transmittance_to_light(scene, integrator, frame, scratch, pixel)
                if stream.origin == SAMPLED:
                    learn(path_at(frame.paths, pixel).mean_visibility, FIRST, v)
            known = layer
        group = point_group(frame.light_groups, stream.source, stream.primitive)
        _take(frame, reuse_at(reuse, layer), pixel, groups_of(scratch, layer), stream, f, v, group)


@inlined
def _take(frame, options, pixel, groups, stream, f, v, light_group):
    """Add a group's sample to the light, and keep it by chance; one in shadow may be thrown away."""
    target = target_of_light(options, f)
    w = contribution_weight(float(stream.total), target)
    if w <= 0.0:
        return
    seen = lobe_scale(f, v)
    light = lobe_scale(seen, (w, w, w))
    note_group(frame, options, pixel, light_group, light)
    put_lobes(groups.light, lobe_add(lobes_of(groups.light), light))
    dark = target_of_light(options, seen) <= 0.0
    if dark and (options.visibility == TARGET or options.discard != 0):
        return
    if options.visibility == TARGET:
        f = seen
        target = target_of_light(options, f)
    elif max3(v) <= 0.0:
        # No ray by the BSDF can have found it: light samples alone stand for it (contribution MIS, eq. 7.1).
        w *= 1.0 + stream.bsdf_ratio
    groups.total += target * w
    chosen, u = accept(target * w, float(groups.total), float(groups.choice))
    groups.choice = u
    if chosen:
        copy_point(groups, stream)
        groups.target = target
        put_lobes(groups.f, f)
        put(groups.visibility, v)


@inlined
def settle(reuse, layers, frame, scratch, pixel, seed, last):
    """Fill the pixel's reservoirs and frame.light: p̂, V and W of what each layer has kept, or the light of all."""
    for layer in range(layers):
        options = reuse_at(reuse, layer)
        groups = groups_of(scratch, layer)
        reservoirs = reservoirs_of(frame, options, frame.reservoirs)
        clear(reservoir_at(reservoirs, pixel), 1.0)
        r = direct_reservoir_at(reservoirs, pixel)
        r.seed = seed
        light = NO_LOBES
        if groups.target > 0.0:
            r.technique = DIRECT_LIGHT
            copy_point(r, groups)
            r.light_group = point_group(frame.light_groups, groups.source, groups.primitive)
            r.target = groups.target
            r.contribution_weight = contribution_weight(float(groups.total), float(groups.target))
            keep(r, vec(groups.visibility))
            light = lobes_of(groups.f)
        if last != 0:
            light = lobe_add(lobes_of(groups.light), control_variate_at(frame, pixel))
        store_light(frame, options, pixel, light)
