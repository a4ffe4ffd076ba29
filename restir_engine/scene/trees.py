"""Acceleration structures of meshes, kept from scene to scene."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..embree.scenes import MeshScene, Placed
from .mesh import Mesh, moved
from .recent import Recent

# Triangles of a mesh that is worth a structure of its own where it stands in the world only once. Smaller ones are
# built anew into the tree over the world, which is traversed faster than many trees below it.
LARGE = 50_000

_HERE = np.eye(3, 4, dtype=np.float32).ravel()


class _Kept(NamedTuple):
    """What is known of a shape; its arrays are kept with it, so that nothing else takes their identity."""

    mesh: Mesh
    tree: MeshScene | None
    place: bytes = b""  # of the structure in world space, or where the shape stood last


class Trees:
    """Owner of the bottom-level structures that the scenes of this frame and of the one before have used.

    A mesh is known again by its arrays of vertices and triangles, which do not change once they are committed.
    """

    def __init__(self) -> None:
        self._own: Recent[_Kept] = Recent()  # structures in object space
        self._standing: Recent[_Kept] = Recent()  # structures in world space
        self._seen: Recent[_Kept] = Recent()

    def next_frame(self) -> None:
        """Give up what the last frame did not use."""
        for recent in (self._own, self._standing, self._seen):
            recent.next_frame()

    def of(self, mesh: Mesh) -> MeshScene:
        """The structure of a mesh in object space."""
        shape = _shape(mesh)
        kept = self._own.get(shape) or self._own.put(shape, _Kept(mesh, MeshScene(mesh.vertices, mesh.triangles)))
        return kept.tree

    def place(self, mesh: Mesh, transform: np.ndarray, mask: int) -> Placed:
        """A mesh at its only place, float32 (12,).

        What is small or seen for the first time goes into the tree over the world. A large mesh that stands where it
        stood gets a structure in world space, whose hits are the same to the last bit; one that has moved gets the
        structure of its own.
        """
        if len(mesh.triangles) < LARGE:
            return _in_world(mesh, transform, mask)
        shape, place = _shape(mesh), transform.tobytes()
        before = self._seen.get(shape)
        self._seen.put(shape, _Kept(mesh, None, place))
        if self._own.get(shape) or (before and before.place != place):
            return Placed(mask, transform, scene=self.of(mesh))
        if before is None:
            return _in_world(mesh, transform, mask)
        standing = self._standing.get(shape)
        if standing is None or standing.place != place:
            tree = MeshScene(moved(mesh.vertices, transform.reshape(3, 4)), mesh.triangles)
            standing = self._standing.put(shape, _Kept(mesh, tree, place))
        return Placed(mask, _HERE, scene=standing.tree)


def _in_world(mesh: Mesh, transform: np.ndarray, mask: int) -> Placed:
    vertices = moved(mesh.vertices, transform.reshape(3, 4))
    return Placed(mask, transform, vertices=vertices, triangles=mesh.triangles)


def _shape(mesh: Mesh) -> tuple[int, int]:
    return id(mesh.vertices), id(mesh.triangles)
