"""What the headers of image files say of their alpha, where Blender's image does not tell."""

from __future__ import annotations

import struct
from pathlib import Path
from typing import NamedTuple

from .open_exr import LONGEST_HEADER, OPEN_EXR, shown

_GREY, _GREY_ALPHA = 0, 4  # colour types of PNG
_SAMPLES_PER_PIXEL, _EXTRA_SAMPLES = 277, 338  # tags of TIFF
_ASSOCIATED = 1


class FileAlpha(NamedTuple):
    """What a file's header says: whether its pixels are one channel (and alpha), and associated with alpha."""

    is_grey: bool = False
    is_associated: bool = False


def file_alpha(path: str) -> FileAlpha:
    """What a PNG, TIFF or OpenEXR file says of its channels; of others that they are colours of straight alpha."""
    with Path(path).open("rb") as file:
        head = file.read(26)
        if head[:4] == OPEN_EXR:
            found = shown(head + file.read(LONGEST_HEADER))
            return FileAlpha(is_grey=found is not None and len(found.channels) < 3)
        if head[:4] == b"\x89PNG":
            return FileAlpha(is_grey=head[25] in (_GREY, _GREY_ALPHA))
        if head[:4] in (b"II*\0", b"MM\0*"):
            tags = _tiff_tags(file, "<" if head[:2] == b"II" else ">")
            return FileAlpha(tags.get(_SAMPLES_PER_PIXEL, 1) < 3, tags.get(_EXTRA_SAMPLES) == _ASSOCIATED)
    return FileAlpha()


def _tiff_tags(file, order: str) -> dict[int, int]:
    """The first value of each tag of the first picture (of those that fit into the directory)."""
    file.seek(4)
    file.seek(struct.unpack(order + "I", file.read(4))[0])
    (count,) = struct.unpack(order + "H", file.read(2))
    tags = {}
    for _ in range(count):
        tag, kind, _, value = struct.unpack(order + "HHI4s", file.read(12))
        tags[tag] = struct.unpack(order + "H", value[:2])[0] if kind == 3 else struct.unpack(order + "I", value)[0]
    return tags
