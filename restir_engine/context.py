"""What belongs to a frame and not to its scene: the camera, the media that it may stand in, the light tiles."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from .kernels.core import records as rec
from .kernels.core.memory import address
from .kernels.lights.tiles import fill_tiles
from .scene.light_tiles import LightTiles
from .scene.record_owner import RecordOwner

if TYPE_CHECKING:
    from .scene.camera import Camera
    from .scene.scene import Scene


class FrameContext(RecordOwner):
    """A committed scene as a frame sees it.

    camera: who looks, where that is not the scene's own camera. tiles: what light samples are resampled from, to be
    filled before each frame; None: they are drawn for their receiver. caught: the frame in which paths go on that a
    shadow catcher has caught; None: this one.

    Kernels get `record`, a SCENE record of this context's own: that of the scene with what belongs to the frame put
    in. The scene itself is only read, so that any number of contexts can share it, on any threads.
    """

    def __init__(
        self,
        scene: Scene,
        camera: Camera | None = None,
        tiles: LightTiles | None = None,
        caught: FrameContext | None = None,
    ) -> None:
        self.scene, self.camera, self.tiles, self._caught = scene, camera or scene.camera, tiles, caught
        self._camera = np.array([self.camera.record()], rec.CAMERA)
        self._lights = np.array([scene.lights.record], rec.LIGHT_TABLE)
        if tiles:
            self._lights[0]["tiles"] = tiles.address
        self._record = np.array([scene.record], rec.SCENE)
        self._record[0]["light_table"] = address(self._lights)
        self._record[0]["camera"] = address(self._camera)
        self._record[0]["caught"] = caught.address if caught else 0
        self._record[0]["camera_in_media"] = self._may_start_in_media()
        for array in (self._camera, self._lights, self._record):
            array.flags.writeable = False

    @property
    def camera_record(self) -> np.void:
        """The CAMERA record, likewise."""
        return self._camera[0]

    def with_tiles(self, tiles: LightTiles | None) -> FrameContext:
        """The same frame, its light samples resampled from `tiles`, where there are any."""
        return FrameContext(self.scene, self.camera, tiles)

    def fill_tiles(self, seed: int, scratch: np.ndarray, first: int = 0, last: int | None = None) -> None:
        """Draw the points of light tiles [first, last) for the frame of this seed; threads can share the tiles out."""
        fill_tiles(self.record, address(scratch), seed, first, self.tiles.count if last is None else last)

    def _may_start_in_media(self) -> bool:
        """Whether camera rays may start inside a medium: the world's, or a mesh's by its bounding box."""
        if self.scene.record["flags"] & rec.SCENE_WORLD_MEDIUM:
            return True
        low, high = self.camera.origins()
        return any(np.all(lower <= high) and np.all(upper >= low) for lower, upper in self.scene.media_bounds)
