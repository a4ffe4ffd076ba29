"""The kernel of shared walks: PATH by blocks of pixels, whose walks light all of them."""

from ....kernels.core import rng
from ....kernels.core.jit import inlined, kernel
from ....kernels.core.memory import clear_record, load_i64
from ....kernels.core.records import (
    CAMERA,
    FILM,
    INTEGRATOR,
    SCENE,
    SCRATCH_PATH,
    SCRATCH_TAKER,
    path_at,
    tile_camera,
    tile_point,
    tile_scene,
)
from ....kernels.core.vec import vec
from ....kernels.film.frame_pixels import is_active
from ....kernels.path.direct import direct_light
from ....kernels.path.state import ARRIVES, ENDS, ENTERS, GOES_ON, LIT, SHADES, start_path
from ....kernels.subsurface.method_table import EXACT_WALKS, FLAGS
from ....kernels.subsurface.methods import scatter
from ....kernels.subsurface.walk import MIN_ALBEDO
from ....kernels.subsurface.walked import walked_in
from ...path.bounce import bounce
from ...path.trace import trace_ray
from ...path.vertex import arrive
from .entrance import NO_WALK, entrance_at, note_entrance, note_light, note_walk
from .share import share_walks
from .taker import begin_taking, walk_taker_at


@inlined
def _trace(scene, camera, integrator, film, scratch, event, e, floor, mediums, taker, light_samples, exit_lights):
    """`trace_path` with the walk from the path's first entrance e, and all that it brings, for who shares it."""
    path = path_at(scratch + SCRATCH_PATH, 0)
    sp = tile_point(scratch)
    samples = light_samples
    while event != ENDS:
        if event == GOES_ON:
            trace_ray(scene, camera, scratch, path)
            event = ARRIVES
        if event == ARRIVES:
            event = arrive(scene, camera, integrator, film, scratch, path, sp)
            samples = light_samples if path.bounce == 0 else 1
        if event == SHADES:
            direct_light(scene, integrator, film, scratch, path, sp, samples)
            event = LIT
        if event == LIT:
            if path.bounce == 0 and e.opens == 0 and path.caught == 0:
                note_entrance(scene, path, sp, e, floor, mediums)
            event = bounce(scene, integrator, path, sp)
        if event == ENTERS:
            samples = exit_lights if path.bounce == 0 else 1
            enters = e.opens != 0 and e.taken == 0 and path.bounce == 0 and sp.scatterer == e.closure
            walked_in(scratch).events = 0
            event = scatter(scene, integrator, film, scratch, path, sp)
            if enters:
                e.taken = 1
                if event != ENDS:
                    note_walk(e, path, sp, walked_in(scratch))
                    begin_taking(integrator, scratch, path, taker)


@kernel
def shared_walks_tile(
    scene: SCENE, camera: CAMERA, integrator: INTEGRATOR, unclamped: INTEGRATOR, film: FILM, block, scratch, taker,
    mediums, light_samples, exit_lights, side, left, below, x0, y0, x1, y1, sample,
):  # fmt: skip
    """Add a sample to each pixel of a tile, in blocks of side × side pixels that share walks.

    block: ENTRANCE [side × side] for use here; taker: code of `take_from_walk`; mediums: see `note_entrance`. Blocks
    begin so many pixels (left, below) before multiples of their side. light_samples: those at surfaces that are seen;
    exit_lights: where light leaves the first object below whose surface it is scattered.
    """
    floor = 0.0 if load_i64(integrator.scatter, FLAGS) & EXACT_WALKS != 0 else MIN_ALBEDO
    whole = scene
    scene, camera = tile_scene(whole, scratch, 0), tile_camera(camera, scratch, 0)
    for v in range((y0 + below) // side, (y1 + below - 1) // side + 1):
        for u in range((x0 + left) // side, (x1 + left - 1) // side + 1):
            n = 0
            for y in range(max(v * side - below, y0), min((v + 1) * side - below, y1)):
                for x in range(max(u * side - left, x0), min((u + 1) * side - left, x1)):
                    if not is_active(film, x, y):
                        continue
                    if whole.caught != 0:
                        scene = tile_scene(whole, scratch, 0)
                    pixel = film.pixels + 4 * film.channels * (y * film.width + x)
                    e = entrance_at(block, n)
                    clear_record(e)
                    e.pixel = pixel
                    key = rng.key(integrator.seed, x, y, 0)
                    event = start_path(scene, camera, integrator, scratch, pixel, key, sample, x, y)
                    _trace(
                        scene, camera, integrator, film, scratch, event, e, floor, mediums, taker, light_samples,
                        exit_lights,
                    )  # fmt: skip
                    if e.walk != NO_WALK:
                        found = walk_taker_at(scratch + SCRATCH_TAKER, 0)
                        note_light(e, vec(found.direct), vec(found.indirect))
                    n += 1
            share_walks(scene, unclamped, film, scratch, block, n)
    return (x1 - x0) * (y1 - y0)
