"""What temporal and spatial reuse of direct light share: working memory, candidates, and what comes of them."""

from ...kernels.jit import device, inlined
from ...kernels.memory import load_f32, load_i64, store_f32, store_i64
from ...kernels.records import SCRATCH_SCATTER
from ...kernels.vec import load3_f64, scale, store3_f64
from .mis import CONTRIBUTION
from .options import SHADED, TARGET
from .resample import (
    MAX_CANDIDATES,
    TABLE_BYTES,
    put_candidate,
    selected_weight,
    target_of,
    total_confidence,
    weight_of,
)
from .reservoir import RESERVOIR, UNKNOWN, clear, copy_sample, reservoir_at
from .target import load9, masked, store9, target_of_light, unshadowed, visibility
from .visibility import carried, forget, keep, kept, merged

# Working memory of a pixel, in that part of the tile's that scattering uses at other times: the table of candidates;
# of each candidate f (9 floats), V (3), the address of its reservoir, the source of its light in this scene, its pixel.
WORK_TABLE = SCRATCH_SCATTER
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
        f = masked(f, visibility(scene, integrator, frame, scratch, pixel))
        p = target_of_light(reuse, f)
    return p


@device
def put_canonical(scene, reuse, scratch, sp, address, last):
    """Candidate 0: the pixel's own sample. Its f is only worked out for the last reuse, which shades."""
    r = reservoir_at(address, 0)
    v = kept(r)
    f = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    if last != 0 and r.contribution_weight > 0.0:
        f = unshadowed(scene, sp, scratch, r.source, r.primitive, float(r.u), float(r.v))
        if reuse.visibility == TARGET:
            f = masked(f, v)
    _put(scratch, 0, address, r.source, f, v)
    put_candidate(scratch + WORK_TABLE, 0, float(r.confidence), float(r.contribution_weight), float(r.target))


@device
def put_shifted(scene, integrator, frame, reuse, scratch, sp, pixel, i, address, source, confidence, trace):
    """Candidate i: the sample of another reservoir, whose light is `source` here, shifted to this pixel.

    The shift keeps the point of the light: Jacobian 1. trace: whether V that is carried along is traced again here.
    """
    r = reservoir_at(address, 0)
    w = float(r.contribution_weight)
    f = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    v = kept(r) if carried(reuse) else (UNKNOWN, 0.0, 0.0)
    p = 0.0
    if w > 0.0 and source >= 0:
        f = unshadowed(scene, sp, scratch, source, r.primitive, float(r.u), float(r.v))
        p = target_of_light(reuse, f)
        if p > 0.0 and (reuse.visibility == TARGET or (trace and carried(reuse))):
            v = visibility(scene, integrator, frame, scratch, pixel)
            if reuse.visibility == TARGET:
                f = masked(f, v)
                p = target_of_light(reuse, f)
    _put(scratch, i, address, source, f, v)
    put_candidate(scratch + WORK_TABLE, i, confidence, w, p)


@inlined
def _put(scratch, i, address, source, f, v):
    store9(scratch + WORK_LIGHT, i, f)
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
def shade_candidates(scene, integrator, frame, reuse, scratch, sp, pixel, n, kind, chosen, to):
    """Sum up what the pixel is lit by, to frame.light: Σ w_i f_i V_i / p̂_i, or f V W of the one chosen.

    The sum has the same mean in every channel and no noise of colour; CONTRIBUTION has no weights for it.
    """
    light = frame.light + 36 * pixel
    out = reservoir_at(to, 0)
    for k in range(9):
        if reuse.channel < 0 or k % 3 == reuse.channel:
            store_f32(light, k, 0.0)
    if chosen < 0:
        return
    if reuse.vector == 0 or kind == CONTRIBUTION:
        v = kept(out)
        if v[0] == UNKNOWN:
            v = _trace(scene, integrator, frame, scratch, sp, pixel, chosen)
        _add_light(reuse, light, load9(scratch + WORK_LIGHT, chosen), v, float(out.contribution_weight))
        return
    table = scratch + WORK_TABLE
    for i in range(n):
        weight = weight_of(table, i)
        if weight > 0.0:
            v = load3_f64(scratch + WORK_VISIBILITY, 3 * i)
            if v[0] == UNKNOWN:
                v = _trace(scene, integrator, frame, scratch, sp, pixel, i)
            _add_light(reuse, light, load9(scratch + WORK_LIGHT, i), v, weight / target_of(table, i))


@device
def _trace(scene, integrator, frame, scratch, sp, pixel, i):
    """V of candidate i at the pixel."""
    r = reservoir_at(load_i64(scratch + WORK_RESERVOIR, i), 0)
    unshadowed(scene, sp, scratch, load_i64(scratch + WORK_SOURCE, i), r.primitive, float(r.u), float(r.v))
    return visibility(scene, integrator, frame, scratch, pixel)


@inlined
def _add_light(reuse, light, f, v, weight):
    """Add f V times a weight to nine float32; p̂ that contains V has it in f."""
    if reuse.visibility == TARGET:
        v = (1.0, 1.0, 1.0)
    f = masked(f, scale(v, weight))
    for k in range(9):
        if reuse.channel < 0 or k % 3 == reuse.channel:
            store_f32(light, k, load_f32(light, k) + f[k])
