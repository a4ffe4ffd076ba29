"""How coarse the pictures of a view are while something moves: as fine as the time that each may take allows."""

from __future__ import annotations

import math

COARSEST = 16  # pixels of the view along a side of one that is rendered
FIRST = 4  # where it is not known what a pixel costs
_FINER = 0.8  # a finer picture has to take no more than this share of the time, so that sizes do not alternate


class Pace:
    """Learns what pictures cost. seconds: what each of them may take."""

    def __init__(self, seconds: float) -> None:
        self._seconds = seconds
        self._cost = 0.0  # seconds a pixel
        self.step = FIRST  # pixels of the view along a side of one that is rendered

    def choose(self, pixels: int) -> int:
        """The step for the next picture of a view of so many pixels, which `step` is from now on."""
        if self._cost > 0.0:
            needed = self._fitting(pixels, self._seconds)
            if needed > self.step:
                self.step = needed
            else:
                self.step = min(self.step, self._fitting(pixels, _FINER * self._seconds))
        return self.step

    def _fitting(self, pixels: int, seconds: float) -> int:
        return min(max(math.ceil(math.sqrt(pixels * self._cost / seconds)), 1), COARSEST)

    def took(self, pixels: int, seconds: float) -> None:
        """Learn that a picture of so many pixels, as many as were rendered, took so long."""
        cost = seconds / max(pixels, 1)
        self._cost = cost if self._cost == 0.0 else 0.5 * (self._cost + cost)
