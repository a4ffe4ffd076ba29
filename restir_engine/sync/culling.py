"""Culling of a simplified scene: which objects stand beside the camera's frame or far from it, as Cycles decides."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..scene.camera import Camera


class Culled(NamedTuple):
    """How an object may be left out, and the corners of its bounding box in object space, (8, 3)."""

    by_camera: bool
    by_distance: bool
    corners: np.ndarray


class Culling:
    """What the evaluated scene and its objects ask for; `camera`: who looks."""

    def __init__(self, scene, camera: Camera) -> None:
        settings = getattr(scene, "cycles", None)
        simple = settings is not None and scene.render.use_simplify and not scene.render.use_multiview
        simple = simple and camera.kind != "PANO"
        self._by_camera = simple and settings.use_camera_cull
        self._by_distance = simple and settings.use_distance_cull and settings.distance_cull_margin > 0.0
        if simple:
            self._margin, self._distance = settings.camera_cull_margin, settings.distance_cull_margin
        self._camera = camera

    def of(self, item) -> Culled | None:
        """How an evaluated object may be left out; None: not at all."""
        by_camera = self._by_camera and item.cycles.use_camera_cull
        by_distance = self._by_distance and item.cycles.use_distance_cull
        return Culled(by_camera, by_distance, np.array(item.bound_box)) if by_camera or by_distance else None

    def culled(self, culled: Culled, matrices: np.ndarray) -> np.ndarray:
        """Which placements (n, 12) of an object are left out: by both tests, where both are asked for."""
        linear = matrices.reshape(-1, 3, 4)
        corners = np.einsum("nij,kj->nki", linear[:, :, :3], culled.corners) + linear[:, None, :, 3]
        result = np.ones(len(matrices), bool)
        if culled.by_camera:
            result &= self._outside(corners)
        if culled.by_distance:
            place = np.array(self._camera.to_world, np.float64)[:3, 3]
            nearest = np.clip(place, corners.min(1), corners.max(1))
            result &= np.linalg.norm(nearest - place, axis=1) > self._distance
        return result

    def _outside(self, corners: np.ndarray) -> np.ndarray:
        """Which boxes (n, 8, 3) lie outside of the rendered frame, a margin in units of its size around it."""
        camera = self._camera
        to_camera = camera.record()["to_camera"].reshape(3, 4)
        x, y, z = np.moveaxis(corners @ to_camera[:, :3].T + to_camera[:, 3], -1, 0)
        near, far, away = camera.clip_start, camera.clip_end, -z
        depth = (away - near) / (far - near)  # as in clip space: from 0 to its w
        if camera.kind == "PERSP":
            depth = depth * far
            away = np.where(away == 0.0, 1e-30, away)
            x, y = x / away, y / away
        left, right, bottom, top = camera.screen
        start_x, start_y, width, height = camera.region or (0, 0, camera.width, camera.height)
        x = ((x - left) / (right - left) * camera.width - start_x) / width
        y = ((y - bottom) / (top - bottom) * camera.height - start_y) / height
        x, y = np.where(depth < 0.0, 1.0 - x, x), np.where(depth < 0.0, 1.0 - y, y)
        margin = self._margin
        beside = (x.min(1) >= 1.0 + margin) | (y.min(1) >= 1.0 + margin)
        beside |= (x.max(1) <= -margin) | (y.max(1) <= -margin)
        return beside | (depth < -margin).all(1)
