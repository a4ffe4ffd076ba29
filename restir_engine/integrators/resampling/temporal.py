"""Temporal reuse: a pixel resamples its own sample with that of the pixel that showed the same surface a frame before.

The history is at most worth `confidence_cap` frames, and nothing where the surface cannot be found again: decided by
points and normals, never by samples. For the MIS weights the frame before is asked with its own scene, lights, vertices
and shadows, without which light that has moved is counted wrongly (HISTORY_TARGET).
"""

from ...kernels.core import rng
from ...kernels.core.jit import device, kernel
from ...kernels.core.vec import vec
from ...kernels.path.state import FAR
from ..techniques.direct.shift import (
    RESERVOIR_BYTES,
    WORK_TABLE,
    leave_light,
    put_canonical,
    put_shifted,
    reservoirs_of,
    settle,
    target_at,
)
from ..techniques.direct.target import point_at
from .mis import BALANCE, CONTRIBUTION
from .motion import pixel_before, place_before, source_before, source_now
from .neighbours import similar
from .options import BEFORE
from .resample import choose, contribution_of, needs_from, put_from, weigh
from .reservoir import clear, reservoir_at

STREAM = 1
DIM_CHOICE = 1
SEARCH = 5  # pixels looked at for the surface: the one it should be at, and its four neighbours


@kernel
def temporal_tile(
    scene, camera, integrator, frame, scene_before, camera_before, integrator_before, before, motion, reuse, scratch,
    x0, y0, x1, y1, last,
):  # fmt: skip
    """Temporal reuse from frame.reservoirs and before.reservoirs to frame.reused for the pixels of a tile.

    scene_before, camera_before, integrator_before, before: of the frame before, whose points, paths and last reservoirs
    are still there; last: whether no spatial reuse follows, so that frame.light is what lights.
    """
    for y in range(y0, y1):
        for x in range(x0, x1):
            there = find_before(scene, camera, frame, scene_before, camera_before, before, motion, reuse, x, y)
            key = rng.key(reuse.seed, x, y, STREAM)
            pixel = y * frame.width + x
            _reuse_pixel(
                scene, integrator, frame, scene_before, integrator_before, before, motion, reuse, scratch, pixel, there,
                key, last,
            )  # fmt: skip


@device
def _reuse_pixel(
    scene, integrator, frame, scene_before, integrator_before, before, motion, reuse, scratch, pixel, there, key, last
):
    to = reservoirs_of(frame, reuse, frame.reused) + RESERVOIR_BYTES * pixel
    sp = point_at(frame, pixel)
    if sp.instance < 0:
        clear(reservoir_at(to, 0), 0.0)
        return
    table = scratch + WORK_TABLE
    own = reservoirs_of(frame, reuse, frame.reservoirs) + RESERVOIR_BYTES * pixel
    put_canonical(frame, scratch, pixel, own)
    n = 1
    kind = reuse.mis
    if kind == CONTRIBUTION:
        kind = BALANCE  # of two candidates it asks no more
    if there >= 0:
        at = reservoirs_of(before, reuse, before.reservoirs) + RESERVOIR_BYTES * there
        r = reservoir_at(at, 0)
        source = -1
        if r.contribution_weight > 0.0:
            source = source_now(motion, int(r.source), int(r.primitive))
        confidence = min(float(r.confidence), reuse.confidence_cap)
        put_shifted(scene, integrator, frame, reuse, scratch, sp, pixel, 1, at, source, confidence, False)
        n = 2
        if needs_from(kind, 1, 1):
            put_from(table, 1, 1, float(r.target))
        if needs_from(kind, 0, 1) and contribution_of(table, 0) > 0.0:
            value = _target_before(
                scene, integrator, scene_before, integrator_before, before, motion, reuse, scratch, own, there
            )
            put_from(table, 0, 1, value)
    total = weigh(table, n, kind)
    chosen = choose(table, n, total, rng.sample1(key, 0, DIM_CHOICE))
    settle(reuse, scratch, n, kind, total, chosen, to)
    leave_light(scene, integrator, frame, reuse, scratch, sp, pixel, n, kind, chosen, to, last, 1)


@device
def find_before(scene, camera, frame, scene_before, camera_before, before, motion, reuse, x, y):
    """The pixel of the frame before that shows the surface that is at pixel (x, y) now; -1: none."""
    sp = point_at(frame, y * frame.width + x)
    if sp.instance < 0:
        return -1
    instance, p, n = place_before(scene, scene_before, motion, sp)
    if instance < 0:
        return -1
    px, py = pixel_before(camera, camera_before, vec(sp.p), p, x, y)
    for k in range(SEARCH):
        qx = px + (1 if k == 1 else 0) - (1 if k == 2 else 0)
        qy = py + (1 if k == 3 else 0) - (1 if k == 4 else 0)
        if qx < 0 or qy < 0 or qx >= before.width or qy >= before.height:
            continue
        pixel = qy * before.width + qx
        op = point_at(before, pixel)
        # Its distance from that camera is not known: the tangent planes alone tell.
        if op.instance == instance and similar(
            p, n, 0, FAR, vec(op.p), vec(op.n), 0, op.t, reuse.min_cosine, reuse.max_depth
        ):
            return pixel
    return -1


@device
def _target_before(scene, integrator, scene_before, integrator_before, before, motion, reuse, scratch, own, there):
    """p̂ of the pixel's own sample at the pixel of the frame before."""
    r = reservoir_at(own, 0)
    op = point_at(before, there)
    if reuse.history_target != BEFORE:
        return target_at(scene, integrator, before, reuse, scratch, op, there, r, int(r.source))
    source = source_before(motion, int(r.source), int(r.primitive))
    if source < 0:
        return 0.0
    return target_at(scene_before, integrator_before, before, reuse, scratch, op, there, r, source)
