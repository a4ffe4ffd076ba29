"""Multilayer OpenEXR files as Blender writes them: view layers, views and passes, in one part or in a part a pass."""

from __future__ import annotations

import uuid
from pathlib import Path
from typing import NamedTuple

import numpy as np

from .record import Record, read_records

LOSSLESS = {"NO", "RLE", "ZIPS", "ZIP", "PIZ"}


class FileError(Exception):
    """A file that cannot be read, written or merged, in words for whoever named it."""


class Key(NamedTuple):
    """Whose pixels: `view` is "" where there is one view only; `name` is that of the pass in the file."""

    layer: str
    view: str
    name: str


class MultilayerFile:
    """A file in memory. Pixels are given and taken from bottom to top, as Blender has them, and of the rendered region
    alone, where the file has more.

    records: of the view layers that this engine has rendered. `keys` are those of their passes; `others` the names of
    all other channels, which are left out when the file is written.
    """

    def __init__(self, path: str | Path, header_only: bool = False) -> None:
        self.path = Path(path)
        if not self.path.is_file():
            raise FileError(f"“{path}” is not there.")
        try:
            self._file = _library().File(str(path), separate_channels=True, header_only=header_only)
        except (RuntimeError, ValueError) as error:
            raise FileError(f"“{path}” cannot be read: {error}") from error
        self.fields = {k: v for part in self._file.parts for k, v in part.header.items() if isinstance(v, str)}
        self.records: dict[str, Record] = read_records(self.fields)
        self._channels: dict[Key, dict[str, tuple[int, str]]] = {}
        self.others: list[str] = []
        for number, part in enumerate(self._file.parts):
            for channel in part.header["channels"]:
                self._sort_in(number, part, channel.name)

    def _sort_in(self, number: int, part, channel: str) -> None:
        view = part.header.get("view", "")
        name = channel if channel.count(".") else f"{part.name().removesuffix(f'-{view}')}.{channel}"
        layer = max((x for x in self.records if name.startswith(f"{x}.")), key=len, default=None)
        if layer is None:
            self.others.append(name)
            return
        rest, _, letter = name.removeprefix(f"{layer}.").rpartition(".")
        if not view and self._views and rest.rpartition(".")[2] in self._views:
            rest, _, view = rest.rpartition(".")
        self._channels.setdefault(Key(layer, view, rest), {})[letter] = number, channel

    @property
    def _views(self) -> list[str]:
        return self._file.parts[0].header.get("multiView", [])

    @property
    def keys(self) -> list[Key]:
        """All passes of view layers that there is a record of."""
        return list(self._channels)

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of what was rendered, in pixels."""
        return self._window[2:]

    @property
    def _window(self) -> tuple[int, int, int, int]:
        """The rendered region in the file: x, y, width, height from the lower left corner."""
        low, high = self._file.parts[0].header["dataWindow"]
        size = int(high[0] - low[0]) + 1, int(high[1] - low[1]) + 1
        region = next((record.region for record in self.records.values()), ())
        return region if region and region[2:] != size else (0, 0, *size)

    def pixels(self, key: Key, letters: str, rows: slice = slice(None)) -> np.ndarray:
        """Rows of a pass: float32 (height, width, channels), its channels in the order of their letters."""
        arrays = [self._pixels(key, letter)[rows] for letter in letters]
        result = np.empty((*arrays[0].shape, len(arrays)), np.float32)
        for k, array in enumerate(arrays):
            result[..., k] = array
        return result

    def put(self, key: Key, letters: str, values: np.ndarray) -> None:
        """Set the pixels of a pass; they are rounded to what the file has."""
        for k, letter in enumerate(letters):
            self._pixels(key, letter)[:] = values[:, :, k]

    def _pixels(self, key: Key, letter: str) -> np.ndarray:
        channels = self._channels[key]
        number, name = channels.get(letter) or channels[letter.swapcase()]
        x, y, width, height = self._window
        return self._file.parts[number].channels[name].pixels[::-1][y : y + height, x : x + width]

    def write(self, path: str | Path, fields: dict[str, str], without: set[Key] = frozenset()) -> None:
        """Write the passes, but for some, with text fields of the first part replaced; all of the file or nothing.

        Compression that loses something would lose it a second time: it becomes ZIP.
        """
        exr = _library()
        kept = {name for key, entries in self._channels.items() if key not in without for name in entries.values()}
        parts = []
        for number, part in enumerate(self._file.parts):
            channels = {name: c.pixels for name, c in part.channels.items() if (number, name) in kept}
            if channels:
                header = {k: v for k, v in part.header.items() if k not in ("channels", "chunkCount")}
                if header["compression"].name.partition("_")[0] not in LOSSLESS:
                    header["compression"] = exr.ZIP_COMPRESSION
                parts.append(exr.Part(header, channels, part.name()))
        parts[0].header.update(fields)
        path = Path(path)
        unfinished = path.with_name(f".{path.name}.{uuid.uuid4().hex}")  # of nobody else, on whatever machine
        try:
            exr.File(parts).write(str(unfinished))
            unfinished.replace(path)
        except (RuntimeError, OSError) as error:
            raise FileError(f"“{path}” cannot be written: {error}") from error
        finally:
            unfinished.unlink(missing_ok=True)


def _library():
    """The package OpenEXR, which is needed for merging alone."""
    try:
        import OpenEXR
    except ImportError as error:
        raise FileError(
            f"The Python package “openexr” is missing ({error}). Install the ReSTIR zip that was built for this "
            "Blender version and platform, or outside of Blender: pip install openexr."
        ) from error
    return OpenEXR
