"""Path tracing with shared exits, as a session drives it."""

from __future__ import annotations

from collections import deque
from functools import partial

import numpy as np

from ...context import FrameContext
from ...film import Film
from ...kernels.core.direct import Direct
from ...kernels.core.memory import address
from ...kernels.lights.tiles import fill_tiles
from ...kernels.subsurface.methods import exits_entries, exits_flag
from ...scene.light_tiles import LightTiles, tile_count
from ...scene.scene import Scene
from ...settings import RenderSettings, is_denoised
from ..base import Integrator, Stage, Tile, frame_seed
from .block import BLOCK, SIDE, block_bytes
from .tile import blocks_tile

BLOCKS = Direct(blocks_tile)

# Pixels along a block's side. HYBRID's light that is not shared is noise of its own, so that fewer do.
SIDES = {"HYBRID": SIDE // 2}
# Of how many pixels along each side a block has one. Where a denoiser follows, neighbors belong to different blocks: it
# takes what they share for a part of the picture.
DENOISED_SPREAD = 2
PLACES, LONGEST_RUN = 16, 16  # that blocks have in a render, at least; samples with the same, at most


class BlocksIntegrator(Integrator):
    """The blocks' kernel with a context, settings and a film; from_tiles: whether lights come from tiles."""

    max_batch = 4 * LONGEST_RUN

    def __init__(self, context: FrameContext, settings: RenderSettings, film: Film, from_tiles: bool = False) -> None:
        tiles = None
        if from_tiles:
            candidates, count = max(settings.reuse.light_candidates, 1), tile_count(film.width * film.height)
            tiles = LightTiles(context.scene, count, candidates=candidates, control_variates=not film.has_light_groups)
        super().__init__(context.with_tiles(tiles) if tiles else context, settings, film)
        self.side = SIDES.get(settings.sss_method, SIDE)
        self.spread = DENOISED_SPREAD if is_denoised(settings) else 1
        # In long renders blocks stay where they are for some samples, each of which would be a round of all threads.
        self._run = 1 if tiles or self.cache else min(max(settings.total_samples // PLACES, 1), LONGEST_RUN)
        self._codes = exits_entries(settings.sss_method)
        groups = context.scene.light_groups
        self._groups = int(groups[0]["count"]) if film.has_light_groups else 0
        self._idle: deque[np.ndarray] = deque()

    def kernels(self) -> list:
        """The one that renders a tile, and what fills light tiles."""
        return [blocks_tile, *([fill_tiles] if self.context.tiles else [])]

    def stages(self, first_sample: int, samples: int) -> list[Stage]:
        """One for each run of samples whose blocks have the same places, which tiles follow."""
        found, first, end = [], first_sample, first_sample + samples
        while first < end:
            count = min(self._run - first % self._run, end - first)
            if self.context.tiles:
                tiles = [(tile, tile + 1) for tile in range(self.context.tiles.count)]
                found.append(Stage(partial(self._fill_tiles, frame_seed(self.settings.seed, first)), tiles))
            found.append(self._stage(first, count))
            first += count
        return found

    def _stage(self, first: int, count: int) -> Stage:
        seed, wide = frame_seed(self.settings.seed, first // self._run), self.side * self.spread
        corner = (seed % wide, seed // wide % wide) if self.settings.reuse.moving_blocks else (0, 0)
        run = partial(self._render, first, count, seed, corner)
        return Stage(run, self.film.tiles(*corner), finish=self.end_batch)

    def _fill_tiles(self, seed: int, tiles: tuple[int, int], scratch: np.ndarray) -> None:
        self.context.fill_tiles(seed, scratch, *tiles)

    def _render(
        self, first: int, count: int, seed: int, corner: tuple[int, int], tile: Tile, scratch: np.ndarray
    ) -> None:
        """corner: by how many pixels the first blocks begin before the film, along x and y."""
        block = self._take_block()
        context = self.context
        args = context.address, int(context.record["camera"]), address(self.record), self.film.address
        places = self.side, self.spread, seed, *corner
        BLOCKS(*args, address(scratch), address(block), *self._codes, *places, *tile, first, count)
        self._idle.append(block)
        self.add_catchers(tile, scratch, first, count)

    def _take_block(self) -> np.ndarray:
        """Working memory of a block, for one thread."""
        try:
            return self._idle.pop()
        except IndexError:
            memory = np.zeros(block_bytes(self._groups) + 64, np.uint8)
            memory = memory[-address(memory) % 64 :]
            memory[: BLOCK.itemsize].view(BLOCK)["groups"] = self._groups
            return memory


def shares_exits(scene: Scene, settings: RenderSettings) -> bool:
    """Whether pixels of a render share exits in blocks: the settings let them, and the scene has what is served.

    Nothing is shared between moments, at which surfaces are elsewhere, nor where light is resampled in other ways.
    """
    wanted = settings.sss_shift in ("AUTO", "BLOCKS")
    if not wanted or settings.sss_temporal or not scene.have_flag(exits_flag(settings.sss_method)).any():
        return False
    reuse = settings.reuse
    alone = not reuse.temporal and not reuse.rounds and "Visibility Estimate" not in settings.passes
    if settings.sss_shift == "BLOCKS" and not (alone and not scene.record["shutter"]):
        text = "below surfaces is off: there are no Blocks with motion blur or with reuse of direct light"
        scene.warnings.add("Render", "Reuse", text)
    return alone and not scene.record["shutter"]
