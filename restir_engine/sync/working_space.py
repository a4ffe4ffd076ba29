"""The primaries of scene-linear colours: Rec. 709, what the file has chosen (from Blender 5 on), or what an
OpenColorIO configuration in the environment says.
"""

from __future__ import annotations

import os
import re
import tempfile
from functools import cache
from pathlib import Path

import bpy
import numpy as np

REC709 = "Linear Rec.709"

_D65, _D60 = (0.3127, 0.3290), (0.32168, 0.33767)
# CIE xy of red, green and blue, and the white point.
_PRIMARIES = {
    REC709: (((0.64, 0.33), (0.30, 0.60), (0.15, 0.06)), _D65),
    "Linear Rec.2020": (((0.708, 0.292), (0.170, 0.797), (0.131, 0.046)), _D65),
    "ACEScg": (((0.713, 0.293), (0.165, 0.830), (0.128, 0.044)), _D60),
}
_BRADFORD = np.array([[0.8951, 0.2664, -0.1614], [-0.7502, 1.7135, 0.0367], [0.0389, -0.0685, 1.0296]])


# What linear Rec. 709 is called in configurations that know it by other names.
_ALIASES = (REC709, "Linear Rec.709 (sRGB)", "Linear", "lin_rec709_srgb", "lin_srgb", "Utility - Linear - sRGB")


def working_space() -> str:
    """The name of the scene-linear colour space."""
    chosen = getattr(getattr(bpy.data, "colorspace", None), "working_space", None)
    return chosen or _role_of(os.environ.get("OCIO", ""))


def from_rec709() -> np.ndarray | None:
    """The matrix from linear Rec. 709 to the scene-linear space; None where they are the same."""
    return _from_rec709(working_space(), os.environ.get("OCIO", ""))


def luminance_weights() -> tuple[float, float, float]:
    """What red, green and blue of the scene-linear space count for in luminance."""
    matrix = from_rec709()
    to_xyz = _to_xyz(REC709) if matrix is None else _to_xyz(REC709) @ np.linalg.inv(matrix)
    return tuple(to_xyz[1].tolist())


@cache
def _role_of(config: str) -> str:
    """The colour space that has the role scene_linear in a configuration file, that of Blender's own without one."""
    path = Path(config)
    text = path.read_text(errors="replace") if config and path.is_file() else ""
    found = re.search(r"^\s+scene_linear:\s*[\"']?([^\"'\n]+)", text, re.MULTILINE)
    return found[1].strip() if found else REC709


@cache
def _from_rec709(name: str, config: str) -> np.ndarray | None:
    if name in _PRIMARIES:
        return None if name == REC709 else np.linalg.inv(_to_xyz(name)) @ _to_xyz(REC709)
    return _measured() if config else None


def _measured() -> np.ndarray | None:
    """The same matrix by what Blender makes of three colours; None where it knows no linear Rec. 709."""
    colors = np.zeros((1, 3, 4), np.float32)
    colors[0, :, :3] = np.eye(3)
    for name in _ALIASES:
        try:
            matrix = to_scene_linear(colors, name)[0, :, :3].T.astype(np.float64)
        except TypeError:  # no colour space of the configuration has this name
            continue
        return None if np.allclose(matrix, np.eye(3), atol=1e-4) else matrix
    return None


def to_scene_linear(values: np.ndarray, name: str) -> np.ndarray:
    """Colours (height, width, 4) from the colour space `name` by Blender, which converts float files when it loads
    them; alpha is kept."""
    height, width = values.shape[:2]
    opaque = values.copy()
    opaque[..., 3] = 1.0
    with tempfile.TemporaryDirectory() as folder:
        path = str(Path(folder) / "colours.exr")
        raw = bpy.data.images.new("colours", width, height, alpha=True, float_buffer=True, is_data=True)
        try:
            raw.pixels.foreach_set(opaque.ravel())
            raw.filepath_raw = path
            raw.file_format = "OPEN_EXR"
            raw.save()
        finally:
            bpy.data.images.remove(raw)
        loaded = bpy.data.images.load(path, check_existing=False)
        try:
            loaded.colorspace_settings.name = name
            result = np.empty(opaque.size, np.float32)
            loaded.pixels.foreach_get(result)
        finally:
            bpy.data.images.remove(loaded)
    result = result.reshape(height, width, 4)
    result[..., 3] = values[..., 3]
    return result


@cache
def _to_xyz(name: str) -> np.ndarray:
    """From linear colours to CIE XYZ under D65, adapted by Bradford's transform."""
    primaries, white = _PRIMARIES[name]
    corners = np.array([_xyz(x, y) for x, y in primaries]).T
    matrix = corners * np.linalg.solve(corners, _xyz(*white))
    gain = (_BRADFORD @ _xyz(*_D65)) / (_BRADFORD @ _xyz(*white))
    return np.linalg.inv(_BRADFORD) @ (gain[:, None] * _BRADFORD) @ matrix


def _xyz(x: float, y: float) -> np.ndarray:
    return np.array([x / y, 1.0, (1.0 - x - y) / y])
