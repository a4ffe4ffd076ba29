"""Sockets and links of a node tree as the compiler sees them."""

from __future__ import annotations

import bpy

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


# Where a socket of this identifier was found among so many: nodes of a type have it at the same place.
_places: dict[tuple[str, int], int] = {}


def find_socket(sockets, name: str) -> bpy.types.NodeSocket | None:
    """The socket with this identifier (even one that a mode hides), else the first enabled one with this name."""
    count = len(sockets)
    place = _places.get((name, count), -1)
    if place >= 0:
        socket = sockets[place]
        if socket.identifier == name:
            return socket
    by_name = None
    for index, socket in enumerate(sockets):
        if socket.identifier == name:
            _places[name, count] = index
            return socket
        if socket.name == name and by_name is None and socket.enabled:
            by_name = socket
    return by_name


def same_socket(sockets, socket: bpy.types.NodeSocket) -> bpy.types.NodeSocket | None:
    """The socket of a group node that belongs to one of its input or output node, or the other way round."""
    return next((other for other in sockets if other.identifier == socket.identifier), None)


class Links:
    """The links that count, by the socket where they end: valid, not muted, between enabled sockets."""

    def __init__(self) -> None:
        self._by_tree: dict[int, dict[int, bpy.types.NodeLink]] = {}

    def into(self, socket: bpy.types.NodeSocket) -> bpy.types.NodeLink | None:
        if not socket.is_linked:
            return None
        tree = socket.id_data
        links = self._by_tree.get(tree.as_pointer())
        if links is None:
            links = self._by_tree[tree.as_pointer()] = {
                link.to_socket.as_pointer(): link
                for link in tree.links
                if link.is_valid and not link.is_muted and link.from_socket.enabled and link.to_socket.enabled
            }
        return links.get(socket.as_pointer())

    @staticmethod
    def through_muted(node: bpy.types.Node, output: bpy.types.NodeSocket) -> bpy.types.NodeSocket | None:
        """The input of a muted node that its output passes on."""
        wanted = output.as_pointer()
        return next((link.from_socket for link in node.internal_links if link.to_socket.as_pointer() == wanted), None)
