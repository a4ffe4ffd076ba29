"""OpenEXR files of several layers or parts, cut down to their first layer: Blender hands out no pixels of the whole.

Nothing is decompressed: pixels of one part stay as they are, only the header names the first layer's channels R, G, B
and A, and the others by names that keep the order of all (which is that of the pixels).
"""

from __future__ import annotations

import struct

_MAGIC = b"\x76\x2f\x31\x01"
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
)
_ROWS_OF_CHUNK = (1, 1, 1, 16, 32, 16, 32, 32, 32, 256)  # by compression: none, RLE, ZIPS, ZIP, PIZ, PXR24, B44(A), DWA
_BY_NAME = (8, 9)  # DWAA and DWAB pack channels by their names, which then must stay
_NAMES = {"X": "R", "Y": "G", "Z": "B"}


def first_layer(data: bytes) -> bytes | None:
    """A file with the first layer of the first part of an OpenEXR file of scan lines, None for any other file."""
    if data[:4] != _MAGIC:
        return None
    (version,) = struct.unpack_from("<I", data, 4)
    if version & (_TILED | _DEEP):
        return None
    headers, at = [], 8
    while data[at] or not headers:
        attributes, at = attributes_at(data, at)
        headers.append(attributes)
        if not version & _MULTIPART:
            break
    else:
        at += 1
    channels = _renamed(headers[0][b"channels"][1])
    compression = headers[0][b"compression"][1][0]
    if channels is None or (compression in _BY_NAME and b"00" in channels):
        return None
    counts = [_chunk_count(header) for header in headers]
    first, step = counts[0], 4 if version & _MULTIPART else 0
    offsets = struct.unpack_from(f"<{first}Q", data, at)
    kept = {name: headers[0][name] for name in _KEPT if name in headers[0]}
    kept[b"channels"] = (b"chlist", channels)
    head = _MAGIC + struct.pack("<I", version & ~_MULTIPART)
    for name, (kind, value) in kept.items():
        head += name + b"\0" + kind + b"\0" + struct.pack("<i", len(value)) + value
    head += b"\0"
    table, chunks, position = [], [], len(head) + 8 * first
    for offset in offsets:
        start = offset + step
        (size,) = struct.unpack_from("<i", data, start + 4)
        chunks.append(data[start : start + 8 + size])
        table.append(position)
        position += 8 + size
    return head + struct.pack(f"<{first}Q", *table) + b"".join(chunks)


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


def _chunk_count(header: dict[bytes, tuple[bytes, bytes]]) -> int:
    if b"chunkCount" in header:
        return struct.unpack("<i", header[b"chunkCount"][1])[0]
    _, low, _, high = struct.unpack("<4i", header[b"dataWindow"][1])
    rows = _ROWS_OF_CHUNK[header[b"compression"][1][0]]
    return (high - low) // rows + 1


def _renamed(channels: bytes) -> bytes | None:
    """The list of channels with new names; None where the first layer has no colours or is cut by another's names."""
    entries, at = [], 0
    while channels[at]:
        end = channels.index(0, at)
        entries.append((channels[at:end].decode("utf-8", "replace"), channels[end + 1 : end + 17]))
        at = end + 17
    layer = min(name.rpartition(".")[0] for name, _ in entries)
    names = []
    for index, (name, _) in enumerate(entries):
        owner, _, short = name.rpartition(".")
        if owner == layer and _NAMES.get(short, short) in "RGBA":
            names.append(_NAMES.get(short, short))
        else:
            names.append(f"{'z' if 'R' in names else '!'}{index:04d}")
    if not {"R", "G", "B"} <= set(names) or names != sorted(names):
        return None
    parts = [name.encode() + b"\0" + kind for name, (_, kind) in zip(names, entries, strict=True)]
    return b"".join(parts) + b"\0"
