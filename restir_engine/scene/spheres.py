"""Spheres, which stand for the points of point clouds, as arrays that kernels and Embree read in place."""

from __future__ import annotations

from dataclasses import InitVar, dataclass, field

import numpy as np

from ..embree.scenes import SphereScene
from ..kernels.core.records import SHAPE_SPHERES
from ..kernels.geometry.shapes import FILTERS
from .shape import Shape


@dataclass(eq=False)
class Spheres(Shape):
    """Spheres about positions (n, 3) with radii (n,). One with a number that is not finite is a point: never hit."""

    positions: InitVar[np.ndarray]
    radii: InitVar[np.ndarray]
    _points: np.ndarray = field(init=False)

    def __post_init__(self, positions: np.ndarray, radii: np.ndarray) -> None:
        positions = np.asarray(positions, np.float32).reshape(-1, 3)
        self._points = np.empty((len(positions), 4), np.float32)
        self._points[:, :3], self._points[:, 3] = positions, radii
        if not np.isfinite(self._points).all():
            self._points[~np.isfinite(self._points).all(axis=1)] = 0.0
        np.maximum(self._points[:, 3], 0.0, out=self._points[:, 3])

    @property
    def arrays(self) -> dict[str, np.ndarray | None]:
        return super().arrays | {"points": self._points}

    @property
    def form(self) -> tuple[np.ndarray, ...]:
        return self._points, self.steps

    @property
    def points(self) -> np.ndarray:
        return self._points

    def tree(self) -> SphereScene:
        return SphereScene(SHAPE_SPHERES, self._points, FILTERS[SHAPE_SPHERES].address, self.steps)

    def record(self, attributes: np.ndarray | None = None) -> np.void:
        result = super().record(attributes)
        result["shape"] = SHAPE_SPHERES
        return result
