"""Image files of one colour, written byte by byte as paint programs write them."""

from __future__ import annotations

import struct
import zlib
from pathlib import Path

import numpy as np

_PNG_TYPES = {1: 0, 2: 4, 3: 2, 4: 6}  # channels → colour type


def write_png(path: Path, color: tuple[float, ...], bits: int, size: int = 8) -> None:
    """A PNG of straight alpha with 8 or 16 bits a channel: grey, grey and alpha, RGB or RGBA by the colour's length."""
    rows = np.tile(_integers(color, bits, ">"), (size, size))
    data = b"".join(b"\0" + row.tobytes() for row in rows)
    header = struct.pack(">IIBBBBB", size, size, bits, _PNG_TYPES[len(color)], 0, 0, 0)
    path.write_bytes(
        b"\x89PNG\r\n\x1a\n" + _chunk(b"IHDR", header) + _chunk(b"IDAT", zlib.compress(data)) + _chunk(b"IEND", b"")
    )


def write_tiff(path: Path, color: tuple[float, ...], bits: int, associated: bool = False, size: int = 8) -> None:
    """An uncompressed TIFF with 8 or 16 bits or 32-bit floats a channel; `associated`: it says so of its colours."""
    channels = len(color)
    pixel = np.array(color, "<f4") if bits == 32 else _integers(color, bits, "<")
    data = np.tile(pixel, size * size).tobytes()
    tags = [
        (256, 3, [size]),  # width
        (257, 3, [size]),  # height
        (258, 3, [bits] * channels),  # bits per sample
        (259, 3, [1]),  # no compression
        (262, 3, [2 if channels > 2 else 1]),  # RGB or black is zero
        (273, 4, [8]),  # where the one strip begins
        (277, 3, [channels]),
        (278, 3, [size]),  # rows of the strip
        (279, 4, [len(data)]),
        (284, 3, [1]),  # channels together
        (339, 3, [3 if bits == 32 else 1] * channels),  # floats or integers
    ]
    if channels in (2, 4):
        tags.append((338, 3, [1 if associated else 2]))  # what the last channel is
    tags.sort()
    directory = 8 + len(data)
    outside = directory + 2 + 12 * len(tags) + 4
    entries, extra = b"", b""
    for tag, kind, values in tags:
        packed = struct.pack("<" + ("H" if kind == 3 else "I") * len(values), *values)
        if len(packed) > 4:
            packed, extra = struct.pack("<I", outside + len(extra)), extra + packed
        entries += struct.pack("<HHI", tag, kind, len(values)) + packed.ljust(4, b"\0")
    head = b"II*\0" + struct.pack("<I", directory)
    path.write_bytes(head + data + struct.pack("<H", len(tags)) + entries + b"\0\0\0\0" + extra)


def _integers(color: tuple[float, ...], bits: int, order: str) -> np.ndarray:
    return np.rint(np.array(color) * (2**bits - 1)).astype(f"{order}u{bits // 8}")


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
