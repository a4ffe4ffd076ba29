"""RESTIR: frames of one sample a pixel, each a sequence of kernels with a barrier between them; see docs/restir.md."""

from __future__ import annotations

from functools import partial

import numpy as np

from ...context import FrameContext
from ...film import Film
from ...kernels.core.memory import address
from ...kernels.lights.tiles import fill_tiles
from ...scene.light_tiles import LightTiles, tile_count
from ...settings import RenderSettings, carries_visibility
from ..base import Integrator, Stage, Tile
from ..resampling.frame import Frame
from ..resampling.history import History
from ..resampling.reuse import Reuse
from ..techniques.direct.candidates import candidates_tile
from ..techniques.direct.groups import LAST, LAST_OF_FRAME
from ..techniques.direct.row import direct_technique
from ..techniques.direct.sample import DIRECT_RESERVOIR
from ..techniques.direct.visibility import visibility_of
from .gbuffer import gbuffer_tile
from .shade import film_tile, shade_tile


def frame_seed(seed: int, sample: int) -> int:
    """A seed of 31 bits for what all pixels of a frame share."""
    return (seed * 0x9E3779B1 + sample * 0x85EBCA6B + 1) & 0x7FFFFFFF


class RestirIntegrator(Integrator):
    """The kernels of RESTIR with a context, settings and a film.

    history: that of the integrator of the frame before, which goes on here where it serves these settings.
    """

    max_batch = 1

    def __init__(
        self, context: FrameContext, settings: RenderSettings, film: Film, history: History | None = None
    ) -> None:
        options = settings.reuse
        if history is None or not history.serves(options):
            history = History(options)
        count = tile_count(film.width * film.height)
        tiles = LightTiles(context.scene, count, candidates=options.light_candidates)
        super().__init__(context.with_tiles(tiles), settings, film)
        self._later = self.context if options.later_tiles else context  # for all but the vertex that is resampled
        self.history = history
        self.reuse = Reuse(options, direct_technique(options))
        self.frame = self._new_frame()
        self._seed = settings.seed
        self._shows_visibility = "Visibility Estimate" in settings.passes and carries_visibility(settings)

    def _new_frame(self) -> Frame:
        film = self.film
        size = film.width, film.height
        seen = self.history.mean_visibilities(*size)
        return Frame(*size, film.pixels.shape[2], seen, DIRECT_RESERVOIR, len(self.reuse.records))

    def kernels(self) -> list:
        """The steps of a frame in their order, see `stages`."""
        return [fill_tiles, gbuffer_tile, candidates_tile, *self.reuse.kernels(), shade_tile, film_tile]

    def stages(self, first_sample: int, samples: int) -> list[Stage]:
        """The steps of a frame."""
        self._sample = first_sample
        if self.cache:
            self.cache.watch(self.frame.pixels)
        seed = frame_seed(self._seed, first_sample)
        reuse = self.reuse.stages(self.context, self.record, self.frame, self.history, seed)
        last = LAST_OF_FRAME if self.reuse.settings.temporal else LAST
        candidates = partial(self._candidates, 0 if reuse else last)
        tiles = [(tile, tile + 1) for tile in range(self.context.tiles.count)]
        fill = Stage(partial(self._fill_tiles, seed), tiles)
        steps = [fill, Stage(self._gbuffer), Stage(candidates), *reuse, Stage(self._shade)]
        return [*steps, Stage(self._film, finish=self._finish)]

    def visibility(self) -> np.ndarray:
        """V̄ of the samples in the last finished frame by channel: (height, width, 3), NaN where unknown."""
        return visibility_of(self._finished.reservoirs)

    def _finish(self) -> None:
        """A finished frame is history to the next."""
        self.end_batch()
        self._finished = self.frame
        if self._shows_visibility:
            v = self.visibility()
            sums = self.film.sums("Visibility Estimate")
            sums[..., :3] += np.nan_to_num(v)
            sums[..., 3] += np.isfinite(v).mean(-1)
        if self.reuse.settings.temporal:
            self.frame = self.history.remember(self, self.frame) or self._new_frame()

    def _fill_tiles(self, seed: int, tiles: tuple[int, int], scratch: np.ndarray) -> None:
        """Fill tiles [first, last)."""
        self.context.fill_tiles(seed, scratch, *tiles)

    def _gbuffer(self, tile: Tile, scratch: np.ndarray) -> None:
        context, frame = self._later, self.frame
        closures = 0
        while True:
            pool = frame.pool(tile, closures)
            closures = gbuffer_tile(
                context.record, context.camera_record, self.record[0], self.film.record, frame.record, address(pool),
                len(pool), address(scratch), *tile, self._sample,
            )  # fmt: skip
            if closures <= len(pool):
                return

    def _candidates(self, last: int, tile: Tile, scratch: np.ndarray) -> None:
        frame, reuse = self.frame, self.reuse.records
        layers = address(reuse), len(reuse)
        candidates_tile(self.context.record, self.record[0], *layers, frame.record, address(scratch), *tile, last)

    def _shade(self, tile: Tile, scratch: np.ndarray) -> None:
        context = self._later
        args = (context.record, context.camera_record, self.record[0], self.film.record, self.frame.record)
        shade_tile(*args, address(scratch), self.reuse.settings.exit_lights, *tile)

    def _film(self, tile: Tile, scratch: np.ndarray) -> None:
        film_tile(self.film.record, self.frame.record, *tile)
