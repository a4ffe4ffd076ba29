"""Spatial reuse: a pixel resamples its own sample with those of a few neighbours on surfaces like its own."""

from ...kernels.core import rng
from ...kernels.core.jit import device, kernel
from ...kernels.core.memory import load_i64, store_i64
from ...kernels.core.vec import vec
from ..techniques.direct.shift import (
    RESERVOIR_BYTES,
    WORK_PIXEL,
    WORK_RESERVOIR,
    WORK_SOURCE,
    WORK_TABLE,
    leave_light,
    put_canonical,
    put_shifted,
    reservoirs_of,
    settle,
    target_at,
)
from ..techniques.direct.target import point_at
from .mis import CONTRIBUTION
from .neighbours import disk_neighbour, pixel_radius, similar
from .resample import MAX_CANDIDATES, choose, contribution_of, needs_from, put_from, weigh
from .reservoir import clear, reservoir_at

STREAM = 2  # of random numbers; with the round it makes the key
DIM_CHOICE = 1


@kernel
def spatial_tile(scene, camera, integrator, frame, reuse, scratch, x0, y0, x1, y1, turn, last):
    """One round of spatial reuse from frame.reservoirs to frame.reused for the pixels of a tile.

    turn: which round it is; last: whether it is the last reuse of the frame, after which frame.light is what lights.
    """
    for y in range(y0, y1):
        for x in range(x0, x1):
            pixel = y * frame.width + x
            key = rng.key(reuse.seed, x, y, STREAM + 16 * turn)
            _reuse_pixel(scene, camera, integrator, frame, reuse, scratch, pixel, x, y, key, last)


@device
def _reuse_pixel(scene, camera, integrator, frame, reuse, scratch, pixel, x, y, key, last):
    start = reservoirs_of(frame, reuse, frame.reservoirs)
    to = reservoirs_of(frame, reuse, frame.reused) + RESERVOIR_BYTES * pixel
    sp = point_at(frame, pixel)
    if sp.instance < 0:
        clear(reservoir_at(to, 0), 0.0)
        return
    table = scratch + WORK_TABLE
    put_canonical(frame, scratch, pixel, start + RESERVOIR_BYTES * pixel)
    n = _gather(scene, camera, integrator, frame, reuse, scratch, start, pixel, x, y, key)
    for i in range(n):
        if contribution_of(table, i) > 0.0:
            for j in range(1, n):
                if needs_from(reuse.mis, i, j):
                    _fill_from(scene, integrator, frame, reuse, scratch, i, j)
    total = weigh(table, n, reuse.mis)
    chosen = choose(table, n, total, rng.sample1(key, 0, DIM_CHOICE))
    if reuse.mis == CONTRIBUTION and chosen >= 0:
        for j in range(1, n):
            _fill_from(scene, integrator, frame, reuse, scratch, chosen, j)
    settle(reuse, scratch, n, reuse.mis, total, chosen, to)
    leave_light(scene, integrator, frame, reuse, scratch, sp, pixel, n, reuse.mis, chosen, to, last, n)


@device
def _gather(scene, camera, integrator, frame, reuse, scratch, start, pixel, x, y, key):
    """Put the samples of accepted neighbours into the table; the number of candidates."""
    sp = point_at(frame, pixel)
    radius = reuse.radius
    if reuse.world_radius > 0.0:
        radius = max(2.0, min(radius, pixel_radius(camera, sp.t, reuse.world_radius)))
    n = 1
    for index in range(min(reuse.neighbours, MAX_CANDIDATES - 1)):
        nx, ny = disk_neighbour(key, index, x, y, radius)
        if nx < 0 or ny < 0 or nx >= frame.width or ny >= frame.height:
            continue
        other = ny * frame.width + nx
        op = point_at(frame, other)
        if other == pixel or op.instance < 0:
            continue
        if not similar(
            vec(sp.p), vec(sp.n), sp.material, sp.t, vec(op.p), vec(op.n), op.material, op.t, reuse.min_cosine,
            reuse.max_depth,
        ):  # fmt: skip
            continue
        at = start + RESERVOIR_BYTES * other
        r = reservoir_at(at, 0)
        far = (nx - x) ** 2 + (ny - y) ** 2 >= reuse.near * reuse.near
        put_shifted(scene, integrator, frame, reuse, scratch, sp, pixel, n, at, int(r.source), float(r.confidence), far)
        store_i64(scratch + WORK_PIXEL, n, other)
        n += 1
    return n


@device
def _fill_from(scene, integrator, frame, reuse, scratch, i, j):
    """p̂_{←j} of candidate i: what pixel j would have of the sample; of its own it knows it."""
    r = reservoir_at(load_i64(scratch + WORK_RESERVOIR, i), 0)
    value = float(r.target)
    if i != j:
        other = load_i64(scratch + WORK_PIXEL, j)
        source = load_i64(scratch + WORK_SOURCE, i)
        value = target_at(scene, integrator, frame, reuse, scratch, point_at(frame, other), other, r, source)
    put_from(scratch + WORK_TABLE, i, j, value)
