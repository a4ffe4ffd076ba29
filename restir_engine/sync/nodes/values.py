"""Values in a shader tree: the walk from an input socket up to what it is linked to."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from contextlib import contextmanager

import bpy
import numpy as np

from ...kernels.shading import opcodes as ops
from ..working_space import from_rec709, luminance_weights
from .assembler import LOOKED_UP, Assembler, Code
from .fallback import unsupported_node
from .registry import NODES, UNLINKED, has_converter
from .sockets import COLOR, FLOAT, INT, NUMBERS, SHADER, VECTOR, Inputs, Links, kind_of, same_socket

# Up to 4.5 a value takes the type of each group socket that it passes; later Blender puts groups in their place first.
_BORDERS_CONVERT = bpy.app.version < (5, 0, 0)

_INLINED = re.compile(r"^\d+_")  # what Blender puts before the names of nodes when it puts groups in their place


class ValueCompiler(Assembler):
    """Gives the register of any value of a tree, computing it first where it is not yet known."""

    def __init__(self, scene, kind: str, name: str) -> None:
        """`kind` and `name` are the datablock's, for warnings ("Material", "Skin")."""
        super().__init__()
        self.scene = scene
        self.kind = kind
        self.name = name
        self._offset = 0
        self._filter = -1  # register of the bump filter width that shifted points were made with
        self._offset_read = False
        self._links = Links()
        self._inputs: dict[bpy.types.Node, Inputs] = {}
        self._path: tuple[bpy.types.Node, ...] = ()  # group nodes around the present node
        self._nodes: list[bpy.types.Node] = []  # being converted, for warnings and against cycles
        self._active: set = set()
        self._cache: dict = {}
        self.looked_at: dict = {}  # attributes of sockets that decide what code there is, by (socket, name)
        self.lookups: list[tuple[Callable[..., int], bpy.types.Node]] = []
        self.is_alone = False  # whether the program is of use for no other tree
        self.objects: set[int] = set()  # session_uids of those whose place is a constant of the program

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

    def converted(self, node: bpy.types.Node, name: str, output: bpy.types.NodeSocket) -> int:
        """The register of an input as what an output of the node is."""
        return self._input_as(node, name, kind_of(output), 0.0)

    def normal(self, node: bpy.types.Node, name: str = "Normal") -> int:
        """The register of a normal, -1 (the shading normal) when it is not linked."""
        return self.vector(node, name) if self.is_linked(node, name) else -1

    def is_linked(self, node: bpy.types.Node, name: str) -> bool:
        """Whether a link that counts ends at this input."""
        found = self.inputs(node).find(name)
        return found is not None and self._links.into(found[0]) is not None

    def inputs(self, node: bpy.types.Node) -> Inputs:
        """The input sockets of a node."""
        inputs = self._inputs.get(node)
        if inputs is None:
            inputs = self._inputs[node] = Inputs(node)
        return inputs

    def parameter(self, socket: bpy.types.NodeSocket) -> int:
        """The register of the number, vector or colour that a socket itself has."""
        register = self._known.get(socket)
        return self._new_constant(socket, numbers(socket)) if register is None else register

    def look_at(self, socket: bpy.types.NodeSocket, name: str = "default_value"):
        """An attribute of a socket that decides what is emitted."""
        value = self.looked_at[socket, name] = getattr(socket, name)
        return value

    def lookup(self, function: Callable[..., int], node: bpy.types.Node) -> int:
        """The immediate that function(compiler, node) gives, for this node and for those like it in other trees."""
        self.lookups.append((function, node))
        return LOOKED_UP + len(self.lookups) - 1

    def look_up(self, code: Code) -> list[int]:
        """What `lookups` give, as `code.link` takes it."""
        found = []
        for function, node in self.lookups:
            self._nodes = [node]
            found.append(function(self, node))
        self._nodes = []
        return [found[number] for number in code.lookups]

    def table(self, values) -> int:
        """The offset of these floats in the scene's tables."""
        return self.scene.shaders.table(values)

    def attribute(self, name: str) -> int:
        """The number of an attribute's name; "" is the render UV map."""
        return self.scene.attribute_name(name)

    def warn(self, text: str) -> None:
        """A warning that names the datablock and the node that is being converted."""
        self.is_alone = True
        place = f"node “{_INLINED.sub('', self._nodes[-1].name)}”: " if self._nodes else ""
        self.scene.warnings.add(self.kind, self.name, place + text)

    def once(self, key, make) -> int:
        """The register that `make()` returns, made once for a key (and a bump's offset, where `make` reads it)."""
        return self._cached(("once", key), make)

    @contextmanager
    def shifted(self, offset: int, filter_width: int):
        """Inside, the position and all coordinates are those of a point shifted for a bump."""
        before = self._offset, self._filter
        self._offset, self._filter = offset, filter_width
        yield
        self._offset, self._filter = before

    # Values ---------------------------------------------------------------------------------------------------

    def _input_as(self, node, name, kind, default) -> int:
        inputs = self._inputs.get(node) or self.inputs(node)
        found = inputs.find(name)
        if found is None:
            return self.constant(default if kind in NUMBERS else (default,) * 3)
        socket, own = found
        if kind == own == FLOAT and self._links.into(socket) is None:  # most inputs are
            return self.parameter(socket)
        return self._convert(*self._input(node, socket, own), kind)

    def _input(self, node, socket, kind) -> tuple[int, str]:
        """Register and kind of an input socket of this kind: what is linked to it, or its default."""
        source = self._links.into(socket)
        found = self._output(source[0], source[1]) if source is not None else None
        if found is None or kind in (SHADER, None):
            return self._unlinked(node, socket, kind), kind
        return self._convert(*found, kind), kind

    def _unlinked(self, node, socket, kind) -> int:
        if kind == VECTOR and self.look_at(socket, "hide_value") and socket.name in UNLINKED:
            return UNLINKED[socket.name](self, node)
        if kind in (INT, FLOAT, COLOR, VECTOR):
            return self.parameter(socket)
        return self.constant((0.0, 0.0, 0.0))

    def _output(self, node, socket) -> tuple[int, str] | None:
        """Register and kind of an output socket; None: as if there were no link."""
        kind, identifier = kind_of(socket), node.bl_idname
        if identifier == "NodeReroute":
            source = self._links.into(node.inputs[0])
            if source is None:
                return None if kind in (SHADER, None) else (self.constant((0.0, 0.0, 0.0)), kind)
            return self._output(source[0], source[1])
        if kind in (SHADER, None):
            return None
        if node.mute:
            source = self._links.through_muted(node, socket)
            return None if source is None else (self._convert(*self._input(node, source, kind_of(source)), kind), kind)
        inner = None if identifier in NODES else self._enter_or_leave(node, socket)
        if inner is not None:
            path, inner_node, inner_socket = inner
            if inner_node is None:
                return None
            with self._at(path):
                if not _BORDERS_CONVERT:
                    source = self._links.into(inner_socket)
                    found = self._output(source[0], source[1]) if source is not None else None
                    if found is not None:
                        return found
                found = self._input(inner_node, inner_socket, kind_of(inner_socket))
            return self._convert(*found, kind), kind
        register = self._convert_node(node, NODES.get(identifier, unsupported_node)).get(socket.identifier)
        if callable(register):
            register = self._cached((self._key(node), socket.identifier), register)
        return None if register is None else (register, kind)

    def _enter_or_leave(self, node, socket):
        """(path, node, input socket) that a group's or group input's output stands for; None for other nodes."""
        identifier = node.bl_idname
        if has_converter(identifier):
            return None
        if identifier == "NodeGroupInput":
            if not self._path:
                return (), None, None
            parent = self._path[-1]
            return self._path[:-1], parent, same_socket(parent.inputs, socket)
        if getattr(node, "node_tree", None) is None and identifier != "ShaderNodeGroup":
            return None
        tree = node.node_tree
        if tree is None or any(tree == group.node_tree for group in (*self._path, node)[:-1]):
            if tree is not None:
                self.scene.warnings.add(self.kind, self.name, f"the node group “{tree.name}” contains itself")
            return self._path, None, None
        output = next((n for n in tree.nodes if n.bl_idname == "NodeGroupOutput" and n.is_active_output), None)
        inner = same_socket(output.inputs, socket) if output else None
        return (*self._path, node), output if inner else None, inner

    def _convert_node(self, node, converter) -> dict:
        """The outputs of a node, by its converter; converted once for each place and offset."""
        key = self._key(node)

        def convert():
            if key in self._active:
                self.warn("is part of a cycle of links, which is cut here")
                return {}
            self._active.add(key)
            self._nodes.append(node)
            outputs = converter(self, node)
            self._nodes.pop()
            self._active.discard(key)
            return outputs

        return self._cached(key, convert)

    def _is_known(self, key) -> bool:
        return key in self._cache or (key, self._offset, self._filter) in self._cache

    def _cached(self, key, make):
        """What `make()` returns, kept for the present offset, or for all offsets when `make` did not ask for it."""
        shifted = (key, self._offset, self._filter)
        known = self._cache.get(shifted) or self._cache.get(key)
        if known is not None:
            result, read = known
            self._offset_read |= read
            return result
        outer, self._offset_read = self._offset_read, False
        result = make()
        read = self._offset_read
        self._cache[shifted if read else key] = result, read
        self._offset_read |= outer
        return result

    def _key(self, node) -> tuple:
        return self._path, node

    @contextmanager
    def _at(self, path):
        before, self._path = self._path, path
        if path:
            self._links.read(path[-1].node_tree)
        yield
        self._path = before

    def _convert(self, register: int, kind: str, wanted: str) -> int:
        """A value as another kind: luminance of a colour, mean of a vector, a number three times or truncated."""
        if wanted == INT:
            return register if kind == INT else self._truncated(self._convert(register, kind, FLOAT))
        if (kind in NUMBERS) == (wanted == FLOAT):
            return register
        if wanted == FLOAT and kind == COLOR:
            return self.luminance(register)
        if wanted == FLOAT:
            opcode, folded = ops.AVERAGE, self.folded(_mean, (register, 3))
        else:
            opcode, folded = ops.SPLAT, self.folded(_splat, (register, 1))
        if folded is not None:
            return folded
        return self._cached(("as", opcode, register), lambda: self._emit_conversion(opcode, register, wanted))

    def luminance(self, register: int) -> int:
        """The register of a colour's luminance, by the primaries of the file."""
        folded = self.folded(_luminance, (register, 3))
        if folded is not None:
            return folded
        if from_rec709() is None:
            return self._cached(("luminance", register), lambda: self._emit_conversion(ops.LUMINANCE, register, FLOAT))

        def weigh() -> int:
            out, dot = self.allocate(3), ops.VECTOR_OPERATIONS.index("DOT_PRODUCT")
            zero = self.constant((0.0, 0.0, 0.0))
            self.emit(ops.VECTOR_MATH, out, dot, register, self.constant(luminance_weights()), zero, self.constant(1.0))
            return out

        return self._cached(("luminance", register), weigh)

    def of_rec709(self, register: int) -> int:
        """The register of a linear Rec. 709 colour as one of the file's primaries."""
        matrix = from_rec709()
        if matrix is None:
            return register
        out = self.allocate(3)
        self.emit(ops.AFFINE, out, register, self.constant(tuple(np.column_stack([matrix, np.zeros(3)]).ravel())))
        return out

    def _truncated(self, register: int) -> int:
        """A number without its fraction."""
        folded = self.folded(_whole, (register, 1))
        if folded is not None:
            return folded

        def truncate() -> int:
            out, zero = self.allocate(1), self.constant(0.0)
            self.emit(ops.MATH, out, ops.MATH_OPERATIONS.index("TRUNC"), register, zero, zero)
            return out

        return self._cached(("truncated", register), truncate)

    def _emit_conversion(self, opcode, register, wanted) -> int:
        out = self.allocate(1 if wanted == FLOAT else 3)
        self.emit(opcode, out, register)
        return out


def numbers(socket: bpy.types.NodeSocket) -> tuple[float, ...]:
    """The number, or three of the numbers, that a socket itself has."""
    value = socket.default_value
    return (float(value),) if isinstance(value, (float, int)) else value[:3]


def _mean(values: tuple[float, ...]) -> tuple[float]:
    return (sum(values) / 3.0,)


def _splat(values: tuple[float, ...]) -> tuple[float, ...]:
    return values * 3


def _luminance(values: tuple[float, ...]) -> tuple[float]:
    return (sum(a * b for a, b in zip(values, luminance_weights(), strict=True)),)


def _whole(values: tuple[float, ...]) -> tuple[float]:
    return (float(math.trunc(values[0])) if math.isfinite(values[0]) else 0.0,)
