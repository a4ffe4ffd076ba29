"""An evaluated depsgraph → `SceneDescription`: one pass over everything that it instances."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property

import bpy
import numpy as np

from ..kernels.core.memory import address
from ..kernels.core.records import DOMAIN_MESH, MATERIAL_SUBSURFACE
from ..scene import names
from ..scene.camera import Camera
from ..scene.description import SceneDescription
from ..scene.instances import build_instances, thickened, usable
from ..scene.mesh import Mesh, with_normals_for
from ..scene.scene import Scene
from ..scene.shape import Attribute, Shape, attribute_table
from ..scene.spheres import Spheres
from ..scene.strands import Strands
from ..settings import aov_channels
from .adaptive import adaptive_modifier, diced
from .culling import Culled, Culling
from .hashing import hash_uint2, to_unit
from .identity import name_key, numbered
from .left_out import note_object, note_scene
from .light_linking import blockers, owners, receivers
from .lights import sync_light
from .materials import Materials
from .mesh import readable
from .mesh_cache import MeshCache, memory_of
from .motion import (
    Blur,
    Frames,
    Moments,
    Steps,
    along_velocity,
    bends,
    blur_of,
    identities,
    matrices_of,
    steps_of,
    vectors_of,
)
from .objects import (
    asset_name,
    instance_flags,
    instancer_values,
    light_group,
    name_random,
    placed_by,
    property_value,
    rays_that_see,
)
from .particle_hair import hair_systems
from .points import read_points
from .strands import hair_form, read_curves, read_hair, strand_look
from .views import Views
from .volumes import density_factors, is_grids, read_grids
from .world import sync_world


def build_scene(depsgraph, settings) -> Scene:
    """Everything that `depsgraph` shows, committed and ready to render.

    Raises SceneError where no picture can come of it.
    """
    return read_scene(depsgraph, settings).commit()


def read_scene(
    depsgraph,
    settings,
    camera: Camera | None = None,
    meshes: MeshCache | None = None,
    materials: Callable[[SceneDescription], Materials] = Materials,
    space=None,
    frames: Frames | None = None,
    views: Views | None = None,
    baked=None,
) -> SceneDescription:
    """Everything that `depsgraph` shows, read but not yet committed: the rest needs no bpy.

    views: who looks, where that is not the scene's camera; or a camera alone. meshes: those that earlier frames have
    read. materials: gives the programs for a description. space: the 3D view that shows it.
    frames: how other times are read, for motion blur; None: nothing is blurred. baked: an object with the faces that
    Blender bakes, which are not subdivided. Raises SceneError where no picture can come of it.
    """
    meshes = MeshCache() if meshes is None else meshes
    views = views or Views()
    scene = SceneDescription(meshes.attribute_names)
    scene.aovs = aov_channels(settings.aovs)
    scene.light_groups = {name: number for number, name in enumerate(settings.light_groups)}
    scene.frame = depsgraph.scene.frame_current
    render = depsgraph.scene.render
    scene.time = now = depsgraph.scene.frame_current_final
    scene.frames_per_second = render.fps / render.fps_base
    blur = blur_of(depsgraph) if frames else None
    if frames and not blur and "Vector" in settings.passes:
        blur = vectors_of(depsgraph)
    try:
        if blur and blur.middle != now:
            frames.show(blur.middle)
        scene.cameras = (camera,) if camera else views.cameras(depsgraph, scene.warnings)
        note_scene(depsgraph, scene.warnings)
        reader = _Reader(scene, depsgraph, settings, meshes, materials(scene), space, blur, baked)
        reader.read()
        sync_world(scene, depsgraph, reader.materials)
        reader.materials.compiled()
        if blur:
            reader.moments.read(depsgraph, blur, frames, views)
    finally:
        if blur:
            frames.show(now)
    reader.fit_normals()
    return scene


@dataclass
class _Placed:
    """What all instances of one object under one instancer have in common; mesh -1: nothing to render."""

    mesh: int
    materials: int = 0
    n_materials: int = 0
    seen_by: int = 0
    flags: int = 0
    object_index: int = 0
    light_group: int = -1
    crypto_object: float = 0.0
    crypto_asset: float = 0.0
    key: int = 0
    random: float = 0.0
    color: tuple[float, ...] = (1.0, 1.0, 1.0, 1.0)
    in_object_space: bool = False  # a Volume whose density is
    terminator: float = 0.0
    terminator_frequency: float = 1.0
    rules: tuple[int, int] = (-1, -1)  # of its emission, by receivers and by blockers: see sync.light_linking
    owners: tuple[int, ...] = ()
    light_set: int = 0
    blocker_set: int = 0
    links: int = -1
    blockers: int = -1
    culled_by: Culled | None = None
    particles: bool = False
    properties: list[Attribute] = field(default_factory=list)  # one value each
    instancer: list[tuple[Attribute, np.ndarray]] = field(default_factory=list)  # values by number of the instance
    steps: int = 0  # over the shutter, 0: it is not blurred
    deforms: bool = False  # its mesh may change meanwhile


def changes_shape(item, data) -> bool:
    """Whether something beside its data tells what shape an evaluated object has."""
    return len(item.modifiers) > 0 or getattr(data, "shape_keys", None) is not None


_LIGHT = (-1,)  # stands for a lamp among the numbers of what is placed
_NO_ID = 0x7FFFFFFF  # ends a persistent_id, which goes from the innermost instance to the outermost


class _Reader:
    """One walk over the instances of a depsgraph."""

    def __init__(
        self,
        scene: SceneDescription,
        depsgraph,
        settings,
        meshes: MeshCache,
        materials: Materials,
        space,
        blur: Blur | None,
        baked,
    ) -> None:
        self.scene = scene
        self._blur = blur
        self._changing: dict[int, Steps] = {}  # shapes that move along their velocities
        self._cache = meshes
        self.depsgraph = depsgraph
        self.settings = settings
        self.view_layer = depsgraph.view_layer
        self.override = depsgraph.view_layer_eval.material_override
        self.culling = Culling(depsgraph.scene_eval, scene.camera)
        self.materials = materials
        self._space = space
        self._baked = baked
        self._linking = receivers(), blockers()
        self._lamp_rules: list[tuple[int, int]] = []
        self._is_render = depsgraph.mode == "RENDER"
        self._placed: list[_Placed] = [_Placed(-1)]
        self._by_key: dict[tuple[int, ...], tuple[int, ...]] = {}
        self._meshes: dict[int, tuple[int, int]] = {}  # datablock → index, number of names known when it was read
        self._slots: dict[tuple[int, ...], int] = {}
        self._slot_values: list[int] = []

    def read(self) -> None:
        """Fill meshes, instances, material slots and lights of the scene."""
        rows, placed, particle = [], [], []
        instances = self.depsgraph.object_instances
        is_instance = _column(instances, "is_instance", (len(instances),), bool)
        for row, (instance, instanced) in enumerate(zip(instances, is_instance.tolist(), strict=True)):
            for index in self._visit(instance, instanced):
                rows.append(row)
                placed.append(index)
                if self._placed[index].particles:
                    particle.append((len(placed) - 1, instance.persistent_id[0]))
        self.scene.material_slots = np.array(self._slot_values, np.int32)
        self._link_lights()
        self._build(np.array(rows, np.int64), np.array(placed, np.int64), is_instance, particle)

    def _visit(self, instance, instanced: bool) -> tuple[int, ...]:
        """The numbers of the `_Placed` that this instance belongs to: its surface, its hair, where it has them."""
        item = instance.object
        data = item.data
        if data is None:
            return ()
        if instanced:
            # `object` is a temporary that serves for every instance in turn.
            owner, parent = instance.instance_object, instance.parent
            key = (owner.as_pointer() if owner else 0, data.as_pointer(), parent.as_pointer() if parent else 0)
        else:
            key = (item.as_pointer(), data.as_pointer())
        numbers = self._by_key.get(key)
        if numbers is None:
            numbers = self._by_key[key] = self._first(instance, item, data)
        if numbers == _LIGHT:
            if sync_light(self.scene, instance, self.materials, rays_that_see(instance, self.view_layer)):
                self._lamp_rules.append(self._rules(item))
            return ()
        return numbers

    def _first(self, instance, item, data) -> tuple[int, ...]:
        """What `_visit` gives for a combination of object, data and instancer that is seen for the first time."""
        if self._space is not None and not placed_by(instance).original.visible_in_viewport_get(self._space):
            return ()
        if item.type == "LIGHT":
            note_object(item, self.scene.warnings)
            return _LIGHT
        found = []
        if instance.show_self:
            if rays_that_see(instance, self.view_layer):
                note_object(item, self.scene.warnings)
            if self._is_shown(item, data):
                found.append(self._place(instance, item, data, self._shape))
        shows_hair = instance.show_particles and self.depsgraph.view_layer_eval.use_strand
        if shows_hair and hair_systems(item, self._is_render):
            found.append(self._place(instance, item, data, self._hair))
        found = [placed for placed in found if placed is not None]
        self._placed += found
        return tuple(range(len(self._placed) - len(found), len(self._placed)))

    def _place(self, instance, item, data, read: Callable[..., int]) -> _Placed | None:
        """An object's shape, of which `read` gives the index; None: there is nothing to see."""
        seen_by = rays_that_see(instance, self.view_layer)
        if not seen_by:
            return None
        materials = self._material_indices(item, data)
        mesh = read(instance, item, data)
        if mesh < 0:
            return None
        scatters = any(self.scene.shaders[index].flags & MATERIAL_SUBSURFACE for index in materials)
        if scatters and isinstance(self.scene.meshes[mesh], (Strands, Spheres)):
            self.scene.warnings.add("Object", item.name, "subsurface scattering of strands and points is not Cycles'")
        steps, deforms = self._steps_of(instance, item)
        if steps and deforms:
            deforms = self._deforms(item, data, mesh, read == self._hair)
        flags = instance_flags(instance, self.view_layer)
        return _Placed(
            mesh=mesh,
            materials=self._slot_start(materials),
            n_materials=len(materials),
            seen_by=seen_by,
            flags=flags,
            object_index=item.pass_index,
            light_group=light_group(self.scene, instance),
            crypto_object=self.scene.manifests.note("Object", item.name),
            crypto_asset=self.scene.manifests.note("Asset", asset_name(item)),
            key=name_key(instance) ^ int(read == self._hair),
            random=name_random(item.name),
            # Instances have the colour of their instancer; `object` tells it only while Python holds no other
            # reference to the object that is instanced.
            color=tuple((instance.parent or item).color),
            in_object_space=isinstance(data, bpy.types.Volume) and data.render.space == "OBJECT",
            terminator=item.shadow_terminator_geometry_offset,
            terminator_frequency=1.0 / (1.0 - 0.5 * item.shadow_terminator_shading_offset),
            rules=self._rules(item),
            owners=owners(instance),
            culled_by=self.culling.of(item),
            particles=instance.is_instance and instance.particle_system is not None,
            properties=self._properties(instance),
            instancer=self._instancer_values(instance),
            steps=steps,
            deforms=bool(steps) and deforms,
        )

    def _is_shown(self, item, data) -> bool:
        """Whether data is of a kind that is rendered, and that the view layer shows."""
        layer = self.depsgraph.view_layer_eval
        if is_grids(item):
            return layer.use_volumes
        if isinstance(data, bpy.types.Curves):
            return layer.use_strand
        return isinstance(data, bpy.types.PointCloud) or (isinstance(data, bpy.types.Mesh) and layer.use_solid)

    def _deforms(self, item, data, index: int, is_hair: bool) -> bool:
        """Whether other times are to be looked at for how an object's shape changes; a warning where they cannot."""
        if is_grids(item):
            return False
        if is_hair:  # emitter, dynamics, settings: it is read again where its points or a sample of it are others
            return self._blur.shutter is not None
        if not isinstance(data, bpy.types.Mesh) or len(data.vertices) == len(self.scene.meshes[index].points):
            return not self._follow_velocity(index, data) and changes_shape(item, data)
        if self._blur.shutter and bends(item, data):
            text = "adaptive subdivision: the blur of its deformation is left out"
            self.scene.warnings.add("Object", item.name, text)
        return False

    def _follow_velocity(self, index: int, data) -> bool:
        """Whether the points of a shape move along its velocities; they are made to."""
        moved = along_velocity(self.scene.meshes[index], data, self._blur.length / self.scene.frames_per_second)
        if moved:
            self._changing[index] = moved
        return moved is not None

    def _steps_of(self, instance, item) -> tuple[int, bool]:
        """(over how many steps an instance's motion is read, 0: not at all; whether its shape's is as well)."""
        if not self._blur:
            return 0, False
        return steps_of(item, instance.parent) if self._blur.shutter else (3, True)

    def _material_indices(self, item, data) -> tuple[int, ...]:
        materials = [slot.material for slot in item.material_slots] or list(getattr(data, "materials", ()))
        if self.override is not None:
            materials = [self.override] * max(len(materials), 1)
        return tuple(self.materials.index(material, is_grids(item)) for material in materials or [None])

    def _slot_start(self, materials: tuple[int, ...]) -> int:
        start = self._slots.get(materials)
        if start is None:
            start = self._slots[materials] = len(self._slot_values)
            self._slot_values.extend(materials)
        return start

    def _shape(self, instance, item, data) -> int:
        """The index of the shape of an object, read at first sight; -1: there is none.

        Call when the programs of the object's materials are compiled: they name the attributes that are read.
        """
        index, asked = self._meshes.get(data.as_pointer(), (None, 0))
        if index == -1 or asked == len(self.scene.attribute_names):
            return index
        return self._put_shape(data.as_pointer(), index, self._read(instance, item, data))

    def _put_shape(self, key: int, index: int | None, shape: Shape | None) -> int:
        """Let a shape be the one of a key, in place of that at an index where there is one; its index."""
        if index is None:
            index = -1 if shape is None else len(self.scene.meshes)
            self.scene.meshes += [] if shape is None else [shape]
        else:
            self.scene.meshes[index] = shape
        self._meshes[key] = (index, len(self.scene.attribute_names))
        return index

    def _read(self, instance, item, data) -> Shape | None:
        """What an evaluated object's data is rendered as; None: it is empty."""
        place = memory_of(data, (item, data, instance.parent, instance.instance_object))
        if is_grids(item):
            key = place, self.scene.time
            return self._cache.kept(key, place, self.scene, lambda: read_grids(self.scene, item, self._cache.volumes))
        if not isinstance(data, bpy.types.Mesh):
            key = place, strand_look(self.depsgraph.scene_eval)
            return self._cache.kept(key, place, self.scene, lambda: self._read_others(data))
        mesh = self._cache.untouched(self.scene, data, place)
        if mesh is None:
            with readable(item, data, self.depsgraph) as source:
                mesh = self._cache.read(self.scene, source, changes_shape(item, data), place)
        modifier = adaptive_modifier(item, self.depsgraph)
        if mesh is not None and modifier is not None and item != self._baked:
            with readable(item, data, self.depsgraph) as source:
                mesh = diced(self.scene, item, source, mesh, modifier, self.depsgraph, self._cache.diced)
        return mesh

    def _read_others(self, data) -> Shape | None:
        """What curves or points are rendered as."""
        if isinstance(data, bpy.types.Curves):
            return read_curves(self.scene, data, strand_look(self.depsgraph.scene_eval), self._cache)
        return read_points(self.scene, data, self._cache)

    def _read_again(self, instance, time: float) -> Shape | None:
        """What an instance's curves or points are at another time, or the hair of its mesh, which has no attributes."""
        data = instance.object.data
        if not isinstance(data, bpy.types.Mesh):
            return self._read_others(data)
        look = strand_look(self.depsgraph.scene_eval)
        return hair_form(_emitter(instance), look, self._is_render, self._cache, time)[1]

    def _hair(self, instance, item, data) -> int:
        """The index of an object's particle hair, as `_shape` has it."""
        owner = _emitter(instance)
        key = ~owner.as_pointer()  # no datablock's
        index, asked = self._meshes.get(key, (None, 0))
        if index == -1 or asked == len(self.scene.attribute_names):
            return index
        place = memory_of(data, (item, data, owner, instance.parent, *(s.settings for s in owner.particle_systems)))
        look = strand_look(self.depsgraph.scene_eval)
        strands = self._cache.kept(
            ("hair", owner.as_pointer(), look),
            place,
            self.scene,
            lambda: read_hair(self.scene, owner, look, self._is_render, self._cache),
        )
        return self._put_shape(key, index, strands)

    def _properties(self, instance) -> list[Attribute]:
        """The properties of an object, or of what it belongs to, that Attribute nodes ask for."""
        found = []
        for name, index in self.scene.attribute_names.items():
            asked = names.split_object_property(name)
            if asked:
                value = property_value(*asked, instance, self.depsgraph.scene, self.view_layer)
                if value is not None:
                    found.append(Attribute(index, DOMAIN_MESH, np.array([value])))
        return found

    def _instancer_values(self, instance) -> list[tuple[Attribute, np.ndarray]]:
        """What geometry nodes have stored with an instancer's instances, where Attribute nodes ask for it."""
        asked = ((index, names.split_object_property(name)) for name, index in self.scene.attribute_names.items())
        wanted = {index: pair[1] for index, pair in asked if pair and pair[0] == "INSTANCER"}
        if not wanted or instance.parent is None:
            return []
        found = ((index, instancer_values(instance.parent, name)) for index, name in wanted.items())
        return [(Attribute(index, DOMAIN_MESH, each[0]), each[1]) for index, each in found if each is not None]

    def _build(self, rows: np.ndarray, placed: np.ndarray, is_instance: np.ndarray, particle: list) -> None:
        """The INSTANCE array.

        rows: where the instances stand in the depsgraph; placed: the numbers of their `_Placed`; is_instance: of each
        row of the depsgraph; particle: pairs (instance, particle) of indices.
        """
        instances = self.depsgraph.object_instances
        count = len(instances)
        matrices = matrices_of(self.depsgraph)[rows]
        meshes = np.array([item.mesh for item in self._placed])[placed]
        # Cycles applies the transform of a mesh that is placed once: what this flattens is still there.
        alone = (meshes >= 0) & (np.bincount(meshes + 1)[meshes + 1] == 1)
        matrices[alone] = thickened(matrices[alone])
        shown = (placed > 0) & usable(matrices)
        for number, item in enumerate(self._placed):
            if item.culled_by is not None:
                mine = np.flatnonzero(placed == number)
                shown[mine] &= ~self.culling.culled(item.culled_by, matrices[mine])
        which, chosen = placed[shown], rows[shown]

        def of_object(name: str) -> np.ndarray:
            return np.array([getattr(item, name) for item in self._placed])[which]

        is_instance = is_instance[chosen]
        random_id = _column(instances, "random_id", (count,), np.int32)[chosen]
        orco = _column(instances, "orco", (count, 3), np.float32)[chosen]
        uv = _column(instances, "uv", (count, 2), np.float32)[chosen]
        particle_random = np.zeros(len(rows))
        if particle:
            owners, numbers = np.array(particle).T
            particle_random[owners] = to_unit(hash_uint2(numbers, 0))
        self.scene.instances = build_instances(
            matrices[shown],
            of_object("mesh"),
            random=np.where(is_instance, to_unit(random_id.view(np.uint32)), of_object("random")),
            dupli_generated=np.where(is_instance[:, None], 0.5 * orco - 0.5, 0.0),
            dupli_uv=np.where(is_instance[:, None], uv, 0.0),
            particle=particle_random[shown],
            volume_density=np.where(of_object("in_object_space"), density_factors(matrices[shown]), 1.0),
            key=np.where(is_instance, numbered(of_object("key"), self._persistent_ids[chosen]), of_object("key")),
            **{
                name: of_object(name)
                for name in (
                    "materials",
                    "n_materials",
                    "seen_by",
                    "flags",
                    "object_index",
                    "light_group",
                    "crypto_object",
                    "crypto_asset",
                    "color",
                    "terminator",
                    "terminator_frequency",
                    "light_set",
                    "blocker_set",
                    "links",
                    "blockers",
                )
            },
        )
        self._attach_attributes(which, chosen)
        if self._blur:
            numbers = np.where(shown, np.cumsum(shown) - 1, -1)
            steps = np.array([item.steps for item in self._placed])[placed]
            mine = np.flatnonzero(shown)[::-1].tolist()
            entries = {number: entry for entry, number in zip(mine, which[::-1].tolist(), strict=True)}
            items = [(entries[n], item.mesh) for n, item in enumerate(self._placed) if item.deforms and n in entries]
            deforming = {mesh: entry for entry, mesh in items}  # each mesh once
            deforming = {entry: mesh for mesh, entry in deforming.items()}
            around = identities(self.depsgraph), rows, matrices, steps, numbers, deforming
            self.moments = Moments(self.scene, self._read_again, self._changing, *around)

    def fit_normals(self) -> None:
        """Give meshes that stand in one place alone the normals that they have there."""
        instances, meshes = self.scene.instances, self.scene.meshes
        moving = np.concatenate([np.zeros(0, np.int64), *(group.instances for group in self.scene.instance_steps)])
        shown = np.bincount(instances["mesh"], minlength=len(meshes))
        shown[instances["mesh"][moving]] = 0
        for instance in instances[shown[instances["mesh"]] == 1]:
            mesh = meshes[instance["mesh"]]
            if isinstance(mesh, Mesh) and mesh.steps is None:
                meshes[instance["mesh"]] = with_normals_for(mesh, instance["to_object"])

    def _rules(self, item) -> tuple[int, int]:
        """The rules of what an object emits: of receivers, of blockers."""
        return tuple(linking.rule_of(item) for linking in self._linking)

    def _link_lights(self) -> None:
        """Tell lamps and objects apart by what lights what, and what blocks what."""
        lamps = self.scene.lights.lamps
        names = (("light_set", "links"), ("blocker_set", "blockers"))
        for which, (linking, (name, bits_name)) in enumerate(zip(self._linking, names, strict=True)):
            if not linking.rules:
                continue
            sets, bits, crowded = linking.resolve([item.owners for item in self._placed])
            if crowded:
                text = f"light or shadow linking tells apart more than {linking.most} sets of objects"
                self.scene.warnings.add("Scene", self.depsgraph.scene.name, text)
            for item, own in zip(self._placed, sets, strict=True):
                setattr(item, name, own)
                setattr(item, bits_name, bits[item.rules[which]] if item.rules[which] >= 0 else -1)
            lamps[bits_name] = [bits[rules[which]] if rules[which] >= 0 else -1 for rules in self._lamp_rules]

    def _attach_attributes(self, which: np.ndarray, chosen: np.ndarray) -> None:
        """Give the instances their attributes. which: their `_Placed`; chosen: their place in the depsgraph."""
        rows = self.scene.instances
        for number, placed in enumerate(self._placed):
            own = [attribute for attribute, _ in placed.instancer]
            table = attribute_table([*own, *placed.properties])
            if not len(table):
                continue
            mine = np.flatnonzero(which == number)
            step = 0
            if own:
                # Each instance has a copy of the table, with the addresses of its own values.
                table = np.tile(table, (len(mine), 1))
                step = table.strides[0]
                for k, (attribute, numbers) in enumerate(placed.instancer):
                    place = np.searchsorted(numbers, self._outermost[chosen[mine]])
                    place = np.minimum(place, len(numbers) - 1)
                    table["values"][:, k] += place * attribute.values.strides[0]
            self.scene.instance_attributes.append((table, placed))
            rows["attributes"][mine] = address(table) + step * np.arange(len(mine))
            rows["n_attributes"][mine] = table.shape[-1]

    @cached_property
    def _persistent_ids(self) -> np.ndarray:
        """For each instance of the depsgraph its numbers, the innermost instancer's first: int32 (n, 8)."""
        instances = self.depsgraph.object_instances
        return _column(instances, "persistent_id", (len(instances), 8), np.int32)

    @cached_property
    def _outermost(self) -> np.ndarray:
        """For each instance of the depsgraph the number that its instancer has given it."""
        numbers = self._persistent_ids
        depth = (numbers != _NO_ID).sum(axis=1)
        return numbers[np.arange(len(numbers)), np.maximum(depth - 1, 0)]


def _emitter(instance):
    """The evaluated object that an instance's particle hair grows on."""
    return instance.instance_object if instance.is_instance else instance.object


def _column(collection, field: str, shape: tuple[int, ...], dtype) -> np.ndarray:
    result = np.empty(shape, dtype)
    collection.foreach_get(field, result.reshape(-1))
    return result
