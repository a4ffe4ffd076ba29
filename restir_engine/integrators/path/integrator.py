"""PATH as a session drives it."""

from __future__ import annotations

from functools import partial

import numpy as np

from ...kernels.core.memory import address
from ..base import Integrator, Stage, Tile
from .tile import render_tile

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
        self.add_catchers(tile, scratch, first_sample, samples)
