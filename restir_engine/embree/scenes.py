"""Acceleration structures: scenes of single meshes, and the world that holds triangles and instances of them."""

from dataclasses import dataclass

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

    def _attach_triangles(self, vertices: np.ndarray, triangles: np.ndarray, index: int, mask: int) -> None:
        """Attach triangles under the geometry ID `index`; the arrays must live as long as this scene."""
        geometry = self._rtc.rtcNewGeometry(self._device.handle, lib.TRIANGLES)
        for kind, fmt, array in (
            (lib.BUFFER_VERTEX, lib.FLOAT3, vertices),
            (lib.BUFFER_INDEX, lib.UINT3, triangles),
        ):
            self._rtc.rtcSetSharedGeometryBuffer(geometry, kind, 0, fmt, array.ctypes.data, 0, 12, len(array))
        self._attach(geometry, index, mask)

    def _attach(self, geometry: int, index: int, mask: int) -> None:
        self._rtc.rtcSetGeometryMask(geometry, mask)
        self._rtc.rtcCommitGeometry(geometry)
        self._rtc.rtcAttachGeometryByID(self.handle, geometry, index)
        self._rtc.rtcReleaseGeometry(geometry)

    def _commit(self) -> None:
        self._rtc.rtcCommitScene(self.handle)
        self._device.check()


class MeshScene(_Scene):
    """The triangles of one mesh, in object space.

    vertices: float32 (n, 3), C-contiguous, with 4 readable bytes behind the last row (16-byte loads);
    triangles: uint32 (m, 3). Both are shared with Embree, which means that they must live as long as this.
    """

    def __init__(self, vertices: np.ndarray, triangles: np.ndarray) -> None:
        super().__init__(lib.SCENE_ROBUST | lib.SCENE_ARGUMENT_FILTER, lib.QUALITY_MEDIUM)
        self._arrays = (vertices, triangles)
        self._attach_triangles(vertices, triangles, 0, lib.INVALID)
        self._commit()


@dataclass(frozen=True)
class Placed:
    """What stands at one place of the world: an instance of `scene`, or triangles in world space."""

    mask: int
    transform: np.ndarray  # float32 (12,), row-major 3x4
    scene: MeshScene | None = None
    vertices: np.ndarray | None = None
    triangles: np.ndarray | None = None


class WorldScene(_Scene):
    """Everything that rays meet; the ID that a ray reports is the index into `content`, mask 0 leaves one out.

    Triangles that stand in the world only once are put here themselves rather than as an instance: one tree over all
    of them is traversed faster than many below an instance each.
    """

    def __init__(self, content: list[Placed]) -> None:
        super().__init__(lib.SCENE_ROBUST | lib.SCENE_ARGUMENT_FILTER, lib.QUALITY_MEDIUM)
        self._content = content
        for index, placed in enumerate(content):
            if not placed.mask:
                continue
            if placed.scene is None:
                self._attach_triangles(placed.vertices, placed.triangles, index, placed.mask)
                continue
            geometry = self._rtc.rtcNewGeometry(self._device.handle, lib.INSTANCE)
            self._rtc.rtcSetGeometryInstancedScene(geometry, placed.scene.handle)
            self._rtc.rtcSetGeometryTransform(geometry, 0, lib.FLOAT3X4_ROW_MAJOR, placed.transform.ctypes.data)
            self._attach(geometry, index, placed.mask)
        self._commit()
