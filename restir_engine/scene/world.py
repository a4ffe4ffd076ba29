"""The world's program, and the map by which kernels choose bright directions of it."""

from __future__ import annotations

import math
import os
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field

import numpy as np

from ..kernels import records as rec
from ..kernels.memory import address
from ..kernels.world import bake_world

# Share of the samples that is uniform over the sphere, so that light which the map missed is found.
_UNIFORM = 0.03

# Share of the samples that goes to a sun of the sky, when it has one.
_SUN = 0.5


@dataclass(eq=False)
class World:
    """What surrounds the scene.

    material: index of its program, -1: black. map_width: pixels around the horizon of the importance map; 0: light is
    not sampled there, rays find it (right for a constant world). sun: direction and angular diameter of a small bright
    disk in it, which no map resolves.
    """

    material: int = -1
    visibility: int = rec.RAY_ALL
    map_width: int = 0
    max_bounces: int = 1024
    casts_shadow: bool = True
    sun: tuple[tuple[float, float, float], float] | None = None
    mean: float = field(default=0.0, init=False)  # mean luminance over the sphere, known when sampled

    def __post_init__(self) -> None:
        self._record = np.zeros(1, rec.WORLD_TABLE)
        self._marginal = np.zeros(0, np.float32)
        self._conditional = np.zeros(0, np.float32)
        self._baked = None

    @property
    def sampled(self) -> bool:
        """Whether light sampling chooses the world; known after `commit`."""
        return self.material >= 0 and self.map_width > 0 and self.mean > 0.0

    @property
    def record(self) -> np.void:
        """The WORLD_TABLE record."""
        return self._record[0]

    def commit(self, scene) -> None:
        """Bake the map where the program is new, and put the world into the scene's record."""
        record = scene.record
        record["world_material"] = self.material
        record["world_visibility"] = self.visibility
        record["world_table"] = address(self._record)
        table = self._record[0]
        table["max_bounces"] = self.max_bounces
        table["no_shadow"] = not self.casts_shadow
        if self.material < 0 or self.map_width <= 0:
            self.mean = 0.0
            return
        program = scene.shaders[self.material]
        if self._baked is None or self._baked[0] is not program or self._baked[1] != self.map_width:
            self._baked = program, self.map_width
            self._bake(scene)

    def _bake(self, scene) -> None:
        width = int(np.clip(self.map_width, 16, 8192))
        height = max(width // 2, 8)
        values = np.zeros((height, width), np.float32)
        rows = np.linspace(0, height, min(height, 64) + 1).astype(int)

        def bake(first: int, last: int) -> None:
            scratch = np.zeros(rec.SCRATCH_BYTES, np.uint8)
            bake_world(scene.record, address(scratch), address(values), width, height, int(first), int(last))

        bake(0, 0)  # compiles, or loads from the cache, in one thread
        with ThreadPoolExecutor(os.cpu_count()) as pool:
            list(pool.map(bake, rows[:-1], rows[1:]))
        heights = -np.cos(np.pi * np.arange(height + 1) / height)
        bands = np.diff(heights)
        self.mean = float((values.mean(axis=1, dtype=np.float64) * bands).sum() / 2.0)
        table = self._record[0]
        table["width"] = table["height"] = 0
        table["map"], table["sun"], table["uniform"] = 0.0, 0.0, 1.0
        if self.mean > 0.0:
            self._conditional, self._marginal = importance_map(values, bands)
            table["width"], table["height"] = width, height
            table["marginal"], table["conditional"] = address(self._marginal), address(self._conditional)
            table["map"], table["uniform"] = 1.0 - _UNIFORM, _UNIFORM
        if self.sun is not None:
            direction, angle = self.sun
            table["sun_direction"] = np.asarray(direction) / np.linalg.norm(direction)
            table["sun_one_minus_cos"] = 2.0 * math.sin(0.25 * max(angle, 1e-4)) ** 2
            table["map"] *= 1.0 - _SUN
            table["uniform"] *= 1.0 - _SUN
            table["sun"] = _SUN


def importance_map(values: np.ndarray, bands: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(conditional [height, width + 1], marginal [height + 1]): cumulated distributions of a map, float32.

    values: luminance at pixels; bands: height on the unit sphere of each row. Every pixel takes part of its
    neighbours' light, since interpolation spreads the light of an image's pixel that far.
    """
    values = 0.5 * values + 0.25 * (np.roll(values, 1, axis=1) + np.roll(values, -1, axis=1))
    padded = np.concatenate([values[:1], values, values[-1:]])
    values = 0.5 * values + 0.25 * (padded[:-2] + padded[2:])
    rows = values.sum(axis=1, dtype=np.float64)
    conditional = np.zeros((values.shape[0], values.shape[1] + 1))
    np.cumsum(values, axis=1, dtype=np.float64, out=conditional[:, 1:])
    conditional /= np.where(rows > 0.0, rows, 1.0)[:, None]
    conditional[:, -1] = 1.0
    marginal = np.concatenate([[0.0], np.cumsum(rows * bands)])
    marginal /= marginal[-1]
    marginal[-1] = 1.0
    return np.ascontiguousarray(conditional, np.float32), marginal.astype(np.float32)
