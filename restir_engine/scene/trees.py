"""Acceleration structures of shapes, kept from scene to scene."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..embree.scenes import MeshScene, Placed, ShapeScene
from .displacement import Moved
from .mesh import Mesh, moved
from .recent import Recent
from .shape import Shape

# Triangles of a mesh that may have a structure of its own where it stands in the world only once. Smaller ones are
# built anew into the tree over the world.
LARGE = 100_000

# Triangles from which a mesh is always instanced where that is wanted: an edit of anything builds the tree over the
# world again, which then has an entry of it in place of its triangles.
INSTANCED = 1_000

# Seconds by which a triangle lengthens the building of the tree over the world, and by how much rays are slower that
# have to enter trees below it (4 to 10 %): a long render is done sooner with all triangles in the tree over the world.
_BUILT, _SLOWER = 0.6e-6, 0.07

_HERE = np.eye(3, 4, dtype=np.float32).ravel()


class _Kept(NamedTuple):
    """What is known of a shape; its arrays are kept with it, so that nothing else takes their identity."""

    shape: Shape
    tree: ShapeScene | None
    place: bytes = b""  # of the structure in world space, or where the shape stood last


class Trees:
    """Owner of the bottom-level structures that the scenes of this frame and of the one before have used.

    A shape is known again by the arrays of its form, which do not change once they are committed. The pictures are the
    same to the last bit whatever is kept; but where meshes are `instanced`, as in the 3D view. `moved`: what displaced
    meshes have become.
    """

    def __init__(self, instanced: bool = False) -> None:
        self._instanced = instanced
        self._rendered = 0.0  # seconds
        self._large = self._large_before = 0  # triangles of large meshes in the scenes of a frame
        self._own: Recent[_Kept] = Recent()  # structures in object space
        self._standing: Recent[_Kept] = Recent()  # structures in world space
        self._seen: Recent[_Kept] = Recent()
        self.moved: Recent[Moved] = Recent()

    def next_frame(self) -> None:
        """Give up what the last frame did not use."""
        for recent in (self._own, self._standing, self._seen, self.moved):
            recent.next_frame()
        self._large, self._large_before = 0, self._large

    def rendered(self, seconds: float) -> None:
        """Tell how long the last scene was rendered, where what is built is rendered but once."""
        self._rendered = seconds

    def of(self, shape: Shape) -> ShapeScene:
        """The structure of a shape in object space."""
        key = _identity(shape)
        kept = self._own.get(key) or self._own.put(key, _Kept(shape, shape.tree()))
        return kept.tree

    def place(self, mesh: Mesh, transform: np.ndarray, mask: int) -> Placed:
        """A mesh at its only place, float32 (12,).

        What is small or seen for the first time goes into the tree over the world. A large mesh that stands where it
        stood gets a structure in world space.
        """
        if self._instanced and len(mesh.triangles) >= INSTANCED:
            return Placed(mask, transform, scene=self.of(mesh))
        if len(mesh.triangles) < LARGE or mesh.steps is not None:
            return _in_world(mesh, transform, mask)
        self._large += len(mesh.triangles)
        shape, place = _identity(mesh), transform.tobytes()
        before = self._seen.get(shape)
        self._seen.put(shape, _Kept(mesh, None, place))
        pays = max(self._large, self._large_before) * _BUILT > self._rendered * _SLOWER
        if before is None or not pays or before.place != place:
            return _in_world(mesh, transform, mask)
        standing = self._standing.get(shape)
        if standing is None or standing.place != place:
            tree = MeshScene(moved(mesh.vertices, transform.reshape(3, 4)), mesh.triangles)
            standing = self._standing.put(shape, _Kept(mesh, tree, place))
        return Placed(mask, _HERE, scene=standing.tree)


def _in_world(mesh: Mesh, transform: np.ndarray, mask: int) -> Placed:
    matrix = transform.reshape(3, 4)
    steps = None
    if mesh.steps is not None:
        steps = np.stack([np.add(step @ matrix[:, :3].T, matrix[:, 3], dtype=np.float32) for step in mesh.steps])
    return Placed(mask, transform, vertices=moved(mesh.vertices, matrix), triangles=mesh.triangles, steps=steps)


def _identity(shape: Shape) -> tuple[int, ...]:
    return tuple(id(array) for array in shape.form)
