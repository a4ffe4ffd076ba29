"""Thin films on Principled, Metallic and Glass BSDFs: what the running Blender's Cycles makes of them."""

from __future__ import annotations

from functools import cache

import bpy
import numpy as np

from ...kernels.lobes.nodes import THIN_FILM
from ..working_space import from_rec709, working_space
from .spectra import WAVELENGTHS, XYZ_TO_REC709, color_matching

_THICKNESS, _IOR = "Thin Film Thickness", "Thin Film IOR"
_V5 = bpy.app.version >= (5, 0, 0)
FILM_ON_METAL = _V5

# Below this thickness in nm a film fades away.
_FADES = 1.0 if _V5 else 30.0
_FARTHEST = 60000.0 / (2.0 * np.pi)  # path difference in nm
_ENTRIES = 512 if _V5 else 2048  # Cycles' own table has 512; before Blender 5 it has none

# The fit of Gaussians to the CIE curves over the wavenumber (rad/m) in the supplement to Belcour and Barla 2017: of X,
# Y, Z and a second one of X their height, middle and variance; all by the integral of Y.
_HEIGHT = np.array([5.4856e-13, 4.4201e-13, 5.2481e-13])
_MIDDLE = np.array([1.6810e6, 1.7953e6, 2.2084e6])
_VARIANCE = np.array([4.3278e9, 9.3046e9, 6.6121e9])
_SECOND_AREA, _SECOND_MIDDLE, _SECOND_VARIANCE = 1.64408e-8, 2.2399e6, 4.5282e9
_INTEGRAL = 1.0685e-7


def thin_film(c, node) -> int:
    """The register of a node's film as BSDFs take it, -1 where it has none."""
    if c.inputs(node).find(_THICKNESS) is None:
        return -1
    thickness = c.value(node, _THICKNESS)
    if c.constant_value(thickness) == (0.0,):
        return -1
    if c.inputs(node).find("Thin Wall") is not None and c.constant_value(c.value(node, "Thin Wall")) != (0.0,):
        c.warn("a thin film on a thin wall has about its colours: reflected light differs from Cycles' by up to 3 %")
    out = c.allocate(3)
    c.emit(THIN_FILM, out, thickness, c.value(node, _IOR), c.table(film_table(working_space())))
    return out


@cache
def film_table(space: str) -> np.ndarray:
    """The table of `kernels.lobes.thin_film` for a file's scene-linear colours."""
    path = np.linspace(0.0, _FARTHEST, _ENTRIES)
    to_rgb = XYZ_TO_REC709 if from_rec709() is None else from_rec709() @ XYZ_TO_REC709
    transform = _of_curves(path, to_rgb) if _V5 else _of_gaussians(path, to_rgb)
    rows = np.hstack([transform.real, transform.imag])
    return np.concatenate([[_FADES, _ENTRIES, path[1]], rows.ravel()]).astype(np.float32)


def _of_curves(path: np.ndarray, to_rgb: np.ndarray) -> np.ndarray:
    """∫ s(λ) exp(2πi OPD / λ) dλ of the colour matching functions, 1 at OPD = 0: complex (n, 3)."""
    curves = color_matching() @ to_rgb.T
    wavelengths = np.arange(WAVELENGTHS[0], WAVELENGTHS[1] + 0.5)
    steps = np.linspace(*WAVELENGTHS, len(curves))
    curves = np.stack([np.interp(wavelengths, steps, curve) for curve in curves.T], axis=1)
    waves = np.exp(2j * np.pi * path[:, None] / wavelengths)
    return waves @ curves / curves.sum(0)


def _of_gaussians(path: np.ndarray, to_rgb: np.ndarray) -> np.ndarray:
    """The transform of the Gaussians that stand for X, Y and Z, by their white: complex (n, 3)."""
    phase = 2.0 * np.pi * path[:, None] * 1e-9
    xyz = _HEIGHT * np.sqrt(2.0 * np.pi * _VARIANCE) * np.exp(1j * _MIDDLE * phase - _VARIANCE * phase**2)
    second = np.exp(1j * _SECOND_MIDDLE * phase[:, 0] - _SECOND_VARIANCE * phase[:, 0] ** 2)
    xyz[:, 0] += _SECOND_AREA * second
    white = np.linalg.inv(to_rgb).sum(1)
    return (xyz / _INTEGRAL * white) @ to_rgb.T
