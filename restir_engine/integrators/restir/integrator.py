"""RESTIR: frames of one sample a pixel, each a sequence of kernels with a barrier between them; see docs/restir.md."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from ...context import FrameContext
from ...film import Film
from ...kernels.core.direct import Direct
from ...kernels.core.memory import address
from ...kernels.lights.tiles import fill_tiles
from ...scene.light_tiles import LightTiles, has_choice, tile_count
from ...settings import RenderSettings, carries_visibility
from ..base import Integrator, Stage, Tile, frame_seed
from ..resampling.frame import Frame
from ..resampling.history import History
from ..resampling.reuse import Reuse
from ..techniques.direct.candidates import candidates_tile
from ..techniques.direct.groups import LAST, LAST_OF_FRAME
from ..techniques.direct.row import direct_technique
from ..techniques.direct.sample import DIRECT_RESERVOIR
from ..techniques.direct.visibility import visibility_of
from ..techniques.refraction.layer import RefractionLayer, resamples_refraction
from ..techniques.subsurface.layer import SubsurfaceLayer, resamples_subsurface
from ..techniques.subsurface.watch import add_watched, watches
from .gbuffer import gbuffer_tile
from .paths import PathSteps, resamples_paths
from .shade import film_tile, shade_tile
from .tile_frames import TileFrames

GBUFFER, CANDIDATES, SHADE, FILM = map(Direct, (gbuffer_tile, candidates_tile, shade_tile, film_tile))
MOST_FRAMES = 16  # of a batch, where a frame is not kept whole


class RestirIntegrator(Integrator):
    """The kernels of RESTIR with a context, settings and a film.

    history: that of the integrator of the frame before, which goes on here where it serves these settings.
    """

    max_batch = 1  # of whole frames

    def __init__(
        self, context: FrameContext, settings: RenderSettings, film: Film, history: History | None = None
    ) -> None:
        options = settings.reuse
        kept = (options, settings.sss_shift, settings.sss_method, settings.sss_refraction)
        if history is None or not history.serves(kept):
            history = History(kept)
        is_whole = resamples_paths(options, context.scene)
        tiles = None
        if not is_whole or (options.light_candidates and has_choice(context.scene)):
            candidates = max(options.light_candidates, 1)
            variates = not film.has_light_groups  # they are the light of several at once
            count = tile_count(film.width * film.height)
            tiles = LightTiles(context.scene, count, candidates=candidates, control_variates=variates)
        super().__init__(context.with_tiles(tiles), settings, film)
        later = self.context if options.later_tiles else context  # for all but the vertex that is resampled
        self._later = later.address, int(later.record["camera"]), address(self.record), self.film.address
        self.history = history
        groups = int(film.record["light_groups"])
        self.paths = PathSteps(self.record, groups) if is_whole else None
        self.reuse = Reuse(options, self.paths.technique if self.paths else direct_technique(options))
        scene = context.scene
        crossing = resamples_refraction(scene, settings) and not self.paths
        self.refraction = RefractionLayer(settings) if crossing else None
        below = resamples_subsurface(scene, settings) and not self.paths
        self.subsurface = SubsurfaceLayer(settings, crossing) if below else None
        self.layers = [layer for layer in (self.subsurface, self.refraction) if layer]
        self._seed = settings.seed
        self._shows_visibility = "Visibility Estimate" in settings.passes and carries_visibility(settings)
        reservoir = self.paths.reservoir if self.paths else DIRECT_RESERVOIR
        shape = {"reservoir": reservoir, "layers": len(self.reuse.records), "indirect": self.paths is not None}
        shape["light_groups"] = context.scene.light_groups if film.has_light_groups else None
        self._frame_of = partial(Frame, channels=film.pixels.shape[2], **shape)
        whole = not self.reuse.block or self.layers or self._shows_visibility or self.cache
        self.frame = self._new_frame() if whole else None
        if not whole:
            self.max_batch = MOST_FRAMES
            self._tile_frames = TileFrames(self._frame_of, history.mean_visibilities(film.width, film.height))

    def _new_frame(self) -> Frame:
        size = self.film.width, self.film.height
        frame = self._frame_of(*size, mean_visibilities=self.history.mean_visibilities(*size))
        for layer in self.layers:
            layer.accompany(frame)
        return frame

    def kernels(self) -> list:
        """The steps of a frame in their order, see `stages`."""
        candidates, shade = self.paths.kernels if self.paths else (candidates_tile, shade_tile)
        below = [kernel for layer in self.layers for kernel in layer.kernels()]
        return [fill_tiles, gbuffer_tile, candidates, *self.reuse.kernels(), *below, shade, film_tile]

    def stages(self, first_sample: int, samples: int) -> list[Stage]:
        """The steps of a frame, or where no pixel looks at another of several, a tile's all at once."""
        if not self.frame:
            return [stage for sample in range(first_sample, first_sample + samples) for stage in self._by_tiles(sample)]
        self._sample = first_sample
        if self.cache:
            self.cache.watch(self.frame.pixels)
        reuse = self.reuse.stages(self.context, self.record, self.frame, self.history, self._frame_seed(first_sample))
        last = LAST_OF_FRAME if self.reuse.settings.temporal else LAST
        frame = self.frame
        below = [stage for layer in self.layers for stage in self._layer_stages(layer, first_sample)]
        return [
            *self._fill(first_sample),
            Stage(partial(self._gbuffer, first_sample, frame)),
            Stage(partial(self._candidates, 0 if reuse else last, frame)),
            *reuse,
            *below,
            Stage(partial(self._shade, frame, self._lights(frame))),
            Stage(partial(self._film, first_sample, frame), finish=self._finish),
        ]

    def _by_tiles(self, sample: int) -> list[Stage]:
        """The steps of a frame, those of each tile one after the other."""
        seed = self._frame_seed(sample)
        reuse, corner = self.reuse.within_tile(self.context, self.record, seed), self.reuse.corner(seed)
        tiles = self.film.tiles(*corner) if any(corner) else None
        return [*self._fill(sample), Stage(partial(self._whole_tile, sample, reuse), tiles, finish=self.end_batch)]

    def _whole_tile(self, sample: int, reuse: Callable, tile: Tile, scratch: np.ndarray) -> None:
        with self._tile_frames.at(tile) as frame:
            self._gbuffer(sample, frame, tile, scratch)
            self._candidates(0 if self.reuse.settings.rounds else LAST, frame, tile, scratch)
            reuse(frame, tile, scratch)
            self._shade(frame, self._lights(frame), tile, scratch)
            self._film(sample, frame, tile, scratch)

    def _frame_seed(self, sample: int) -> int:
        return frame_seed(self._seed, sample)

    def _fill(self, sample: int) -> list[Stage]:
        """The step that draws the points of all light tiles, where there are any."""
        if not self.context.tiles:
            return []
        tiles = [(tile, tile + 1) for tile in range(self.context.tiles.count)]
        return [Stage(partial(self._fill_tiles, self._frame_seed(sample)), tiles)]

    def _layer_stages(self, layer: SubsurfaceLayer | RefractionLayer, sample: int) -> list[Stage]:
        """Candidates and reuse of light below the surface."""
        frame, seed = self.frame, self._frame_seed(sample)
        reuse = layer.reuse.stages(self.context, self.record, frame.companions[layer.name], self.history, seed)
        args = (0 if reuse else 1, self.context, self.record, self.film.record, frame)
        return [Stage(partial(layer.candidates, *args)), *reuse]

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
        if self.subsurface and watches(self.settings.passes):
            add_watched(self.film, self.settings.passes, self.frame.companions[self.subsurface.name])
        if any(one.reuse.settings.temporal for one in (self, *self.layers)):
            self.frame = self.history.remember(self, self.frame) or self._new_frame()

    def _fill_tiles(self, seed: int, tiles: tuple[int, int], scratch: np.ndarray) -> None:
        """Fill tiles [first, last)."""
        self.context.fill_tiles(seed, scratch, *tiles)

    def _gbuffer(self, sample: int, frame: Frame, tile: Tile, scratch: np.ndarray) -> None:
        place = tile if self.frame else (0, 0, tile[2] - tile[0], tile[3] - tile[1])
        closures = 0
        while True:
            pool = frame.pool(place, closures)
            closures = GBUFFER(*self._later, frame.address, address(pool), len(pool), address(scratch), *tile, sample)
            if closures <= len(pool):
                return

    def _candidates(self, last: int, frame: Frame, tile: Tile, scratch: np.ndarray) -> None:
        if self.paths:
            self.paths.candidates(last, self, frame, tile, scratch)
            return
        layers = address(self.reuse.records), len(self.reuse.records)
        args = self.context.address, address(self.record), *layers, frame.address, address(scratch)
        CANDIDATES(*args, *tile, last)

    def _lights(self, frame: Frame) -> np.ndarray:
        """int64 (layers, 2): addresses of each layer's FRAME and of the code that adds its light."""
        return np.array([(frame.companions[a.name].address, a.shading) for a in self.layers], np.int64).reshape(-1, 2)

    def _shade(self, frame: Frame, lights: np.ndarray, tile: Tile, scratch: np.ndarray) -> None:
        if self.paths:
            self.paths.light(self, frame, tile, scratch)
            return
        way = (int(lights[0, 0]), self.subsurface.go_on) if self.subsurface else (0, 0)
        method = self.refraction.method if self.refraction else 0
        below = address(lights), len(lights), *way, method
        SHADE(*self._later, frame.address, address(scratch), self.reuse.settings.exit_lights, *below, *tile)

    def _film(self, sample: int, frame: Frame, tile: Tile, scratch: np.ndarray) -> None:
        FILM(self.film.address, frame.address, *tile)
        self.add_catchers(tile, scratch, sample, 1)
