"""Frames as large as a tile, for what is not reused by other pixels: a thread's stays in the processor's cache.

A whole frame takes a kilobyte a pixel. Where no pixel looks at another, all steps of a tile follow one another, and the
same few tiles of memory serve the whole picture.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from ..base import Tile
from ..resampling.frame import Frame


class TileFrames:
    """Frames for the tiles of a film, made by `new(width, height, mean_visibilities=...)`.

    mean_visibilities: what lights.mean_visibility keeps of each pixel of the film, float32 (height, width, 4).
    """

    def __init__(self, new, mean_visibilities: np.ndarray) -> None:
        self._new, self._mean_visibilities = new, mean_visibilities
        self._idle: deque[Frame] = deque()

    @contextmanager
    def at(self, tile: Tile) -> Iterator[Frame]:
        """A frame in which the pixels of a tile have their places, for one thread."""
        x0, y0, x1, y1 = tile
        width, height = x1 - x0, y1 - y0
        try:
            frame = self._idle.pop()
        except IndexError:
            frame = None
        if frame is None or frame.points.shape[0] < height or frame.points.shape[1] < width:
            frame = self._new(width, height, mean_visibilities=np.zeros((height, width, 4), np.float32))
        frame.place(tile)
        known = self._mean_visibilities[y0:y1, x0:x1]
        own = frame.mean_visibilities[:height, :width]
        own[:] = known
        yield frame
        known[:] = own
        self._idle.append(frame)
