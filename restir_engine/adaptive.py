"""Adaptive sampling: which pixels are done, by the noise that their samples show.

Samples are taken in pairs of halves of equal size. With a_i and b_i the sums of a pixel's samples in the halves of the
i-th pair and n its samples by now,

    s² = Σ (a_i - b_i)² / n²

is the variance of the pixel's mean (each difference has that of all samples of its pair). The error is

    e = Σ_rgb E|x| / √(Σ_rgb mean),   x normal with the variance s²,

which is what Cycles compares with its threshold (there from one pair, of all even and all odd samples). A pixel is
done when the variance of the 3 × 3 pixels about it says so, and all within REACH have it as well: few samples may have
missed what is rare. When to look depends on the number of samples alone, not on time or threads.

A range of the samples, a share q of all, is judged by itself, by the threshold / √q and with the share of the fewest
samples: merged with the other ranges, a pixel has the error and the samples that one render of all gives it.
"""

from __future__ import annotations

import math

import numpy as np

from .film import Film
from .settings import RenderSettings

REACH = 2  # pixels
FEWEST = 8  # samples of a half
_MEAN_ABSOLUTE = math.sqrt(2.0 / math.pi)  # of a normal distribution, in standard deviations


def min_samples(threshold: float, wanted: int) -> int:
    """The samples that every pixel gets: those wanted; 0: as many as Cycles takes by its threshold."""
    return wanted or max(4, math.ceil(16.0 / threshold**0.3))


def half_size(samples: int) -> int:
    """Samples of each half of the pair that begins after so many: a power of two, about an eighth of them."""
    return max(FEWEST, 1 << max(samples // 8, 1).bit_length() - 1)


class Convergence:
    """The pixels of a film that still are to be sampled; the film is told which."""

    def __init__(self, film: Film, settings: RenderSettings) -> None:
        self._film = film
        share = settings.share
        self._threshold = max(settings.adaptive_threshold, 1e-5) / math.sqrt(share)
        self._min_samples = share * min_samples(settings.adaptive_threshold, settings.adaptive_min_samples)
        shape = film.height, film.width, 3
        self._before = np.zeros(shape, np.float32)
        self._first = np.zeros(shape, np.float32)  # what the first half of the pair in progress has added
        self._squares = np.zeros(shape, np.float64)
        self._in_second = False
        self._size = half_size(0)
        self._next = self._size
        film.count_pixels()

    @property
    def left(self) -> int:
        """Samples until the end of this half."""
        return self._next - self._film.samples

    def add(self) -> bool:
        """Take in a batch that has reached the film; True when all pixels are done."""
        film = self._film
        if film.samples < self._next:
            return False
        now = film.light()
        added = now - self._before
        self._before = now.copy()
        done = False
        if self._in_second:
            self._squares += np.square(added - self._first, dtype=np.float64)
            self._size = half_size(film.samples)
            if film.samples >= self._min_samples:
                film.sample_only(self._unconverged())
                done = not film.active.any()
        else:
            self._first = added
        self._in_second = not self._in_second
        self._next = film.samples + self._size
        return done

    def variance(self) -> np.ndarray:
        """s² of each pixel's mean, (height, width, 3), by the pairs that are complete."""
        return self._squares / np.maximum(self._film.counts, 1)[..., None].astype(np.float64) ** 2

    def _unconverged(self) -> np.ndarray:
        """Pixels (height, width) above the threshold, and those about them."""
        film = self._film
        count = np.maximum(film.counts, 1)[..., None]
        exposure = film.exposure
        deviation = np.sqrt(_over_square(self.variance(), 1, np.add) / 9.0)
        brightness = exposure * np.maximum(film.light() / count, 0.0).sum(2)
        error = _MEAN_ABSOLUTE * exposure * deviation.sum(2) / (np.sqrt(brightness) + 1e-4)
        return _over_square(~(error < self._threshold), REACH, np.maximum)


def _over_square(values: np.ndarray, reach: int, combine: np.ufunc) -> np.ndarray:
    """Each pixel combined with all that are at most `reach` rows and columns away; at edges the last ones repeat."""
    for axis in (0, 1):
        width = [(reach, reach) if k == axis else (0, 0) for k in range(values.ndim)]
        padded = np.pad(values, width, "edge")
        size = values.shape[axis]
        parts = [np.take(padded, range(k, k + size), axis) for k in range(2 * reach + 1)]
        values = combine.reduce(parts)
    return values
