"""Random replay: the first bounces of a sample's path, from vertex 1 of another pixel, by the same random numbers."""

from ....kernels.core.jit import device, inlined
from ....kernels.core.memory import copy_words, record_address
from ....kernels.core.records import INTEGRATOR, SCRATCH_TAKER, integrator_at
from ....kernels.core.vec import put, vec
from ....kernels.film.contribute import NO_GROUP
from ....kernels.lights import note_choice, samples_tiles
from ....kernels.path.state import DIM_FIRST_VERTEX, GOES_ON, SHADES
from ...path.bounce import bounce
from ...path.trace import trace_ray
from ...path.vertex import arrive
from ...resampling.vertex import hold, let_go
from .walk import WORK_INTEGRATOR, WORK_PIXEL, bounce_pdf, connects, note_bounce, start_walk
from .work import RAYS, count

_ENDLESS = 1 << 40
_INTEGRATOR_WORDS = INTEGRATOR.itemsize // 8


@inlined
def _without_roulette(scratch, integrator):
    """Put a copy of an INTEGRATOR by which no path ends by chance into working memory."""
    copy_words(scratch + WORK_INTEGRATOR, record_address(integrator), _INTEGRATOR_WORDS)
    integrator_at(scratch + WORK_INTEGRATOR, 0).min_bounces = _ENDLESS


@inlined
def start_replay(scene, integrator, frame, scratch, walk, options, path, sp, pixel, key, index):
    """Take up vertex 1 of a pixel; key, index: of the random numbers. What the path finds goes to the walk.

    Returns the INTEGRATOR of paths that are replayed, which have no Russian roulette.
    """
    if not hold(scene, integrator, frame, scratch, path, sp, pixel):
        _without_roulette(scratch, integrator)
    start_walk(walk, options, sp)
    walk.reuse = 0
    walk.bounces = path.bounce
    put(walk.prefix, vec(path.throughput))
    put(walk.found, (0.0, 0.0, 0.0))
    walk.found_group = NO_GROUP
    path.taker = scratch + SCRATCH_TAKER
    path.pixel = scratch + WORK_PIXEL
    path.data_done = 1
    path.denoise = 0
    path.mean_visibility = 0
    put(path.throughput, (1.0, 1.0, 1.0))
    path.key = key
    path.sample = index
    path.dimension = DIM_FIRST_VERTEX
    return integrator_at(scratch + WORK_INTEGRATOR, 0)


@device
def replay(scene, camera, integrator, film, scratch, walk, path, sp, bounces):
    """Replay so many bounces; False where one of them ends the path or could be reconnected to."""
    for _ in range(bounces):
        if not replay_bounce(scene, integrator, walk, path, sp):
            return False
        let_go(scratch)
        count(scratch, RAYS, 1)
        trace_ray(scene, camera, scratch, path)
        if arrive(scene, camera, integrator, film, scratch, path, sp) != SHADES:
            return False
        walk.vertex += 1
    return True


@inlined
def replay_bounce(scene, integrator, walk, path, sp):
    """One bounce, without its ray; False likewise."""
    if not samples_tiles(scene):
        note_choice(scene, sp)  # as light samples do, which MIS asks for by the next ray
    if bounce(scene, integrator, path, sp) != GOES_ON or connects(walk, sp, bounce_pdf(path)):
        return False
    note_bounce(walk, path, sp)
    return True


@device
def replay_ray(scene, camera, integrator, film, scratch, walk, path, sp, source):
    """The last bounce and its ray: what that finds of `source` is in walk.found. False likewise."""
    if not replay_bounce(scene, integrator, walk, path, sp):
        return False
    walk.source = source
    let_go(scratch)
    count(scratch, RAYS, 1)
    trace_ray(scene, camera, scratch, path)
    arrive(scene, camera, integrator, film, scratch, path, sp)
    return True
