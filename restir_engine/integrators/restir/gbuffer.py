"""The G-buffer of a frame: each pixel's path up to the vertex that is lit by resampling."""

from ...kernels.core import rng
from ...kernels.core.jit import kernel
from ...kernels.core.memory import copy_words, record_address
from ...kernels.core.records import (
    CAMERA,
    CLOSURE,
    FILM,
    INTEGRATOR,
    PATH,
    SCENE,
    SCRATCH_PATH,
    SHADING_POINT,
    path_at,
    shading_point_at,
    tile_camera,
    tile_point,
    tile_scene,
)
from ...kernels.film.frame_pixels import clear_pixel, is_active
from ...kernels.lights.mean_visibility import MEAN_VISIBILITY_BYTES
from ...kernels.path.state import start_path
from ..path.first_vertex import first_vertex
from ..resampling.frame import FRAME

POINT_WORDS, PATH_WORDS, CLOSURE_BYTES = SHADING_POINT.itemsize // 8, PATH.itemsize // 8, CLOSURE.itemsize
CLOSURE_WORDS = CLOSURE_BYTES // 8


@kernel
def gbuffer_tile(
    scene: SCENE, camera: CAMERA, integrator: INTEGRATOR, film: FILM, frame: FRAME, pool, capacity, scratch,
    x0, y0, x1, y1, sample,
):  # fmt: skip
    """Fill `points`, `paths` and `pixels` of a tile; closures go to `pool` (CLOSURE [capacity]).

    Returns how many closures there are. When there are more than the pool holds, call again with a larger one.
    """
    used = 0
    scene, camera = tile_scene(scene, scratch, 0), tile_camera(camera, scratch, 0)
    path = path_at(scratch + SCRATCH_PATH, 0)
    sp = tile_point(scratch)
    for y in range(y0, y1):
        for x in range(x0, x1):
            index = y * frame.width + x
            pixel = frame.pixels + 4 * frame.channels * index
            clear_pixel(pixel, frame.channels)
            kept = shading_point_at(frame.points, index)
            kept.instance = -1
            if not is_active(film, x, y):
                continue
            key = rng.key(integrator.seed, x, y, 0)
            event = start_path(scene, camera, integrator, scratch, pixel, key, sample, x, y)
            path.mean_visibility = frame.mean_visibilities + MEAN_VISIBILITY_BYTES * index
            if not first_vertex(scene, camera, integrator, film, scratch, path, sp, event):
                continue
            if used + sp.n_closures <= capacity:
                closures = pool + CLOSURE_BYTES * used
                copy_words(closures, sp.closures, CLOSURE_WORDS * sp.n_closures)
                copy_words(record_address(kept), record_address(sp), POINT_WORDS)
                kept.closures = closures
                copy_words(record_address(path_at(frame.paths, index)), record_address(path), PATH_WORDS)
            used += sp.n_closures
    return used
