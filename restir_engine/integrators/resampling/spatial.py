"""Spatial reuse: a pixel resamples its own sample with those of a few others on surfaces like its own.

DISK takes neighbours by chance from a disk; two shifts a neighbour, there and back. PAIRS takes partners, whose two
shifts are computed once for both (`pairing`): first every pixel of a block shifts its partners' samples to itself,
then every pixel finds in the table also what its own sample is worth to them.
"""

from ...film import TILE
from ...kernels.core import rng
from ...kernels.core.jit import device, inlined, kernel
from ...kernels.core.memory import load_f32
from ...kernels.core.records import INTEGRATOR, SCENE, tile_scene
from ...kernels.core.vec import vec
from .frame import FRAME
from .inputs import (
    WORK_MASKS,
    counts,
    domain_of,
    point_at,
    put_canonical,
    put_from_domain,
    put_from_shifted,
    put_shifted,
    resample,
    reservoirs_of,
    shifted_of,
)
from .mis import BALANCE
from .neighbours import disk_neighbour, similar
from .options import PAIRS, REUSE
from .pairing import block_of, draw_masks, partner
from .resample import MAX_CANDIDATES, needs_from
from .reservoir import RESERVOIR_BYTES, clear, reservoir_at
from .technique import NOW, SHIFTED_BYTES, copy_shifted, domain_at, set_domain, shift
from .vertex import let_go

STREAM = 2  # of random numbers; with the round it makes the key
DIM_CHOICE = 1


@kernel
def spatial_tile(
    scene: SCENE, integrator: INTEGRATOR, frame: FRAME, reuse: REUSE, pairs, scratch, x0, y0, x1, y1, turn, last
):
    """One round of spatial reuse from frame.reservoirs to frame.reused for the pixels of a tile.

    pairs: SHIFTED [reuse.neighbours] for each pixel of a block, working memory of PAIRS; turn: which round it is;
    last: whether it is the last reuse of the frame, after which frame.light is what lights.
    """
    scene = tile_scene(scene, scratch, 0)
    let_go(scratch)
    start = reservoirs_of(frame, reuse, frame.reservoirs)
    to = reservoirs_of(frame, reuse, frame.reused)
    count = min(reuse.neighbours, MAX_CANDIDATES - 1)
    for i in range(count + 1):
        set_domain(domain_at(domain_of(scratch, i), 0), scene, integrator, frame, 0, reuse, scratch, NOW)
    side = TILE
    if reuse.pattern == PAIRS:
        side = block_of(reuse.radius)
        draw_masks(scratch + WORK_MASKS, reuse.seed, turn, count, side, reuse.left, reuse.below)
    for top in range(y0 - (y0 + reuse.below) % side, y1, side):
        for left in range(x0 - (x0 + reuse.left) % side, x1, side):
            block = max(left, x0), max(top, y0), min(left + side, x1), min(top + side, y1)
            _reuse_in_block(frame, reuse, scratch, start, to, block, turn, count, pairs, last)


@inlined
def _reuse_in_block(frame, reuse, scratch, start, to, block, turn, count, pairs, last):
    """The round for the pixels of a block (x0, y0, x1, y1), which PAIRS exchange samples in."""
    x0, y0, x1, y1 = block
    if reuse.pattern == PAIRS:
        for y in range(y0, y1):
            for x in range(x0, x1):
                _shift_partners(frame, reuse, scratch, start, x, y, count, _pairs_of(pairs, count, x, y, x0, y0, x1))
    for y in range(y0, y1):
        for x in range(x0, x1):
            pixel = y * frame.width + x
            if not _has_domain(frame, start, pixel):
                clear(reservoir_at(to, pixel), 0.0)
                continue
            domain_at(domain_of(scratch, 0), 0).pixel = pixel
            put_canonical(frame, scratch, pixel, start + RESERVOIR_BYTES * pixel)
            key = rng.key(reuse.seed, x, y, STREAM + 16 * turn)
            if reuse.pattern == PAIRS:
                n = _put_partners(frame, reuse, scratch, start, x, y, count, pairs, x0, y0, x1, y1)
            else:
                n = _put_neighbours(frame, reuse, scratch, start, x, y, key, count)
            if reuse.mis == BALANCE:
                _put_targets(reuse, scratch, n)
            u = rng.sample1(key, 0, DIM_CHOICE)
            resample(frame, reuse, scratch, n, reuse.mis, u, to + RESERVOIR_BYTES * pixel, n, last)


@inlined
def _pairs_of(pairs, count, x, y, x0, y0, x1):
    """The address of SHIFTED [count] of a pixel of the block."""
    return pairs + SHIFTED_BYTES * count * ((y - y0) * (x1 - x0) + x - x0)


@inlined
def _has_domain(frame, start, pixel):
    """Whether the technique has anything to sample at a pixel."""
    return point_at(frame, pixel).instance >= 0 and reservoir_at(start, pixel).confidence > 0.0


@inlined
def _suits(frame, reuse, start, pixel, x, y):
    """Whether the pixel (x, y) is in the frame and shows a surface like that of `pixel`, another one; symmetric."""
    if x < frame.left or y < frame.bottom or x >= frame.right or y >= frame.top or y * frame.width + x == pixel:
        return False
    sp = point_at(frame, pixel)
    op = point_at(frame, y * frame.width + x)
    return _has_domain(frame, start, y * frame.width + x) and similar(
        vec(sp.p), vec(sp.n), sp.material, sp.t, vec(op.p), vec(op.n), op.material, op.t, reuse.min_cosine,
        reuse.max_depth,
    )  # fmt: skip


@device
def _put_neighbours(frame, reuse, scratch, start, x, y, key, count):
    """Put the samples of accepted neighbours from a disk into the table; the number of candidates."""
    pixel = y * frame.width + x
    n = 1
    radius = load_f32(frame.radii, pixel) if frame.radii != 0 else float(reuse.radius)
    for index in range(count):
        nx, ny = disk_neighbour(key, index, x, y, radius)
        if _suits(frame, reuse, start, pixel, nx, ny):
            other = ny * frame.width + nx
            domain_at(domain_of(scratch, n), 0).pixel = other
            at = start + RESERVOIR_BYTES * other
            shift(reuse, domain_of(scratch, n), domain_of(scratch, 0), at, shifted_of(scratch, n))
            put_shifted(scratch, n, at, float(reservoir_at(at, 0).confidence))
            n += 1
    # PAIRWISE and DEFENSIVE: what the pixel's own sample is worth to its neighbours.
    if needs_from(reuse.mis, 0, 1) and counts(scratch, 0):
        for j in range(1, n):
            put_from_domain(reuse, scratch, 0, j)
    return n


@device
def _shift_partners(frame, reuse, scratch, start, x, y, count, shifted):
    """Shift the samples of a pixel's partners to it: SHIFTED [count] at the address `shifted`."""
    pixel = y * frame.width + x
    if not _has_domain(frame, start, pixel):
        return
    for index in range(count):
        px, py = partner(scratch + WORK_MASKS, index, x, y)
        if _suits(frame, reuse, start, pixel, px, py):
            other = py * frame.width + px
            domain_at(domain_of(scratch, 0), 0).pixel = pixel
            domain_at(domain_of(scratch, 1), 0).pixel = other
            at = start + RESERVOIR_BYTES * other
            shift(reuse, domain_of(scratch, 1), domain_of(scratch, 0), at, shifted + SHIFTED_BYTES * index)


@device
def _put_partners(frame, reuse, scratch, start, x, y, count, pairs, x0, y0, x1, y1):
    """Put partners' samples into the table, and what the pixel's own is worth to them; the number of candidates."""
    pixel = y * frame.width + x
    n = 1
    for index in range(count):
        px, py = partner(scratch + WORK_MASKS, index, x, y)
        if not _suits(frame, reuse, start, pixel, px, py):
            continue
        domain_at(domain_of(scratch, n), 0).pixel = py * frame.width + px
        at = start + RESERVOIR_BYTES * (py * frame.width + px)
        copy_shifted(shifted_of(scratch, n), pairs + SHIFTED_BYTES * (count * ((y - y0) * (x1 - x0) + x - x0) + index))
        put_shifted(scratch, n, at, float(reservoir_at(at, 0).confidence))
        if x0 <= px < x1 and y0 <= py < y1:
            theirs = _pairs_of(pairs, count, px, py, x0, y0, x1) + SHIFTED_BYTES * index
            put_from_shifted(scratch, 0, n, theirs)
        elif counts(scratch, 0):  # the pair's other half is another tile's
            put_from_domain(reuse, scratch, 0, n)
        n += 1
    return n


@device
def _put_targets(reuse, scratch, n):
    """What the sample of each neighbour is worth to the others."""
    for i in range(1, n):
        if counts(scratch, i):
            for j in range(1, n):
                if i != j:
                    put_from_domain(reuse, scratch, i, j)
