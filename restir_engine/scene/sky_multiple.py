"""Blender 5's sky with multiple scattering: four wavelengths stand for the spectrum, and a fit for all light that is
scattered more than once (García Liñán 2022, https://fgarlin.com/posts/2024-12-06-spectral_sky/).

Kilometres; arrays end in the wavelengths 630, 560, 490, 430 nm.
"""

from __future__ import annotations

from math import cos, pi, sin

import numpy as np

from .sky import XYZ_TO_REC709, Atmosphere, _mirrored

_EARTH, _THICKNESS = 6371.0, 100.0
_SPACE = _EARTH + _THICKNESS
_ALBEDO = 0.3  # of the ground
_AEROSOL_G = 0.8
_STEPS = 64
_SUN_IRRADIANCE = np.array([1.679, 1.828, 1.986, 1.307])
_AIR_SCATTERING = np.array([6.605e-3, 1.067e-2, 1.842e-2, 3.156e-2])  # per km at sea level
_OZONE_ABSORPTION = 334.5 * np.array([3.472e-25, 3.914e-25, 1.349e-25, 11.03e-27])  # times the density below
_AEROSOL_DENSITY, _AEROSOL_BACKGROUND, _AEROSOL_HEIGHT = 1.3681e20, 2e6, 0.73
_AEROSOL_ABSORPTION = np.array([2.8722e-24, 4.6168e-24, 7.9706e-24, 1.3578e-23])
_AEROSOL_SCATTERING = np.array([1.5908e-22, 1.7711e-22, 2.0942e-22, 2.4033e-22])
_HIGHER_ORDERS = 0.02 * np.array([0.217, 0.347, 0.594, 1.0])
_SPECTRUM_TO_RGB = XYZ_TO_REC709 @ np.array(
    [
        [53.386918, 43.904844, 1.613728, 20.762669],
        [22.981338, 71.347796, 18.422961, 2.361421],
        [0.0, 0.102507, 31.742921, 110.480096],
    ]
)
_TABLE_WIDTH, _TABLE_HEIGHT = 256, 64  # of the transmittance, by the sun's cosine to the zenith and by altitude
_WIDTH, _HEIGHT = 512, 256


def _coefficients(atmosphere: Atmosphere, height: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Scattering by air and by aerosols, and extinction, per km at heights above the sea."""
    height = height[..., None]
    air = atmosphere.air * _AIR_SCATTERING * np.exp(-0.07771971 * np.maximum(height, 0.0) ** 1.16364243)
    log_height = np.log(np.maximum(height, 1e-4))
    ozone = 3.78547397e20 * np.exp(-((log_height - 3.22261) ** 2) * 5.55555555 - log_height)
    aerosols = np.exp(-height / _AEROSOL_HEIGHT) + _AEROSOL_BACKGROUND / _AEROSOL_DENSITY
    aerosols = atmosphere.aerosols * _AEROSOL_DENSITY * aerosols
    scattering = aerosols * _AEROSOL_SCATTERING
    extinction = air + scattering + aerosols * _AEROSOL_ABSORPTION + atmosphere.ozone * ozone * _OZONE_ABSORPTION
    return air, scattering, extinction


def _to_space(square: np.ndarray, along: np.ndarray) -> np.ndarray:
    """Distance to the end of the atmosphere from points p; `square` is p·p, `along` p·d for the unit direction d."""
    return -along + np.sqrt(np.maximum(along * along - square + _SPACE**2, 0.0))


def _to_ground(square: np.ndarray, along: np.ndarray) -> np.ndarray:
    """Distance to the ground, -1 where the ray passes it; arguments as for `_to_space`."""
    d = along * along - square + _EARTH**2
    return np.where((d >= 0.0) & (along < 0.0), -along - np.sqrt(np.maximum(d, 0.0)), -1.0)


def _transmittance(atmosphere: Atmosphere, cosine: np.ndarray, altitude: np.ndarray) -> np.ndarray:
    """From points at these altitudes (0 … 1 of the atmosphere) to a sun at these cosines to the zenith."""
    radius = _EARTH + _THICKNESS * altitude
    step = _to_space(radius * radius, radius * cosine) / _STEPS
    depth = 0.0
    for i in range(_STEPS):
        distance = (i + 0.5) * step
        height = np.sqrt(radius * radius + distance * (2.0 * radius * cosine + distance)) - _EARTH
        depth = depth + _coefficients(atmosphere, np.maximum(height, 0.0))[2] * step[..., None]
    return np.exp(-depth)


def _blend(values: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Rows of `values` between which the fractional indices x lie, interpolated; the last axes stay."""
    i = np.minimum(x.astype(int), len(values) - 2)
    share = (x - i).reshape(x.shape + (1,) * (values.ndim - 1)).astype(values.dtype)
    return values[i] * (1.0 - share) + values[i + 1] * share


def _blend_each(values: np.ndarray, x: np.ndarray) -> np.ndarray:
    """As `_blend`, each row of x in a table of its own: values (n, m, 4), x (n, k) → (n, k, 4)."""
    i = np.minimum(x.astype(int), values.shape[1] - 2)
    share = (x - i)[..., None].astype(values.dtype)
    rows = np.arange(len(values))[:, None]
    return values[rows, i] * (1.0 - share) + values[rows, i + 1] * share


class _Table:
    """Transmittance to the sun by altitude and by the cosine of the sun to the zenith."""

    def __init__(self, atmosphere: Atmosphere) -> None:
        cosine = np.linspace(-1.0, 1.0, _TABLE_WIDTH)
        altitude = np.linspace(0.0, 1.0, _TABLE_HEIGHT)
        self._values = _transmittance(atmosphere, *np.meshgrid(cosine, altitude)).astype(np.float32)

    def lines(self, altitude: np.ndarray) -> np.ndarray:
        """Transmittance at these altitudes (n) over all cosines: (n, cosines, 4)."""
        return _blend(self._values, np.clip(altitude, 0.0, 1.0) * (_TABLE_HEIGHT - 1))

    @staticmethod
    def along(lines: np.ndarray, cosine: np.ndarray) -> np.ndarray:
        """The value of each line (n) at its cosines (n, k): (n, k, 4)."""
        return _blend_each(lines, np.clip(0.5 * cosine + 0.5, 0.0, 1.0) * (_TABLE_WIDTH - 1))

    def at_ground(self, cosine: np.ndarray) -> np.ndarray:
        """Transmittance at sea level."""
        return _blend(self._values[0], np.clip(0.5 * cosine + 0.5, 0.0, 1.0) * (_TABLE_WIDTH - 1))


def _indirect(table: _Table, lines: np.ndarray, cosine: np.ndarray, radius: np.ndarray) -> np.ndarray:
    """Light at points that the ground or the air has scattered before, for unit irradiance."""
    solid_angle = 2.0 * pi * (1.0 - np.sqrt(np.maximum(1.0 - (_EARTH / radius) ** 2, 0.0)))
    to_ground = table.at_ground(np.ones(1)) / lines[:, -1]
    ground = table.at_ground(cosine) * to_ground[:, None] * (solid_angle * cosine)[..., None]
    air = _HIGHER_ORDERS / (1.0 + 5.0 * np.exp(-17.92 * cosine))[..., None]
    return air + ground * (_ALBEDO / pi / (4.0 * pi))


def _radiance(atmosphere: Atmosphere, latitudes: np.ndarray, longitudes: np.ndarray) -> np.ndarray:
    """RGB radiance of sky and ground (latitudes, longitudes, 3), the sun standing over longitude π.

    What depends on the height alone is the same all around the zenith: arrays of one column.
    """
    latitude = latitudes[:, None]
    mu = np.sin(latitude) * sin(atmosphere.elevation)
    mu = mu - np.cos(latitude) * np.cos(longitudes) * cos(atmosphere.elevation)
    start = _EARTH + min(max(atmosphere.altitude, 1.0), 99999.0) / 1000.0
    along, square = start * np.sin(latitude), np.array(start * start)
    ground = _to_ground(square, along)
    step = np.where(ground < 0.0, _to_space(square, along), ground) / _STEPS
    g2 = _AEROSOL_G * _AEROSOL_G
    air_phase = (3.0 / (16.0 * pi) * (1.0 + mu * mu))[..., None]
    aerosol_phase = ((1.0 - g2) / (4.0 * pi) / (1.0 + g2 - 2.0 * _AEROSOL_G * mu) ** 1.5)[..., None]
    table = _Table(atmosphere)
    result, transmittance = 0.0, 1.0
    for i in range(_STEPS):
        distance = (i + 0.5) * step
        radius = np.sqrt(square + distance * (2.0 * along + distance))
        height = np.maximum(radius - _EARTH, 0.0)
        cosine = (start * sin(atmosphere.elevation) + distance * mu) / radius
        air, aerosols, extinction = _coefficients(atmosphere, height)
        lines = table.lines(height[:, 0] / _THICKNESS)
        direct = table.along(lines, cosine)
        indirect = _indirect(table, lines, cosine, radius)
        source = air * (air_phase * direct + indirect) + aerosols * (aerosol_phase * direct + indirect)
        passed = np.exp(-step[..., None] * extinction)
        # Hillaire's exact integral over a segment of even density.
        result = result + source * (transmittance * (1.0 - passed) / np.maximum(extinction, 1e-7))
        transmittance = transmittance * passed
    return (_SUN_IRRADIANCE * result) @ _SPECTRUM_TO_RGB.T


def multiple_dome(atmosphere: Atmosphere) -> np.ndarray:
    """Sky and ground in all directions: float32 (height, width, 4)."""
    rows = 2.0 * (np.arange(_HEIGHT) + 0.5) / _HEIGHT - 1.0
    latitudes = np.copysign(rows * rows, rows) * 0.5 * pi
    longitudes = 2.0 * pi * (np.arange(_WIDTH // 2) + 0.5) / _WIDTH
    return _mirrored(_radiance(atmosphere, latitudes, longitudes))


def multiple_sun(atmosphere: Atmosphere) -> tuple[np.ndarray, np.ndarray]:
    """RGB radiance at the lowest and the highest point of the sun's disc."""
    half = 0.5 * atmosphere.size
    altitude = np.array(min(max(atmosphere.altitude, 1.0), 99999.0) / 1000.0 / _THICKNESS)
    colors = []
    for elevation in (atmosphere.elevation - half, atmosphere.elevation + half):
        passed = _transmittance(atmosphere, np.array(sin(elevation)), altitude)
        colors.append(_SPECTRUM_TO_RGB @ (_SUN_IRRADIANCE * passed / (2.0 * pi * (1.0 - cos(half)))))
    return colors[0], colors[1]
