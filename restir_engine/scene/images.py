"""Images as kernels read them: 8-bit or float pixels, each image kept once."""

from __future__ import annotations

from collections.abc import Hashable, Iterator
from functools import cache

import numpy as np

from ..kernels.core import records as rec
from ..kernels.core.memory import address


@cache
def srgb_decode() -> np.ndarray:
    """Scene-linear values of sRGB-encoded ones, evenly over [0, 1] (IEC 61966-2-1)."""
    x = np.linspace(0.0, 1.0, rec.IMAGE_DECODE + 1)
    return np.where(x < 0.04045, x / 12.92, ((x + 0.055) / 1.055) ** 2.4).astype(np.float32)


class ImageTable:
    """The images of a scene by index and by key. Rows run from bottom to top, alpha is associated.

    before: a table whose images are taken over when they are asked for.
    """

    def __init__(self, before: ImageTable | None = None) -> None:
        self._pixels: list[np.ndarray] = []
        self._decodes: list[np.ndarray | None] = []
        self._indices: dict[Hashable, int] = {}
        self._before = before and before.copy()

    def copy(self) -> ImageTable:
        """A table of the same images, to be changed apart from this one."""
        result = ImageTable()
        result._pixels, result._decodes = list(self._pixels), list(self._decodes)
        result._indices = dict(self._indices)
        return result

    def __len__(self) -> int:
        return len(self._pixels)

    def same_as(self, other: ImageTable) -> bool:
        """Whether `other` has our arrays under our indices."""
        here, there = [*self._pixels, *self._decodes], [*other._pixels, *other._decodes]
        return len(here) == len(there) and all(a is b for a, b in zip(here, there, strict=True))

    @property
    def nbytes(self) -> int:
        """Memory that the pixels take."""
        return sum(pixels.nbytes for pixels in self._pixels)

    def __iter__(self) -> Iterator[Hashable]:
        """The keys of all images, in the order of their indices."""
        return iter(self._indices)

    def drop(self, key: Hashable) -> None:
        """Forget the image of before that was added under this key."""
        if self._before:
            self._before._indices.pop(key, None)

    def pixels(self, index: int) -> np.ndarray:
        """The pixels of an image (height, width, 4)."""
        return self._pixels[index]

    def find(self, key: Hashable) -> int | None:
        """The index of the image that was added under this key, here or before."""
        index = self._indices.get(key)
        there = self._before._indices.get(key) if index is None and self._before else None
        if there is not None:
            index = self.add(key, self._before._pixels[there], self._before._decodes[there])
        return index

    def add(self, key: Hashable, pixels: np.ndarray, decode: np.ndarray | None = None) -> int:
        """The index of new pixels, uint8 or float32 [height, width, 4]; those of a known key are replaced in place.

        `decode`: float32 [IMAGE_DECODE + 1], scene-linear values of encoded ones in [0, 1], applied after filtering.
        """
        if pixels.dtype not in (np.uint8, np.float32) or pixels.ndim != 3 or pixels.shape[2] != 4 or not pixels.size:
            raise ValueError(f"not an image: {pixels.dtype} {pixels.shape}")
        pixels = np.ascontiguousarray(pixels)
        index = self._indices.setdefault(key, len(self._pixels))
        if index == len(self._pixels):
            self._pixels.append(pixels)
            self._decodes.append(decode)
        else:
            self._pixels[index] = pixels
            self._decodes[index] = decode
        return index

    @property
    def arrays(self) -> list[np.ndarray]:
        """What `records` point to."""
        return [*self._pixels, *(decode for decode in self._decodes if decode is not None)]

    def records(self) -> np.ndarray:
        """IMAGE records; valid as long as `arrays` live."""
        records = np.zeros(len(self._pixels), rec.IMAGE)
        for record, pixels, decode in zip(records, self._pixels, self._decodes, strict=True):
            record["pixels"] = address(pixels)
            record["height"], record["width"] = pixels.shape[:2]
            record["flags"] = rec.IMAGE_BYTES if pixels.dtype == np.uint8 else 0
            record["decode"] = address(decode)
        return records
