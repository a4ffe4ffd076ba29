"""The tree by which emissive triangles are chosen: kernels.lights.emitter_tree, built level by level."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..kernels.core import records as rec
from ..kernels.core.memory import address
from ..kernels.lights.emitter_tree import CENTER, INTENSITY, NODE, NORMAL, RADIUS, TOP

_MOST_LEAVES = 1 << 18  # about; with more triangles a leaf is a run of some
_GRID = 1 << 10  # cells along an edge for the order of leaves


class Run(NamedTuple):
    """Runs of a mesh's emissive triangles in object space, one row each."""

    low: np.ndarray  # (n, 3) corners of bounding boxes
    high: np.ndarray
    intensity: np.ndarray  # (n,) mean intensity; of single triangles that at their normal
    normal: np.ndarray  # (n, 3) unit for single triangles that emit on one side, twice that for two; else 0


def _spread(cells: np.ndarray) -> np.ndarray:
    """Ten bits of each with two zeros between neighbours; uint32."""
    x = cells.astype(np.uint32)
    for shift, mask in ((16, 0x030000FF), (8, 0x0300F00F), (4, 0x030C30C3), (2, 0x09249249)):
        x = (x | x << np.uint32(shift)) & np.uint32(mask)
    return x


def morton_order(points: np.ndarray) -> np.ndarray:
    """The order of points (n, 3) along a Z-curve: what is near in it is near in space."""
    low, size = points.min(0), np.ptp(points, axis=0).max()
    x, y, z = ((points - low) * ((_GRID - 1) / max(size, 1e-30))).T
    return np.argsort(_spread(x) | _spread(y) << np.uint32(1) | _spread(z) << np.uint32(2), kind="stable")


def normals_and_areas(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Unit normals (n, 3), zero where there is no area, and areas (n,) of triangles with corners (n, 3)."""
    normals = np.cross(b - a, c - a)
    length = np.sqrt(np.einsum("ij,ij->i", normals, normals))
    normals /= np.where(length > 0.0, length, 1.0)[:, None]
    return normals, 0.5 * length


def runs(corners: tuple, normals: np.ndarray, power: np.ndarray, both: np.ndarray, run: int) -> Run:
    """Runs of `run` triangles each, which stand in their order.

    corners: three (n, 3); power: radiance times area (n,); both: whether both sides emit (n,).
    """
    starts = np.arange(0, len(power), run)
    a, b, c = corners
    low = np.minimum.reduceat(np.minimum(np.minimum(a, b), c), starts)
    high = np.maximum.reduceat(np.maximum(np.maximum(a, b), c), starts)
    if run == 1:
        return Run(low, high, power, normals * np.where(both, 2.0, 1.0)[:, None])
    # The mean of the cosine over directions: 1/2 of both sides, 1/4 of one.
    return Run(low, high, np.add.reduceat(power * np.where(both, 0.5, 0.25), starts), np.zeros_like(low))


def is_closed(triangles: np.ndarray) -> bool:
    """Whether triangles (n, 3) have each edge twice, once in each direction; too many are not looked at."""
    if len(triangles) > _MOST_LEAVES:
        return False
    start, end = triangles.astype(np.int64).T[[[0, 1, 2], [1, 2, 0]]].reshape(2, -1)
    size = int(triangles.max()) + 1 if len(triangles) else 0
    there, back = np.sort(start * size + end), np.sort(end * size + start)
    return len(there) > 0 and np.array_equal(there, back) and bool((there[1:] != there[:-1]).all())


def run_length(triangles: int) -> int:
    """How many triangles a leaf takes, of so many over all emitters."""
    return max(1, -(-triangles // _MOST_LEAVES))


class EmitterTree:
    """Owner of an EMITTER_TREE over the leaves of all emitters, which follow one another emitter by emitter."""

    def __init__(self, run: int) -> None:
        self.run = run
        self._leaves: list[tuple[np.ndarray, ...]] = []
        self._count = 0
        self._record = np.zeros(1, rec.EMITTER_TREE)

    def add(
        self, emitters: np.ndarray, matrices: np.ndarray, growth: np.ndarray, runs: Run, reach: np.ndarray
    ) -> np.ndarray:
        """Add the leaves of emitters (n,) with the same runs; the first leaf of each.

        matrices: object to world (n, 3, 4); growth: of areas by them (n,); reach: how far from there they may be while
        the shutter is open (n,), 0 for those that stand still. What moves may face any way.
        """
        n, m = len(emitters), len(runs.intensity)
        linear = matrices[:, :, :3]
        middle, half = 0.5 * (runs.high + runs.low), 0.5 * (runs.high - runs.low)
        center = np.einsum("nij,mj->nmi", linear, middle) + matrices[:, None, :, 3]
        extent = np.einsum("nij,mj->nmi", np.abs(linear), half) + reach[:, None, None]
        # Normals go by the inverse transposed, which is the cofactors' matrix but for its size.
        x, y, z = linear[:, :, 0], linear[:, :, 1], linear[:, :, 2]
        cofactors = np.stack([np.cross(y, z), np.cross(z, x), np.cross(x, y)], axis=2)
        cofactors *= np.sign(np.linalg.det(linear))[:, None, None]
        normal = np.einsum("nij,mj->nmi", cofactors, runs.normal)
        length = np.linalg.norm(normal, axis=2, keepdims=True)
        size = np.linalg.norm(runs.normal, axis=1)[None, :, None]
        normal = np.divide(normal * size, length, out=np.zeros_like(normal), where=length > 0.0)
        normal[reach > 0.0] = 0.0
        intensity = growth[:, None] * runs.intensity
        owners = np.stack(np.broadcast_arrays(emitters[:, None], np.arange(m)), axis=2).astype(np.int32)
        columns = (center, extent, normal, owners)
        self._leaves.append((*(column.reshape(n * m, -1) for column in columns), intensity.ravel()))
        first = self._count + m * np.arange(n)
        self._count += n * m
        return first

    def build(self) -> np.ndarray:
        """The EMITTER_TREE record (1,), valid as long as this tree lives."""
        center, extent, normal, owners, intensity = (np.concatenate(part) for part in zip(*self._leaves, strict=True))
        self._leaves.clear()
        order = morton_order(center)
        count = len(order)
        width = 1 << max(count - 1, 0).bit_length()
        self.places = np.empty(count, np.int32)
        self.places[order] = np.arange(count, dtype=np.int32)
        self.leaves = np.full((width, 2), -1, np.int32)
        self.leaves[:count] = owners[order]
        self.nodes = np.zeros((2 * width, NODE), np.float32)
        leaves = self.nodes[width : width + count]
        leaves[:, CENTER : CENTER + 3] = center[order]
        leaves[:, RADIUS] = np.linalg.norm(extent[order], axis=1)
        leaves[:, INTENSITY] = intensity[order]
        leaves[:, NORMAL : NORMAL + 3] = normal[order]
        self._merge(width, count, (center - extent)[order], (center + extent)[order])
        record = self._record[0]
        record["width"], record["top"], record["run"] = width, min(width, TOP), self.run
        for name in ("nodes", "places", "leaves"):
            record[name] = address(getattr(self, name))
        return self._record

    def _merge(self, width: int, count: int, low: np.ndarray, high: np.ndarray) -> None:
        """Fill the nodes above the leaves; places without a leaf have no extent and no light."""
        rest = width - count
        low = np.concatenate([low, np.full((rest, 3), np.inf)])
        high = np.concatenate([high, np.full((rest, 3), -np.inf)])
        leaves = self.nodes[width:]
        length2 = (leaves[:, NORMAL : NORMAL + 3].astype(np.float64) ** 2).sum(1)
        intensity = leaves[:, INTENSITY] * np.where(length2 > 2.0, 0.5, np.where(length2 > 0.0, 0.25, 1.0))
        while width > 1:
            width //= 2
            low = np.minimum(low[0::2], low[1::2])
            high = np.maximum(high[0::2], high[1::2])
            intensity = intensity[0::2] + intensity[1::2]
            nodes = self.nodes[width : 2 * width]
            some = np.isfinite(low[:, 0])
            nodes[some, CENTER : CENTER + 3] = 0.5 * (low[some] + high[some])
            nodes[some, RADIUS] = 0.5 * np.linalg.norm(high[some] - low[some], axis=1)
            nodes[:, INTENSITY] = intensity
