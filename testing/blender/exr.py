"""The channels of an OpenEXR file of uncompressed scan lines, of one part or several."""

import struct
from pathlib import Path

import numpy as np

from restir_engine.sync.open_exr import attributes_at

_TYPES = {1: np.dtype("<f2"), 2: np.dtype("<f4")}
_MULTIPART = 0x1000


def kinds(path: str | Path) -> dict[str, np.dtype]:
    """How the channels of a file's first part are stored, by name."""
    header, _ = attributes_at(Path(path).read_bytes(), 8)
    return dict(_entries(header[b"channels"][1]))


def channels(path: str | Path) -> dict[str, np.ndarray]:
    """Float32 (height, width) by name, rows bottom to top; names of parts are put before those of their channels."""
    data = Path(path).read_bytes()
    several = struct.unpack_from("<I", data, 4)[0] & _MULTIPART
    headers, at = [], 8
    while data[at] or not headers:
        header, at = attributes_at(data, at)
        headers.append(header)
        if not several:
            break
    else:
        at += 1
    found = {}
    for header in headers:
        x0, y0, x1, y1 = struct.unpack("<4i", header[b"dataWindow"][1])
        width, height = x1 - x0 + 1, y1 - y0 + 1
        if header[b"compression"][1] != b"\0":
            raise ValueError(f"{path} is compressed")
        offsets = struct.unpack_from(f"<{height}Q", data, at)
        at += 8 * height
        part = header[b"name"][1].decode() + "." if several else ""
        entries = list(_entries(header[b"channels"][1]))
        arrays = [np.empty((height, width), np.float32) for _ in entries]
        for offset in offsets:
            start = offset + (4 if several else 0)
            (y,) = struct.unpack_from("<i", data, start)
            start += 8
            for (_, kind), array in zip(entries, arrays, strict=True):
                array[y1 - y] = np.frombuffer(data, kind, width, start)
                start += width * kind.itemsize
        names = (name if name.startswith(part) else part + name for name, _ in entries)
        found.update(zip(names, arrays, strict=True))
    return found


def _entries(channel_list: bytes):
    """(name, type) of the channels of a header, in the order of the pixels."""
    at = 0
    while channel_list[at]:
        end = channel_list.index(0, at)
        (kind,) = struct.unpack_from("<i", channel_list, end + 1)
        yield channel_list[at:end].decode(), _TYPES[kind]
        at = end + 17
