"""Finding and loading the Embree library that the embreex wheel ships, and its C API."""

import ctypes
import importlib.util
import os
from ctypes import c_bool, c_char_p, c_float, c_int, c_size_t, c_ssize_t, c_uint, c_void_p
from functools import cache
from pathlib import Path

import llvmlite.binding

TRIANGLES, ROUND_LINEAR, SPHERES, ROUND_CATMULL_ROM, FLAT_CATMULL_ROM, INSTANCE = 0, 16, 50, 58, 59, 121
BUFFER_INDEX, BUFFER_VERTEX, BUFFER_FLAGS = 0, 1, 32
UCHAR, UINT, UINT3, FLOAT3, FLOAT4, FLOAT3X4_ROW_MAJOR = 0x1001, 0x5001, 0x5003, 0x9003, 0x9004, 0x9134
CURVE_NEIGHBOR_LEFT, CURVE_NEIGHBOR_RIGHT = 1, 2
SCENE_COMPACT, SCENE_ROBUST, SCENE_ARGUMENT_FILTER = 2, 4, 8
QUALITY_MEDIUM = 1
RAY_MASK_SUPPORTED = 64
INVALID = 0xFFFFFFFF

_API = {
    # name: (result, arguments)
    "rtcNewDevice": (c_void_p, [c_char_p]),
    "rtcReleaseDevice": (None, [c_void_p]),
    "rtcGetDeviceProperty": (c_ssize_t, [c_void_p, c_int]),
    "rtcGetDeviceError": (c_int, [c_void_p]),
    "rtcGetDeviceLastErrorMessage": (c_char_p, [c_void_p]),
    "rtcNewScene": (c_void_p, [c_void_p]),
    "rtcReleaseScene": (None, [c_void_p]),
    "rtcSetSceneFlags": (None, [c_void_p, c_int]),
    "rtcSetSceneBuildQuality": (None, [c_void_p, c_int]),
    "rtcCommitScene": (None, [c_void_p]),
    "rtcGetSceneBounds": (None, [c_void_p, c_void_p]),
    "rtcNewGeometry": (c_void_p, [c_void_p, c_int]),
    "rtcReleaseGeometry": (None, [c_void_p]),
    "rtcCommitGeometry": (None, [c_void_p]),
    "rtcSetGeometryMask": (None, [c_void_p, c_uint]),
    "rtcSetGeometryBuildQuality": (None, [c_void_p, c_int]),
    "rtcSetGeometryTessellationRate": (None, [c_void_p, c_float]),
    "rtcSetGeometryUserData": (None, [c_void_p, c_void_p]),
    "rtcSetGeometryIntersectFilterFunction": (None, [c_void_p, c_void_p]),
    "rtcSetGeometryOccludedFilterFunction": (None, [c_void_p, c_void_p]),
    "rtcAttachGeometryByID": (None, [c_void_p, c_void_p, c_uint]),
    "rtcDetachGeometry": (None, [c_void_p, c_uint]),
    "rtcSetSharedGeometryBuffer": (
        None,
        [c_void_p, c_int, c_uint, c_int, c_void_p, c_size_t, c_size_t, c_size_t],
    ),
    "rtcUpdateGeometryBuffer": (None, [c_void_p, c_int, c_uint]),
    "rtcSetGeometryInstancedScene": (None, [c_void_p, c_void_p]),
    "rtcSetGeometryTransform": (None, [c_void_p, c_uint, c_int, c_void_p]),
    "rtcSetGeometryTimeStepCount": (None, [c_void_p, c_uint]),
    "rtcIntersect1": (None, [c_void_p, c_void_p, c_void_p]),
    "rtcSetDeviceMemoryMonitorFunction": (None, [c_void_p, c_void_p, c_void_p]),
}

# What kernels call by symbol: rtc* in the library, restir_rtc* in LLVM.
QUERIES = ("rtcIntersect1", "rtcOccluded1", "rtcOccluded8")


class EmbreeError(RuntimeError):
    """Embree is missing or has refused something."""


def find_library() -> Path:
    """The path of the embree4 library in the installed embreex wheel.

    Raises EmbreeError when embreex is not installed or has no library in it.
    """
    spec = importlib.util.find_spec("embreex")
    if spec is None or not spec.origin:
        raise EmbreeError("the Python package “embreex” is missing: reinstall the extension for this Blender version")
    package = Path(spec.origin).parent
    for folder in (package.parent / "embreex.libs", package / ".dylibs", package):
        for pattern in ("libembree4*.so*", "embree4*.dll", "libembree4*.dylib"):
            for path in sorted(folder.glob(pattern)):
                return path
    raise EmbreeError(f"no Embree library in {package}: reinstall the extension for this platform")


@cache
def load() -> ctypes.CDLL:
    """The loaded library with the C API's signatures; registers the queries with LLVM."""
    path = find_library()
    if hasattr(os, "add_dll_directory"):
        os.add_dll_directory(str(path.parent))
    library = ctypes.CDLL(str(path))
    for name, (result, arguments) in _API.items():
        function = getattr(library, name)
        function.restype = result
        function.argtypes = arguments
    for name in QUERIES:
        pointer = ctypes.cast(getattr(library, name), c_void_p).value
        llvmlite.binding.add_symbol("restir_" + name, pointer)
    return library


_MONITOR = ctypes.CFUNCTYPE(c_bool, c_void_p, c_ssize_t, c_bool)


class Device:
    """The Embree device of this process; `memory` is the bytes that Embree has allocated."""

    def __init__(self) -> None:
        self.library = load()
        self.handle = self.library.rtcNewDevice(b"")
        if not self.handle:
            raise EmbreeError("Embree could not start on this processor")
        self.memory = 0
        self._monitor = _MONITOR(self._count)
        self.library.rtcSetDeviceMemoryMonitorFunction(self.handle, ctypes.cast(self._monitor, c_void_p), None)

    def _count(self, _pointer, size, _post) -> bool:
        self.memory += size
        return True

    def check(self) -> None:
        """Raise EmbreeError if the last calls failed."""
        code = self.library.rtcGetDeviceError(self.handle)
        if code:
            raise EmbreeError(f"Embree error {code}")

    @property
    def ray_masks(self) -> bool:
        return bool(self.library.rtcGetDeviceProperty(self.handle, RAY_MASK_SUPPORTED))


@cache
def device() -> Device:
    """The one device; Embree devices are thread-safe."""
    return Device()
