"""OpenEXR files as Cycles sees them: up to four channels of the first part, whatever they are called.

Blender hands out no pixels of files of several layers or parts, and what happens to be in memory where channels have
names of their own. So it is given a file of the first part alone. Nothing is decompressed: pixels stay as they are,
only the header names the channels that are shown R, G, B and A, or one of them Y, and the others by names that keep the
order of all (which is that of the pixels).
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

OPEN_EXR = b"\x76\x2f\x31\x01"  # how files begin
LONGEST_HEADER = 1 << 16  # bytes; of most
_TILED, _DEEP, _MULTIPART = 0x200, 0x800, 0x1000
_KEPT = (
    b"channels",
    b"compression",
    b"dataWindow",
    b"displayWindow",
    b"lineOrder",
    b"pixelAspectRatio",
    b"screenWindowCenter",
    b"screenWindowWidth",
    b"tiles",
)
_BY_NAME = (8, 9)  # DWAA and DWAB pack channels by their names, which then must stay

# Where channels stand among those of their layer; behind them, by name, all others.
_RANKS = {"R": 0, "X": 0, "G": 1, "Y": 1, "B": 2, "A": 3, "Z": 4}
_LAST = 5

# Files whose pixels Blender reads as Cycles does, by all their channels, or by those that are shown. It alone knows
# luminance and chroma.
_READ_BY_BLENDER = (("Y",), ("Y", "A"), ("R", "G", "B"), ("BY", "RY", "Y"), ("A", "BY", "RY", "Y"))
_COLORS = ("R", "G", "B", "A")


class Shown(NamedTuple):
    """What a texture shows of a file: some channels of a part, by their places: grey (and alpha) or RGB (and A)."""

    channels: tuple[int, ...]
    is_deep: bool  # then nothing is
    is_plain: bool  # Blender reads the same
    part: int = 0


def shown(data: bytes) -> Shown | None:
    """What is shown of a file, of which its first header is enough; None where it has no header of OpenEXR."""
    if data[:4] != OPEN_EXR:
        return None
    try:
        header, _ = attributes_at(data, 8)
        names = _names(header)
    except (LookupError, ValueError, struct.error):
        return None
    (version,) = struct.unpack_from("<I", data, 4)
    order = _ordered(names)[:4]
    chosen = tuple(names[place] for place in order)
    single = not version & _MULTIPART
    is_deep = bool(single and version & _DEEP) or _is_deep(header)
    plain = single and not is_deep and not any("." in name for name in names)
    plain &= tuple(names) in _READ_BY_BLENDER or chosen in (_COLORS, *_READ_BY_BLENDER[:3])
    return Shown(tuple(order), is_deep, plain)


def shown_packed(data: bytes) -> Shown:
    """What is shown of a file of layers or parts that is packed, which Blender reads: the first layer by its name."""
    headers, _ = _headers(data)
    layers: dict[str, tuple[int, list[int]]] = {}
    for part, header in enumerate(headers):
        own = header.get(b"name", (b"", b""))[1].decode("utf-8", "replace")
        for place, name in enumerate(_names(header)):
            layers.setdefault(name.rpartition(".")[0] or own, (part, []))[1].append(place)
    part, places = layers[min(layers)]
    names = [_names(headers[part])[place] for place in places]
    channels = tuple(places[k] for k in _ordered(names)[:4])
    return Shown(channels, any(map(_is_deep, headers)), False, part)


def _headers(data: bytes) -> tuple[list[dict[bytes, tuple[bytes, bytes]]], int]:
    """The attributes of each part, and where the places of chunks are."""
    (version,) = struct.unpack_from("<I", data, 4)
    headers, at = [], 8
    while data[at] or not headers:
        attributes, at = attributes_at(data, at)
        headers.append(attributes)
        if not version & _MULTIPART:
            return headers, at
    return headers, at + 1


def _is_deep(header: dict[bytes, tuple[bytes, bytes]]) -> bool:
    return header.get(b"type", (b"", b""))[1].startswith(b"deep")


def _names(header: dict[bytes, tuple[bytes, bytes]]) -> list[str]:
    return [name for name, _ in _channels(header[b"channels"][1])]


def _ordered(names: list[str]) -> list[int]:
    return sorted(range(len(names)), key=lambda place: _rank(names[place], names))


def _channels(entries: bytes) -> list[tuple[str, bytes]]:
    """(name, how it is stored) of the channels of a list, in the order of the pixels."""
    found, at = [], 0
    while entries[at]:
        end = entries.index(0, at)
        found.append((entries[at:end].decode("utf-8", "replace"), entries[end + 1 : end + 17]))
        at = end + 17
    return found


def _rank(name: str, names: list[str]) -> tuple:
    """Channels are sorted by layer, and in it by what they are."""
    layer, dot, short = name.rpartition(".")
    is_blue = short == "Z" and {f"{layer}{dot}X", f"{layer}{dot}Y"} <= set(names)
    return layer, 2 if is_blue else _RANKS.get(short, _LAST), short


def as_shown(data: bytes, found: Shown, luminance: Callable[[bytes], np.ndarray]) -> bytes | None:
    """A file that Blender reads as what is shown of another; None where channels are packed by their names.

    luminance: gives the pixels (height, width) of a file with channel Y, where names would put pixels in another order.
    """
    channels = found.channels
    names = _COLORS if len(channels) > 2 else ("Y", "A")
    file = _with_channels(data, found.part, dict(zip(channels, names, strict=False)))
    if file is not None:
        return file
    files = [_with_channels(data, found.part, {channel: "Y"}) for channel in channels]
    return None if None in files else _uncompressed(dict(zip(names, map(luminance, files), strict=False)))


def _uncompressed(channels: dict[str, np.ndarray]) -> bytes:
    """A file of channels (height, width) by name."""
    names = sorted(channels)
    pixels = np.stack([channels[name] for name in names], 1).astype("<f4")  # lines, channels, columns
    height, _, width = pixels.shape
    box = struct.pack("<4i", 0, 0, width - 1, height - 1)
    kind = struct.pack("<4i", 2, 0, 1, 1)
    head = _header(
        {
            b"channels": (b"chlist", b"".join(name.encode() + b"\0" + kind for name in names) + b"\0"),
            b"compression": (b"compression", b"\0"),
            b"dataWindow": (b"box2i", box),
            b"displayWindow": (b"box2i", box),
            b"lineOrder": (b"lineOrder", b"\0"),
            b"pixelAspectRatio": (b"float", struct.pack("<f", 1.0)),
            b"screenWindowCenter": (b"v2f", bytes(8)),
            b"screenWindowWidth": (b"float", struct.pack("<f", 1.0)),
        },
        version=2,
    )
    lines = [struct.pack("<2i", y, line.nbytes) + line.tobytes() for y, line in enumerate(pixels)]
    first, size = len(head) + 8 * height, len(lines[0])
    table = struct.pack(f"<{height}Q", *range(first, first + height * size, size))
    return head + table + b"".join(lines)


def _header(attributes: dict[bytes, tuple[bytes, bytes]], version: int) -> bytes:
    head = OPEN_EXR + struct.pack("<I", version)
    for name, (kind, value) in attributes.items():
        head += name + b"\0" + kind + b"\0" + struct.pack("<i", len(value)) + value
    return head + b"\0"


def _with_channels(data: bytes, part: int, called: dict[int, str]) -> bytes | None:
    """A file of one part, in which the channels at some places have other names, all others have none that count.

    None where that cannot be: the order of the pixels is that of the names.
    """
    (version,) = struct.unpack_from("<I", data, 4)
    headers, at = _headers(data)
    header = headers[part]
    channels = _renamed(_channels(header[b"channels"][1]), called)
    if channels is None or (header[b"compression"][1][0] in _BY_NAME and b"00" in channels):
        return None
    is_tiled = b"tiles" in header
    counts = [struct.unpack("<i", own[b"chunkCount"][1])[0] for own in headers if b"chunkCount" in own]
    counts = counts or [_chunk_count(data, at)]
    at, count = at + 8 * sum(counts[:part]), counts[part]
    step = 4 if version & _MULTIPART else 0
    offsets = struct.unpack_from(f"<{count}Q", data, at)
    kept = {name: header[name] for name in _KEPT if name in header}
    kept[b"channels"] = (b"chlist", channels)
    head = _header(kept, version & ~(_MULTIPART | _DEEP | _TILED) | _TILED * is_tiled)
    table, chunks, position = [], [], len(head) + 8 * count
    place = 16 if is_tiled else 4  # of the size: behind the tile's or the first line's number
    for offset in offsets:
        start = offset + step
        (size,) = struct.unpack_from("<i", data, start + place)
        chunks.append(data[start : start + place + 4 + size])
        table.append(position)
        position += place + 4 + size
    return head + struct.pack(f"<{count}Q", *table) + b"".join(chunks)


def _renamed(channels: list[tuple[str, bytes]], called: dict[int, str]) -> bytes | None:
    """The list of channels with new names; None where they are in another order."""
    first = min(called)
    names = [called.get(place, f"{'z' if place > first else '!'}{place:04d}") for place in range(len(channels))]
    if names != sorted(names):
        return None
    return b"".join(name.encode() + b"\0" + kind for name, (_, kind) in zip(names, channels, strict=True)) + b"\0"


def attributes_at(data: bytes, at: int) -> tuple[dict[bytes, tuple[bytes, bytes]], int]:
    """(type, value) of a header's attributes by name, and where the header ends."""
    found = {}
    while data[at]:
        end = data.index(0, at)
        name, at = data[at:end], end + 1
        end = data.index(0, at)
        kind, at = data[at:end], end + 1
        (size,) = struct.unpack_from("<i", data, at)
        found[name] = kind, data[at + 4 : at + 4 + size]
        at += 4 + size
    return found, at + 1


def _chunk_count(data: bytes, at: int) -> int:
    """How many places of chunks a file of one part lists from `at` on: until the first chunk begins."""
    count, end = 0, len(data)
    while at + 8 * count < end:
        end = min(end, *struct.unpack_from("<Q", data, at + 8 * count))
        count += 1
    return count
