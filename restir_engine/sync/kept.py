"""What renders leave to those that follow: meshes and their acceleration structures."""

from __future__ import annotations

from collections.abc import Hashable

from ..scene.trees import Trees
from .mesh_cache import MeshCache


class Kept:
    """Owner of what the view layers of a frame share, and the frames of an animation."""

    def __init__(self) -> None:
        self.meshes = MeshCache()
        self.trees = Trees()
        self._frame: Hashable = None

    def begin(self, frame: Hashable) -> None:
        """Before a view layer of a frame is read: with a new frame, what the last one did not use is given up."""
        if frame != self._frame:
            self._frame = frame
            self.meshes.next_frame()
            self.trees.next_frame()
