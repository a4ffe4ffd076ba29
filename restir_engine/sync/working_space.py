"""The primaries of a file's scene-linear colours: Rec. 709, or from Blender 5 on what the file has chosen."""

from __future__ import annotations

from functools import cache

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


def working_space() -> str:
    """The name of the file's scene-linear colour space."""
    return getattr(getattr(bpy.data, "colorspace", None), "working_space", REC709)


def from_rec709() -> np.ndarray | None:
    """The matrix from linear Rec. 709 to the file's space; None where they are the same, or where it is not known."""
    name = working_space()
    if name == REC709 or name not in _PRIMARIES:
        return None
    return np.linalg.inv(_to_xyz(name)) @ _to_xyz(REC709)


def luminance_weights() -> tuple[float, float, float]:
    """What red, green and blue of the file's space count for in luminance."""
    name = working_space()
    return tuple(_to_xyz(name if name in _PRIMARIES else REC709)[1].tolist())


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
