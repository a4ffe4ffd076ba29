"""The world's program, and the map by which kernels choose bright directions of it."""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from ..kernels.core import records as rec
from ..kernels.core.memory import address
from ..kernels.lights.world import bake_world, measure_world
from .record_owner import RecordOwner

if TYPE_CHECKING:
    from .scene import Scene

# Part of the mean that every pixel of the map has beside its own light, so that light which the map missed is found. A
# technique of its own for it would spoil the stratification of the others: 15 % more noise under an HDRI.
_FLOOR = 0.005

# Bounds of the share of the samples that goes to a sun of the sky, when it has one.
_SUN_SHARE = (0.2, 0.8)

# The share of the samples that goes through portals where any faces the point, beside a map; as wide as a map is that
# only the mean is asked of.
_PORTAL_SHARE = 0.5
_COARSE = 16


@dataclass
class World:
    """What surrounds the scene.

    material: index of its program, -1: black. map_width: pixels around the horizon of the importance map; 0: light is
    not sampled there, rays find it (right for a constant world). sun_angle: diameter of a small bright disk that is
    somewhere in it, 0: there is none. light_group, medium_group: the light groups of what it emits, and of what its
    medium does; -1: none.
    """

    material: int = -1
    seen_by: int = rec.RAY_ALL
    map_width: int = 0
    max_bounces: int = 1024
    casts_shadow: bool = True
    sun_angle: float = 0.0
    light_group: int = -1
    medium_group: int = -1


class WorldTable(RecordOwner):
    """The importance map of a world in a scene that is being committed, whose programs are in place.

    portals: LIGHT (1,) each, see `Lamps`. mean: luminance over the sphere, 0 where it is not sampled.
    """

    def __init__(self, scene: Scene, world: World, portals: Sequence[np.ndarray] = ()) -> None:
        self.material, self.mean = world.material, 0.0
        self._world = replace(world)
        self.portals = np.concatenate([np.zeros(0, rec.LIGHT), *portals])
        self._asked = list(map(bytes, portals))
        self._sun_angle = world.sun_angle
        self._record = np.zeros(1, rec.WORLD_TABLE)
        self._marginal = np.zeros(0, np.float32)
        self._conditional = np.zeros(0, np.float32)
        self._guide = np.zeros(0, np.uint16)
        self._record[0]["max_bounces"] = world.max_bounces
        self._record[0]["no_shadow"] = not world.casts_shadow
        if world.material >= 0 and (world.map_width > 0 or len(self.portals)):
            self._bake(scene, world.map_width or _COARSE)
        if self.sampled and len(self.portals):
            self._commit_portals(world.map_width > 0)
        self._record.flags.writeable = False

    def _commit_portals(self, has_map: bool) -> None:
        """Let directions be drawn through portals, and by the map where there is one."""
        table = self._record[0]
        self.portals["importance"] *= self.mean
        self.portals.flags.writeable = False
        table["n_portals"], table["portals"] = len(self.portals), address(self.portals)
        table["portal"] = _PORTAL_SHARE if has_map else 1.0
        if not has_map:
            table["map"] = table["sun"] = 0.0

    @property
    def has_portals(self) -> bool:
        """Whether directions are drawn through portals."""
        return self._record[0]["n_portals"] > 0

    def serves(self, scene: Scene, world: World, portals: Sequence[np.ndarray], before: Scene) -> bool:
        """Whether this table of the scene `before` is what `world` would get in another one that is being committed.

        Light that depends on who looks keeps the map that it has had.
        """
        if world != self._world or not scene.looks_up_as(before):
            return False
        if list(map(bytes, portals)) != self._asked:
            return False
        return world.material < 0 or scene.shaders[world.material] is before.shaders[world.material]

    @property
    def sampled(self) -> bool:
        """Whether light sampling chooses the world."""
        return self.mean > 0.0

    def _bake(self, scene: Scene, width: int) -> None:
        width = int(np.clip(width, 16, 8192))
        height = max(width // 2, 8)
        values = np.zeros((height, width), np.float32)
        rows = np.linspace(0, height, min(height, 64) + 1).astype(int)

        def bake(first: int, last: int) -> None:
            scratch = np.zeros(rec.SCRATCH_BYTES, np.uint8)
            bake_world(scene.record, address(scratch), address(values), width, height, int(first), int(last))

        bake(0, 0)  # compiles, or loads from the cache, in one thread
        with ThreadPoolExecutor(os.cpu_count()) as pool:
            list(pool.map(bake, rows[:-1], rows[1:]))
        bands = np.diff(-np.cos(np.pi * np.arange(height + 1) / height))
        self.mean = float((values.mean(axis=1, dtype=np.float64) * bands).sum() / 2.0)
        table = self._record[0]
        if self.mean <= 0.0:
            return
        sun = self._find_sun(scene, values) if self._sun_angle > 0.0 else None
        if sun is not None:
            direction, half_angle, flux = sun
            rest = float((values.mean(axis=1, dtype=np.float64) * bands).sum() * 2.0 * np.pi)
            self.mean = (flux + rest) / (4.0 * np.pi)
            table["sun_direction"] = direction
            table["sun_one_minus_cos"] = 2.0 * math.sin(0.5 * half_angle) ** 2
            table["sun"] = np.clip(flux / (flux + rest), *_SUN_SHARE)
        table["irradiance"] = irradiance_polynomial(values, bands)
        if sun is not None:
            table["irradiance"] += flux * cosine_polynomial(np.asarray(sun[0])[None])[0]
        self._put_map(values + np.float32(_FLOOR * (values.mean(axis=1) * bands).sum() / 2.0), bands)
        table["map"] = 1.0 - table["sun"]

    def _put_map(self, values: np.ndarray, bands: np.ndarray) -> None:
        table = self._record[0]
        self._conditional, self._marginal = importance_map(values, bands)
        self._guide = guide(self._conditional)
        table["height"], table["width"] = values.shape
        for name, array in (("marginal", self._marginal), ("conditional", self._conditional), ("guide", self._guide)):
            array.flags.writeable = False
            table[name] = address(array)

    def _find_sun(self, scene: Scene, values: np.ndarray) -> tuple[np.ndarray, float, float] | None:
        """(direction, half angle, irradiance at normal incidence) of a cone about the sun; it is cut out of the map.

        None where no single spot of its size stands out.
        """
        height, width = values.shape
        bright = values > 0.1 * values.max()
        if values.max() < 20.0 * self.mean or bright.sum() > 0.01 * values.size:
            return None
        rows, columns = np.nonzero(bright)
        around = map_directions((columns + 0.5) / width, (rows + 0.5) / height)
        center = around.sum(axis=0)
        center /= np.linalg.norm(center)
        pixel = 2.0 * math.pi / width
        half = 0.5 * self._sun_angle
        if np.arccos(np.clip(around @ center, -1.0, 1.0)).max() > half + 2.0 * pixel:
            return None
        # A finer look, to make the cone no wider than needed.
        reach = half + 2.0 * pixel
        n = 128
        x, y = (reach * (2.0 * (np.arange(n) + 0.5) / n - 1.0) for _ in range(2))
        x, y = (grid.ravel() for grid in np.meshgrid(x, y))
        side = np.cross(center, [1.0, 0.0, 0.0] if abs(center[0]) < 0.9 else [0.0, 1.0, 0.0])
        side /= np.linalg.norm(side)
        fine = center + np.outer(x, side) + np.outer(y, np.cross(center, side))
        fine /= np.linalg.norm(fine, axis=1)[:, None]
        fine = np.ascontiguousarray(fine)
        light = np.zeros(n * n)
        scratch = np.zeros(rec.SCRATCH_BYTES, np.uint8)
        measure_world(scene.record, address(scratch), address(fine), n * n, address(light))
        seen = light > 0.01 * light.max()
        if not seen.any():
            return None
        center = fine[seen].sum(axis=0)
        center /= np.linalg.norm(center)
        half = float(np.arccos(np.clip(fine[seen] @ center, -1.0, 1.0)).max()) + 2.0 * reach / n
        values[bright] = min(values[bright].min(), values[~bright].max())
        return center, half, float(light[seen].sum() * (2.0 * reach / n) ** 2)


def map_directions(u: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Unit vectors (n, 3) at map coordinates."""
    phi, theta = (0.5 - u) * 2.0 * np.pi, (1.0 - v) * np.pi
    return np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=-1)


def cosine_polynomial(directions: np.ndarray) -> np.ndarray:
    """What light from unit directions (n, 3) lays on a surface with normal (x, y, z), about max(cos, 0): (n, 9).

    Coefficients of 1, y, z, x, xy, yz, 3z² - 1, xz, x² - y² (Ramamoorthi and Hanrahan 2001, equations 3 and 8).
    """
    x, y, z = directions.T
    one = np.ones_like(x)
    basis = np.stack([one, y, z, x, x * y, y * z, 3.0 * z * z - 1.0, x * z, x * x - y * y], axis=1)
    squared = np.array([1.0, 3.0, 3.0, 3.0, 15.0, 15.0, 1.25, 15.0, 3.75]) / (4.0 * np.pi)  # of the harmonics' factors
    decay = np.pi * np.array([1.0, 2 / 3, 2 / 3, 2 / 3, 0.25, 0.25, 0.25, 0.25, 0.25])
    return basis * squared * decay


def irradiance_polynomial(values: np.ndarray, bands: np.ndarray) -> np.ndarray:
    """The irradiance of a map by the normal, as coefficients (9,) of `cosine_polynomial`'s monomials."""
    height, width = values.shape
    rows, columns = (np.linspace(0, size, min(size, 128) + 1).astype(int)[:-1] for size in (height, width))
    flux = values * (bands * 2.0 * np.pi / width)[:, None]
    flux = np.add.reduceat(np.add.reduceat(flux, rows, axis=0), columns, axis=1)
    v = (rows + np.append(rows[1:], height)) / (2.0 * height)
    u = (columns + np.append(columns[1:], width)) / (2.0 * width)
    directions = map_directions(*(grid.ravel() for grid in np.meshgrid(u, v)))
    return flux.ravel() @ cosine_polynomial(directions)


def importance_map(values: np.ndarray, bands: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(conditional [height, width + 1], marginal [height + 1]): cumulated distributions of a map, float32.

    values: luminance at pixels; bands: height on the unit sphere of each row. A pixel has the mean of what linear
    interpolation between their middles makes of it and its neighbours.
    """
    values = 0.75 * values + 0.125 * (np.roll(values, 1, axis=1) + np.roll(values, -1, axis=1))
    padded = np.concatenate([values[:1], values, values[-1:]])
    values = 0.75 * values + 0.125 * (padded[:-2] + padded[2:])
    rows = values.sum(axis=1, dtype=np.float64)
    conditional = np.zeros((values.shape[0], values.shape[1] + 1))
    np.cumsum(values, axis=1, dtype=np.float64, out=conditional[:, 1:])
    conditional /= np.where(rows > 0.0, rows, 1.0)[:, None]
    conditional[:, -1] = 1.0
    marginal = np.concatenate([[0.0], np.cumsum(rows * bands)])
    marginal /= marginal[-1]
    marginal[-1] = 1.0
    return np.ascontiguousarray(conditional, np.float32), marginal.astype(np.float32)


def guide(conditional: np.ndarray) -> np.ndarray:
    """For each row of a cumulated distribution the last index whose value is at most i / width: [height, width]."""
    height, width = conditional.shape[0], conditional.shape[1] - 1
    first = np.ceil(conditional[:, 1:width].astype(np.float64) * width).astype(np.int64)
    first += np.arange(height)[:, None] * (width + 1)
    counts = np.bincount(first.ravel(), minlength=height * (width + 1)).reshape(height, width + 1)
    return np.cumsum(counts[:, :width], axis=1).astype(np.uint16)
