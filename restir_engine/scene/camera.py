"""The camera and the part of its frame that is rendered."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np

from ..kernels.core import records as rec
from ..kernels.core.memory import address
from .instances import inverse
from .motion import along_arcs, finer_by
from .texels import Texels

# By the names that Blender gives them; for one of the fisheye lenses see `Camera.fisheye`.
PROJECTIONS = {
    "EQUIRECTANGULAR": rec.PANORAMA_EQUIRECTANGULAR,
    "CENTRAL_CYLINDRICAL": rec.PANORAMA_CYLINDRICAL,
    "MIRRORBALL": rec.PANORAMA_MIRROR_BALL,
    "EQUIANGULAR_CUBEMAP_FACE": rec.PANORAMA_CUBE_FACE,
    "FISHEYE_EQUIDISTANT": rec.PANORAMA_EQUIDISTANT,
    "FISHEYE_EQUISOLID": rec.PANORAMA_EQUISOLID,
    "FISHEYE_LENS_POLYNOMIAL": rec.PANORAMA_POLYNOMIAL,
}
KINDS = {"PERSP": rec.CAMERA_PERSPECTIVE, "ORTHO": rec.CAMERA_ORTHOGRAPHIC, "PANO": rec.CAMERA_PANORAMA}
_STEP = 0.05  # radians that it turns on a line at most: directions are then 1e-6 off the arc


@dataclass(frozen=True, eq=False)
class Camera:
    """What a camera sees: lengths in scene units, angles in radians.

    to_world: (4, 4) or (3, 4), the camera looks along -z with y up; scale and shear of it are ignored.
    width, height: the whole frame in pixels. region: the rendered part of it, (x, y, width, height) from the lower
    left corner; None: all. screen: left, right, bottom, top of the frame on the plane at distance 1 (PERSP), or of
    the viewed box (ORTHO). projection: one of PROJECTIONS (PANO). longitude, latitude: what an equirectangular or
    cylindrical panorama shows; the latter's latitude is a height on the cylinder of radius 1. fisheye: field of view;
    lens, width and height of the sensor in millimetres; polynomial: see CAMERA. eye, convergence, pole_merge: of
    spherical stereo, see CAMERA. Of `steps`, place, frame, aperture and focus count.
    """

    kind: str = "PERSP"
    to_world: np.ndarray = field(default_factory=lambda: np.eye(4))
    width: int = 64
    height: int = 64
    region: tuple[int, int, int, int] | None = None
    screen: tuple[float, float, float, float] = (-0.5, 0.5, -0.5, 0.5)
    clip_start: float = 0.1
    clip_end: float = 1000.0
    aperture: float = 0.0
    focus_distance: float = 10.0
    blades: int = 0
    blade_rotation: float = 0.0
    aperture_ratio: float = 1.0
    longitude: tuple[float, float] = (-math.pi, math.pi)
    latitude: tuple[float, float] = (-math.pi / 2, math.pi / 2)
    projection: str = "EQUIRECTANGULAR"
    fisheye: tuple[float, float, float, float] = (math.pi, 10.5, 36.0, 24.0)
    polynomial: tuple[float, ...] = (0.0, 0.0, 0.0, 0.0, 0.0)
    eye: float = 0.0
    convergence: float = 0.0
    pole_merge: tuple[float, float] = (0.0, 0.0)
    texels: Texels | None = None  # a surface that is baked: pixels are its, and none of the frame's
    steps: tuple[Camera, ...] = ()  # the same at even distances of time while the shutter is open; (): it stands still
    around: tuple[Camera, Camera] | None = None  # the same a frame before and after, for the pass Vector

    def __post_init__(self) -> None:
        to_world = np.array(self.to_world, np.float64)[:3]
        to_world.flags.writeable = False
        object.__setattr__(self, "to_world", to_world)
        object.__setattr__(self, "_table", self._step_table())
        object.__setattr__(self, "_around", np.array([camera.record() for camera in self.around or ()], rec.CAMERA))

    @property
    def film_size(self) -> tuple[int, int]:
        """Width and height of the rendered region, or of what is baked."""
        if self.texels:
            return self.texels.size
        return self.region[2:] if self.region else (self.width, self.height)

    @property
    def rectangle(self) -> tuple[float, float, float, float]:
        """The rendered region as left, bottom, right, top in units of the frame."""
        x, y, width, height = self.region or (0, 0, self.width, self.height)
        return x / self.width, y / self.height, (x + width) / self.width, (y + height) / self.height

    def coarser(self, step: int) -> Camera:
        """The same view in pixels of about so many of ours along a side; its region has ours inside."""
        width, height = -(-self.width // step), -(-self.height // step)
        if not self.region:
            return replace(self, width=width, height=height)
        x, y, across, up = self.region
        low = math.floor(x * width / self.width), math.floor(y * height / self.height)
        high = math.ceil((x + across) * width / self.width), math.ceil((y + up) * height / self.height)
        return replace(self, width=width, height=height, region=(*low, high[0] - low[0], high[1] - low[1]))

    def origins(self) -> tuple[np.ndarray, np.ndarray]:
        """Lower and upper corner, (3,) each, of a box that contains the origins of all rays."""
        if self.texels:
            return np.full(3, -np.inf), np.full(3, np.inf)
        corner = math.hypot(max(map(abs, self.screen[:2])), max(map(abs, self.screen[2:])))
        reach = self.clip_start * math.hypot(1.0, corner if self.kind == "PERSP" else 0.0)
        reach += (corner if self.kind == "ORTHO" else 0.0) + self.aperture / min(max(self.aperture_ratio, 1e-6), 1.0)
        reach += abs(self.eye)
        places = np.array([camera.to_world[:, 3] for camera in (self, *self.steps)])
        return places.min(axis=0) - reach, places.max(axis=0) + reach

    def _step_table(self) -> np.ndarray:
        """CAMERA_STEP array, on lines that follow the camera's arc."""
        if not self.steps:
            return np.zeros(0, rec.CAMERA_STEP)
        matrices = np.array([step.record()["to_world"] for step in self.steps])
        finer = int(finer_by(matrices, _STEP))
        table = np.zeros((len(self.steps) - 1) * finer + 1, rec.CAMERA_STEP)
        table["to_world"] = along_arcs(matrices, finer)
        times = np.arange(len(table)) / finer
        for name in ("screen", "aperture", "focus_distance"):
            values = np.array([getattr(step, name) for step in self.steps], float).reshape(len(self.steps), -1)
            finely = [np.interp(times, np.arange(len(values)), column) for column in values.T]
            table[name] = np.stack(finely, 1) if len(finely) > 1 else finely[0]
        return table

    def same_as(self, other: Camera) -> bool:
        """Whether both see the same."""
        return self.film_size == other.film_size and self.record().tobytes() == other.record().tobytes()

    def record(self) -> np.void:
        """The CAMERA record; valid as long as this lives."""
        to_world = np.array(self.to_world)
        lengths = np.linalg.norm(to_world[:, :3], axis=0)
        to_world[:, :3] /= np.where(lengths > 0.0, lengths, 1.0)
        result = np.zeros((), rec.CAMERA)
        result["kind"] = KINDS[self.kind]
        result["width"], result["height"] = self.width, self.height
        if self.region:
            result["region_x"], result["region_y"] = self.region[:2]
        result["to_world"] = to_world.ravel()
        result["to_camera"] = inverse(to_world.reshape(1, 12))[0]
        result["panorama"] = (*self.longitude, *self.latitude)
        result["projection"] = PROJECTIONS[self.projection]
        result["fisheye"], result["polynomial"] = self.fisheye, self.polynomial
        result["n_steps"], result["steps"] = len(self._table), address(self._table)
        result["around"] = address(self._around) if self.around else 0
        result["pole_merge"] = self.pole_merge
        result["texels"] = self.texels.address if self.texels else 0
        result["aperture_ratio"] = max(self.aperture_ratio, 1e-6)
        for name in ("screen", "clip_start", "clip_end", "aperture", "focus_distance", "blades", "blade_rotation"):
            result[name] = getattr(self, name)
        result["eye"], result["convergence"] = self.eye, self.convergence
        return result[()]
