"""Grids of voxels: attributes of the space inside of a mesh."""

from __future__ import annotations

import numpy as np

from ..kernels.core.memory import address
from ..kernels.core.records import DOMAIN_VOXEL, VOXELS
from .mesh import Mesh


class VoxelAttribute:
    """A grid of values under an interned name; stands among the `Attribute`s of a mesh.

    values: (nx, ny, nz) or (nx, ny, nz, components) with zeros at its six sides, of which linear interpolation makes a
    continuous function that is 0 outside; to_index: 3x4, from object space to indices of values.
    """

    domain = DOMAIN_VOXEL

    def __init__(self, name: int, values: np.ndarray, to_index: np.ndarray) -> None:
        values = np.ascontiguousarray(values, np.float32)
        self.name = name
        self.values = values.reshape(*values.shape[:3], -1)
        self.to_index = np.array(to_index, np.float64)[:3]
        self.table = np.zeros(1, VOXELS)
        record = self.table[0]
        record["nx"], record["ny"], record["nz"], record["components"] = self.values.shape
        record["to_index"], record["values"] = self.to_index.ravel(), address(self.values)

    @property
    def components(self) -> int:
        return self.values.shape[3]

    @property
    def to_object(self) -> np.ndarray:
        """3x4, from indices to object space."""
        return np.linalg.inv(np.vstack([self.to_index, (0.0, 0.0, 0.0, 1.0)]))[:3]

    def corners(self) -> np.ndarray:
        """The eight corners of the box that the values fill, (8, 3) in object space."""
        last = np.array(self.values.shape[:3]) - 1.0
        corners = np.stack(np.meshgrid(*([0.0, end] for end in last), indexing="ij"), -1).reshape(8, 3)
        return corners @ self.to_object[:, :3].T + self.to_object[:, 3]


# The two triangles of each side of a box whose corners are numbered by bits, x the highest; they look outwards.
_SIDES = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
_TRIANGLES = np.array([(a, b, c) for a, b, c, d in _SIDES] + [(a, c, d) for a, b, c, d in _SIDES], np.uint32)


def box_mesh(name: str, grids: list[VoxelAttribute]) -> Mesh:
    """A box around grids of voxels, which are its attributes; that of the first one where all have its place."""
    corners = grids[0].corners()
    if any(not same_place(grid, grids[0]) for grid in grids[1:]):
        points = np.concatenate([grid.corners() for grid in grids])
        low, high = points.min(0), points.max(0)
        corners = np.stack(np.meshgrid(*zip(low, high, strict=True), indexing="ij"), -1).reshape(8, 3)
    triangles = _TRIANGLES
    edges = corners[[4, 2, 1]] - corners[0]
    if np.linalg.det(edges) < 0.0:
        triangles = triangles[:, ::-1]
    size = np.maximum(corners.max(0) - corners.min(0), 1e-20)
    return Mesh(
        corners,
        triangles,
        name=name,
        attributes=list(grids),
        generated_offset=tuple(corners.min(0)),
        generated_scale=tuple(1.0 / size),
    )


def same_place(a: VoxelAttribute, b: VoxelAttribute) -> bool:
    """Whether two grids have the same voxels."""
    return a.values.shape[:3] == b.values.shape[:3] and np.allclose(a.to_index, b.to_index, rtol=1e-6, atol=1e-6)
