"""Meshes that earlier frames have read, found again by what they hold.

Blender does not say what of a mesh has changed between two frames of an animation: every frame and view layer has a
depsgraph of its own, all of it new, unless "Persistent Data" is on. So what a mesh is made from is read each time, at
the speed of copying memory, and its digest is looked up. A mesh is the same where all of it is the same, whatever its
name, object or datablock; what Blender derives from it (triangles apart), what we do, and its structure are kept.

In the 3D view there is one depsgraph, which names what it has evaluated anew; a mesh that is where it was, and that
nothing names, is not even looked at.
"""

from __future__ import annotations

import copy
from collections.abc import Callable, Hashable
from typing import NamedTuple

import bpy
import numpy as np

from ..kernels.core.digest import digest
from ..scene import names
from ..scene.description import SceneDescription
from ..scene.mesh import Mesh
from ..scene.recent import Recent
from ..scene.shape import Shape
from .mesh import LAYOUTS, add_attributes, byte_colors, read_mesh
from .working_space import working_space

# Attributes that others are told apart by; all others that begin with a dot are selections and the like.
_TOPOLOGY = (".edge_verts", ".corner_vert")


class _Kept(NamedTuple):
    mesh: Shape | None
    asked: int  # how many names of attributes were known when it was read


class Memory(NamedTuple):
    """Where an evaluated mesh lies, and the `session_uid`s of all that it may be evaluated from."""

    address: int
    owners: frozenset[int]


def memory_of(data: bpy.types.Mesh, owners: tuple[bpy.types.ID | None, ...]) -> Memory:
    """The `Memory` of an evaluated mesh and its owners."""
    return Memory(data.as_pointer(), frozenset(owner.original.session_uid for owner in owners if owner is not None))


class _Standing(NamedTuple):
    key: Hashable
    shape: Hashable


class MeshCache:
    """Owner of the shapes that this frame and the one before have read, and of their attributes' names."""

    def __init__(self) -> None:
        self.attribute_names = names.reserved()
        self._meshes: Recent[_Kept] = Recent()  # by shape and look
        self._shapes: Recent[Mesh] = Recent()
        self._standing: Recent[_Standing] = Recent()
        self._others: Recent[_Kept] = Recent()  # strands and spheres
        self._forms: Recent[Shape] = Recent()  # strands and spheres without attributes, by what they are made of
        self._changed: frozenset[int] | None = None
        self.diced: Recent = Recent()  # meshes subdivided by their size, see adaptive
        self.volumes: Recent = Recent()  # grids of files, see volumes
        self._memory = np.empty(0, np.uint8)  # where what is only looked at is read to

    def next_frame(self, changed: frozenset[int] | None = None) -> None:
        """Give up what the last frame did not show.

        changed: `session_uid`s of objects and data whose geometry has been evaluated anew; None: that is not known.
        """
        self._changed = changed
        own = self._meshes, self._shapes, self._standing, self._others, self._forms
        for recent in (*own, self.diced, self.volumes):
            recent.next_frame()

    def untouched(self, scene: SceneDescription, data: bpy.types.Mesh, memory: Memory) -> Mesh | None:
        """The mesh that was read from `data` in the last frame, if nothing has named it or its owners since."""
        if self._changed is None or memory.owners & self._changed or data.is_editmode:
            return None
        standing = self._standing.get(memory)
        kept = standing and self._meshes.get(standing.key)
        if not kept:
            return None
        self._shapes.get(standing.shape)
        if kept.asked == len(scene.attribute_names):
            return kept.mesh
        mesh = _extended(scene, data, kept.mesh)
        self._meshes.put(standing.key, _Kept(mesh, len(scene.attribute_names)))
        return mesh

    def kept(
        self, key: Hashable, memory: Memory, scene: SceneDescription, read: Callable[[], Shape | None]
    ) -> Shape | None:
        """What `read` gives of data that is no mesh; where nothing has named it since, what it gave for this key."""
        known = None if self._changed is None or memory.owners & self._changed else self._others.get(key)
        if known is None or known.asked != len(scene.attribute_names):
            known = self._others.put(key, _Kept(read(), len(scene.attribute_names)))
        return known.mesh

    def read(
        self, scene: SceneDescription, data: bpy.types.Mesh, deformed: bool, memory: Memory | None = None
    ) -> Mesh | None:
        """What `read_mesh` gives, for a scene with our names of attributes; memory: under which it is `untouched`."""
        if not len(data.loop_triangles):
            return None
        shape = self._shape(data)
        key = shape, self._look(data, deformed)
        if memory:
            self._standing.put(memory, _Standing(key, shape))
        kept, known = self._meshes.get(key), self._shapes.get(shape)
        if kept is None:
            mesh = read_mesh(scene, data, deformed)
            if mesh is None:
                return None
            if not mesh.problem:
                _share_shape(mesh, known or self._shapes.put(shape, mesh))
        else:
            mesh = kept.mesh if kept.asked == len(scene.attribute_names) else _extended(scene, data, kept.mesh)
            if mesh.problem:
                scene.warnings.add("Mesh", data.name, mesh.problem)
        self._meshes.put(key, _Kept(mesh, len(scene.attribute_names)))
        return mesh

    def form(self, key: Hashable, make: Callable[[], Shape]) -> Shape:
        """A copy, with no attributes yet, of the strands or spheres that this frame or the last has made for a key."""
        shape = copy.copy(self._forms.get(key) or self._forms.put(key, make()))
        shape.attributes = []
        return shape

    def _shape(self, data: bpy.types.Mesh) -> Hashable:
        """What vertices, triangles, corners and polygons are made from."""
        return (
            self._digest(data.attributes["position"].data, "vector", np.float32, 3),
            self._digest(data.attributes[".corner_vert"].data, "value", np.int32, 1),
            self._digest(data.loop_triangles, "loops", np.uint32, 3),
            self._digest(data.loop_triangle_polygons, "value", np.int32, 1),
        )

    def _look(self, data: bpy.types.Mesh, deformed: bool) -> Hashable:
        """What all else is made from: normals, material slots, attributes, texture space."""
        attributes = [
            (a.name, a.domain, a.data_type, self._attribute_digest(a))
            for a in data.attributes
            if a.name != "position" and (a.name in _TOPOLOGY or not a.name.startswith("."))
        ]
        render_map = next((layer.name for layer in data.uv_layers if layer.active_render), None)
        corner_normals = data.has_custom_normals and self._digest(data.corner_normals, "vector", np.float32, 3)
        undeformed = deformed and self._digest(data.vertices, "undeformed_co", np.float32, 3)
        return (
            tuple(attributes),
            (render_map, data.attributes.default_color_name, data.attributes.active_color_name),
            (data.normals_domain, corner_normals),
            (tuple(data.texspace_location), tuple(data.texspace_size), undeformed),
        )

    def _attribute_digest(self, attribute: bpy.types.Attribute) -> Hashable:
        if attribute.data_type == "BYTE_COLOR":
            return working_space(), *digest(byte_colors(attribute.data))
        if attribute.data_type not in LAYOUTS:  # never read
            return None
        field, dtype, components = LAYOUTS[attribute.data_type]
        return self._digest(attribute.data, field, dtype, components)

    def _digest(self, collection, field: str, dtype, components: int) -> tuple[int, int, int]:
        """The number of elements, and the digest of a field of all of them."""
        count = len(collection)
        size = count * components * np.dtype(dtype).itemsize
        if len(self._memory) < size:
            self._memory = np.empty(size, np.uint8)
        values = self._memory[:size].view(dtype)
        collection.foreach_get(field, values)
        return count, *digest(values)


def _share_shape(mesh: Mesh, known: Mesh) -> None:
    """Give a mesh the arrays by which the acceleration structure of its shape is known."""
    for name in ("vertices", "triangles", "corners", "polygons"):
        setattr(mesh, name, getattr(known, name))


def _extended(scene: SceneDescription, data: bpy.types.Mesh, mesh: Mesh) -> Mesh:
    """The mesh that was read from `data` with the attributes that have been asked for since; itself if it has none."""
    extended = copy.copy(mesh)
    extended.attributes = list(mesh.attributes)
    add_attributes(scene, extended, data)
    return extended if len(extended.attributes) > len(mesh.attributes) else mesh
