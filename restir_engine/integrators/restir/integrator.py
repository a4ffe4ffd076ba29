"""RESTIR: frames of one sample a pixel, each a sequence of kernels with a barrier between them; see docs/restir.md."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...film import Film
from ...kernels.memory import address
from ...settings import RenderSettings
from ..base import Integrator, Stage, Tile
from .candidates import candidates_tile
from .frame import Frame
from .gbuffer import gbuffer_tile
from .shade import film_tile, shade_tile
from .technique import technique_record

if TYPE_CHECKING:
    from ...scene.scene import Scene

NO_TILE = (0, 0, 0, 0)


class RestirIntegrator(Integrator):
    """The kernels of RESTIR with a scene, settings and a film."""

    max_batch = 1

    def __init__(self, scene: Scene, settings: RenderSettings, film: Film) -> None:
        super().__init__(scene, settings, film)
        scene.lights.prepare_reuse(scene)
        self.technique = technique_record(settings)
        self.frame = Frame(film.width, film.height, film.pixels.shape[2])
        scratch = self.scratch()
        for stage in self.stages(0, 0):
            stage.run(NO_TILE, scratch)  # compiles, or loads from the cache

    def stages(self, first_sample: int, samples: int) -> list[Stage]:
        """The steps of a frame."""
        self._sample = first_sample
        return [Stage(self._gbuffer), Stage(self._candidates), Stage(self._shade), Stage(self._film, finish=self.warn)]

    def _gbuffer(self, tile: Tile, scratch: np.ndarray) -> None:
        scene, frame = self.scene, self.frame
        closures = 0
        while True:
            pool = frame.pool(tile, closures)
            closures = gbuffer_tile(
                scene.record, self.camera[0], self.record[0], self.film.record, frame.record, address(pool), len(pool),
                address(scratch), *tile, self._sample,
            )  # fmt: skip
            if closures <= len(pool):
                return

    def _candidates(self, tile: Tile, scratch: np.ndarray) -> None:
        args = (self.scene.record, self.record[0], self.technique[0], self.frame.record, address(scratch))
        candidates_tile(*args, *tile)

    def _shade(self, tile: Tile, scratch: np.ndarray) -> None:
        args = (self.scene.record, self.camera[0], self.record[0], self.film.record, self.frame.record)
        shade_tile(*args, address(scratch), *tile)

    def _film(self, tile: Tile, scratch: np.ndarray) -> None:
        film_tile(self.film.record, self.frame.record, *tile)
