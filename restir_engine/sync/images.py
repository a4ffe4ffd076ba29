"""Blender's images as scene-linear pixels, through Blender's own image and colour code.

What Blender cannot give for an image as it is (another frame, another tile, an unusual colour space) comes from
temporary datablocks that are removed at once; the artist's own are never touched.
"""

from __future__ import annotations

import re
import struct
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path

import bpy
import numpy as np

from ..scene.images import srgb_decode
from .image_headers import FileAlpha, file_alpha
from .open_exr import LONGEST_HEADER, Shown, as_shown, shown, shown_packed
from .working_space import REC709, to_scene_linear, working_space

_ENCODED = "sRGB"
_RAW = "Non-Color"
_MOVING = ("SEQUENCE", "MOVIE")
# Files whose encoded values Blender turns into scene-linear floats when they have more than 8 bits: Cycles does not.
_ENCODED_FLOATS = ("PNG", "TIFF", "JPEG2000")


def image_index(scene, image: bpy.types.Image, image_user, warn) -> int:
    """The index of an image in `scene.images`, read when it is new; -1 where it is missing.

    `warn(text)` is told what is missing or only approximated.
    """
    image = image.original
    frame = _frame(image_user, scene.frame) if image.source in _MOVING else 0
    return _add(scene, image, frame, 0, warn)


def tile_indices(scene, image: bpy.types.Image, warn) -> dict[int, int]:
    """Index by number of each tile of a tiled image."""
    image = image.original
    return {tile.number: _add(scene, image, 0, tile.number, warn) for tile in image.tiles}


def associates_alpha(image: bpy.types.Image) -> bool:
    """Whether colours end up multiplied by alpha, and are divided again where a node's alpha output is used."""
    return not image.colorspace_settings.is_data and image.alpha_mode not in ("CHANNEL_PACKED", "NONE")


def _to_associate(image, is_float: bool, path: str | None) -> bool:
    """Whether Cycles multiplies the colours by alpha: from Blender 5 on if the image is set to straight, before all
    integers that are so in the file; never the grey of a file.

    path: the file that Cycles reads itself, None where it takes Blender's pixels.
    """
    if not associates_alpha(image):
        return False
    says = FileAlpha() if path is None else file_alpha(path)
    if bpy.app.version >= (5, 0, 0):
        return image.alpha_mode == "STRAIGHT" and not says.is_grey
    return not is_float and not says.is_grey and not says.is_associated


def _frame(user, frame: int) -> int:
    """The number of the file, or of the frame of a movie, that an ImageUser shows at a frame of the scene."""
    length = user.frame_duration
    if length == 0:
        return 0
    number = frame - user.frame_start + 1
    number = (number - 1) % length + 1 if user.use_cyclic else min(max(number, 0), length)
    return number + user.frame_offset


def _add(scene, image, frame: int, tile: int, warn) -> int:
    key = (image.session_uid, frame, tile)
    index = scene.images.find(key)
    if index is None:
        found = _read(image, frame, tile, warn)
        if found is None:
            return -1
        index = scene.images.add(key, *found)
    return index


def _read(image, frame: int, tile: int, warn) -> tuple[np.ndarray, np.ndarray | None] | None:
    """Pixels and decode table of an image, of one of its frames or tiles; None where it is missing."""
    part = f" (tile {tile})" if tile else f" (frame {frame})" if image.source in _MOVING else ""
    try:
        data = _odd_exr(image, frame, tile)
        is_packed = len(image.packed_files) > 0
        of_file = None if data is None else shown_packed(data) if is_packed else shown(data)
        if of_file is not None and of_file.is_deep:
            warn(f"image “{image.name}”{part} is a deep OpenEXR file, which is no texture")
            return None
        ways = partial(_by_blender, image, frame, tile), partial(_by_channels, data, of_file, image)
        for read in ways if is_packed else reversed(ways):  # Cycles, too, takes what Blender reads of a packed file
            found = read()
            if found is not None:
                return found
    except (RuntimeError, struct.error):  # the file cannot be read
        pass
    warn(f"image “{image.name}”{part} is missing")
    return None


def _by_blender(image, frame: int, tile: int) -> tuple[np.ndarray, np.ndarray | None] | None:
    """As `_read`, of what Blender can read."""
    with _loaded(image, frame, tile) as (source, path):
        return _pixels(source, image, path) if source is not None and source.size[0] and source.size[1] else None


def _by_channels(data: bytes | None, of_file: Shown | None, image) -> tuple[np.ndarray, np.ndarray | None] | None:
    """As `_read`, of an OpenEXR file by the channels that are shown; None where they cannot be told apart."""
    file = None if data is None else as_shown(data, of_file, _luminance)
    if file is None:
        return None
    with _written(file, image) as (source, path):
        return _pixels(source, image, path) if source.size[0] else None


def _odd_exr(image, frame: int, tile: int) -> bytes | None:
    """An OpenEXR file that Blender reads otherwise than Cycles; None of all other images."""
    if image.source not in ("FILE", "SEQUENCE", "TILED") or image.is_dirty:
        return None
    packed = next((file for file in image.packed_files if not tile or file.tile_number == tile), None)
    path = bpy.path.abspath(image.filepath, library=image.library)
    path = _numbered(path, frame) if image.source == "SEQUENCE" else _tile_path(path, tile) if tile else path
    if Path(path).suffix.lower() not in (".exr", ""):
        return None
    if packed is not None:
        data = packed.packed_file.data
    elif Path(path).is_file():
        with Path(path).open("rb") as file:
            data = file.read(LONGEST_HEADER)
            found = shown(data)
            data = data if found is not None and found.is_plain else data + file.read()
    else:
        return None
    found = shown(data)
    return None if found is None or found.is_plain else data


@contextmanager
def _written(data: bytes, like) -> Iterator[tuple[bpy.types.Image, str]]:
    """An image of the values of an OpenEXR file, in the colour space of another; and where the file is."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "channels.exr"
        path.write_bytes(data)
        with _temporary(str(path), like) as loaded:
            yield loaded


def _luminance(data: bytes) -> np.ndarray:
    """The pixels (height, width) of an OpenEXR file that has luminance alone, top row first."""
    with _written(data, None) as (source, _):
        width, height = source.size
        values = np.empty((height, width, source.channels), np.float32)
        source.pixels.foreach_get(values.reshape(-1))
    return values[::-1, :, 0]


@contextmanager
def _loaded(image, frame: int, tile: int) -> Iterator[tuple[bpy.types.Image | None, str | None]]:
    """A datablock whose pixels are those of the frame or tile, and the file, if it holds the file's own values.

    The datablock is the image itself where it can be.
    """
    path = bpy.path.abspath(image.filepath, library=image.library)
    if image.source == "SEQUENCE":
        with _temporary(_numbered(path, frame), image) as loaded:
            yield loaded
    elif image.source == "MOVIE":
        with _temporary(path, image) as (loaded, path):
            if loaded is not None and loaded.size[0]:
                loaded.scale(*loaded.size, frame=frame)  # the one way by which Blender gives a frame of a movie
            yield loaded, path
    elif image.source == "TILED" and tile != image.tiles[0].number:
        packed = next((file for file in image.packed_files if file.tile_number == tile), None)
        with tempfile.TemporaryDirectory() as folder:
            path = _tile_path(path, tile)
            if packed is not None:
                path = str(Path(folder) / Path(packed.filepath).name)
                Path(path).write_bytes(packed.packed_file.data)
            with _temporary(path, image) as loaded:
                yield loaded
    else:
        was_loaded = image.has_data
        try:
            with _own(image, path) as loaded:
                yield loaded
        finally:
            if image.source == "FILE" and not was_loaded and not image.is_dirty:
                image.buffers_free()  # Blender takes as much memory as before


@contextmanager
def _own(image, path: str) -> Iterator[tuple[bpy.types.Image, str | None]]:
    """As `_loaded`, of an image that stands for itself."""
    path = _tile_path(path, image.tiles[0].number) if image.source == "TILED" else path
    of_file = image.source in ("FILE", "TILED") and image.packed_file is None and not image.is_dirty
    if of_file and Path(path).is_file():
        if _is_converted(image):
            with _temporary(path, image) as loaded:
                yield loaded
        else:
            yield image, path
    else:
        yield image, None


def _is_converted(image) -> bool:
    """Whether Blender changes a file's values when it loads them: alpha, of bytes to straight and of floats to
    associated, and colours that more than 8 bits encode."""
    if image.is_float and image.file_format in _ENCODED_FLOATS:
        return True
    return image.alpha_mode == ("STRAIGHT" if image.is_float else "PREMUL") and not image.colorspace_settings.is_data


@contextmanager
def _temporary(path: str, like) -> Iterator[tuple[bpy.types.Image | None, str | None]]:
    """The values of the file at `path`, which is returned, too, in the colour space of another image, if there is one.

    Colours that more than 8 bits encode stay encoded. None where there is no such file.
    """
    if not Path(path).is_file():
        yield None, None
        return
    loaded = bpy.data.images.load(path, check_existing=False)
    try:
        encoded = loaded.is_float and loaded.file_format in _ENCODED_FLOATS
        space = _RAW if encoded or like is None else like.colorspace_settings.name
        if space:  # a file that cannot be read has none
            loaded.colorspace_settings.name = space
        loaded.alpha_mode = "CHANNEL_PACKED"
        yield loaded, path
    finally:
        bpy.data.images.remove(loaded)


def _numbered(path: str, frame: int) -> str:
    """The path with the last number in its file name replaced, as wide as it was."""
    file = Path(path)
    name = re.sub(r"\d+(?=\D*$)", lambda found: f"{frame:0{len(found.group())}d}", file.stem)
    return str(file.with_name(name + file.suffix))


def _tile_path(path: str, tile: int) -> str:
    u, v = (tile - 1001) % 10 + 1, (tile - 1001) // 10 + 1
    return path.replace("<UDIM>", str(tile)).replace("<UVTILE>", f"u{u}_v{v}")


def _pixels(source, image, path: str | None) -> tuple[np.ndarray, np.ndarray | None] | None:
    """(pixels, decode table) of a loaded datablock with the settings of `image`; path: see `_loaded`."""
    width, height = source.size
    values = np.empty(width * height * 4, np.float32)
    if len(source.pixels) != len(values):
        values = _fill_channels(source, width * height)
        if values is None:
            return None
    else:
        source.pixels.foreach_get(values)
    values = values.reshape(height, width, 4)
    if image.alpha_mode == "NONE":
        values[..., 3] = 1.0
    encoded = path is not None and source.is_float and source.file_format in _ENCODED_FLOATS
    if source.is_float and not encoded:  # Blender has made them scene-linear when it loaded the file
        if _to_associate(image, True, path):
            values[..., :3] *= values[..., 3:]
        return _finite(values), None
    name = image.colorspace_settings.name
    as_it_is = image.colorspace_settings.is_data or name == working_space()
    associate = _to_associate(image, False, path)
    if not as_it_is and not (name == _ENCODED and working_space() == REC709):
        return _converted(values, name, associate, _unassociates(image)), None
    decode = None if as_it_is else srgb_decode()
    if not encoded:
        return _bytes(values, associate), decode
    if associate:
        values[..., :3] *= values[..., 3:]
    return _finite(values), decode


def _unassociates(image) -> bool:
    """Whether Cycles takes the colours for multiplied by alpha when it converts their colour space."""
    if bpy.app.version >= (5, 0, 0):
        return image.alpha_mode in ("STRAIGHT", "PREMUL")
    return image.alpha_mode != "NONE"


def _converted(values: np.ndarray, name: str, associate: bool, unassociate: bool) -> np.ndarray:
    """Scene-linear colours of values in the colour space `name`, associated with alpha where they are or shall be."""
    alpha = values[..., 3:]
    part = (alpha > 0.0) & (alpha < 1.0) if unassociate and not associate else np.zeros(alpha.shape, bool)
    divided = np.divide(values, alpha, out=values.copy(), where=part)
    divided[..., 3:] = alpha
    result = _finite(to_scene_linear(divided, name))
    if associate:
        result[..., :3] *= alpha
    else:
        np.multiply(result[..., :3], alpha, out=result[..., :3], where=part)
    return result


def _finite(values: np.ndarray) -> np.ndarray:
    """Black and transparent where any channel is not a number: half a pixel would have another hue."""
    values[~np.isfinite(values).all(-1)] = 0.0
    return values


def _bytes(values: np.ndarray, associate: bool) -> np.ndarray:
    """Values in 0 … 1 as uint8, in strips so that a large image is not in memory once more."""
    pixels = np.empty(values.shape, np.uint8)
    strip = max(1, (1 << 18) // values.shape[1])
    for start in range(0, len(values), strip):
        rows = np.rint(values[start : start + strip] * 255.0).astype(np.uint8)
        if associate and rows[..., 3].min() < 255:
            rows[..., :3] = rows[..., :3].astype(np.uint16) * rows[..., 3:] // 255
        pixels[start : start + strip] = rows
    return pixels


def _fill_channels(source, count: int) -> np.ndarray | None:
    """RGBA values of an image that has fewer channels."""
    channels = source.channels
    if not channels or len(source.pixels) != count * channels:
        return None
    given = np.empty(count * channels, np.float32)
    source.pixels.foreach_get(given)
    given = given.reshape(count, channels)
    values = np.ones((count, 4), np.float32)
    values[:, :3] = given[:, :1] if channels < 3 else given[:, :3]
    if channels in (2, 4):
        values[:, 3] = given[:, -1]
    return values.ravel()
