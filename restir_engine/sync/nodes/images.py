"""Image and environment texture nodes."""

from __future__ import annotations

import numpy as np

from ...kernels.shading.textures import environment, image
from ...kernels.shading.textures import opcodes as ops
from ..images import associates_alpha, image_index, tile_indices
from .coordinates import texture_vector
from .registry import node

_EXTENSIONS = {"REPEAT": image.REPEAT, "EXTEND": image.EXTEND, "CLIP": image.CLIP, "MIRROR": image.MIRROR}
_INTERPOLATIONS = {"Linear": image.LINEAR, "Closest": image.CLOSEST, "Cubic": image.CUBIC, "Smart": image.CUBIC}
_PROJECTIONS = {"FLAT": image.FLAT, "SPHERE": image.SPHERE, "TUBE": image.TUBE}
_ENVIRONMENTS = {"EQUIRECTANGULAR": environment.EQUIRECTANGULAR, "MIRROR_BALL": environment.MIRROR_BALL}
_UNREADABLE = ("VIEWER",)


def _usable(c, source):
    """The image of a node, None (rendered magenta) where there is none."""
    if source is None:
        c.warn("no image is chosen: it is rendered magenta")
        return None
    if source.source in _UNREADABLE:
        c.warn(f"“{source.name}” is a render result, which cannot be a texture: it is rendered magenta")
        return None
    return source


def _index(c, node) -> int:
    return image_index(c.scene, node.image, node.image_user, c.warn)


def _flags(node, source, extension: int) -> int:
    flags = extension | _INTERPOLATIONS[node.interpolation] << 4
    uses_alpha = any(output.identifier == "Alpha" and output.is_linked for output in node.outputs)
    if uses_alpha and source is not None and associates_alpha(source):
        flags |= image.FLAG_UNASSOCIATE
    return flags


@node("ShaderNodeTexImage")
def image_texture(c, node):
    source = _usable(c, node.image)
    out = c.allocate(4)
    vector = texture_vector(c, node)
    flags = _flags(node, source, _EXTENSIONS[node.extension])
    if source is not None and source.source == "TILED" and node.projection != "BOX":
        tiles = tile_indices(c.scene, source, c.warn)
        table = c.table(np.array([len(tiles), *np.array(list(tiles.items())).ravel()], np.float32))
        c.emit(ops.IMAGE_TILES, out, vector, table, flags | _PROJECTIONS[node.projection] << 8)
    else:
        index = -1 if source is None else c.lookup(_index, node)
        if node.projection == "BOX":
            c.emit(ops.IMAGE_BOX, out, vector, index, flags, c.constant(node.projection_blend))
        else:
            c.emit(ops.IMAGE, out, vector, index, flags | _PROJECTIONS[node.projection] << 8)
    return {"Color": out, "Alpha": out + 3}


@node("ShaderNodeTexEnvironment")
def environment_texture(c, node):
    source = _usable(c, node.image)
    out = c.allocate(4)
    index = -1 if source is None else c.lookup(_index, node)
    flags = _flags(node, source, image.REPEAT)
    c.emit(ops.ENVIRONMENT, out, texture_vector(c, node), index, flags, _ENVIRONMENTS[node.projection])
    return {"Color": out}
