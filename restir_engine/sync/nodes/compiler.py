"""The walk through a shader tree that turns it into a program."""

from __future__ import annotations

import sys
from contextlib import contextmanager

import bpy
import numpy as np

from ...kernels import opcodes as ops
from ...kernels import records as rec
from ...scene.shaders import Program
from .assembler import Assembler, TooManyRegisters
from .bump import displaced_normal
from .fallback import unsupported_closure, unsupported_node
from .registry import CLOSURES, NODES, UNLINKED
from .sockets import COLOR, FLOAT, SHADER, VECTOR, Links, find_socket, kind_of, same_socket

# Up to 4.5 a value takes the type of each group socket that it passes; later Blender puts groups in their place first.
_BORDERS_CONVERT = bpy.app.version < (5, 0, 0)


class Compiler(Assembler):
    """Compiles one tree of a material, world or light of `scene`.

    Converters use `value`, `vector`, `is_linked`, `constant`, `allocate`, `emit`, `table`, `attribute`, `warn`,
    `offset`, `scene`, and for closures `closure`, `emits` and `lets_light_through`.
    """

    def __init__(self, scene, kind: str, name: str) -> None:
        """`kind` and `name` are the datablock's, for warnings ("Material", "Skin")."""
        super().__init__()
        self.scene = scene
        self.kind = kind
        self.name = name
        self.transparent_shadows = True  # whether shadow rays may see transparency at all
        self.displaces = False  # whether displacement is meant to move the surface
        self.flags = 0
        self.emission_estimate = np.zeros(3)
        self.one = self.constant((1.0, 1.0, 1.0))
        self._offset = 0
        self._filter = -1  # register of the bump filter width that shifted points were made with
        self._offset_read = False
        self._links = Links()
        self._path: tuple[bpy.types.Node, ...] = ()  # group nodes around the present node
        self._nodes: list[bpy.types.Node] = []  # being converted, for warnings and against cycles
        self._active: set = set()
        self._cache: dict = {}
        self._estimates: dict[int, float] = {self.one: 1.0}

    # What converters call -----------------------------------------------------------------------------------

    @property
    def offset(self) -> int:
        """0, or 1 and 2 while a bump's height is compiled at the points shifted by the footprint's two axes."""
        self._offset_read = True
        return self._offset

    @property
    def width(self) -> int:
        """The register of the shifted points' distance in footprints, the word after `offset` in instructions."""
        return self._filter if self.offset else self.constant(0.0)

    def value(self, node: bpy.types.Node, name: str, default: float = 0.0) -> int:
        """The register of an input as a float; of `default` when the node has no such socket."""
        return self._input_as(node, name, FLOAT, default)

    def vector(self, node: bpy.types.Node, name: str, default: float = 0.0) -> int:
        """The first register of an input as a vector or colour."""
        return self._input_as(node, name, VECTOR, default)

    def normal(self, node: bpy.types.Node, name: str = "Normal") -> int:
        """The register of a normal, -1 (the shading normal) when it is not linked."""
        return self.vector(node, name) if self.is_linked(node, name) else -1

    def is_linked(self, node: bpy.types.Node, name: str) -> bool:
        """Whether a link that counts ends at this input."""
        socket = find_socket(node.inputs, name)
        return socket is not None and self._links.into(socket) is not None

    def table(self, values) -> int:
        """The offset of these floats in the scene's tables."""
        return self.scene.shaders.table(values)

    def attribute(self, name: str) -> int:
        """The number of an attribute's name; "" is the render UV map."""
        return self.scene.attribute_name(name)

    def warn(self, text: str) -> None:
        """A warning that names the datablock and the node that is being converted."""
        place = f"node “{self._nodes[-1].name}”: " if self._nodes else ""
        self.scene.warnings.add(self.kind, self.name, place + text)

    def once(self, key, make) -> int:
        """The register that `make()` returns, made once for a key (and a bump's offset, where `make` reads it)."""
        return self._cached(("once", key), make)

    def closure(self, node: bpy.types.Node, name: str, weight: int) -> None:
        """Compile what is linked to a shader input, scaled by the rgb at `weight`."""
        socket = find_socket(node.inputs, name)
        if socket is not None:
            self._closure_input(socket, weight)

    def branches(self, node: bpy.types.Node, parts: list[tuple[str, int, float]]) -> None:
        """Compile shader inputs under weights of their own: (input, weight, share of the whole), skipped when 0."""
        found = [(find_socket(node.inputs, name), weight, share) for name, weight, share in parts]
        self._compile_shared([socket for socket, _, _ in found])
        whole = self._estimate
        for socket, weight, share in found:
            self._estimates[weight] = whole * share
            before, cache = self.position, dict(self._cache)
            self._closure_input(socket, weight)
            # What the branch computed may have been skipped: nothing after it may use it.
            self._cache = cache
            if self.position > before + 1:
                self.insert_jump(before, weight)

    def emits(self, weight: int, color: int, strength: int) -> None:
        """Note that weight · colour · strength is emitted: flags and the estimate for light selection."""
        known = [self.constant_value(weight, 3), self.constant_value(color, 3), self.constant_value(strength)]
        if any(values is not None and not any(values) for values in known):
            return
        if any(values is None for values in known):
            self.flags |= rec.MATERIAL_VARYING_EMISSION
        self.flags |= rec.MATERIAL_EMITS
        share = self._estimates.get(weight, 1.0)
        radiance = [np.array(values) if values is not None else np.ones(1) for values in known[1:]]
        self.emission_estimate += share * np.maximum(radiance[0] * radiance[1], 0.0)

    def lets_light_through(self) -> None:
        """Note that shadow rays may pass."""
        self.flags |= rec.MATERIAL_TRANSPARENT

    @contextmanager
    def shifted(self, offset: int, filter_width: int):
        """Inside, the position and all coordinates are those of a point shifted for a bump."""
        before = self._offset, self._filter
        self._offset, self._filter = offset, filter_width
        yield
        self._offset, self._filter = before

    # Entry ----------------------------------------------------------------------------------------------------

    def compile(self, tree: bpy.types.NodeTree | None) -> Program:
        """The program of the tree's output for Cycles; an empty one when there is none."""
        limit = sys.getrecursionlimit()
        sys.setrecursionlimit(max(limit, 20000))
        try:
            output = tree.get_output_node("CYCLES") if tree is not None else None
            if output is not None:
                self._path = _path_to(tree, output)
                self._surface(output)
            return self.program()
        except TooManyRegisters:
            self.warn("the node tree is too large, it is rendered black")
            return Program()
        finally:
            sys.setrecursionlimit(limit)

    def program(self) -> Program:
        """What has been emitted so far as a program."""
        code, constants = self.finish()
        flags = self.flags if self.transparent_shadows else self.flags & ~rec.MATERIAL_TRANSPARENT
        return Program(code, constants, flags=flags, emission_estimate=tuple(self.emission_estimate))

    def _surface(self, output: bpy.types.Node) -> None:
        self._nodes.append(output)
        if self.is_linked(output, "Volume"):
            self.warn("volumes are not rendered")
        if self.is_linked(output, "Displacement"):
            if self.displaces:
                self.warn("displacement is rendered as bump")
            normal = displaced_normal(self, output)
            self._cache.clear()
            self.emit(ops.SET_NORMAL, normal)
        self.closure(output, "Surface", self.one)
        self._nodes.pop()

    # Values ---------------------------------------------------------------------------------------------------

    def _input_as(self, node, name, kind, default) -> int:
        socket = find_socket(node.inputs, name)
        if socket is None:
            return self.constant(default if kind == FLOAT else (default,) * 3)
        return self._convert(*self._input(node, socket), kind)

    def _input(self, node, socket) -> tuple[int, str]:
        """Register and kind of an input socket: what is linked to it, or its default."""
        link = self._links.into(socket)
        found = self._output(link.from_node, link.from_socket) if link else None
        kind = kind_of(socket)
        if found is None or kind in (SHADER, None):
            return self._unlinked(node, socket), kind
        return self._convert(*found, kind), kind

    def _unlinked(self, node, socket) -> int:
        kind = kind_of(socket)
        if kind == VECTOR and socket.hide_value and socket.name in UNLINKED:
            return UNLINKED[socket.name](self, node)
        if kind == FLOAT:
            return self.constant(float(socket.default_value))
        if kind in (COLOR, VECTOR):
            return self.constant(tuple(socket.default_value)[:3])
        return self.constant((0.0, 0.0, 0.0))

    def _output(self, node, socket) -> tuple[int, str] | None:
        """Register and kind of an output socket; None: as if there were no link."""
        kind = kind_of(socket)
        if node.bl_idname == "NodeReroute":
            link = self._links.into(node.inputs[0])
            if link is None:
                return None if kind in (SHADER, None) else (self.constant((0.0, 0.0, 0.0)), kind)
            return self._output(link.from_node, link.from_socket)
        if kind in (SHADER, None):
            return None
        if node.mute:
            source = self._links.through_muted(node, socket)
            return None if source is None else (self._convert(*self._input(node, source), kind), kind)
        inner = self._enter_or_leave(node, socket)
        if inner is not None:
            path, inner_node, inner_socket = inner
            if inner_node is None:
                return None
            with self._at(path):
                if not _BORDERS_CONVERT:
                    link = self._links.into(inner_socket)
                    found = self._output(link.from_node, link.from_socket) if link else None
                    if found is not None:
                        return found
                found = self._input(inner_node, inner_socket)
            return self._convert(*found, kind), kind
        register = self._convert_node(node).get(socket.identifier)
        if callable(register):
            register = self._cached((self._key(node), socket.identifier), register)
        return None if register is None else (register, kind)

    def _enter_or_leave(self, node, socket):
        """(path, node, input socket) that a group's or group input's output stands for; None for other nodes."""
        if node.bl_idname == "NodeGroupInput":
            if not self._path:
                return (), None, None
            parent = self._path[-1]
            return self._path[:-1], parent, same_socket(parent.inputs, socket)
        if getattr(node, "node_tree", None) is None and node.bl_idname != "ShaderNodeGroup":
            return None
        tree = node.node_tree
        if tree is None or any(tree == group.node_tree for group in (*self._path, node)[:-1]):
            if tree is not None:
                self.scene.warnings.add(self.kind, self.name, f"the node group “{tree.name}” contains itself")
            return self._path, None, None
        output = next((n for n in tree.nodes if n.bl_idname == "NodeGroupOutput" and n.is_active_output), None)
        inner = same_socket(output.inputs, socket) if output else None
        return (*self._path, node), output if inner else None, inner

    def _convert_node(self, node) -> dict:
        """The outputs of a node, by its converter; converted once for each place and offset."""
        key = self._key(node)

        def convert():
            if key in self._active:
                self.warn("is part of a cycle of links, which is cut here")
                return {}
            self._active.add(key)
            self._nodes.append(node)
            outputs = NODES.get(node.bl_idname, unsupported_node)(self, node)
            self._nodes.pop()
            self._active.discard(key)
            return outputs

        return self._cached(key, convert)

    def _cached(self, key, make):
        """What `make()` returns, kept for the present offset, or for all offsets when `make` did not ask for it."""
        shifted = (key, self._offset, self._filter)
        for known in (shifted, key):
            if known in self._cache:
                result, read = self._cache[known]
                self._offset_read |= read
                return result
        outer, self._offset_read = self._offset_read, False
        result = make()
        read = self._offset_read
        self._cache[shifted if read else key] = result, read
        self._offset_read |= outer
        return result

    def _key(self, node) -> tuple:
        return (*(group.as_pointer() for group in self._path), node.as_pointer())

    @contextmanager
    def _at(self, path):
        before, self._path = self._path, path
        yield
        self._path = before

    def _convert(self, register: int, kind: str, wanted: str) -> int:
        """A value as another kind: luminance of a colour, mean of a vector, the same float three times."""
        if (kind == FLOAT) == (wanted == FLOAT):
            return register
        if wanted == FLOAT:
            opcode = ops.LUMINANCE if kind == COLOR else ops.AVERAGE
            known = self.constant_value(register, 3)
            if known is not None:
                weights = (0.2126729, 0.7151522, 0.0721750) if kind == COLOR else (1 / 3, 1 / 3, 1 / 3)
                return self.constant(sum(a * b for a, b in zip(known, weights, strict=True)))
        else:
            opcode = ops.SPLAT
            known = self.constant_value(register)
            if known is not None:
                return self.constant(known * 3)
        return self._cached(("as", opcode, register), lambda: self._emit_conversion(opcode, register, wanted))

    def _emit_conversion(self, opcode, register, wanted) -> int:
        out = self.allocate(1 if wanted == FLOAT else 3)
        self.emit(opcode, out, register)
        return out

    # Closures -------------------------------------------------------------------------------------------------

    @property
    def _estimate(self) -> float:
        return self._estimates.get(self._weight, 1.0)

    _weight = 0

    def _closure_input(self, socket, weight: int) -> None:
        link = self._links.into(socket)
        if link is not None:
            self._closure_output(link.from_node, link.from_socket, weight)

    def _closure_output(self, node, socket, weight: int) -> None:
        if node.bl_idname == "NodeReroute":
            self._closure_input(node.inputs[0], weight)
            return
        if node.mute and socket.type == SHADER:
            source = self._links.through_muted(node, socket)
            if source is not None and source.type == SHADER:
                self._closure_input(source, weight)
            return
        if socket.type != SHADER:  # a value linked to a shader socket is an emission of that colour
            found = self._output(node, socket)
            if found is not None:
                color, strength = self._convert(*found, COLOR), self.constant(1.0)
                self.emits(weight, color, strength)
                self.emit(ops.EMISSION, weight, color, strength)
            return
        inner = self._enter_or_leave(node, socket)
        if inner is not None:
            path, inner_node, inner_socket = inner
            if inner_node is not None and inner_socket is not None:
                with self._at(path):
                    self._closure_input(inner_socket, weight)
            return
        self._closure_node(node, weight)

    def _closure_node(self, node, weight: int) -> None:
        key = self._key(node)
        if key in self._active:
            self.warn("is part of a cycle of links, which is cut here")
            return
        self._active.add(key)
        self._nodes.append(node)
        before, self._weight = self._weight, weight
        CLOSURES.get(node.bl_idname, unsupported_closure)(self, node, weight)
        self._weight = before
        self._nodes.pop()
        self._active.discard(key)

    # What branches have in common -----------------------------------------------------------------------------

    def _compile_shared(self, sockets) -> None:
        """Compile the value nodes that several of these shader inputs need, before any of them may be skipped."""
        seen: dict[tuple, tuple] = {}
        shared: dict[tuple, tuple] = {}
        for socket in sockets:
            found: dict[tuple, tuple] = {}
            self._upstream(socket, found)
            for key, place in found.items():
                (shared if key in seen else seen)[key] = place
        for path, node, output in shared.values():
            with self._at(path):
                self._output(node, output)

    def _upstream(self, socket, found: dict, visited: set | None = None) -> None:
        """Collect the values above an input socket: key → (path, node, output)."""
        visited = set() if visited is None else visited
        link = self._links.into(socket)
        if link is None:
            return
        node, output = link.from_node, link.from_socket
        visit = (self._key(node), output.identifier)
        if visit in visited:
            return
        visited.add(visit)
        if node.mute and node.bl_idname != "NodeReroute":
            source = self._links.through_muted(node, output)
            if source is not None:
                self._upstream(source, found, visited)
            return
        inner = None if node.bl_idname == "NodeReroute" else self._enter_or_leave(node, output)
        if inner is not None:
            path, _, inner_socket = inner
            if inner_socket is not None:
                with self._at(path):
                    self._upstream(inner_socket, found, visited)
            return
        for source in node.inputs:
            self._upstream(source, found, visited)
        if node.bl_idname != "NodeReroute" and output.type != SHADER:
            found[visit] = (self._path, node, output)


def _path_to(tree, output) -> tuple[bpy.types.Node, ...]:
    """The group nodes around an output node that lies inside groups of `tree`."""

    def search(inside, path):
        if inside == output.id_data:
            return path
        for node in inside.nodes:
            group = getattr(node, "node_tree", None)
            if group is not None and all(group != other.node_tree for other in path):
                found = search(group, (*path, node))
                if found is not None:
                    return found
        return None

    return search(tree, ()) or ()
