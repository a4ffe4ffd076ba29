"""The film: sums of what kernels write for each pixel, and the passes made of them.

With adaptive sampling pixels have unlike numbers of samples: each is divided by its own.
"""

from __future__ import annotations

import numpy as np

from .kernels.core import records as rec
from .kernels.core.memory import address
from .kernels.film.more_data import more_data
from .scene.cryptomatte import KINDS
from .scene.record_owner import RecordOwner
from .settings import (
    BARE_CATCHER,
    CATCHER_BACKDROP,
    NOISY_IMAGE,
    PASS_BY_NAME,
    ROUGHNESS,
    SAMPLE_COUNT,
    SHADOW_CATCHER,
    SURROUNDINGS,
    Pass,
)

MORE_DATA = [PASS_BY_NAME[name] for name in ("Ambient Occlusion", ROUGHNESS, SURROUNDINGS)]
FAR = 1.0e10  # depth of the background, as Cycles gives it
TILE = 32  # pixels along a side


class Film(RecordOwner):
    """Pixels of `width` × `height` for a list of passes; every pixel holds sums over its samples.

    samples: how many have been taken of the pixels that have most. After `count_pixels`, `counts` (height, width) has
    the number of each pixel and `active` tells which are sampled on; before, both are None and all pixels are alike.
    `catcher_factor` (height, width, 3), where it is set, is shown as the pass Shadow Catcher: it has been denoised.
    shows_catchers: whether Combined has shadow catchers in it.
    """

    def __init__(
        self, width: int, height: int, passes: list[Pass], exposure: float = 1.0, transparent: bool = False
    ) -> None:
        self.width, self.height = width, height
        self.passes = passes
        self.exposure = exposure
        self.transparent = transparent
        self.catcher_factor: np.ndarray | None = None
        self.shows_catchers = any(item.name == CATCHER_BACKDROP for item in passes)
        self.samples = 0
        self.counts: np.ndarray | None = None
        self.active: np.ndarray | None = None
        self._by_name = {item.name: item for item in passes}
        self._offsets: dict[str, int] = {}
        channels = 0
        for item in passes:
            self._offsets[item.name] = channels
            channels += len(item.channels)
        self._slots = {kind: [item.name for item in passes if item.slots == kind] for kind in KINDS}
        self.pixels = np.zeros((height, width, channels), np.float32)
        self._record = np.zeros(1, rec.FILM)
        self._fill_record()

    def tiles(self, left: int = 0, below: int = 0) -> list[tuple[int, int, int, int]]:
        """Tiles (x0, y0, x1, y1), from the centre outwards; the first begin so many pixels before the film."""
        width, height = self.width, self.height
        tiles = [
            (max(x, 0), max(y, 0), min(x + TILE, width), min(y + TILE, height))
            for y in range(-below, height, TILE)
            for x in range(-left, width, TILE)
        ]
        centre = (0.5 * (width - TILE), 0.5 * (height - TILE))
        return sorted(tiles, key=lambda t: (t[0] - centre[0]) ** 2 + (t[1] - centre[1]) ** 2)

    def _fill_record(self) -> None:
        record = self._record[0]
        for name in rec.FILM.names:
            record[name] = -1
        record["pixels"] = address(self.pixels)
        record["width"], record["height"], record["channels"] = self.width, self.height, self.pixels.shape[2]
        for item in self.passes:
            if item.field:
                record[item.field] = self._offsets[item.name]
        record["alpha"] = record["combined"] + 3
        record["aovs"] = next((self._offsets[item.name] for item in self.passes if item.aov), -1)
        record["groups"] = next((self._offsets[item.name] for item in self.passes if item.light_group), -1)
        record["active"] = record["light_groups"] = record["more_data"] = 0
        record["light_passes"] = any(item.light and item.field.endswith("direct") for item in self.passes)
        record["summed"] = sum(len(item.channels) for item in self.passes if not item.slots)
        record["crypto_slots"] = 2 * max(map(len, self._slots.values()))
        record["data_passes"] = any((item.field or item.aov) and not item.light for item in self.passes)

    @property
    def has_catchers(self) -> bool:
        """Whether light on shadow catchers is accumulated."""
        return BARE_CATCHER in self._by_name

    def caught_record(self, name: str) -> np.ndarray:
        """FILM (1,) for what caught paths find and nothing else; name: the pass that it adds up to, one of two.

        That without objects finds the world behind catchers, where the film is not transparent.
        """
        record = np.zeros(1, rec.FILM)
        for field in rec.FILM.names:
            record[field] = -1
        for field in ("pixels", "width", "height", "channels", "active"):
            record[field] = self._record[field]
        for field in ("light_passes", "data_passes", "summed", "crypto_slots", "light_groups", "more_data"):
            record[field] = 0
        record["caught"] = self._offsets[name]
        if name == BARE_CATCHER:
            record["alpha"] = record["caught"] + 3
            record["backdrop"] = -1 if self.transparent else self._offsets.get(CATCHER_BACKDROP, -1)
        return record

    def light(self) -> np.ndarray:
        """Sums of all light, (height, width, 3), whatever becomes of it: what adaptive sampling judges."""
        combined = self.sums("Combined")[..., :3]
        return combined + self.sums(SHADOW_CATCHER) if self.has_catchers else combined

    @property
    def has_light_groups(self) -> bool:
        """Whether there are passes of light groups."""
        return bool(self._record[0]["groups"] >= 0)

    def know_light_groups(self, table: np.ndarray) -> None:
        """Tell kernels what belongs to which light group, where there are passes of them; LIGHT_GROUPS (1,)."""
        if self.has_light_groups:
            self._record[0]["light_groups"] = address(table)

    def take_no_more(self) -> None:
        """Let paths end at the first surface that lets nothing through; Combined stays black."""
        self._record[0]["combined"] = -1

    def load_code(self) -> None:
        """Compile or load what only some passes need."""
        if any(self._record[0][item.field] >= 0 for item in MORE_DATA):
            self._record[0]["more_data"] = more_data.address

    def count_pixels(self) -> None:
        """Count the samples of each pixel from now on; all are active."""
        self.counts = np.zeros((self.height, self.width), np.int32)
        self.active = np.ones((self.height, self.width), bool)
        self._record[0]["active"] = address(self.active)

    def sample_only(self, active: np.ndarray) -> None:
        """From now on sample these pixels only, bool (height, width)."""
        self.active[:] = active

    def add_samples(self, count: int) -> None:
        """Note that the active pixels have been given so many samples more."""
        self.samples += count
        self.catcher_factor = None
        if self.counts is not None:
            self.counts += np.int32(count) * self.active

    def _samples_of_pixels(self) -> np.ndarray | int:
        """Samples (height, width, 1) of each pixel, or of all; at least 1."""
        return max(self.samples, 1) if self.counts is None else np.maximum(self.counts, 1)[..., None]

    def sums(self, name: str) -> np.ndarray:
        """The accumulated values of a pass, a view (height, width, channels)."""
        start = self._offsets[name]
        return self.pixels[:, :, start : start + len(self._by_name[name].channels)]

    def mean(self, name: str) -> np.ndarray:
        """The mean of a pass over the samples, float32 (height, width, channels), not divided by its colour."""
        exposure = self.exposure if self._by_name[name].light else 1.0
        return self.sums(name) * (np.float32(exposure) / self._samples_of_pixels())

    def pass_array(self, name: str) -> np.ndarray:
        """A pass as Blender wants it: float32 (height, width, channels), rows bottom to top."""
        if name == SAMPLE_COUNT:
            counts = np.full((self.height, self.width), self.samples) if self.counts is None else self.counts
            return counts[..., None].astype(np.float32)
        if name == NOISY_IMAGE:
            name = "Combined"
        item = self._by_name[name]
        if item.slots:
            return self._mattes(item)
        if name == SHADOW_CATCHER:
            return self._catcher_factor() if self.catcher_factor is None else self.catcher_factor
        result = self.sums(name).copy()
        if not item.averaged:
            if name == "Depth":
                result[result == 0.0] = FAR
            return result
        scale = np.float32(1.0) / self._samples_of_pixels()
        if item.divide:
            divisor = self.sums(item.divide)
            result = np.divide(result, divisor, out=np.zeros_like(result), where=divisor != 0.0)
            scale = 1.0
        result *= np.asarray(scale, np.float32)
        if name == "Combined":
            result[:, :, 3] = np.clip(1.0 - result[:, :, 3], 0.0, 1.0)
            if self.shows_catchers:
                self._show_catchers(result)
            result[:, :, :3] *= self.exposure
        elif item.light:
            result[:, :, :3] *= self.exposure
        elif name == "Mist":
            result = 1.0 - result
        return result

    def load(self, passes: dict[str, np.ndarray], counts: np.ndarray) -> None:
        """Take the sums of another film by what its `pass_array` gives, of which its Combined shows no catchers.

        passes: float32 (height, width, channels) by name; counts: (height, width), the samples of each pixel.
        """
        self.count_pixels()
        self.add_samples(int(counts.max()))
        self.counts[:] = counts
        for item in sorted(self.passes, key=lambda item: bool(item.divide)):
            if item.name != SAMPLE_COUNT:
                self._put(item, passes[item.name])

    def _put(self, item: Pass, values: np.ndarray) -> None:
        """Set the sums of a pass to those of which `pass_array` makes these values; those it is divided by are set."""
        count = self.counts[..., None].astype(np.float32)
        sums = self.sums(item.name)
        if item.slots:
            sums[:] = values
            sums[..., 1::2] *= count
        elif item.name == SHADOW_CATCHER:
            bare, covered = self.sums(BARE_CATCHER)[..., :3], self._caught_share()
            sums[:] = bare * (1.0 + np.divide(values - 1.0, covered, out=np.zeros_like(values), where=covered > 0.0))
        elif not item.averaged:
            sums[:] = values
        else:
            sums[:] = 1.0 - values if item.name == "Mist" else values
            if item.name == "Combined":
                sums[..., 3] = 1.0 - values[..., 3]
            sums *= self.sums(item.divide) if item.divide else count
            if item.light and self.exposure > 0.0:
                sums[..., :3] /= self.exposure

    def add(self, other: Film, row: int, before: bool) -> None:
        """Add the samples of a film of the same passes to the rows from `row` on, and leave slots of Cryptomatte alone.

        before: its samples precede those that are there, so that first samples are its own.
        """
        rows, summed = slice(row, row + other.height), int(self._record[0]["summed"])
        first = other if before else self
        values = {item.name: first.sums(item.name) for item in self.passes if not item.averaged}
        values = {name: (array if before else array[rows]).copy() for name, array in values.items()}
        self.pixels[rows, :, :summed] += other.pixels[:, :, :summed]
        for name, array in values.items():
            self.sums(name)[rows] = array
        self.counts[rows] += other.counts
        self.samples = max(self.samples, int(self.counts[rows].max()))

    def slots(self, kind: str) -> np.ndarray:
        """The slots of a kind of Cryptomatte, a view (height, width, slots, 2) of ids and their weights."""
        names = self._slots[kind]
        start = self._offsets[names[0]] if names else 0
        return self.pixels[:, :, start : start + 4 * len(names)].reshape(self.height, self.width, -1, 2)

    def _caught_share(self) -> np.ndarray:
        """What shadow catchers cover of the pixels, (height, width, 1)."""
        through = self.sums(BARE_CATCHER)[..., 3:] / np.asarray(self._samples_of_pixels(), np.float32)
        return np.clip(1.0 - through, 0.0, 1.0)

    def _catcher_factor(self) -> np.ndarray:
        """Light on catchers over that without objects, (height, width, 3): 1 where there is none, or no catcher."""
        light = self.sums(BARE_CATCHER)[..., :3]
        factor = np.divide(self.sums(SHADOW_CATCHER), light, out=np.ones_like(light), where=light > 0.0)
        return 1.0 + self._caught_share() * (factor - 1.0)

    def _show_catchers(self, combined: np.ndarray) -> None:
        """Put the shadows on catchers into Combined, as Cycles does; see docs/shadow-catchers.md."""
        seen = (1.0 - combined[:, :, 3:]) * np.clip(self.pass_array(SHADOW_CATCHER).mean(2, keepdims=True), 0.0, 1.0)
        if self.transparent:
            combined[:, :, 3:] = 1.0 - seen
        else:
            combined[:, :, :3] += seen * self.sums(CATCHER_BACKDROP) / self._samples_of_pixels()
            combined[:, :, 3] = 1.0

    def _mattes(self, item: Pass) -> np.ndarray:
        """Two ids of a kind of Cryptomatte and what they cover of each pixel, as they rank by that."""
        names, slots = self._slots[item.slots], self.slots(item.slots)
        order = np.argsort(-slots[..., 1], axis=2, kind="stable")
        first = 2 * names.index(item.name)
        ranked = np.take_along_axis(slots, order[:, :, first : first + 2, None], axis=2)
        ranked[..., 1] *= np.float32(1.0) / self._samples_of_pixels()
        return ranked.reshape(self.height, self.width, 4)
