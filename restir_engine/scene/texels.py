"""A surface that is baked: which point of it each pixel of a picture stands for."""

from __future__ import annotations

import numpy as np

from ..kernels.core import records as rec
from ..kernels.core.memory import address
from .record_owner import RecordOwner


class Texels(RecordOwner):
    """Points of the triangles of one instance, by pixel, rows bottom to top.

    primitives: int32 (height, width), -1 where there is none. places: float32 (height, width, 6), barycentrics u and v
    (of a triangle's second and third corner) and their derivatives du/dx, du/dy, dv/dx, dv/dy by pixel: what a texel
    covers. seeds: int32 (height, width), pixels of the same seed have the same random numbers; None: each has its own.
    jittered: samples lie all over a texel; else in its centre. from_camera: the surface is seen from the camera; else
    each point along its normal.
    """

    def __init__(
        self,
        instance: int,
        primitives: np.ndarray,
        places: np.ndarray,
        seeds: np.ndarray | None = None,
        jittered: bool = True,
        from_camera: bool = False,
    ) -> None:
        height, width = primitives.shape
        self.size = width, height
        self.primitives = np.ascontiguousarray(primitives, np.int32)
        self.places = np.ascontiguousarray(places, np.float32)
        self._seeds = np.arange(height * width, dtype=np.int32) if seeds is None else seeds
        self._seeds = np.ascontiguousarray(self._seeds, np.int32)
        self._record = np.zeros(1, rec.TEXELS)
        record = self._record[0]
        record["instance"], record["width"] = instance, width
        record["jittered"], record["from_camera"] = jittered, from_camera
        record["primitives"], record["places"] = address(self.primitives), address(self.places)
        record["seeds"] = address(self._seeds)
