"""The views of a render: cameras, or the eyes of one, that look at one scene. Blender has an engine render them all."""

from __future__ import annotations

import numpy as np

from ..scene.camera import Camera
from ..scene.warnings import Warnings
from .camera import Eye, sync_camera

_SIDES = {"left": -1, "right": 1}


class Views:
    """What the running render of an engine has to show of its scene; without an engine, what the scene's camera sees.

    names: as Blender calls the views; "" where there is but one.
    """

    def __init__(self, engine=None) -> None:
        self._engine = engine
        result = engine.get_result() if engine else None
        self.names = tuple(view.name for view in result.views) if result else ("",)

    def cameras(self, depsgraph, warnings: Warnings) -> tuple[Camera, ...]:
        """What sees each view, as the evaluated depsgraph is now."""
        return tuple(sync_camera(depsgraph, warnings, eye=self._eye(depsgraph, name)) for name in self.names)

    def objects(self, depsgraph) -> list:
        """The camera object of each view."""
        return [eye.camera if (eye := self._eye(depsgraph, name)) else depsgraph.scene.camera for name in self.names]

    def _eye(self, depsgraph, name: str) -> Eye | None:
        if self._engine is None:
            return None
        self._engine.active_view_set(name)
        camera = self._engine.camera_override  # also that of a scene strip, or the one with the view's suffix
        if camera is None or camera.type != "CAMERA":
            return None
        camera = camera.evaluated_get(depsgraph)
        spherical = self._engine.use_spherical_stereo(camera)
        return Eye(
            camera,
            np.array(self._engine.camera_model_matrix(camera, use_spherical_stereo=spherical)),
            self._engine.camera_shift_x(camera, use_spherical_stereo=spherical),
            _SIDES.get(name, 0) if spherical else 0,
        )
