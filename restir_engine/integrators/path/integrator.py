"""The kernel of PATH, and what drives it."""

from __future__ import annotations

from functools import partial

import numpy as np

from ...kernels.core import rng
from ...kernels.core.jit import kernel
from ...kernels.core.memory import address
from ...kernels.core.records import CAMERA, FILM, INTEGRATOR, SCENE, tile_camera, tile_scene
from ...kernels.film.frame_pixels import is_active
from ...kernels.path.state import GOES_ON, start_path
from ..base import Integrator, Stage, Tile
from .trace import trace_path


@kernel
def render_tile(
    scene: SCENE, camera: CAMERA, integrator: INTEGRATOR, film: FILM, scratch, x0, y0, x1, y1, first_sample, samples
):
    """Add `samples` samples to each pixel of a tile; returns the number of paths."""
    scene, camera = tile_scene(scene, scratch, 0), tile_camera(camera, scratch, 0)
    for y in range(y0, y1):
        for x in range(x0, x1):
            if not is_active(film, x, y):
                continue
            pixel = film.pixels + 4 * film.channels * (y * film.width + x)
            key = rng.key(integrator.seed, x, y, 0)
            for sample in range(first_sample, first_sample + samples):
                if start_path(scene, camera, integrator, scratch, pixel, key, sample, x, y):
                    trace_path(scene, camera, integrator, film, scratch, GOES_ON, 1)
    return (x1 - x0) * (y1 - y0) * samples


FIRST_KERNELS = [render_tile]  # what a render needs in any case


class PathIntegrator(Integrator):
    """The PATH kernel with a scene, settings and a film."""

    def kernels(self) -> list:
        """The one that renders a tile."""
        return FIRST_KERNELS

    def stages(self, first_sample: int, samples: int) -> list[Stage]:
        """One: all samples of a tile at once."""
        return [Stage(partial(self._render, first_sample=first_sample, samples=samples), finish=self.end_batch)]

    def _render(self, tile: Tile, scratch: np.ndarray, first_sample: int, samples: int) -> None:
        context = self.context
        args = (context.record, context.camera_record, self.record[0], self.film.record, address(scratch))
        render_tile(*args, *tile, first_sample, samples)
