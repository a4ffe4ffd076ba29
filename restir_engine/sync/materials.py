"""Materials, worlds and lights from Blender as programs in the scene's shader table."""

from __future__ import annotations

import logging

import bpy

from ..kernels.core.records import MATERIAL_BUMP_UNCORRECTED, MATERIAL_SUBSURFACE, MATERIAL_VARYING_EMISSION
from ..kernels.lobes.nodes import BSDF_NODES, DIFFUSE, MULTI_GGX, NORMAL, TANGENT
from ..kernels.shading import opcodes as ops
from ..scene.images import ImageTable
from ..scene.shaders import Program
from .changes import Changes
from .nodes import Compiler
from .nodes.outline import outline, stands_for_itself
from .nodes.subsurface import Subsurface, material_subsurface
from .nodes.templates import Templates
from .nodes.volumes import default_medium

log = logging.getLogger(__name__)

_EMISSION_SAMPLING = {"NONE": 0, "AUTO": 1, "FRONT": 2, "BACK": 3, "FRONT_BACK": 4}
_DEFAULT_COLOR = (0.8, 0.8, 0.8)  # of a slot without a material, as Cycles has it
_DEFAULT_NAME = "default_surface"  # as Cryptomatte names it
_DEFAULT_SURFACE = {"Base Color": 0.8, "Roughness": 0.5, "IOR": 1.5, "Alpha": 1.0}  # of Cycles' Principled, else 0


# Tables and images that programs no longer use are given up when there is so much more of them than there was.
_MOST_TABLES, _MOST_IMAGES = 1 << 20, 1 << 28  # floats, bytes


_Key = tuple[int | None, bool]  # session_uid of a datablock, None of an empty slot; whether it is that of grids


class Materials:
    """Indices of programs; each datablock is compiled when it is first asked for.

    They can serve one description after another: what is compiled from a datablock that has not changed is kept.
    """

    def __init__(self, scene) -> None:
        self._scene = scene
        self._indices: dict[_Key, int] = {}
        self._lights: dict[_Key, Program] = {}
        self._objects: dict[int, set[int]] = {}  # by datablock, whose places its program contains
        self._templates = Templates()
        self._stale: set[_Key] = set()
        self._kept = 0, 0  # size of tables and images when all was compiled

    def go_on(self, scene, changes: Changes | None) -> None:
        """Serve the description `scene`, which has no programs yet; changes: None where all is to be compiled again.

        A datablock keeps its index. What compiling a datablock has warned of is not said again.
        """
        shaders, images = self._scene.shaders, self._scene.images
        grown = shaders.table_size > self._kept[0] + _MOST_TABLES or images.nbytes > self._kept[1] + _MOST_IMAGES
        everything = changes is None or changes.shared or changes.images or grown
        for kind, names in self._scene.manifests.names.items():
            scene.manifests.names[kind].update(names if kind == "Material" else {})
        scene.shaders = shaders.copy(tables=not everything)
        scene.images = ImageTable(images) if everything else images.copy()
        for key in images if changes and changes.images else ():
            if key[0] in changes.images:
                scene.images.drop(key)
        if everything:
            stale, self._kept = {*self._indices, *self._lights}, (0, 0)
        else:
            named = changes.shaders | changes.places
            known = {*self._indices, *self._lights}
            stale = {key for key in known if key[0] in named or self._objects.get(key[0], set()) & named}
        self._stale |= stale
        self._templates = Templates()
        for key in stale:
            self._lights.pop(key, None)
        self._scene = scene

    def compiled(self) -> None:
        """All that the description needs has been asked for."""
        if self._kept == (0, 0):
            self._kept = self._scene.shaders.table_size, self._scene.images.nbytes

    def index(self, material: bpy.types.Material | None, in_grids: bool = False) -> int:
        """The program of a material; that of an empty slot for None. in_grids: of a box with grids of voxels."""
        return self._once(material, lambda: self._material(material, in_grids), in_grids)

    def compile_world(self, world: bpy.types.World | None) -> int:
        """The program of a world, -1 without one."""
        return -1 if world is None else self._once(world, lambda: self._world(world))

    def compile_light(self, light: bpy.types.Light) -> int:
        """The program whose emission multiplies the lamp's own, -1 when that is 1 everywhere."""
        if not _has_nodes(light):
            return -1
        key = light.original.session_uid, False
        if key not in self._lights:
            self._lights[key] = self._compiled(Compiler(self._scene, "Light", light.name), light)
        program = self._lights[key]
        constant = not program.flags & MATERIAL_VARYING_EMISSION
        if constant and all(abs(x - 1.0) < 1e-6 for x in program.emission_estimate):
            return -1
        return self._once(light, lambda: program)

    def _once(self, datablock, make, in_grids: bool = False) -> int:
        key = None if datablock is None else datablock.original.session_uid, in_grids
        if key not in self._indices:
            self._indices[key] = self._scene.shaders.add(make())
        elif key in self._stale:
            self._scene.shaders.replace(self._indices[key], make())
        self._stale.discard(key)
        return self._indices[key]

    def _material(self, material, in_grids: bool) -> Program:
        if material is None:
            program = self._default_medium() if in_grids else self._default()
            program.crypto_material = self._scene.manifests.note("Material", _DEFAULT_NAME)
            return program
        subsurface = Subsurface() if in_grids else material_subsurface(material)
        if in_grids:
            program = self._compiled(self._compiler(material, subsurface, in_grids=True), material)
        elif _has_nodes(material):
            program = self._tree(material, subsurface)
        else:
            program = self._plain(tuple(material.diffuse_color)[:3], DIFFUSE)
        if subsurface.medium and not program.flags & MATERIAL_SUBSURFACE:
            program = self._tree(material, subsurface, is_medium=True)
        program.pass_index = material.pass_index
        program.crypto_material = self._scene.manifests.note("Material", material.name)
        program.medium_priority = material.restir.medium_priority
        settings = getattr(material, "cycles", None)
        if in_grids and getattr(settings, "volume_interpolation", "LINEAR") == "CUBIC":
            self._scene.warnings.add("Material", material.name, "cubic interpolation of grids is linear")
        if not getattr(settings, "use_bump_map_correction", True):
            program.flags |= MATERIAL_BUMP_UNCORRECTED
        program.emission_sampling = _EMISSION_SAMPLING.get(getattr(settings, "emission_sampling", "AUTO"), 1)
        return program

    def _tree(self, material, subsurface: Subsurface, is_medium: bool = False) -> Program:
        return self._compiled(self._compiler(material, subsurface, is_medium), material)

    def _compiler(self, material, subsurface, is_medium: bool = False, in_grids: bool = False) -> Compiler:
        compiler = Compiler(self._scene, "Material", material.name)
        compiler.transparent_shadows = material.use_transparent_shadow or in_grids
        compiler.displacement_method = material.displacement_method
        compiler.subsurface, compiler.is_medium, compiler.in_grids = subsurface, is_medium, in_grids
        return compiler

    def _world(self, world) -> Program:
        if not _has_nodes(world):
            return self._plain(tuple(world.color), ops.EMISSION)
        return self._compiled(Compiler(self._scene, "World", world.name), world)

    def _compiled(self, compiler: Compiler, datablock) -> Program:
        """The program of a datablock's tree; one that defeats a converter is no reason to stop a render."""
        self._objects[datablock.original.session_uid] = compiler.objects
        try:
            if not _has_nodes(datablock):
                return compiler.compile(None)
            tree = datablock.node_tree
            found = outline(tree)
            if found is None and _to_inline(tree):
                inlined = datablock.inline_shader_nodes()  # its tree lives as long as this
                tree = inlined.node_tree
                found = outline(tree)
            return self._templates.program(compiler, tree, found)
        except (ArithmeticError, AttributeError, LookupError, RuntimeError, TypeError, ValueError) as error:
            log.exception("%s %r could not be compiled", compiler.kind, compiler.name)
            compiler.warn(f"cannot be read ({error}), it is rendered in plain colour")
            return self._plain(_DEFAULT_COLOR, DIFFUSE if compiler.kind == "Material" else ops.EMISSION)

    def _default(self) -> Program:
        """The program of a slot without a material: from Blender 5 on Principled, before Diffuse, both of 0.8."""
        if bpy.app.version < (5, 0, 0):
            return self._plain(_DEFAULT_COLOR, DIFFUSE)
        compiler = Compiler(self._scene, "Material", "")
        layout = BSDF_NODES["ShaderNodeBsdfPrincipled"]
        words = []
        for item in layout.inputs:
            value = _DEFAULT_SURFACE.get(item.name, item.missing)
            unlinked = item.default in (NORMAL, TANGENT)
            words.append(-1 if unlinked else compiler.constant(value if item.components == 1 else (value,) * 3))
        words += [MULTI_GGX, *[0] * (len(layout.enums) - 1)]
        compiler.emit(layout.opcode, compiler.one, *words)
        return compiler.program()

    def _default_medium(self) -> Program:
        """The program of grids of voxels without a material: Cycles' Principled Volume."""
        compiler = Compiler(self._scene, "Material", "")
        compiler.in_grids = True
        default_medium(compiler)
        return compiler.program()

    def _plain(self, color: tuple[float, float, float], opcode: int) -> Program:
        """A program of one colour that is scattered or emitted."""
        compiler = Compiler(self._scene, "Material", "")
        register = compiler.constant(color)
        if opcode == ops.EMISSION:
            compiler.emits(compiler.one, register, compiler.constant(1.0))
            compiler.emit(opcode, compiler.one, register, compiler.constant(1.0))
        else:
            compiler.emit(opcode, compiler.one, register, compiler.constant(0.0), -1)
        return compiler.program()


def _has_nodes(datablock) -> bool:
    # From 5.0 on there are nodes always and asking warns.
    return datablock.node_tree is not None and (bpy.app.version >= (5, 0, 0) or datablock.use_nodes)


def _to_inline(tree: bpy.types.NodeTree) -> bool:
    """Whether Blender shall put groups, zones, closures, bundles and switches in their place, as it can from 5.0 on.

    Only where there are any: it crashes on links that no tree should have (5.2.3: Menu to a shader).
    """
    if bpy.app.version < (5, 0, 0):
        return False
    return not all(map(stands_for_itself, {*map(type, tree.nodes.values())}))
