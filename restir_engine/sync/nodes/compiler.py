"""The walk through a shader tree that turns it into a program."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator

import bpy
import numpy as np

from ...kernels.core import records as rec
from ...kernels.core.vec import LARGEST_RADIANCE
from ...kernels.lobes.nodes import BSDF_NODES, PRINCIPLED_HAIR, TRANSPARENT
from ...kernels.shading import opcodes as ops
from ...scene.names import VERTEX_NORMAL, split_object_property
from ...scene.shaders import Program
from .assembler import Code, TooManyRegisters
from .bump import displaced_normal
from .fallback import unsupported_closure
from .proportional import proportional_to
from .prune import shadow_instructions
from .registry import CLOSURES, INSIDE, VOLUMES
from .sockets import COLOR, SHADER
from .subsurface import Subsurface, emit_medium
from .values import ValueCompiler

# Instructions that add a closure (or more) to what Cycles has room for; transparency is kept apart.
_LAYOUTS = (*BSDF_NODES.values(), *PRINCIPLED_HAIR.values())
_CLOSURE_OPCODES = frozenset(layout.opcode for layout in _LAYOUTS) - {TRANSPARENT}


class Compiler(ValueCompiler):
    """Compiles one tree of a material, world or light of `scene`.

    Converters use `value`, `vector`, `is_linked`, `constant`, `allocate`, `emit`, `table`, `attribute`, `warn`,
    `offset`, `scene`, and for closures `closure`, `emits` and `lets_light_through`.
    """

    def __init__(self, scene, kind: str, name: str) -> None:
        """`kind` and `name` are the datablock's, for warnings ("Material", "Skin")."""
        super().__init__(scene, kind, name)
        self.transparent_shadows = True  # False: opaque to shadow rays, whatever it is to others
        self.displacement_method = "BUMP"  # of the material
        self.subsurface = Subsurface()
        self.in_grids = False  # whether it is the material of grids of voxels, which have a volume and no surface
        self.is_medium = False  # whether the surface is the material's own medium, whatever is linked to the output
        self.flags = 0
        self.emission_estimate = np.zeros(3)
        self.one = self.constant((1.0, 1.0, 1.0))
        self.code: Code | None = None  # once it is compiled
        self._converters = CLOSURES  # or VOLUMES, INSIDE
        self._medium: list[list[int]] = []  # instructions of the medium inside
        self._displacement: list[list[int]] = []  # of what moves vertices
        self._aovs: list[list[int]] = []  # of AOV Output nodes
        self._medium_grid = -1  # the grid to which all of the medium's coefficients are proportional
        self._weight = self.one  # of the closure that is being compiled
        self._estimates: dict[int, float] = {self.one: 1.0}

    @property
    def terms(self) -> tuple:
        """What the program depends on beside the tree."""
        own = self.transparent_shadows, self.displacement_method, self.subsurface, self.in_grids, self.is_medium
        return self.kind, *own

    # Entry ----------------------------------------------------------------------------------------------------

    def compile(self, tree: bpy.types.NodeTree | None) -> Program:
        """The program of the tree's output for Cycles; an empty one when there is none."""
        limit = sys.getrecursionlimit()
        # Each node is a few calls deep, which lie on Python's heap, not on the stack.
        sys.setrecursionlimit(max(limit, _CALLS * _size(tree)))
        try:
            output = tree.get_output_node("CYCLES") if tree is not None else None
            self._links.read(tree)
            if output is not None:
                self._path = _path_to(tree, output)
                for group in self._path:
                    self._links.read(group.node_tree)
                self._surface(output)
            elif self.is_medium:
                emit_medium(self)
            if self.scene.aovs and tree is not None:
                self._path = ()
                self._aovs = self._apart(lambda: self._aov_outputs(tree))
            return self.program()
        except TooManyRegisters:
            self.warn("the node tree is too large, it is rendered black")
            return Program()
        finally:
            sys.setrecursionlimit(limit)
            self._cache.clear()  # what it holds refers to the compiler: left to the garbage collector it takes longer

    def program(self) -> Program:
        """What has been emitted so far as a program."""
        shadow = None
        if self.flags & rec.MATERIAL_TRANSPARENT:
            shadow = shadow_instructions(self) if self.transparent_shadows else []
        count = sum(instruction[0] in _CLOSURE_OPCODES for instruction in self.instructions)
        if count > rec.MAX_CLOSURES:
            self.warn(f"has {count} closures, of which {rec.MAX_CLOSURES} at most are rendered at a point")
        parts = {"medium": self._medium, "displacement": self._displacement, "aovs": self._aovs}
        self.code = self.finish(parts, shadow)
        is_alone = self.is_alone
        found = self.look_up(self.code)
        self.is_alone = is_alone  # what is missing is said of each tree
        return Program(
            *self.code.link(self.block_values(self.code), found),
            flags=self.flags,
            emission_estimate=tuple(self.emission_estimate),
            medium_grid=self._medium_grid,
            **self.code.starts,
        )

    def _surface(self, output: bpy.types.Node) -> None:
        self._nodes.append(output)
        if self.in_grids:
            self.medium(lambda: self.closure(output, "Volume", self.one))
            self._nodes.pop()
            return
        if self.is_linked(output, "Volume"):
            if self.kind == "Light":
                self.warn("volumes are not rendered")
            else:
                self._inside(output, "Volume", VOLUMES)
            if self.kind == "Material" and not self.is_linked(output, "Surface") and not self.is_medium:
                self._invisible_boundary()
        if self.subsurface.scatter_inside:
            self._inside(output, "Surface", INSIDE)
        if self.is_linked(output, "Displacement"):
            if self.displacement_method != "BUMP":
                self._displaced(output)
            if self.displacement_method != "DISPLACEMENT":
                normal = displaced_normal(self, output, self.displacement_method == "BOTH")
                self._cache.clear()
                self.emit(ops.SET_NORMAL, normal)
        if self.is_medium:
            emit_medium(self)
        else:
            self.closure(output, "Surface", self.one)
        bumped = self.is_linked(output, "Displacement") and self.displacement_method != "DISPLACEMENT"
        if bumped and self.flags & rec.MATERIAL_SUBSURFACE:
            self.flags |= rec.MATERIAL_BUMPED_EXIT
        self._nodes.pop()

    def medium(self, emit: Callable[[], None]) -> None:
        """Make the program one of grids of voxels: a medium, which emit() emits, with an invisible boundary."""
        self._add_medium(emit, VOLUMES)
        self._note_variation()
        self._invisible_boundary()

    def _inside(self, output: bpy.types.Node, socket: str, converters: dict) -> None:
        """Add what a tree says of the medium inside, by other converters than those of surfaces."""
        self._add_medium(lambda: self.closure(output, socket, self.one), converters)
        if socket == "Volume":
            self._note_variation()
        elif any(self._variation(instruction) for instruction in self._medium):
            self.warn("Scatter Inside has the values of the place where light enters")

    def _add_medium(self, emit: Callable[[], None], converters: dict) -> None:
        self._converters = converters
        self._medium += self._apart(emit)
        self._converters = CLOSURES
        if self._medium:
            self.flags |= rec.MATERIAL_MEDIUM

    def _apart(self, emit: Callable[[], None]) -> list:
        """The instructions that emit() emits: a part of the program that may use nothing that others have computed."""
        others, self.instructions = self.instructions, []
        self._cache.clear()
        emit()
        self._cache.clear()
        mine, self.instructions = self.instructions, others
        return mine

    def _displaced(self, output: bpy.types.Node) -> None:
        """Add the program by which vertices are displaced."""
        self.attribute(VERTEX_NORMAL)  # flat meshes are read with it
        self._displacement = self._apart(lambda: self.emit(ops.DISPLACE, self.vector(output, "Displacement")))
        if self.displacement_method == "DISPLACEMENT":
            self.flags |= rec.MATERIAL_DISPLACED_NORMALS

    def _aov_outputs(self, tree: bpy.types.NodeTree) -> None:
        """Emit what AOV Output nodes write, those within groups included."""
        for path, node in _aov_nodes(tree):
            channel, components = self.scene.aovs.get(node.aov_name, (-1, 0))
            if components:
                with self._at(path):
                    found = self.value(node, "Value") if components == 1 else self.vector(node, "Color")
                self.emit(ops.AOV, channel, components, found)

    def _invisible_boundary(self) -> None:
        """A mesh with nothing but a medium: rays pass its surface."""
        self.lets_light_through()
        self.flags |= rec.MATERIAL_BOUNDARY
        self.emit(TRANSPARENT, self.one, self.one)

    # What converters of closures call ---------------------------------------------------------------------------

    def closure(self, node: bpy.types.Node, name: str, weight: int) -> None:
        """Compile what is linked to a shader input, scaled by the rgb at `weight`."""
        found = self.inputs(node).find(name)
        if found is not None:
            self._closure_input(found[0], weight)

    def branches(self, node: bpy.types.Node, parts: list[tuple[str, int, float]]) -> None:
        """Compile shader inputs under weights of their own: (input, weight, share of the whole), skipped when 0."""
        found = [(self.inputs(node).find(name)[0], weight, share) for name, weight, share in parts]
        self._compile_shared([socket for socket, _, _ in found])
        whole = self._estimates.get(self._weight, 1.0)
        for socket, weight, share in found:
            self._estimates[weight] = whole * share
            before, cache = self.position, dict(self._cache)
            self._closure_input(socket, weight)
            # What the branch computed may have been skipped: nothing after it may use it.
            self._cache = cache
            if self.position > before + 1:
                self.insert_jump(before, weight)

    def emits(self, weight: int, color: int, strength: int, exact: bool = True) -> None:
        """Note that weight · colour · strength is emitted (if not exact: about that): flags and the estimate."""
        known = [self.constant_value(weight, 3), self.constant_value(color, 3), self.constant_value(strength)]
        if any(values is not None and not any(values) for values in known):
            return
        share = self._estimates.get(weight, 1.0) if known[0] is None else np.array(known[0])
        radiance = [np.array(values) if values is not None else np.ones(1) for values in known[1:]]
        with np.errstate(all="ignore"):
            radiance = share * radiance[0] * radiance[1]
            radiance = np.where(np.abs(radiance) <= LARGEST_RADIANCE, radiance, 0.0)
        if not exact or any(values is None for values in known) or (radiance < 0.0).any():
            self.flags |= rec.MATERIAL_VARYING_EMISSION
        self.flags |= rec.MATERIAL_EMITS
        self.emission_estimate += np.maximum(radiance, 0.0)

    def _note_variation(self) -> None:
        """Note whether the medium inside has to be asked for at points, and whether it varies by voxels alone."""
        found = {self._variation(instruction) for instruction in self._medium}
        if any(found):
            self.flags |= rec.MATERIAL_MEDIUM_VARIES
        if rec.MATERIAL_MEDIUM_TEXTURED in found:
            self.flags |= rec.MATERIAL_MEDIUM_TEXTURED
        self._medium_grid = proportional_to(self._medium, self)

    def _variation(self, instruction: list[int]) -> int:
        """What an instruction of a medium makes vary in space: 0 where it does not.

        MATERIAL_MEDIUM_VARIES: it reads voxels; MATERIAL_MEDIUM_TEXTURED: it depends on the point by itself.
        """
        opcode = instruction[0]
        if opcode in (ops.ATTRIBUTE, ops.ATTRIBUTE_FACTOR, ops.VOLUME_ATTRIBUTE):
            name = list(self.scene.attribute_names)[instruction[2]]
            return rec.MATERIAL_MEDIUM_VARIES if split_object_property(name) is None else 0
        textured = opcode in (ops.GEOMETRY, ops.WIREFRAME, ops.CAMERA_DATA) or 80 <= opcode < 200
        return rec.MATERIAL_MEDIUM_TEXTURED if textured else 0

    def lets_light_through(self) -> None:
        """Note that shadow rays may pass."""
        self.flags |= rec.MATERIAL_TRANSPARENT

    # The walk over closures -----------------------------------------------------------------------------------

    def _closure_input(self, socket, weight: int) -> None:
        source = self._links.into(socket)
        if source is not None:
            self._closure_output(source[0], source[1], weight)

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
                if self._converters is CLOSURES:
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
        converter = self._converters.get(node.bl_idname)
        if converter is not None:
            converter(self, node, weight)
        elif self._converters is CLOSURES:  # in volumes, shaders of surfaces are nothing to Cycles either
            unsupported_closure(self, node, weight)
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
        source = self._links.into(socket)
        if source is None:
            return
        node, output = source
        visit = (self._key(node), output.identifier)
        if visit in visited or self._is_known(visit[0]):
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
        for socket in self.inputs(node).sockets:
            self._upstream(socket, found, visited)
        if node.bl_idname != "NodeReroute" and output.type != SHADER:
            found[visit] = (self._path, node, output)


_CALLS = 40  # a node, at most


def _size(tree, around: tuple = ()) -> int:
    """How many nodes a tree has with those of its groups, each time that one is used."""
    if tree is None or tree in around:
        return 0
    inner = (getattr(node, "node_tree", None) for node in tree.nodes)
    return 500 + len(tree.nodes) + sum(_size(group, (*around, tree)) for group in inner if group is not None)


def _aov_nodes(tree, path: tuple = ()) -> Iterator[tuple[tuple[bpy.types.Node, ...], bpy.types.Node]]:
    """(group nodes around it, node) of each AOV Output node that is not muted."""
    for node in tree.nodes:
        if node.mute:
            continue
        if node.bl_idname == "ShaderNodeOutputAOV":
            yield path, node
        group = getattr(node, "node_tree", None)
        if group is not None and all(group != other.node_tree for other in path):
            yield from _aov_nodes(group, (*path, node))


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
