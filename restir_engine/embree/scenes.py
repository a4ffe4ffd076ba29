"""Acceleration structures: one bottom-level scene a mesh, one top-level scene of instances."""

import numpy as np

from . import library as lib


class _Scene:
    """Owner of an RTCScene."""

    def __init__(self, flags: int, quality: int) -> None:
        self._device = lib.device()
        self._rtc = self._device.library
        self.handle = self._rtc.rtcNewScene(self._device.handle)
        self._rtc.rtcSetSceneFlags(self.handle, flags)
        self._rtc.rtcSetSceneBuildQuality(self.handle, quality)

    def close(self) -> None:
        """Give the scene back to Embree; harmless when called twice."""
        if self.handle:
            self._rtc.rtcReleaseScene(self.handle)
            self.handle = 0

    def __del__(self) -> None:
        self.close()

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Lower and upper corner, float32 (3,)."""
        box = np.zeros(8 + 4, np.float32)
        start = (-box.ctypes.data // 4) % 4  # RTCBounds is 16-byte aligned
        self._rtc.rtcGetSceneBounds(self.handle, box.ctypes.data + 4 * start)
        return box[start : start + 3].copy(), box[start + 4 : start + 7].copy()


class MeshScene(_Scene):
    """The triangles of one mesh, in object space.

    vertices: float32 (n, 3), C-contiguous, with 4 readable bytes behind the last row (16-byte loads);
    triangles: uint32 (m, 3). Both are shared with Embree, which means that they must live as long as this.
    """

    def __init__(self, vertices: np.ndarray, triangles: np.ndarray) -> None:
        super().__init__(lib.SCENE_ROBUST | lib.SCENE_ARGUMENT_FILTER, lib.QUALITY_MEDIUM)
        self._arrays = (vertices, triangles)
        geometry = self._rtc.rtcNewGeometry(self._device.handle, lib.TRIANGLES)
        for kind, fmt, array in (
            (lib.BUFFER_VERTEX, lib.FLOAT3, vertices),
            (lib.BUFFER_INDEX, lib.UINT3, triangles),
        ):
            self._rtc.rtcSetSharedGeometryBuffer(geometry, kind, 0, fmt, array.ctypes.data, 0, 12, len(array))
        self._rtc.rtcSetGeometryMask(geometry, lib.INVALID)
        self._rtc.rtcCommitGeometry(geometry)
        self._rtc.rtcAttachGeometryByID(self.handle, geometry, 0)
        self._rtc.rtcReleaseGeometry(geometry)
        self._rtc.rtcCommitScene(self.handle)
        self._device.check()


class InstanceScene(_Scene):
    """Instances of mesh scenes; the geometry ID that a ray reports is the row of the arrays given here."""

    def __init__(self, scenes: list[MeshScene], transforms: np.ndarray, masks: np.ndarray) -> None:
        """scenes: one an instance; transforms: float (n, 12), row-major 3x4; masks: integers (n,), 0: left out."""
        super().__init__(lib.SCENE_ROBUST | lib.SCENE_ARGUMENT_FILTER, lib.QUALITY_MEDIUM)
        self._scenes = scenes
        matrices = np.ascontiguousarray(transforms, np.float32)
        for index, (scene, mask) in enumerate(zip(scenes, masks.tolist(), strict=True)):
            if not mask:
                continue
            geometry = self._rtc.rtcNewGeometry(self._device.handle, lib.INSTANCE)
            self._rtc.rtcSetGeometryInstancedScene(geometry, scene.handle)
            self._rtc.rtcSetGeometryTransform(geometry, 0, lib.FLOAT3X4_ROW_MAJOR, matrices.ctypes.data + 48 * index)
            self._rtc.rtcSetGeometryMask(geometry, mask)
            self._rtc.rtcCommitGeometry(geometry)
            self._rtc.rtcAttachGeometryByID(self.handle, geometry, index)
            self._rtc.rtcReleaseGeometry(geometry)
        self._rtc.rtcCommitScene(self.handle)
        self._device.check()
