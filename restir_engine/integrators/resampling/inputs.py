"""The inputs of a resampling step in working memory, and what comes of them: what temporal and spatial reuse share.

Candidate i has a row in the table of `resample`, a domain, and its sample shifted to the pixel. Candidate 0 is the
pixel's own; its domain is the one resampled for.
"""

from ...kernels.core.jit import device, inlined
from ...kernels.core.memory import call_entry, load_f32, prefetch, store_f32
from ...kernels.core.records import PATH, SHADING_POINT, light_groups_at, resampling_area, scene_at, shading_point_at
from ...kernels.core.vec import load3_f32, store3_f32
from ...kernels.lobes.classes import NO_LOBES, Lobes, lobe_add, lobe_scale, lobe_sum
from .frame import frame_at
from .mis import CONTRIBUTION
from .resample import (
    MAX_CANDIDATES,
    TABLE_BYTES,
    choose,
    contribution_weight_of,
    put_candidate,
    put_from,
    selected_weight,
    target_of,
    total_confidence,
    weigh,
    weight_of,
)
from .reservoir import INDIRECT, RESERVOIR_BYTES, clear, copy_reservoir, reservoir_at
from .technique import (
    DOMAIN_BYTES,
    SHIFTED_BYTES,
    domain_at,
    load_f,
    shift,
    shifted_at,
    store_f,
    target_from,
    technique_at,
)

# One SHIFTED more than there are candidates is for what is needed at once.
_MASK_BYTES = 16
_CANDIDATE_BYTES = DOMAIN_BYTES + SHIFTED_BYTES + _MASK_BYTES
COUNTS = 3
WORK_TABLE = resampling_area(TABLE_BYTES + _CANDIDATE_BYTES * MAX_CANDIDATES + SHIFTED_BYTES + 8 + 8 * COUNTS)
WORK_DOMAINS = WORK_TABLE + TABLE_BYTES
WORK_SHIFTED = WORK_DOMAINS + DOMAIN_BYTES * MAX_CANDIDATES
WORK_BACK = WORK_SHIFTED + SHIFTED_BYTES * MAX_CANDIDATES
WORK_HELD = WORK_BACK + SHIFTED_BYTES  # the address of the point whose copy the tile's SHADING_POINT is; 0: of none
WORK_MASKS = WORK_HELD + 8  # of PAIRS: (x, y) of each partner's mask
WORK_COUNTS = WORK_MASKS + _MASK_BYTES * MAX_CANDIDATES  # int64 [COUNTS] of a technique: the work that it has done


POINT_BYTES, PATH_BYTES = SHADING_POINT.itemsize, PATH.itemsize
LIGHT_BYTES = 36  # of frame.light, a pixel


@inlined
def point_at(frame, pixel):
    """The SHADING_POINT of a pixel; its instance is -1 where there is none."""
    return shading_point_at(frame.points, pixel)


@inlined
def scene_of(domain):
    """The SCENE of a DOMAIN, here set to the time of its pixel's path: domains of a frame share the tile's own."""
    scene = scene_at(domain.scene, 0)
    if scene.shutter != 0:
        scene.time = point_at(frame_at(domain.frame, 0), domain.pixel).time
    return scene


@inlined
def prefetch_domain(frame, pixel):
    """Ask for what p̂ will read of a pixel, its point and its path: temporal reuse alternates between two frames."""
    for offset in range(0, POINT_BYTES, 64):
        prefetch(frame.points + POINT_BYTES * pixel + offset)
    for offset in range(0, PATH_BYTES, 64):
        prefetch(frame.paths + PATH_BYTES * pixel + offset)


@inlined
def reservoirs_of(frame, reuse, base):
    """The address of the first pixel's reservoir in `base` (frame.reservoirs or frame.reused), by channel."""
    layer = reuse.channel if reuse.channel > 0 else 0
    return base + layer * frame.width * frame.height * RESERVOIR_BYTES


@inlined
def load_light(frame, pixel):
    """frame.light of a pixel, by class of lobes."""
    light = frame.light + LIGHT_BYTES * pixel
    return Lobes(load3_f32(light, 0), load3_f32(light, 1), load3_f32(light, 2))


@inlined
def load_indirect(frame, pixel):
    """frame.indirect of a pixel, by class of lobes."""
    light = frame.indirect + LIGHT_BYTES * pixel
    return Lobes(load3_f32(light, 0), load3_f32(light, 1), load3_f32(light, 2))


@inlined
def store_indirect(frame, pixel, f):
    """Set frame.indirect of a pixel."""
    light = frame.indirect + LIGHT_BYTES * pixel
    store3_f32(light, 0, f.diffuse)
    store3_f32(light, 1, f.glossy)
    store3_f32(light, 2, f.transmission)


@inlined
def store_light(frame, reuse, pixel, f):
    """Set frame.light of a pixel, in the channels that the reservoirs are for."""
    light = frame.light + LIGHT_BYTES * pixel
    for k in range(3):
        if reuse.channel < 0 or k == reuse.channel:
            store_f32(light, k, f.diffuse[k])
            store_f32(light, 3 + k, f.glossy[k])
            store_f32(light, 6 + k, f.transmission[k])


@inlined
def light_by_group(frame, pixel):
    """The address of float32 [groups, 3] of a pixel."""
    return frame.light_by_group + 12 * light_groups_at(frame.light_groups, 0).count * pixel


@device
def clear_groups(frame, reuse, pixel):
    """Begin to note by light group what lights a pixel, in the channels that the reservoirs are for."""
    if frame.light_groups != 0:
        light = light_by_group(frame, pixel)
        for group in range(light_groups_at(frame.light_groups, 0).count):
            for k in range(3):
                if reuse.channel < 0 or k == reuse.channel:
                    store_f32(light, 3 * group + k, 0.0)


@device
def note_group(frame, reuse, pixel, group, f):
    """Note f as light that belongs to a light group; NO_GROUP: to none."""
    if frame.light_groups != 0 and group >= 0:
        light, rgb = light_by_group(frame, pixel), lobe_sum(f)
        for k in range(3):
            if reuse.channel < 0 or k == reuse.channel:
                store_f32(light, 3 * group + k, load_f32(light, 3 * group + k) + rgb[k])


@inlined
def _add_scaled(f, shifted, weight):
    """f + weight · f of a SHIFTED sample."""
    return lobe_add(f, lobe_scale(load_f(shifted), (weight, weight, weight)))


@inlined
def domain_of(scratch, i):
    """The address of the DOMAIN of candidate i."""
    return scratch + WORK_DOMAINS + DOMAIN_BYTES * i


@inlined
def shifted_of(scratch, i):
    """The address of the SHIFTED sample of candidate i."""
    return scratch + WORK_SHIFTED + SHIFTED_BYTES * i


@device
def put_canonical(frame, scratch, pixel, reservoir):
    """Candidate 0: the pixel's own sample, whose f frame.light holds."""
    copy_reservoir(shifted_of(scratch, 0), reservoir)
    r = reservoir_at(reservoir, 0)
    store_f(shifted_of(scratch, 0), load_light(frame, pixel))
    put_candidate(scratch + WORK_TABLE, 0, float(r.confidence), float(r.contribution_weight), float(r.target))


@device
def put_shifted(scratch, i, reservoir, confidence):
    """Candidate i: the sample of a reservoir of its domain, of which SHIFTED i is filled in."""
    r = reservoir_at(reservoir, 0)
    s = shifted_at(shifted_of(scratch, i), 0)
    table = scratch + WORK_TABLE
    jacobian = float(s.jacobian)
    put_candidate(table, i, confidence, r.contribution_weight * jacobian, float(s.target))
    if jacobian > 0.0:
        put_from(table, i, i, r.target / jacobian)


@inlined
def counts(scratch, i):
    """Whether candidate i brings a sample that is worth something here: what it is worth elsewhere matters then."""
    return contribution_weight_of(scratch + WORK_TABLE, i) > 0.0


@device
def put_from_domain(reuse, scratch, i, j):
    """p̂_{←j}(y_i): the sample of candidate i, shifted back to the domain of candidate j ≠ 0, i."""
    back = scratch + WORK_BACK
    shift(reuse, domain_of(scratch, 0), domain_of(scratch, j), shifted_of(scratch, i), back)
    put_from_shifted(scratch, i, j, back)


@inlined
def put_from_shifted(scratch, i, j, back):
    """The same where the sample is shifted already: SHIFTED at the address `back`."""
    put_from(scratch + WORK_TABLE, i, j, target_from(back))


@device
def resample(frame, reuse, scratch, n, kind, u, to, fresh, last):
    """Resample n candidates: the reservoir at the address `to` and frame.light; u: a random number.

    The targets that MIS needs are in the table, but for those of CONTRIBUTION. fresh: how many of the first candidates
    are of this frame; last: whether frame.light is what lights, see `_light`.
    """
    table = scratch + WORK_TABLE
    total = weigh(table, n, kind)
    chosen = choose(table, n, total, u)
    w = 0.0
    if chosen >= 0:
        if kind == CONTRIBUTION:
            for j in range(1, n):
                if j != chosen:
                    put_from_domain(reuse, scratch, chosen, j)
        w = selected_weight(table, n, kind, total, chosen)
    _light(frame, reuse, scratch, n, kind, chosen, w, fresh, last)
    out = reservoir_at(to, 0)
    if chosen >= 0:
        merge = technique_at(reuse.technique, 0).merge
        if merge != 0:
            call_entry(merge, domain_of(scratch, 0), shifted_of(scratch, 0), table, n, chosen)
        copy_reservoir(to, shifted_of(scratch, chosen))
        out.contribution_weight = w
        out.confidence = total_confidence(table, n)
        out.target = target_of(table, chosen)
    else:
        clear(out, total_confidence(table, n))


@device
def _light(frame, reuse, scratch, n, kind, chosen, w, fresh, last):
    """Leave in frame.light f of the sample chosen, or after the last reuse what the pixel is lit by.

    That is Σ w_i f_i V_i / p̂_i over all candidates: the same mean as that of f V W of the one chosen, in every channel,
    and no noise of color (ReSTIR PT Enhanced). CONTRIBUTION has no weights for it. Indirect light is in frame.indirect.
    """
    table = scratch + WORK_TABLE
    row = technique_at(reuse.technique, 0)
    pixel = domain_at(domain_of(scratch, 0), 0).pixel
    if last != 0:
        clear_groups(frame, reuse, pixel)
    light = NO_LOBES
    indirect = NO_LOBES
    if chosen >= 0 and last == 0:
        light = load_f(shifted_of(scratch, chosen))
    elif chosen >= 0:
        summed = kind != CONTRIBUTION and reuse.vector_weights != 0
        for i in range(n):
            weight = weight_of(table, i)
            if weight > 0.0 and (summed or i == chosen):
                if row.shade != 0:
                    call_entry(row.shade, domain_of(scratch, 0), shifted_of(scratch, i), 0, 0, 0)
                weight = weight / target_of(table, i) if summed else w
                group = int(reservoir_at(shifted_of(scratch, i), 0).light_group)
                note_group(frame, reuse, pixel, group, _add_scaled(NO_LOBES, shifted_of(scratch, i), weight))
                if frame.indirect != 0 and reservoir_at(shifted_of(scratch, i), 0).flags & INDIRECT:
                    indirect = _add_scaled(indirect, shifted_of(scratch, i), weight)
                else:
                    light = _add_scaled(light, shifted_of(scratch, i), weight)
    if last != 0 and row.variate != 0:
        # By the share that one frame has in what was resampled.
        share = 1.0 / total_confidence(table, n)
        for i in range(fresh):
            call_entry(row.variate, domain_of(scratch, i), scratch + WORK_BACK, 0, 0, 0)
            light = _add_scaled(light, scratch + WORK_BACK, share)
    store_light(frame, reuse, pixel, light)
    if frame.indirect != 0 and last != 0:
        store_indirect(frame, pixel, indirect)
