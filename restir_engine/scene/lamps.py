"""LIGHT records from a lamp's own terms: power in watt (sun: irradiance), size, cone, spread.

`strength` is what a light of white emission 1 sends out; a lamp's program multiplies it.
"""

import math

import numpy as np

from ..kernels.core.records import (
    LIGHT,
    LIGHT_AREA,
    LIGHT_DELTA,
    LIGHT_ELLIPSE,
    LIGHT_HITTABLE,
    LIGHT_NO_SHADOW,
    LIGHT_POINT,
    LIGHT_SPHERE,
    LIGHT_SPOT,
    LIGHT_SUN,
    RAY_ALL,
)
from .instances import inverse

LUMINANCE = np.array([0.2126, 0.7152, 0.0722])

# A blend of 0 is not a step: the edge keeps this width in cosine, as Cycles has it.
_MIN_BLEND = 0.001


def _lamp(
    kind: int,
    matrix,
    *,
    material: int = -1,
    seen_by: int = RAY_ALL,
    max_bounces: int = 1024,
    casts_shadow: bool = True,
    hittable: bool = True,
    links: int = -1,
    blockers: int = -1,
    object_index: int = 0,
    light_group: int = -1,
    key: int = 0,
) -> np.ndarray:
    """What all kinds share. matrix: object to world, 3x4 or 4x4; a flattened axis is given a little length."""
    lamp = np.zeros(1, LIGHT)
    record = lamp[0]
    matrix = np.array(matrix, np.float64)[:3, :4]
    if not np.isfinite(matrix).all():
        matrix = np.eye(4)[:3]
    for axis in np.flatnonzero(np.linalg.norm(matrix[:, :3], axis=0) < 1e-12):
        matrix[:, axis] = 1e-6 * np.eye(3)[axis]
    record["kind"] = kind
    record["material"] = material
    record["seen_by"] = seen_by
    record["links"], record["blockers"] = links, blockers
    record["max_bounces"] = max_bounces
    record["object_index"] = object_index
    record["light_group"] = light_group
    record["key"] = key
    record["flags"] = (0 if casts_shadow else LIGHT_NO_SHADOW) | (LIGHT_HITTABLE if hittable else 0)
    record["to_world"] = matrix.ravel()
    try:
        record["to_object"] = inverse(matrix)[0]
    except np.linalg.LinAlgError:
        record["to_object"] = np.eye(4)[:3].ravel()
    record["center"] = matrix[:, 3]
    return lamp


def _finish(lamp: np.ndarray, strength: np.ndarray, importance: np.ndarray, delta: bool) -> np.ndarray:
    """Strength may be negative: such a lamp takes light away."""
    record = lamp[0]
    record["strength"] = np.nan_to_num(strength, posinf=0.0, neginf=0.0)
    record["importance"] = np.abs(np.nan_to_num(importance, posinf=0.0, neginf=0.0)) @ LUMINANCE
    if delta:
        record["flags"] = (record["flags"] | LIGHT_DELTA) & ~LIGHT_HITTABLE
    return lamp


def point_lamp(matrix, power, radius: float, *, soft: bool = True, normalize: bool = True, **common) -> np.ndarray:
    """A LIGHT (1,) that sends `power` (rgb, watt) all around. soft: a disk that turns to each point, else a sphere."""
    return _ball(_lamp(LIGHT_POINT, matrix, **common), power, radius, soft, normalize)


def spot_lamp(
    matrix,
    power,
    radius: float,
    angle: float,
    blend: float,
    *,
    soft: bool = True,
    normalize: bool = True,
    **common,
) -> np.ndarray:
    """A LIGHT (1,): a point lamp that is dark outside a cone of full `angle` (radians) about -z.

    The axes' lengths stretch the cone. blend: 0 to 1, the share of the cone over which its edge fades.
    """
    lamp = _ball(_lamp(LIGHT_SPOT, matrix, **common), power, radius, soft, normalize)
    record = lamp[0]
    cos = math.cos(0.5 * min(angle, math.pi))
    axes = record["to_world"].reshape(3, 4)[:, :3]
    lengths = np.linalg.norm(axes, axis=0)
    tan = math.tan(0.5 * min(angle, math.pi - 1e-6))
    widest = math.cos(math.atan(tan * max(lengths[0], lengths[1]) / lengths[2]))
    record["p"][0] = cos
    record["p"][1] = 1.0 / max(_MIN_BLEND, (1.0 - cos) * blend)
    record["p"][2] = 1.0 - widest
    record["p"][3:6] = -axes[:, 2] / lengths[2]
    return lamp


def _ball(lamp: np.ndarray, power, radius: float, soft: bool, normalize: bool) -> np.ndarray:
    power = np.asarray(power, np.float64)
    record = lamp[0]
    radius = max(float(radius), 0.0)
    record["radius"] = radius
    if not soft and radius > 0.0:
        record["flags"] |= LIGHT_SPHERE
    area = math.pi * radius * radius if radius > 0.0 else 1.0
    # Not normalised, power / pi is the radiance (of a point the intensity).
    intensity = power / (4.0 * math.pi) if normalize else power / math.pi * area
    strength = intensity / area
    return _finish(lamp, strength, intensity, radius == 0.0)


def area_lamp(
    matrix,
    power,
    width: float,
    height: float,
    *,
    ellipse: bool = False,
    spread: float = math.pi,
    normalize: bool = True,
    **common,
) -> np.ndarray:
    """A LIGHT (1,) that shines along -z; width and height in object space. spread: full angle of the grid before it.

    `power` is the radiant flux without the grid; a narrower spread keeps it.
    """
    lamp = _lamp(LIGHT_AREA, matrix, **common)
    record = lamp[0]
    power = np.asarray(power, np.float64)
    axes = record["to_world"].reshape(3, 4)[:, :3]
    lengths = np.linalg.norm(axes, axis=0)
    width, height = max(abs(width) * lengths[0], 1e-9), max(abs(height) * lengths[1], 1e-9)
    record["p"][0:3] = axes[:, 0] / lengths[0]
    record["p"][3] = width
    record["p"][4:7] = axes[:, 1] / lengths[1]
    record["p"][7] = height
    record["p"][8:11] = -axes[:, 2] / lengths[2]
    area = width * height
    record["radius"] = 0.5 * math.hypot(width, height)
    if ellipse:
        record["flags"] |= LIGHT_ELLIPSE
        area *= 0.25 * math.pi
        record["radius"] = 0.5 * max(width, height)
    half = 0.5 * min(max(spread, 0.0), math.pi)
    record["p"][11] = math.inf
    irradiance = power / area if normalize else power
    peak = 1.0
    if half == 0.0:
        return _finish(lamp, irradiance, power, True)
    if half < 0.5 * math.pi:
        tan = math.tan(half)
        record["p"][11] = tan
        # The grid lets (tan half - tan x) of the light at angle x through; divided by its integral over the hemisphere.
        record["p"][12] = 1.0 / (tan - half) if tan > half else 0.0
        peak = tan * record["p"][12]
    return _finish(lamp, irradiance / math.pi, irradiance * (area * min(peak, 100.0) / math.pi), False)


def portal(matrix, width: float, height: float, ellipse: bool = False) -> np.ndarray:
    """A LIGHT (1,) of radiance 1 where the world shines in along -z; width and height in object space."""
    return area_lamp(matrix, (math.pi,) * 3, width, height, ellipse=ellipse, normalize=False)


def sun_lamp(matrix, irradiance, angle: float, *, normalize: bool = True, **common) -> np.ndarray:
    """A LIGHT (1,) from infinity along -z; angle: diameter of its disk. irradiance: at normal incidence (rgb)."""
    lamp = _lamp(LIGHT_SUN, matrix, **common)
    record = lamp[0]
    strength = np.asarray(irradiance, np.float64)
    z = record["to_world"].reshape(3, 4)[:, 2]
    record["p"][0:3] = z / np.linalg.norm(z)
    half = 0.5 * min(max(angle, 0.0), math.pi)
    record["p"][3] = 2.0 * math.sin(0.5 * half) ** 2
    if half == 0.0:
        return _finish(lamp, strength, strength, True)
    area = math.pi * math.sin(half) ** 2
    if not normalize:
        strength = strength * area
    return _finish(lamp, strength / area, strength, False)


class Lamps:
    """The lamps of a scene that is put together: LIGHT records.

    portals: areas where the world shines in, LIGHT (1,) each, by which its light is sampled.
    """

    def __init__(self) -> None:
        self.portals: list[np.ndarray] = []
        self._lamps = np.zeros(0, LIGHT)
        self._added: list[np.ndarray] = []

    def add(self, lamp: np.ndarray) -> None:
        """Add a LIGHT record (1,)."""
        self._added.append(lamp)

    @property
    def lamps(self) -> np.ndarray:
        """All of them, in the order in which they were added."""
        if self._added:
            self._lamps = np.concatenate([self._lamps, *self._added])
            self._added.clear()
        return self._lamps

    @lamps.setter
    def lamps(self, lamps: np.ndarray) -> None:
        self._lamps = lamps
        self._added.clear()
