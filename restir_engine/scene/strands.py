"""Strands of hair, as arrays that kernels and Embree read in place."""

from __future__ import annotations

from dataclasses import InitVar, dataclass, field

import numpy as np

from ..embree import library
from ..embree.scenes import StrandScene
from ..kernels.core.records import MESH, SHAPE_CONES, SHAPE_RIBBONS, SHAPE_TUBES
from ..kernels.geometry.shapes import FILTERS
from .shape import Shape

_KINDS = {
    SHAPE_RIBBONS: library.FLAT_CATMULL_ROM,
    SHAPE_TUBES: library.ROUND_CATMULL_ROM,
    SHAPE_CONES: library.ROUND_LINEAR,
}


@dataclass(eq=False)
class Strands(Shape):
    """Strands along points: ribbons that face the ray, round tubes (both along Catmull-Rom curves), or cones.

    positions: (n, 3); radii: (n,); offsets: (strands + 1,), where the points of each strand begin. Strands of less than
    two points, or with any that is not finite, have no segments. pieces: of a ribbon's segment, which are flat. slots:
    of a material, (strands,); None: all 0.
    """

    positions: InitVar[np.ndarray]
    radii: InitVar[np.ndarray]
    offsets: InitVar[np.ndarray]
    shape: int = SHAPE_RIBBONS
    pieces: int = 4
    slots: InitVar[np.ndarray | None] = None
    _offsets: np.ndarray = field(init=False)
    _points: np.ndarray = field(init=False)
    _segments: np.ndarray = field(init=False)
    _strands: np.ndarray = field(init=False)

    def __post_init__(
        self, positions: np.ndarray, radii: np.ndarray, offsets: np.ndarray, slots: np.ndarray | None
    ) -> None:
        """Lay out points, segments and strands as MESH has them."""
        positions, offsets = np.asarray(positions, np.float32).reshape(-1, 3), np.asarray(offsets, np.int64)
        counts = np.diff(offsets)
        # Indices of half the size are a third of the memory that is needed meanwhile.
        owner = np.repeat(np.arange(len(counts), dtype=np.int32), counts)
        # Each strand's first and last points stand twice: these are the outer points of its first and last curves.
        places = np.arange(1, len(positions) + 1, dtype=np.int32) + 2 * owner
        points = np.zeros((len(positions) + 2 * len(counts), 4), np.float32)
        points[places, :3], points[places, 3] = positions, radii
        full = np.flatnonzero(counts > 0)
        first, last = offsets[full] + 2 * full, offsets[full + 1] + 2 * full + 1
        points[first], points[last] = points[first + 1], points[last - 1]
        good = counts > 1
        if not np.isfinite(points).all():
            bad = ~np.isfinite(points).all(axis=1)
            good[owner[bad[places]]] = False
            points[bad] = 0.0
        points[:, 3] = np.maximum(points[:, 3], 0.0)
        number = np.where(good, counts - 1, 0)
        self._strands = np.repeat(np.arange(len(counts), dtype=np.int32), number)
        # The first segment of a strand begins with its first row of points, each other one a row later.
        first = offsets[:-1] + 2 * np.arange(len(counts)) - (np.cumsum(number) - number)
        self._segments = np.arange(len(self._strands), dtype=np.uint32)
        self._segments += first.astype(np.uint32)[self._strands]
        self._points, self._offsets = points, offsets
        if slots is not None:
            self.material_slots = np.asarray(slots, np.int32)[self._strands]

    def __len__(self) -> int:
        return len(self._offsets) - 1

    @property
    def count(self) -> int:
        """How many segments there are."""
        return len(self._segments)

    def roots(self) -> np.ndarray:
        """The first points of all strands, (strands, 3); of one without points, some other's."""
        first = self._offsets[:-1] + 2 * np.arange(len(self._offsets) - 1)
        return self._points[np.minimum(first, len(self._points) - 1), :3]

    def lengths(self) -> tuple[np.ndarray, np.ndarray]:
        """At each point its strand's length up to there over all of it (0 where that is 0); those of all strands."""
        counts = np.diff(self._offsets)
        owner = np.repeat(np.arange(len(counts)), counts)
        places = np.arange(len(owner)) + 2 * owner + 1
        steps = np.linalg.norm(self._points[places, :3] - self._points[places - 1, :3], axis=1).astype(np.float64)
        along = np.cumsum(steps)
        full = counts > 0
        before = np.zeros(len(counts))
        before[full] = along[self._offsets[:-1][full]]  # where strands start: their first step is 0
        along -= before[owner]
        total = np.zeros(len(counts))
        total[full] = along[self._offsets[1:][full] - 1]
        share = total[owner]
        return along / np.where(share > 0.0, share, 1.0), total

    @property
    def arrays(self) -> dict[str, np.ndarray | None]:
        own = {"points": self._points, "segments": self._segments, "strands": self._strands}
        return super().arrays | own

    @property
    def form(self) -> tuple[np.ndarray, ...]:
        return self._points, self._segments, self._strands, self.steps

    @property
    def points(self) -> np.ndarray:
        return self._points

    def tree(self) -> StrandScene:
        return StrandScene(
            self.shape,
            _KINDS[self.shape],
            self._points,
            self._segments,
            self._strands,
            self.pieces,
            FILTERS[self.shape].address if self.shape in FILTERS else 0,
            np.array([self.record()], MESH),
            self.steps,
        )

    def record(self, attributes: np.ndarray | None = None) -> np.void:
        result = super().record(attributes)
        result["shape"], result["pieces"], result["n_segments"] = self.shape, self.pieces, self.count
        return result
