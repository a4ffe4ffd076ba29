"""What a node tree is like but for the numbers in its sockets: trees of one outline have programs of one kind."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from itertools import chain
from operator import attrgetter
from typing import NamedTuple

import bpy

from ..images import associates_alpha
from .coordinates import mapping_table

_COMMON = frozenset(bpy.types.Node.bl_rna.properties.keys())
# The beginnings of the types of nodes that stand for themselves in a tree.
_PLAIN = ("ShaderNode", "NodeReroute", "NodeFrame", "NodeImplicitConversion", "FunctionNodeInput")
_IGNORED = ("color_mapping", "image_user", "text")  # have no effect, are looked up with the image, are no setting


class Outline(NamedTuple):
    """A tree as it was read at once."""

    key: tuple  # equal where trees differ in nothing but numbers, and in what is looked up
    nodes: list[bpy.types.Node]
    sockets: list[bpy.types.NodeSocket]  # whose numbers may differ: all inputs, and outputs of nodes that hold values


class _Incomparable(Exception):
    """The tree depends on more than can be compared."""


def outline(tree: bpy.types.NodeTree) -> Outline | None:
    """The outline of a tree; None where its program depends on more: groups, objects, curves, a computed sky."""
    nodes = tree.nodes.values()
    types = [*map(type, nodes)]
    try:
        settings = [read(node) for read, node in zip(map(_settings, types), nodes, strict=True)]
    except _Incomparable:
        return None
    sockets = [*chain.from_iterable([node.inputs.values() for node in nodes])]
    place = dict(zip(sockets, range(len(sockets)), strict=True))
    number = dict(zip(nodes, range(len(nodes)), strict=True))
    wires = [
        (number[node], _OUTPUT(source), place[target], target.enabled, *state)
        for node, source, target, *state in map(_LINK, tree.links.values())
    ]
    key = tuple(types), tuple(settings), tuple(wires), tuple(map(_MUTE, nodes))
    for kind, node in zip(types, nodes, strict=True):
        if kind in _HOLDERS:
            sockets += node.outputs.values()
    return Outline(key, nodes, sockets)


# Whose outputs have values that the artist gives.
_HOLDERS = (bpy.types.ShaderNodeValue, bpy.types.ShaderNodeRGB, bpy.types.ShaderNodeNormal)


_LINK = attrgetter("from_node", "from_socket", "to_socket", "is_valid", "is_muted")
_OUTPUT, _MUTE = attrgetter("identifier", "enabled"), attrgetter("mute")


@cache
def stands_for_itself(kind: type[bpy.types.Node]) -> bool:
    """Whether nodes of a type are not groups, zones, closures, bundles or switches."""
    name = kind.bl_rna.identifier
    return name.startswith(_PLAIN) and name != "ShaderNodeGroup"


@cache
def _settings(kind: type) -> Callable:
    """What reads, of nodes of a type, all that is set in them and not in their sockets, in a form that compares."""
    properties = [item for item in kind.bl_rna.properties if item.identifier not in (*_COMMON, *_IGNORED)]
    if not stands_for_itself(kind) or any(map(_holds_several, properties)):
        return _incomparable
    pointers = [item.identifier for item in properties if item.type == "POINTER"]
    values = [item.identifier for item in properties if item.type != "POINTER"]
    readers = [(attrgetter(name), _POINTERS.get(name, _nothing)) for name in pointers]
    plain = attrgetter(*values) if values else lambda node: None
    if not readers:
        return plain
    return lambda node: (plain(node), *[read(get(node)) for get, read in readers])


def _holds_several(item: bpy.types.Property) -> bool:
    return item.type == "COLLECTION" or getattr(item, "is_array", False)


def _incomparable(_) -> None:
    raise _Incomparable


def _nothing(value) -> None:
    if value is not None:
        raise _Incomparable


def _mapping(mapping: bpy.types.TexMapping) -> bytes | None:
    table = mapping_table(mapping)
    return None if table is None else (mapping.vector_type, table.tobytes())


def _image(image: bpy.types.Image | None) -> tuple | None:
    """What a node makes of an image before it is looked up."""
    if image is None:
        return None
    if image.source in ("TILED", "VIEWER"):
        raise _Incomparable
    return image.source, associates_alpha(image)


_POINTERS = {
    "texture_mapping": _mapping,
    "color_ramp": attrgetter("interpolation"),
    "image": _image,
}
