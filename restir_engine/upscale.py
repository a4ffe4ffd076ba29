"""Coarse pictures of a scene made finer, by what the scene's surfaces look like in finer pixels."""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np

from .context import FrameContext
from .kernels.core import records as rec
from .kernels.core.memory import address
from .kernels.film.upscale import GUIDE, UPSCALE, guide_rows, upscale_rows
from .scene.camera import Camera
from .scene.scene import Scene

_ROWS = 16  # that a thread fills at a time

KERNELS = [guide_rows, upscale_rows]


def guide_of(scene: Scene, camera: Camera, threads: int = 0) -> np.ndarray:
    """The first surfaces in a camera's pixels, GUIDE (height, width). threads: 0: as many as the machine has cores."""
    width, height = camera.film_size
    context = FrameContext(scene, replace(camera, aperture=0.0))
    guide = np.empty((height, width), GUIDE)

    def fill(rows: list[tuple[int, int]]) -> None:
        scratch = np.zeros(rec.SCRATCH_BYTES, np.uint8)
        for first, last in rows:
            guide_rows(context.record, context.camera_record, address(scratch), address(guide), width, first, last)

    count = threads or os.cpu_count() or 1
    rows = _rows(height)
    with ThreadPoolExecutor(count, "restir-guide") as pool:
        list(pool.map(fill, [rows[k::count] for k in range(count)]))
    return guide


def upscaled(picture: np.ndarray, coarse: Camera, fine: Camera, guide: np.ndarray, threads: int = 0) -> np.ndarray:
    """A picture (height, width, 4) of `coarse` in the pixels of `fine`, the same view: float32, as `picture`.

    guide: what guide_of(scene, fine) is. threads: as there.
    """
    height, width = guide.shape
    result = np.empty((height, width, 4), np.float32)
    picture = np.ascontiguousarray(picture, np.float32)
    corners = [np.array((camera.region or (0, 0))[:2], np.float64) for camera in (coarse, fine)]
    scale = np.array([coarse.width / fine.width, coarse.height / fine.height])
    offset = scale * corners[1] - corners[0]
    middles = [
        np.clip((np.arange(across) + 0.5 - start) / ratio, 0, most - 1).astype(np.intp)
        for across, start, ratio, most in zip(coarse.film_size, offset, scale, fine.film_size, strict=True)
    ]
    coarse_guide = guide[middles[1][:, None], middles[0]]
    record = np.zeros(1, UPSCALE)[0]
    record["guide"], record["coarse_guide"] = address(guide), address(coarse_guide)
    record["coarse"], record["fine"] = address(picture), address(result)
    record["width"], record["height"] = width, height
    record["coarse_width"], record["coarse_height"] = coarse.film_size
    record["scale"], record["offset"] = scale, offset
    with ThreadPoolExecutor(threads or os.cpu_count() or 1, "restir-upscale") as pool:
        list(pool.map(lambda pair: upscale_rows(record, *pair), _rows(height)))
    return result


def _rows(height: int) -> list[tuple[int, int]]:
    """First and last row of the shares that threads take."""
    return [(first, min(first + _ROWS, height)) for first in range(0, height, _ROWS)]
