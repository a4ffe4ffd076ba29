"""The memory of an irradiance cache; see kernels.subsurface.irradiance_cache."""

from __future__ import annotations

import numpy as np

from ..kernels.core.memory import address
from ..kernels.subsurface import irradiance_cache as at

CELLS = 1 << 18


class IrradianceCache:
    """An empty cache for a picture; `merge` between batches of one sample, when no kernel runs."""

    def __init__(self, pixels: np.ndarray, cells: int = CELLS) -> None:
        height, width, channels = pixels.shape
        self._cells = np.zeros(cells, at.CELL)
        self._seen = np.zeros(height * width, at.OBSERVATION)
        self._header = np.zeros(at.SIZE, np.int64)
        header = {
            at.CELLS: address(self._cells), at.MASK: cells - 1, at.SEEN: address(self._seen), at.N_SEEN: height * width,
            at.PIXEL_BYTES: channels * pixels.itemsize,
        }  # fmt: skip
        for index, value in header.items():
            self._header[index] = value
        self.watch(pixels)

    @property
    def address(self) -> int:
        """What kernels know it by."""
        return address(self._header)

    @property
    def cells(self) -> np.ndarray:
        """The cells in use."""
        return self._cells[self._cells["key"] != 0]

    def watch(self, pixels: np.ndarray) -> None:
        """Name the pixels (height, width, channels) whose paths look."""
        self._header[at.PIXELS] = address(pixels)

    def merge(self) -> None:
        """Take in what the batch has seen."""
        at.merge(self.address)
