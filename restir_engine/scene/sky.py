"""Skies of the Sky Texture as tables: the atmosphere with single scattering (after Nishita et al. 1993) and with
multiple scattering (García Liñán 2022, Hillaire 2020), and the parameters of Preetham et al. 1999.

Colours are linear Rec.709. A dome's table runs around the zenith from behind the sun; rows are dense at the horizon.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import acos, asin, atan2, copysign, cos, fmod, pi, sin, tan

import numpy as np

XYZ_TO_REC709 = np.array(
    [
        [3.2404542, -1.5371385, -0.4985314],
        [-0.9692660, 1.8760108, 0.0415560],
        [0.0556434, -0.2040259, 1.0572252],
    ]
)


@dataclass(frozen=True)
class Atmosphere:
    """Angles in radians, altitude in metres; densities are multiples of Earth's."""

    elevation: float
    rotation: float
    size: float  # angle that the sun's disc spans
    intensity: float  # of the disc
    disc: bool
    altitude: float
    air: float
    aerosols: float
    ozone: float

    def normalized(self) -> Atmosphere:
        """The same sun with its elevation in -90 … 90 degrees and its rotation counted as the table is."""
        elevation, rotation = fmod(self.elevation, 2.0 * pi), self.rotation
        if abs(elevation) >= pi:
            elevation -= copysign(2.0 * pi, elevation)
        if abs(elevation) >= 0.5 * pi:
            elevation = copysign(pi, elevation) - elevation
            rotation += pi
        return replace(self, elevation=elevation, rotation=2.0 * pi - rotation % (2.0 * pi))


# Single scattering ----------------------------------------------------------------------------------------
# Metres and nanometres; 21 wavelengths from 380 to 780 nm.


def _row(*lines: str) -> np.ndarray:
    return np.array(" ".join(lines).split(), float)


_EARTH = 6360e3
_SPACE = 6420e3  # where the atmosphere ends
_AIR_HEIGHT, _MIE_HEIGHT = 8000.0, 1200.0  # over which the density falls to 1 / e
_MIE_SCATTERING = 2e-5  # per metre at sea level
_MIE_EXTINCTION = 1.11 * _MIE_SCATTERING
_MIE_G = 0.76
_STEPS = 32
_WAVELENGTHS = np.arange(380.0, 781.0, 20.0)
_WIDTH, _HALF_HEIGHT, _FULL_HEIGHT = 512, 128, 256
_SUN_IRRADIANCE = _row(  # W / (m² nm) above the atmosphere
    "1.457568 1.565963 1.651484 1.714962 1.757980 1.782564 1.790951 1.785416 1.768156 1.741221 1.706471",
    "1.665561 1.619934 1.570836 1.519323 1.466285 1.412459 1.358450 1.304749 1.251750 1.199760",
)
_RAYLEIGH = 1e-6 * _row(  # per metre at sea level
    "54.248201 44.185499 36.351519 30.179290 25.263202 21.308593 18.098380 15.470571 13.302850 11.501848",
    "9.995574 8.728000 7.655137 6.742172 5.961341 5.290346 4.711157 4.209105 3.772184 3.390513 3.055915",
)
_OZONE = 1e-9 * _row(  # absorption per metre in the densest layer
    "3.251268 5.853954 19.771912 73.095688 200.845615 403.839581 635.513359 967.070412 1547.974004",
    "2090.386472 2461.280562 2735.512995 2151.258631 1590.518408 1123.561980 735.275515 464.501304",
    "330.960799 225.126123 148.791293 168.286234",
)
_CIE_1931 = np.array(  # colour matching functions of the 2° observer
    [
        _row(
            "0.001368 0.014310 0.134380 0.348280 0.290800 0.095640 0.004900 0.063270 0.290400 0.594500 0.916300",
            "1.062200 0.854450 0.447900 0.164900 0.046770 0.011359 0.002899 0.000690 0.000166 0.000042",
        ),
        _row(
            "0.000039 0.000396 0.004000 0.023000 0.060000 0.139020 0.323000 0.710000 0.954000 0.995000 0.870000",
            "0.631000 0.381000 0.175000 0.061000 0.017000 0.004102 0.001047 0.000249 0.000060 0.000015",
        ),
        _row(
            "0.006450 0.067850 0.645600 1.747060 1.669200 0.812950 0.272000 0.078250 0.020300 0.003900 0.001650",
            "0.000800 0.000190 0.000020 0 0 0 0 0 0 0",
        ),
    ]
)
_SPECTRUM_TO_RGB = 20.0 * XYZ_TO_REC709 @ _CIE_1931


def _optical_rule() -> tuple[np.ndarray, np.ndarray]:
    """Nodes in 0 … 1 and weights for what decays along a ray: Gauss–Laguerre over 25 mean lengths."""
    nodes, weights = np.polynomial.laguerre.laggauss(8)
    return nodes / 25.0, weights * np.exp(nodes) / 25.0


def _densities(height: np.ndarray) -> np.ndarray:
    """Relative density of air, aerosols and ozone at heights above the sea, on a last axis."""
    height = height.astype(np.float32)
    ozone = np.maximum(0.0, 1.0 - np.abs(height - 25000.0) / 15000.0)
    return np.stack([np.exp(-height / _AIR_HEIGHT), np.exp(-height / _MIE_HEIGHT), ozone], -1)


def _to_space(square: np.ndarray, along: np.ndarray) -> np.ndarray:
    """Distance to the end of the atmosphere from points p; `square` is p·p, `along` p·d for the unit direction d."""
    return -along + np.sqrt(np.maximum(along * along - square + _SPACE**2, 0.0))


def _depths(square: np.ndarray, along: np.ndarray) -> np.ndarray:
    """Integrals of the three densities from points to space; arguments as for `_to_space`."""
    length = _to_space(square, along)
    total = 0.0
    for node, weight in zip(*_optical_rule(), strict=True):
        distance = node * length
        total = total + weight * _densities(np.sqrt(square + distance * (2.0 * along + distance)) - _EARTH)
    return total * length[..., None]


def _extinction(atmosphere: Atmosphere) -> np.ndarray:
    """Extinction per metre at full density (3, wavelengths)."""
    mie = np.full(len(_WAVELENGTHS), _MIE_EXTINCTION)
    return np.stack([atmosphere.air * _RAYLEIGH, atmosphere.aerosols * mie, atmosphere.ozone * _OZONE])


def _single_scattering(
    atmosphere: Atmosphere, latitudes: np.ndarray, longitudes: np.ndarray, altitude: float
) -> np.ndarray:
    """RGB radiance of the sky (latitudes, longitudes, 3), the sun standing over longitude 0.

    What depends on the height alone is the same all around the zenith: arrays of one column.
    """
    latitude = latitudes[:, None]
    mu = np.cos(latitude) * np.cos(longitudes) * cos(atmosphere.elevation)
    mu += np.sin(latitude) * sin(atmosphere.elevation)
    radius = _EARTH + altitude
    along = radius * np.sin(latitude)
    segment = _to_space(np.array(radius * radius), along) / _STEPS
    g2 = _MIE_G * _MIE_G
    rayleigh_phase = 3.0 / (16.0 * pi) * (1.0 + mu * mu)
    mie_phase = 3.0 * (1.0 - g2) * (1.0 + mu * mu) / (8.0 * pi * (2.0 + g2) * (1.0 + g2 - 2.0 * _MIE_G * mu) ** 1.5)
    phases = np.stack([rayleigh_phase, mie_phase], -1).astype(np.float32)
    scattering = np.stack([atmosphere.air * _RAYLEIGH, np.full_like(_RAYLEIGH, atmosphere.aerosols * _MIE_SCATTERING)])
    scattering = (scattering * _SUN_IRRADIANCE).astype(np.float32)
    extinction = _extinction(atmosphere).astype(np.float32)
    seen = 0.0
    spectrum = np.zeros((*mu.shape, len(_WAVELENGTHS)), np.float32)
    for step in range(_STEPS):
        distance = (step + 0.5) * segment
        square = radius * radius + distance * (2.0 * along + distance)
        density = segment[..., None] * _densities(np.sqrt(square) - _EARTH)
        seen = seen + density
        to_sun = radius * sin(atmosphere.elevation) + distance * mu
        transmittance = np.exp(-((seen + _depths(square, to_sun)).astype(np.float32) @ extinction))
        if atmosphere.elevation < 0.0:  # the earth may stand between
            transmittance[to_sun * to_sun - square + _EARTH**2 >= 0.0] = 0.0
        spectrum += transmittance * ((phases * density[..., :2]).astype(np.float32) @ scattering)
    return spectrum @ _SPECTRUM_TO_RGB.T


def _single_sun(atmosphere: Atmosphere, altitude: float) -> tuple[np.ndarray, np.ndarray]:
    """RGB radiance at the lowest and the highest point of the sun's disc."""
    half = 0.5 * atmosphere.size
    solid_angle = 2.0 * pi * (1.0 - cos(half))
    extinction = _extinction(atmosphere)[:2]
    colors = []
    for elevation in (atmosphere.elevation - half, atmosphere.elevation + half):
        elevation = max(elevation, 0.0)
        radius = np.array(_EARTH + altitude)
        depth = _depths(radius * radius, radius * sin(elevation))[:2]
        colors.append(_SPECTRUM_TO_RGB @ (_SUN_IRRADIANCE * np.exp(-depth @ extinction) / solid_angle))
    return colors[0], colors[1]


def _mirrored(half: np.ndarray) -> np.ndarray:
    """A table of both sides of the sun's plane from one (height, width / 2, 3), with a fourth channel of ones."""
    whole = np.concatenate([half, half[:, ::-1]], 1)
    return np.concatenate([whole, np.ones_like(whole[..., :1])], -1).astype(np.float32)


def half_dome(atmosphere: Atmosphere) -> np.ndarray:
    """Blender 4's sky above the horizon: float32 (height, width, 4)."""
    rows = np.arange(_HALF_HEIGHT) / _HALF_HEIGHT
    latitudes = (0.5 * pi + 0.25 * pi / _HALF_HEIGHT) * rows**2
    longitudes = 2.0 * pi * np.arange(_WIDTH // 2) / _WIDTH - pi
    return _mirrored(_single_scattering(atmosphere, latitudes, longitudes, atmosphere.altitude))


def full_dome(atmosphere: Atmosphere) -> np.ndarray:
    """Blender 5's sky with single scattering, the horizon fading out below itself: float32 (height, width, 4)."""
    middle = _FULL_HEIGHT // 2
    rows = np.arange(_FULL_HEIGHT) / middle - 1.0
    latitudes = np.copysign(0.5 * pi * rows**2, rows)
    longitudes = 2.0 * pi * np.arange(_WIDTH // 2) / _WIDTH - pi
    altitude = min(max(atmosphere.altitude, 1.0), 59999.0)
    upper = _single_scattering(atmosphere, latitudes[middle:], longitudes, altitude)
    fade = np.maximum(1.0 + 2.5 * np.sin(latitudes[:middle]), 0.0) ** 3
    return _mirrored(np.concatenate([fade[:, None, None] * upper[:1], upper]))


def dome_parameters(atmosphere: Atmosphere, sun: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
    """The table that `kernels.shading.textures.sky` reads beside a dome: sun colours, angles, intensity, horizon."""
    horizon = asin(6371.0 / (6371.0 + max(atmosphere.altitude, 0.0) / 1000.0)) - 0.5 * pi
    diameter = atmosphere.size if atmosphere.disc else -1.0
    angles = [atmosphere.elevation, atmosphere.rotation, diameter, atmosphere.intensity, horizon]
    return np.array([*sun[0], *sun[1], *angles], np.float32)


def single_sun(atmosphere: Atmosphere, full: bool) -> tuple[np.ndarray, np.ndarray]:
    """Colours of the sun's disc, lowest and highest point, for a full dome (Blender 5) or a half one."""
    if not full:
        return _single_sun(atmosphere, atmosphere.altitude)
    if atmosphere.elevation + 0.5 * atmosphere.size <= 0.0:
        return np.zeros(3), np.zeros(3)
    return _single_sun(atmosphere, min(max(atmosphere.altitude, 1.0), 59999.0))


# Preetham -------------------------------------------------------------------------------------------------


def _perez(p: list[float], theta: float, gamma: float) -> float:
    return (1.0 + p[0] * np.exp(p[1] / cos(theta))) * (1.0 + p[2] * np.exp(p[3] * gamma) + p[4] * cos(gamma) ** 2)


def preetham(sun_direction: tuple[float, float, float], turbidity: float, brightness: float = 1.0) -> np.ndarray:
    """The table that `kernels.shading.textures.sky` reads for Preetham's sky (appendix A.2 of the paper)."""
    x, y, z = np.array(sun_direction) / max(np.linalg.norm(sun_direction), 1e-12)
    theta, phi, t = acos(min(max(z, -1.0), 1.0)), atan2(x, y), turbidity
    powers = np.array([theta**3, theta**2, theta, 1.0])
    chi = (4.0 / 9.0 - t / 120.0) * (pi - 2.0 * theta)
    luminance = brightness * 0.06 * ((4.0453 * t - 4.9710) * tan(chi) - 0.2155 * t + 2.4192)
    squares = np.array([t * t, t, 1.0])
    zenith_x = squares @ (
        [
            [0.00166, -0.00375, 0.00209, 0.0],
            [-0.02903, 0.06377, -0.03202, 0.00394],
            [0.11693, -0.21196, 0.06052, 0.25886],
        ]
        @ powers
    )
    zenith_y = squares @ (
        [
            [0.00275, -0.00610, 0.00317, 0.0],
            [-0.04214, 0.08970, -0.04153, 0.00516],
            [0.15346, -0.26756, 0.06670, 0.26688],
        ]
        @ powers
    )
    coefficients = (
        (luminance, [0.1787, -0.3554, -0.0227, 0.1206, -0.0670], [-1.4630, 0.4275, 5.3251, -2.5771, 0.3703]),
        (zenith_x, [-0.0193, -0.0665, -0.0004, -0.0641, -0.0033], [-0.2592, 0.0008, 0.2125, -0.8989, 0.0452]),
        (zenith_y, [-0.0167, -0.0950, -0.0079, -0.0441, -0.0109], [-0.2608, 0.0092, 0.2102, -1.6537, 0.0529]),
    )
    table = [theta, phi]
    for zenith, slopes, offsets in coefficients:
        p = [slope * t + offset for slope, offset in zip(slopes, offsets, strict=True)]
        table += [*p, zenith / _perez(p, 0.0, theta)]
    return np.array([*table, *XYZ_TO_REC709.ravel()], np.float32)
