"""Random walks that the pixels of a block share: PATH by blocks of pixels; see docs/restir-sss.md."""

from __future__ import annotations

from collections import deque
from functools import partial

import numpy as np

from ...context import FrameContext
from ...film import Film
from ...kernels.core.direct import Direct
from ...kernels.core.memory import address
from ...kernels.core.records import SCENE_HAS_MEDIA, SCENE_HAS_SUBSURFACE
from ...kernels.lights.tiles import fill_tiles
from ...kernels.subsurface import method_table as at
from ...kernels.subsurface.methods import METHODS
from ...kernels.subsurface.walk import random_walk
from ...scene.light_tiles import LightTiles, has_choice, tile_count
from ...settings import RenderSettings
from ..base import Integrator, Stage, Tile
from ..techniques.walks.entrance import ENTRANCE
from ..techniques.walks.taker import take_from_walk
from ..techniques.walks.tile import shared_walks_tile
from .integrator import frame_seed

RENDER = Direct(shared_walks_tile)
SIDE = 4  # of blocks, pixels; of TILE a part
MOST_SAMPLES = 16  # of a batch


class SharedWalks(Integrator):
    """The kernel of shared walks with a context, settings and a film.

    Lights are sampled from tiles, as in RESTIR, where settings.reuse.light_candidates are not 0 and there are several.
    """

    def __init__(self, context: FrameContext, settings: RenderSettings, film: Film, side: int = SIDE) -> None:
        options, tiles = settings.reuse, None
        if options.light_candidates and has_choice(context.scene):
            count = tile_count(film.width * film.height)
            tiles = LightTiles(context.scene, count, candidates=options.light_candidates, control_variates=True)
        super().__init__(context.with_tiles(tiles), settings, film)
        self.max_batch = MOST_SAMPLES
        self._lights = (options.light_samples, options.exit_lights) if tiles else (1, 1)
        self._side = side
        self._unclamped = self.record.copy()
        self._unclamped["clamp_direct"] = self._unclamped["clamp_indirect"] = np.inf
        walked = [k for k in (at.MEDIUM, at.BURLEY) if self._scatter[k] == random_walk.address]
        self._mediums = sum(1 << k for k in walked) if side > 1 else 0  # who is alone shares nothing
        self._taker = take_from_walk.address
        self._idle: deque[np.ndarray] = deque()

    def kernels(self) -> list:
        """What the stages run."""
        return [shared_walks_tile, *([fill_tiles] if self.context.tiles else [])]

    def stages(self, first_sample: int, samples: int) -> list[Stage]:
        """Those of each sample: light tiles, where there are any; then the film's tiles, each of whole blocks."""
        return [stage for k in range(samples) for stage in self._of_sample(first_sample + k)]

    def _of_sample(self, sample: int) -> list[Stage]:
        seed, tiles, corner = frame_seed(self.settings.seed, sample), None, (0, 0)
        found = []
        if self.context.tiles:
            fill = partial(self._fill, seed)
            found.append(Stage(fill, [(tile, tile + 1) for tile in range(self.context.tiles.count)]))
        if self.settings.reuse.moving_blocks:
            corner = seed % self._side, seed // self._side % self._side
            tiles = self.film.tiles(*corner)
        return [*found, Stage(partial(self._render, sample, corner), tiles, finish=self.end_batch)]

    def _fill(self, seed: int, tiles: tuple[int, int], scratch: np.ndarray) -> None:
        self.context.fill_tiles(seed, scratch, *tiles)

    def _render(self, sample: int, corner: tuple[int, int], tile: Tile, scratch: np.ndarray) -> None:
        try:
            block = self._idle.pop()
        except IndexError:
            block = np.empty(self._side**2, ENTRANCE)
        context = self.context
        RENDER(
            context.address, int(context.record["camera"]), address(self.record), address(self._unclamped),
            self.film.address, address(block), address(scratch), self._taker, self._mediums, *self._lights, self._side,
            *corner, *tile, sample,
        )  # fmt: skip
        self._idle.append(block)
        self.add_catchers(tile, scratch, sample, 1)


def shares_walks(context: FrameContext, settings: RenderSettings) -> bool:
    """Whether there are random walks that pixels could share, and nothing that hinders them.

    What hinders is said where the settings ask for it: all walks of a block see the same moment; what lies behind
    an exit does not depend on the media around the entrance; and the light that a walk brings is one sum.
    """
    scene = context.scene
    if not scene.record["flags"] & SCENE_HAS_SUBSURFACE or random_walk not in METHODS[settings.sss_method]:
        return False
    hindrances = {
        "motion blur": scene.record["shutter"],
        "volumes": scene.record["flags"] & SCENE_HAS_MEDIA,
        "passes of light groups": settings.light_groups,
        "bakes": context.camera.texels,
    }
    found = [name for name, is_there in hindrances.items() if is_there]
    if found and settings.sss_walks == "SHARED":
        scene.warnings.add("Render", "Random Walks", f"are each pixel's own with {' and '.join(found)}")
    return not found
