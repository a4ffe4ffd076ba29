"""OpenEXR files of every kind, written byte by byte: scan lines and tiles of one or many levels, deep ones, parts."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from pathlib import Path

import numpy as np

SCAN, TILED, DEEP_SCAN, DEEP_TILED = "scanlineimage", "tiledimage", "deepscanline", "deeptile"
ONE, MIPMAP, RIPMAP = range(3)  # levels of tiled parts
_TILE = 8
_TILED_FLAG, _DEEP_FLAG, _MULTIPART_FLAG = 0x200, 0x800, 0x1000


@dataclass(frozen=True)
class Part:
    """Channels by name, float32 (height, width); a deep part has each of its pixels twice."""

    pixels: dict[str, np.ndarray]
    kind: str = SCAN
    levels: int = ONE
    name: str = "part"

    @property
    def is_tiled(self) -> bool:
        return self.kind in (TILED, DEEP_TILED)

    @property
    def is_deep(self) -> bool:
        return self.kind in (DEEP_SCAN, DEEP_TILED)

    @property
    def size(self) -> tuple[int, int]:
        """(width, height)."""
        return next(iter(self.pixels.values())).shape[::-1]


def write(path: Path, *parts: Part) -> None:
    """A file of uncompressed float32 channels."""
    several = len(parts) > 1
    flags = _MULTIPART_FLAG if several else _TILED_FLAG if parts[0].kind == TILED else 0
    flags |= _DEEP_FLAG if any(part.is_deep for part in parts) else 0
    chunks = [_chunks(part) for part in parts]
    heads = [_header(part, len(own), several or part.is_deep) for part, own in zip(parts, chunks, strict=True)]
    head = struct.pack("<II", 20000630, 2 | flags) + b"".join(heads) + b"\0" * several
    if several:
        chunks = [[struct.pack("<i", number) + chunk for chunk in own] for number, own in enumerate(chunks)]
    flat = [chunk for own in chunks for chunk in own]
    places = len(head) + 8 * len(flat) + np.cumsum([0, *map(len, flat[:-1])])
    path.write_bytes(head + places.astype("<u8").tobytes() + b"".join(flat))


def _header(part: Part, chunks: int, is_named: bool) -> bytes:
    width, height = part.size
    box = struct.pack("<4i", 0, 0, width - 1, height - 1)
    channels = b"".join(name.encode() + b"\0" + struct.pack("<4i", 2, 0, 1, 1) for name in sorted(part.pixels))
    attributes = [
        ("channels", "chlist", channels + b"\0"),
        ("compression", "compression", b"\0"),
        ("dataWindow", "box2i", box),
        ("displayWindow", "box2i", box),
        ("lineOrder", "lineOrder", b"\0"),
        ("pixelAspectRatio", "float", struct.pack("<f", 1.0)),
        ("screenWindowCenter", "v2f", bytes(8)),
        ("screenWindowWidth", "float", struct.pack("<f", 1.0)),
    ]
    if part.is_tiled:
        attributes.append(("tiles", "tiledesc", struct.pack("<IIB", _TILE, _TILE, part.levels)))
    if is_named:
        attributes += [
            ("name", "string", part.name.encode()),
            ("type", "string", part.kind.encode()),
            ("chunkCount", "int", struct.pack("<i", chunks)),
        ]
    if part.is_deep:
        attributes += [("version", "int", struct.pack("<i", 1)), ("maxSamplesPerPixel", "int", struct.pack("<i", 2))]
    packed = (f"{name}\0{kind}\0".encode() + struct.pack("<i", len(value)) + value for name, kind, value in attributes)
    return b"".join(packed) + b"\0"


def _chunks(part: Part) -> list[bytes]:
    width, height = part.size
    pixels = np.stack([part.pixels[name] for name in sorted(part.pixels)]).astype("<f4")
    if not part.is_tiled:
        return [struct.pack("<i", y) + _block(part, pixels[:, y : y + 1]) for y in range(height)]
    found = []
    for x_level, y_level in _levels(width, height, part.levels):
        level = pixels[:, :: 1 << y_level, :: 1 << x_level][:, : max(1, height >> y_level), : max(1, width >> x_level)]
        for y in range(0, level.shape[1], _TILE):
            for x in range(0, level.shape[2], _TILE):
                place = struct.pack("<4i", x // _TILE, y // _TILE, x_level, y_level)
                found.append(place + _block(part, level[:, y : y + _TILE, x : x + _TILE]))
    return found


def _levels(width: int, height: int, kind: int) -> list[tuple[int, int]]:
    across, down = width.bit_length(), height.bit_length()
    if kind == MIPMAP:
        return [(level, level) for level in range(max(across, down))]
    return [(x, y) for y in range(down) for x in range(across)] if kind == RIPMAP else [(0, 0)]


def _block(part: Part, pixels: np.ndarray) -> bytes:
    """Sizes and values of a chunk's pixels (channels, rows, columns)."""
    rows = pixels.transpose(1, 0, 2)
    if not part.is_deep:
        return struct.pack("<i", rows.nbytes) + rows.tobytes()
    values = rows.repeat(2, 2).tobytes()
    counts = np.tile(2 * np.arange(1, rows.shape[2] + 1, dtype="<i4"), (len(rows), 1)).tobytes()
    return struct.pack("<3Q", len(counts), len(values), len(values)) + counts + values
