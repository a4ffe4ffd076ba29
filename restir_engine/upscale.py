"""Coarse pictures of a scene made finer, by what the scene's surfaces look like in finer pixels."""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import partial

import numpy as np

from .context import FrameContext
from .kernels.core import records as rec
from .kernels.core.memory import address
from .kernels.film.upscale import GUIDE, UPSCALE, guide_rows, upscale_rows
from .scene.camera import Camera
from .scene.scene import Scene

_ROWS = 16  # that a thread fills at a time


KERNELS = [guide_rows, upscale_rows]


def upscaled(
    picture: np.ndarray, coarse: Camera, fine: Camera, scene: Scene, threads: int = 0
) -> tuple[np.ndarray, np.ndarray]:
    """A picture (height, width, 4) of `coarse` in the pixels of `fine`, the same view: float32, as `picture`.

    Also which pixels show a surface, bool (height, width). threads: 0: as many as the machine has cores.
    """
    width, height = fine.film_size
    context = FrameContext(scene, replace(fine, aperture=0.0))
    guide = np.empty((height, width), GUIDE)
    result = np.empty((height, width, 4), np.float32)
    picture = np.ascontiguousarray(picture, np.float32)
    table = np.zeros(1, UPSCALE)
    record = table[0]
    record["guide"], record["coarse"], record["fine"] = address(guide), address(picture), address(result)
    record["width"], record["height"] = width, height
    record["coarse_width"], record["coarse_height"] = coarse.film_size
    corners = [np.array((camera.region or (0, 0))[:2], np.float64) for camera in (coarse, fine)]
    record["scale"] = scale = np.array([coarse.width / fine.width, coarse.height / fine.height])
    record["offset"] = scale * corners[1] - corners[0]

    def fill_guide(scratch: np.ndarray, first: int, last: int) -> None:
        guide_rows(context.record, context.camera_record, address(scratch), address(guide), width, first, last)

    count = threads or os.cpu_count() or 1
    rows = [(first, min(first + _ROWS, height)) for first in range(0, height, _ROWS)]
    with ThreadPoolExecutor(count, "restir-upscale") as pool:
        shares = [rows[k::count] for k in range(count)]
        list(pool.map(partial(_all, fill_guide), shares))
        list(pool.map(lambda pair: upscale_rows(record, *pair), rows))
    return result, guide["distance"] > 0.0


def _all(fill, rows: list[tuple[int, int]]) -> None:
    """Fill these rows with working memory of their own."""
    scratch = np.zeros(rec.SCRATCH_BYTES, np.uint8)
    for first, last in rows:
        fill(scratch, first, last)
