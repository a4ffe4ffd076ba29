"""The kernel of PATH."""

from ...kernels.core import rng
from ...kernels.core.jit import kernel
from ...kernels.core.records import CAMERA, FILM, INTEGRATOR, SCENE, tile_camera, tile_scene
from ...kernels.film.frame_pixels import is_active
from ...kernels.path.state import start_path
from .trace import trace_path


@kernel
def render_tile(
    scene: SCENE, camera: CAMERA, integrator: INTEGRATOR, film: FILM, scratch, x0, y0, x1, y1, first_sample, samples
):
    """Add `samples` samples to each pixel of a tile; returns the number of paths."""
    whole = scene
    scene, camera = tile_scene(whole, scratch, 0), tile_camera(camera, scratch, 0)
    for y in range(y0, y1):
        for x in range(x0, x1):
            if not is_active(film, x, y):
                continue
            pixel = film.pixels + 4 * film.channels * (y * film.width + x)
            key = rng.key(integrator.seed, x, y, 0)
            for sample in range(first_sample, first_sample + samples):
                if whole.caught != 0:
                    scene = tile_scene(whole, scratch, 0)
                event = start_path(scene, camera, integrator, scratch, pixel, key, sample, x, y)
                trace_path(scene, camera, integrator, film, scratch, event, 1)
    return (x1 - x0) * (y1 - y0) * samples
