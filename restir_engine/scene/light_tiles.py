"""Light tiles of a scene (kernels.lights.tiles): their memory, and what lamps are drawn by."""

from __future__ import annotations

import numpy as np

from ..kernels.core import records as rec
from ..kernels.core.memory import address
from ..kernels.lights.tile_weights import FIELDS, LANES
from ..kernels.lights.tiles import sample_tiles
from .record_owner import RecordOwner

SIZE, CANDIDATES = 1024, 64
_FEWEST, _MOST, _WIDTH = 4, 64, 18


def tile_count(pixels: int) -> int:
    """How many tiles a film needs, one for each _WIDTH pixels of the edge of a square as large.

    All pixels share all points, which must not cost more to draw than to use; shadow rays to fewer of them find more of
    what they need in the processor's cache.
    """
    return min(max(round(pixels**0.5 / _WIDTH), _FEWEST), _MOST)


def has_choice(scene) -> bool:
    """Whether there is anything to choose among: more than one lamp, luminous meshes, a world that is sampled."""
    lights = scene.lights.record
    return scene.record["n_lights"] > 1 or lights["triangles"] > 0.0 or lights["world"] > 0.0


class LightTiles(RecordOwner):
    """Light tiles of a frame of a committed scene; `FrameContext` makes its light samples resampled ones by them.

    `entries` are TILE_ENTRY (tiles, size), `emission` float32 (tiles, groups, FIELDS, LANES) of the same points. The
    context fills the tiles. control_variates: whether light samples have one, which is the light of many lamps at once.

    Raises ValueError where size is no multiple of LANES.
    """

    def __init__(
        self, scene, tiles: int = _MOST, size: int = SIZE, candidates: int = CANDIDATES, control_variates: bool = True
    ) -> None:  # fmt: skip
        self.count = tiles
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
        record["control_variates"] = control_variates
        record["apart"] = scene.lights.record["world"] if scene.world.has_portals else 0.0
        record["lamp_cdf"] = address(self._lamps)
        record["code"] = sample_tiles.address
