"""Temporal reuse: a pixel resamples its own sample with that of the pixel that showed the same surface a frame before.

The history is at most worth `confidence_cap` frames, and nothing where the surface cannot be found again: decided by
points and normals, never by samples. For the MIS weights the frame before is asked with its own scene, lights, vertices
and shadows, without which light that has moved is counted wrongly (history_target BEFORE).
"""

from ...kernels.core import rng
from ...kernels.core.jit import device, kernel
from ...kernels.core.memory import record_address
from ...kernels.core.records import CAMERA, INTEGRATOR, SCENE, tile_camera, tile_scene
from ...kernels.core.vec import vec
from ...kernels.path.shutter import set_time
from ...kernels.path.state import FAR
from .frame import FRAME
from .inputs import (
    counts,
    domain_of,
    point_at,
    prefetch_domain,
    put_canonical,
    put_from_domain,
    put_shifted,
    resample,
    reservoirs_of,
    shifted_of,
)
from .mis import BALANCE, CONTRIBUTION
from .motion import MOTION, pixel_before, place_before
from .neighbours import similar
from .options import OF_NOW, REUSE
from .resample import needs_from
from .reservoir import RESERVOIR_BYTES, clear, reservoir_at
from .technique import BEFORE, NOW, domain_at, set_domain, shift
from .vertex import let_go

STREAM = 1
DIM_CHOICE = 1
SEARCH = 5  # pixels looked at for the surface: the one it should be at, and its four neighbours


@kernel
def temporal_tile(
    scene: SCENE, camera: CAMERA, integrator: INTEGRATOR, frame: FRAME, scene_before: SCENE, camera_before: CAMERA,
    integrator_before: INTEGRATOR, before: FRAME, motion: MOTION, reuse: REUSE, scratch, x0, y0, x1, y1, last,
):  # fmt: skip
    """Temporal reuse from frame.reservoirs and before.reservoirs to frame.reused for the pixels of a tile.

    scene_before, camera_before, integrator_before, before: of the frame before, whose points, paths and last reservoirs
    are still there; last: whether no spatial reuse follows, so that frame.light is what lights.
    """
    scene, camera = tile_scene(scene, scratch, 0), tile_camera(camera, scratch, 0)
    scene_before, camera_before = tile_scene(scene_before, scratch, 1), tile_camera(camera_before, scratch, 1)
    let_go(scratch)
    links = record_address(motion)
    now = domain_at(domain_of(scratch, 0), 0)
    then = domain_at(domain_of(scratch, 1), 0)
    set_domain(now, scene, integrator, frame, links, reuse, scratch, NOW)
    set_domain(then, scene_before, integrator_before, before, links, reuse, scratch, BEFORE)
    own = reservoirs_of(frame, reuse, frame.reservoirs)
    theirs = reservoirs_of(before, reuse, before.reservoirs)
    to = reservoirs_of(frame, reuse, frame.reused)
    kind = reuse.mis
    if kind == CONTRIBUTION:
        kind = BALANCE  # of two candidates it asks no more
    for y in range(y0, y1):
        for x in range(x0, x1):
            pixel = y * frame.width + x
            if point_at(frame, pixel).instance < 0 or reservoir_at(own, pixel).confidence <= 0.0:
                clear(reservoir_at(to, pixel), 0.0)
                continue
            prefetch_domain(frame, pixel)
            now.pixel = pixel
            put_canonical(frame, scratch, pixel, own + RESERVOIR_BYTES * pixel)
            there = find_before(scene, camera, frame, scene_before, camera_before, before, motion, reuse, x, y)
            n = 1
            if there >= 0 and reservoir_at(theirs, there).confidence > 0.0:
                prefetch_domain(before, there)
                then.pixel = there
                at = theirs + RESERVOIR_BYTES * there
                shift(reuse, domain_of(scratch, 1), domain_of(scratch, 0), at, shifted_of(scratch, 1))
                put_shifted(scratch, 1, at, min(float(reservoir_at(at, 0).confidence), reuse.confidence_cap))
                n = 2
                if needs_from(kind, 0, 1) and counts(scratch, 0):
                    if reuse.history_target == OF_NOW:
                        set_domain(then, scene, integrator, before, links, reuse, scratch, NOW)
                    put_from_domain(reuse, scratch, 0, 1)
                    set_domain(then, scene_before, integrator_before, before, links, reuse, scratch, BEFORE)
            u = rng.sample1(rng.key(reuse.seed, x, y, STREAM), 0, DIM_CHOICE)
            resample(frame, reuse, scratch, n, kind, u, to + RESERVOIR_BYTES * pixel, 1, last)


@device
def find_before(scene, camera, frame, scene_before, camera_before, before, motion, reuse, x, y):
    """The pixel of the frame before that shows the surface that is at pixel (x, y) now; -1: none."""
    sp = point_at(frame, y * frame.width + x)
    set_time(scene, camera, sp.time)
    set_time(scene_before, camera_before, sp.time)
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
        if scene_before.shutter != 0:  # where the surface was at the time of that pixel
            scene_before.time = op.time
            _, p, n = place_before(scene, scene_before, motion, sp)
        # Its distance from that camera is not known: the tangent planes alone tell.
        if op.instance == instance and similar(
            p, n, 0, FAR, vec(op.p), vec(op.n), 0, op.t, reuse.min_cosine, reuse.max_depth
        ):
            return pixel
    return -1
