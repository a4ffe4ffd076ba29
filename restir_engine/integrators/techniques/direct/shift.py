"""What temporal and spatial reuse of direct light share: working memory, candidates, and what comes of them."""

from ....kernels.core.jit import device, inlined
from ....kernels.core.memory import load_i64, store_i64
from ....kernels.core.records import shared_area
from ....kernels.core.vec import load3_f64, scale, store3_f64
from ....kernels.lobes.classes import NO_LOBES, load_lobes, lobe_add, lobe_scale, store_lobes
from ...resampling.mis import CONTRIBUTION
from ...resampling.options import SHADED, TARGET
from ...resampling.resample import (
    MAX_CANDIDATES,
    TABLE_BYTES,
    put_candidate,
    selected_weight,
    target_of,
    total_confidence,
    weight_of,
)
from ...resampling.reservoir import RESERVOIR, UNKNOWN, clear, copy_sample, reservoir_at
from .target import (
    control_variate_at,
    load_light,
    store_light,
    target_of_light,
    unshadowed,
    visibility,
)
from .visibility import carried, forget, keep, kept, merged

# Working memory of a pixel: the table of candidates;
# of each candidate f (9 floats), V (3), the address of its reservoir, the source of its light in this scene, its pixel.
WORK_TABLE = shared_area(TABLE_BYTES + (72 + 24 + 8 + 8 + 8) * MAX_CANDIDATES)
WORK_LIGHT = WORK_TABLE + TABLE_BYTES
WORK_VISIBILITY = WORK_LIGHT + 72 * MAX_CANDIDATES
WORK_RESERVOIR = WORK_VISIBILITY + 24 * MAX_CANDIDATES
WORK_SOURCE = WORK_RESERVOIR + 8 * MAX_CANDIDATES
WORK_PIXEL = WORK_SOURCE + 8 * MAX_CANDIDATES

RESERVOIR_BYTES = RESERVOIR.itemsize


@inlined
def reservoirs_of(frame, reuse, base):
    """The address of the first pixel's reservoir in `base` (frame.reservoirs or frame.reused), by channel."""
    layer = reuse.channel if reuse.channel > 0 else 0
    return base + layer * frame.width * frame.height * RESERVOIR_BYTES


@device
def target_at(scene, integrator, frame, reuse, scratch, sp, pixel, reservoir, source):
    """p̂ at a pixel's vertex of the reservoir's sample, whose light is `source` in this scene; traces V if p̂ has it."""
    f = unshadowed(scene, sp, scratch, source, reservoir.primitive, float(reservoir.u), float(reservoir.v))
    p = target_of_light(reuse, f)
    if p > 0.0 and reuse.visibility == TARGET:
        f = lobe_scale(f, visibility(scene, integrator, frame, scratch, pixel))
        p = target_of_light(reuse, f)
    return p


@device
def put_canonical(frame, scratch, pixel, address):
    """Candidate 0: the pixel's own sample, whose f frame.light holds."""
    r = reservoir_at(address, 0)
    store_i64(scratch + WORK_PIXEL, 0, pixel)
    _put(scratch, 0, address, r.source, load_light(frame, pixel), kept(r))
    put_candidate(scratch + WORK_TABLE, 0, float(r.confidence), float(r.contribution_weight), float(r.target))


@device
def put_shifted(scene, integrator, frame, reuse, scratch, sp, pixel, i, address, source, confidence, trace):
    """Candidate i: the sample of another reservoir, whose light is `source` here, shifted to this pixel.

    The shift keeps the point of the light: Jacobian 1. trace: whether V that is carried along is traced again here.
    """
    r = reservoir_at(address, 0)
    w = float(r.contribution_weight)
    f = NO_LOBES
    v = kept(r) if carried(reuse) else (UNKNOWN, 0.0, 0.0)
    p = 0.0
    if w > 0.0 and source >= 0:
        f = unshadowed(scene, sp, scratch, source, r.primitive, float(r.u), float(r.v))
        p = target_of_light(reuse, f)
        if p > 0.0 and (reuse.visibility == TARGET or (trace and carried(reuse))):
            v = visibility(scene, integrator, frame, scratch, pixel)
            if reuse.visibility == TARGET:
                f = lobe_scale(f, v)
                p = target_of_light(reuse, f)
    _put(scratch, i, address, source, f, v)
    put_candidate(scratch + WORK_TABLE, i, confidence, w, p)


@inlined
def _put(scratch, i, address, source, f, v):
    store_lobes(scratch + WORK_LIGHT, i, f)
    store3_f64(scratch + WORK_VISIBILITY, 3 * i, v)
    store_i64(scratch + WORK_RESERVOIR, i, address)
    store_i64(scratch + WORK_SOURCE, i, source)


@device
def settle(reuse, scratch, n, kind, total, chosen, to):
    """Write the reservoir at the address `to`: the chosen candidate, or a null sample, with all confidence."""
    table = scratch + WORK_TABLE
    out = reservoir_at(to, 0)
    confidence = total_confidence(table, n)
    if chosen < 0:
        clear(out, confidence)
        return
    copy_sample(to, load_i64(scratch + WORK_RESERVOIR, chosen))
    out.source = load_i64(scratch + WORK_SOURCE, chosen)
    out.contribution_weight = selected_weight(table, n, kind, total, chosen)
    out.confidence = confidence
    out.target = target_of(table, chosen)
    if reuse.visibility == SHADED and chosen > 0:
        forget(out)
    else:
        keep(out, merged(reuse, table, scratch + WORK_VISIBILITY, n, total, chosen))


@device
def leave_light(scene, integrator, frame, reuse, scratch, sp, pixel, n, kind, chosen, to, last, fresh):
    """Leave in frame.light f of the sample chosen, or after the last reuse what the pixel is lit by.

    That is Σ w_i f_i V_i / p̂_i, or f V W of the one chosen. The sum has the same mean in every channel and no noise of
    colour; CONTRIBUTION has no weights for it. fresh: how many of the first candidates are of this frame's pixels.
    """
    light = NO_LOBES
    if chosen >= 0 and last == 0:
        light = load_lobes(scratch + WORK_LIGHT, chosen)
    elif chosen >= 0 and (reuse.vector == 0 or kind == CONTRIBUTION):
        out = reservoir_at(to, 0)
        v = _seen(scene, integrator, frame, scratch, sp, pixel, chosen, kept(out))
        light = _lit(reuse, load_lobes(scratch + WORK_LIGHT, chosen), v, float(out.contribution_weight))
    elif chosen >= 0:
        table = scratch + WORK_TABLE
        for i in range(n):
            weight = weight_of(table, i)
            if weight > 0.0:
                v = load3_f64(scratch + WORK_VISIBILITY, 3 * i)
                v = _seen(scene, integrator, frame, scratch, sp, pixel, i, v)
                part = _lit(reuse, load_lobes(scratch + WORK_LIGHT, i), v, weight / target_of(table, i))
                light = lobe_add(light, part)
    if last != 0:
        light = lobe_add(light, _variate(frame, scratch, n, fresh))
    store_light(frame, reuse, pixel, light)


@device
def _variate(frame, scratch, n, fresh):
    """The variates of the first candidates, each by the share that one frame has in what was resampled."""
    share = 1.0 / total_confidence(scratch + WORK_TABLE, n)
    f = NO_LOBES
    for i in range(fresh):
        f = lobe_add(f, control_variate_at(frame, load_i64(scratch + WORK_PIXEL, i), share))
    return f


@device
def _seen(scene, integrator, frame, scratch, sp, pixel, i, v):
    """V of candidate i at the pixel, where it is not known yet."""
    if v[0] != UNKNOWN:
        return v
    r = reservoir_at(load_i64(scratch + WORK_RESERVOIR, i), 0)
    unshadowed(scene, sp, scratch, load_i64(scratch + WORK_SOURCE, i), r.primitive, float(r.u), float(r.v))
    return visibility(scene, integrator, frame, scratch, pixel)


@inlined
def _lit(reuse, f, v, weight):
    """f V times a weight; p̂ that contains V has it in f."""
    if reuse.visibility == TARGET:
        v = (1.0, 1.0, 1.0)
    return lobe_scale(f, scale(v, weight))
