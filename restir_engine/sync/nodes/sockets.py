"""Sockets and links of a node tree as the compiler sees them.

Asking Blender is what reading a tree costs: the sockets of a node and the links of a tree are fetched once, and what
nodes of one type have in common is kept by type.
"""

from __future__ import annotations

from typing import NamedTuple

import bpy

from .registry import has_converter

INT, FLOAT, VECTOR, COLOR, SHADER = "INT", "VALUE", "VECTOR", "RGBA", "SHADER"
NUMBERS = (INT, FLOAT)
_KINDS = {
    "INT": INT,
    "BOOLEAN": INT,
    "VALUE": FLOAT,
    "VECTOR": VECTOR,
    "ROTATION": VECTOR,
    "RGBA": COLOR,
    "SHADER": SHADER,
}


def kind_of(socket: bpy.types.NodeSocket) -> str | None:
    """INT, FLOAT, VECTOR, COLOR or SHADER; None for sockets that carry nothing a program could use."""
    return _KINDS.get(socket.type)


class _Layout(NamedTuple):
    """The input sockets of a node."""

    places: dict[str, int]  # by identifier
    names: frozenset[str]
    kinds: tuple[str | None, ...]


_layouts: dict[str, _Layout] = {}  # of types whose nodes all have the same


class Inputs:
    """The input sockets of a node."""

    __slots__ = ("_layout", "sockets")

    def __init__(self, node: bpy.types.Node) -> None:
        self.sockets: list[bpy.types.NodeSocket] = node.inputs.values()
        name = node.bl_idname
        layout = _layouts.get(name)
        if layout is None or len(layout.kinds) != len(self.sockets):
            layout = _layout(self.sockets)
            if has_converter(name) and name.startswith("ShaderNode"):  # others have what the user gives them
                _layouts[name] = layout
        self._layout = layout

    def find(self, name: str) -> tuple[bpy.types.NodeSocket, str | None] | None:
        """The socket with this identifier (even one that a mode hides), else the first enabled one with this name;
        and its kind."""
        layout = self._layout
        place = layout.places.get(name)
        if place is None:
            place = self._named(name) if name in layout.names else None
        return None if place is None else (self.sockets[place], layout.kinds[place])

    def _named(self, name: str) -> int | None:
        return next((k for k, socket in enumerate(self.sockets) if socket.name == name and socket.enabled), None)


def _layout(sockets: list[bpy.types.NodeSocket]) -> _Layout:
    places = {socket.identifier: place for place, socket in reversed([*enumerate(sockets)])}
    return _Layout(places, frozenset(socket.name for socket in sockets), tuple(map(kind_of, sockets)))


def same_socket(sockets, socket: bpy.types.NodeSocket) -> bpy.types.NodeSocket | None:
    """The socket of a group node that belongs to one of its input or output node, or the other way round."""
    identifier = socket.identifier
    return next((other for other in sockets if other.identifier == identifier), None)


class Links:
    """The links that count, by the socket where they end: valid, not muted, between enabled sockets."""

    def __init__(self) -> None:
        self._trees: set[bpy.types.NodeTree] = set()
        self._sources: dict[bpy.types.NodeSocket, tuple[bpy.types.Node, bpy.types.NodeSocket]] = {}

    def read(self, tree: bpy.types.NodeTree | None) -> None:
        """Add the links of a tree whose sockets will be asked about."""
        if tree is None or tree in self._trees:
            return
        self._trees.add(tree)
        for link in tree.links.values():
            if link.is_valid and not link.is_muted:
                source, target = link.from_socket, link.to_socket
                if source.enabled and target.enabled:
                    self._sources[target] = link.from_node, source

    def into(self, socket: bpy.types.NodeSocket) -> tuple[bpy.types.Node, bpy.types.NodeSocket] | None:
        """The node and the output that a link into this socket comes from."""
        return self._sources.get(socket)

    @staticmethod
    def through_muted(node: bpy.types.Node, output: bpy.types.NodeSocket) -> bpy.types.NodeSocket | None:
        """The input of a muted node that its output passes on."""
        return next((link.from_socket for link in node.internal_links if link.to_socket == output), None)
