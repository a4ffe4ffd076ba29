"""Acceleration structures: scenes of single shapes, and the world that holds triangles and instances of these."""

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

    def _attach_triangles(
        self, vertices: np.ndarray, triangles: np.ndarray, steps: np.ndarray | None, index: int, mask: int
    ) -> None:
        """Attach triangles under the geometry ID `index`; the arrays must live as long as this scene.

        steps: see `MeshScene`.
        """
        places = lib.BUFFER_VERTEX, lib.FLOAT3, vertices
        self._attach(
            self._geometry(lib.TRIANGLES, steps, places, (lib.BUFFER_INDEX, lib.UINT3, triangles)), index, mask
        )

    def _geometry(self, kind: int, steps: np.ndarray | None, *buffers: tuple[int, int, np.ndarray]) -> int:
        """A new geometry over (buffer, format, array), a row an element; the arrays must live as long as this scene.

        steps: what takes the place of the first buffer at even distances of time from 0 to 1, (steps, rows, …), which
        may have more rows than that; None: it stands still.
        """
        geometry = self._rtc.rtcNewGeometry(self._device.handle, kind)
        moments = buffers[0][2][None] if steps is None else steps
        self._rtc.rtcSetGeometryTimeStepCount(geometry, len(moments))
        slots = [(slot, *buffers[0][:2], moment, len(buffers[0][2])) for slot, moment in enumerate(moments)]
        slots += [(0, *buffer, len(buffer[2])) for buffer in buffers[1:]]
        for slot, buffer, fmt, array, count in slots:
            start, stride = array.ctypes.data, array.strides[0]
            self._rtc.rtcSetSharedGeometryBuffer(geometry, buffer, slot, fmt, start, 0, stride, count)
        return geometry

    def _attach(self, geometry: int, index: int, mask: int) -> None:
        self._rtc.rtcSetGeometryMask(geometry, mask)
        self._rtc.rtcCommitGeometry(geometry)
        self._rtc.rtcAttachGeometryByID(self.handle, geometry, index)
        self._rtc.rtcReleaseGeometry(geometry)

    def _commit(self) -> None:
        self._rtc.rtcCommitScene(self.handle)
        self._device.check()


class ShapeScene(_Scene):
    """The primitives of one shape, in object space; the geometry ID that a ray reports tells which kind they are."""

    def __init__(self, flags: int = 0) -> None:
        super().__init__(flags | lib.SCENE_ROBUST | lib.SCENE_ARGUMENT_FILTER, lib.QUALITY_MEDIUM)

    def _filter(self, geometry: int, function: int, data: np.ndarray | None = None) -> None:
        """Let the function at an address refuse hits (RTCFilterFunctionNArguments); 0: none. data: its user data."""
        if function:
            self._rtc.rtcSetGeometryUserData(geometry, 0 if data is None else data.ctypes.data)
            self._rtc.rtcSetGeometryIntersectFilterFunction(geometry, function)
            self._rtc.rtcSetGeometryOccludedFilterFunction(geometry, function)


class MeshScene(ShapeScene):
    """The triangles of one mesh, in object space; their geometry ID is 0.

    vertices: float32 (n, 3), C-contiguous, with 4 readable bytes behind the last row (16-byte loads);
    triangles: uint32 (m, 3). steps: where vertices are at even distances of time from 0 to 1, float32
    (steps, n + 2, 3); None: they stand still. All are shared with Embree, and must live as long as this.
    """

    def __init__(self, vertices: np.ndarray, triangles: np.ndarray, steps: np.ndarray | None = None) -> None:
        super().__init__()
        self._arrays = (vertices, triangles, steps)
        self._attach_triangles(vertices, triangles, steps, 0, lib.INVALID)
        self._commit()


class StrandScene(ShapeScene):
    """Segments of strands under the geometry ID `index`; kind: ROUND_LINEAR or one of the Catmull-Rom curves.

    points: float32 (n, 4), place and radius; segments: uint32 (m,), the first of the four points of each, of which it
    leads from the second to the third; strands: int32 (m,), whose segment it is. pieces: by which flat curves are
    approximated, a segment; filter, data: see `_filter`; steps: of points, as of `MeshScene`, (steps, n, 4).
    Compact, it needs a seventh of the memory, and rays through it take 7 to 20 % longer.
    """

    def __init__(
        self,
        index: int,
        kind: int,
        points: np.ndarray,
        segments: np.ndarray,
        strands: np.ndarray,
        pieces: int,
        filter: int,
        data: np.ndarray,
        steps: np.ndarray | None = None,
    ) -> None:
        super().__init__(lib.SCENE_COMPACT)
        buffers = [(lib.BUFFER_VERTEX, lib.FLOAT4, points)]
        if kind == lib.ROUND_LINEAR:
            same = strands[1:] == strands[:-1]
            flags = np.zeros(len(segments), np.uint8)
            flags[1:] |= np.where(same, lib.CURVE_NEIGHBOR_LEFT, 0).astype(np.uint8)
            flags[:-1] |= np.where(same, lib.CURVE_NEIGHBOR_RIGHT, 0).astype(np.uint8)
            buffers += [(lib.BUFFER_INDEX, lib.UINT, segments + np.uint32(1)), (lib.BUFFER_FLAGS, lib.UCHAR, flags)]
        else:
            buffers += [(lib.BUFFER_INDEX, lib.UINT, segments)]
        self._arrays = buffers, data, steps
        geometry = self._geometry(kind, steps, *buffers)
        self._rtc.rtcSetGeometryTessellationRate(geometry, pieces)
        self._filter(geometry, filter, data)
        self._attach(geometry, index, lib.INVALID)
        self._commit()


class SphereScene(ShapeScene):
    """Spheres under the geometry ID `index`.

    points: float32 (n, 4), place and radius; filter: see `_filter`; steps: of points, as of `MeshScene`, (steps, n, 4).
    """

    def __init__(self, index: int, points: np.ndarray, filter: int, steps: np.ndarray | None = None) -> None:
        super().__init__()
        self._arrays = points, steps
        geometry = self._geometry(lib.SPHERES, steps, (lib.BUFFER_VERTEX, lib.FLOAT4, points))
        self._filter(geometry, filter)
        self._attach(geometry, index, lib.INVALID)
        self._commit()


@dataclass(frozen=True)
class Placed:
    """What stands at one place of the world: an instance of `scene`, or triangles in world space.

    steps: of triangles that deform, see `MeshScene`; of an instance that moves, transforms (steps, 12) float32 at even
    distances of time from 0 to 1.
    """

    mask: int
    transform: np.ndarray  # float32 (12,), row-major 3x4
    scene: ShapeScene | None = None
    vertices: np.ndarray | None = None
    triangles: np.ndarray | None = None
    steps: np.ndarray | None = None


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
                self._attach_triangles(placed.vertices, placed.triangles, placed.steps, index, placed.mask)
                continue
            geometry = self._rtc.rtcNewGeometry(self._device.handle, lib.INSTANCE)
            self._rtc.rtcSetGeometryInstancedScene(geometry, placed.scene.handle)
            moments = placed.transform[None] if placed.steps is None else placed.steps
            self._rtc.rtcSetGeometryTimeStepCount(geometry, len(moments))
            start, stride = moments.ctypes.data, moments.strides[0]
            for step in range(len(moments)):
                self._rtc.rtcSetGeometryTransform(geometry, step, lib.FLOAT3X4_ROW_MAJOR, start + step * stride)
            self._attach(geometry, index, placed.mask)
        self._commit()
