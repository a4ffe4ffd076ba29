"""Light tiles of a scene (kernels.lights.tiles): their memory, and what lamps are drawn by."""

from __future__ import annotations

import weakref

import numpy as np

from ..kernels.core import records as rec
from ..kernels.core.memory import address
from ..kernels.lights.tile_weights import FIELDS, LANES
from ..kernels.lights.tiles import fill_tiles, sample_tiles

SIZE, CANDIDATES = 1024, 64
_FEWEST, _MOST, _WIDTH = 4, 64, 18


def tile_count(pixels: int) -> int:
    """How many tiles a film needs, one for each _WIDTH pixels of the edge of a square as large.

    All pixels share all points, which must not cost more to draw than to use; shadow rays to fewer of them find more of
    what they need in the processor's cache.
    """
    return min(max(round(pixels**0.5 / _WIDTH), _FEWEST), _MOST)


def _withdraw(lights, tiles: int) -> None:
    if lights.record["tiles"] == tiles:
        lights.record["tiles"] = 0


class LightTiles:
    """Makes a committed scene's light samples resampled ones, as long as this object lives and until `release`, after
    which light samples are drawn for their receivers again.

    `entries` are TILE_ENTRY (tiles, size), `emission` float32 (tiles, groups, FIELDS, LANES) of the same points.
    Before each frame all tiles are to be filled. A later commit of the scene needs another object.

    Raises ValueError where size is no multiple of LANES.
    """

    def __init__(self, scene, tiles: int = _MOST, size: int = SIZE, candidates: int = CANDIDATES) -> None:
        self.count = tiles
        self._scene = scene
        groups = size // LANES
        if size % LANES or not groups:
            raise ValueError(f"a tile's size must be a multiple of {LANES}, not {size}")
        self.entries = np.zeros((tiles, size), rec.TILE_ENTRY)
        self.emission = np.zeros((tiles, groups, FIELDS, LANES), np.float32)
        self._lamps = np.concatenate([[0.0], np.cumsum(scene.lights.weights)])
        if self._lamps[-1] > 0.0:
            self._lamps /= self._lamps[-1]
        self._record = np.zeros(1, rec.LIGHT_TILES)
        record = self._record[0]
        record["entries"], record["emission"] = address(self.entries), address(self.emission)
        record["n_tiles"], record["groups"] = tiles, groups
        record["candidates"] = min(candidates, size)
        record["lamp_cdf"] = address(self._lamps)
        record["code"] = sample_tiles.address
        scene.lights.prepare_reuse(scene)
        scene.lights.record["tiles"] = address(self._record)
        self.release = weakref.finalize(self, _withdraw, scene.lights, address(self._record))

    def fill(self, seed: int, scratch: np.ndarray, first: int = 0, last: int | None = None) -> None:
        """Draw the points of tiles [first, last) for the frame of this seed; threads can share the tiles out."""
        fill_tiles(self._scene.record, address(scratch), seed, first, self.count if last is None else last)
