"""Open Image Denoise through the shared library that Blender ships."""

from __future__ import annotations

import ctypes
import logging
import os
from ctypes import POINTER, c_bool, c_char_p, c_int, c_size_t, c_void_p
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from .scene.warnings import Warnings
from .settings import SHADOW_CATCHER

if TYPE_CHECKING:
    from .film import Film  # which needs compiled code, and a panel asks here for the library

log = logging.getLogger(__name__)

QUALITIES = {"FAST": 4, "BALANCED": 5, "HIGH": 6}
_DEVICE_CPU, _FLOAT3 = 1, 3
_NAMES = ("libOpenImageDenoise.so.2", "OpenImageDenoise.dll", "libOpenImageDenoise.dylib")

_API = {
    "oidnNewDevice": (c_void_p, [c_int]),
    "oidnCommitDevice": (None, [c_void_p]),
    "oidnReleaseDevice": (None, [c_void_p]),
    "oidnGetDeviceError": (c_int, [c_void_p, POINTER(c_char_p)]),
    "oidnNewFilter": (c_void_p, [c_void_p, c_char_p]),
    "oidnSetSharedFilterImage": (
        None,
        [c_void_p, c_char_p, c_void_p, c_int, c_size_t, c_size_t, c_size_t, c_size_t, c_size_t],
    ),
    "oidnSetFilterBool": (None, [c_void_p, c_char_p, c_bool]),
    "oidnSetFilterInt": (None, [c_void_p, c_char_p, c_int]),
    "oidnCommitFilter": (None, [c_void_p]),
    "oidnExecuteFilter": (None, [c_void_p]),
    "oidnReleaseFilter": (None, [c_void_p]),
}


class _Folders:
    known: tuple[Path, ...] = ()


def configure(folders: list[Path]) -> None:
    """Where to look for Blender's library, besides the libraries that this process has loaded."""
    _Folders.known = tuple(folders)


def find_library() -> Path | None:
    """The path of Blender's Open Image Denoise library, None where this Blender was built without it."""
    folders = list(_Folders.known)
    maps = Path("/proc/self/maps")
    if maps.exists():
        loaded = [line.split()[-1] for line in maps.read_text().splitlines() if "OpenImageDenoise" in line]
        folders += [Path(path).parent for path in dict.fromkeys(loaded)]
    for folder in folders:
        for name in _NAMES:
            if (folder / name).exists():
                return folder / name
    return None


def _load(path: Path) -> ctypes.CDLL:
    if hasattr(os, "add_dll_directory"):
        os.add_dll_directory(str(path.parent))
    library = ctypes.CDLL(str(path))
    for name, (result, arguments) in _API.items():
        function = getattr(library, name)
        function.restype, function.argtypes = result, arguments
    return library


def filter_image(
    color: np.ndarray, albedo: np.ndarray | None, normal: np.ndarray | None, quality: str = "HIGH"
) -> np.ndarray:
    """Denoise a scene-linear HDR image; all arrays are float32 (height, width, 3). Returns a new array.

    Raises RuntimeError with the library's own words when it refuses, or when there is none.
    """
    path = find_library()
    if path is None:
        raise RuntimeError("this Blender was built without Open Image Denoise")
    library = _load(path)
    device = library.oidnNewDevice(_DEVICE_CPU)
    library.oidnCommitDevice(device)
    result = np.empty(color.shape, np.float32)
    images = {b"color": color, b"albedo": albedo, b"normal": normal, b"output": result}
    keep = {name: np.ascontiguousarray(image, np.float32) for name, image in images.items() if image is not None}
    keep[b"output"] = result
    height, width = color.shape[:2]
    oidn_filter = library.oidnNewFilter(device, b"RT")
    try:
        for name, image in keep.items():
            library.oidnSetSharedFilterImage(oidn_filter, name, image.ctypes.data, _FLOAT3, width, height, 0, 0, 0)
        library.oidnSetFilterBool(oidn_filter, b"hdr", True)
        library.oidnSetFilterInt(oidn_filter, b"quality", QUALITIES[quality])
        library.oidnCommitFilter(oidn_filter)
        library.oidnExecuteFilter(oidn_filter)
        message = c_char_p()
        if library.oidnGetDeviceError(device, ctypes.byref(message)):
            raise RuntimeError(f"Open Image Denoise: {(message.value or b'unknown error').decode()}")
    finally:
        library.oidnReleaseFilter(oidn_filter)
        library.oidnReleaseDevice(device)
    return result


def denoise(film: Film, quality: str, warnings: Warnings) -> np.ndarray | None:
    """The Combined pass of a film, denoised; None, and a warning, where that is impossible.

    Of alpha, what shadow catchers make of it is denoised, and nothing else.
    """
    albedo, normal = film.pass_array("Denoising Albedo"), film.pass_array("Denoising Normal")
    try:
        if film.has_catchers:
            film.catcher_factor = filter_image(film.pass_array(SHADOW_CATCHER), albedo, normal, quality)
        combined = film.pass_array("Combined")
        combined[:, :, :3] = filter_image(combined[:, :, :3], albedo, normal, quality)
    except (RuntimeError, OSError) as error:
        warnings.add("Render", "Denoise", str(error))
        return None
    return combined
