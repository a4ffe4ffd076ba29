"""Everything that is rendered, and the SCENE record through which kernels reach it."""

from __future__ import annotations

from dataclasses import replace
from itertools import product
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np

from ..embree.scenes import Placed, ShapeScene, WorldScene
from ..kernels.core import records as rec
from ..kernels.core.memory import address
from ..kernels.geometry.leaving import own_filter
from ..kernels.geometry.shapes import shape_entries
from ..kernels.lobes import lobe_tables
from ..kernels.shading.interpreter import shader_entries
from .displacement import displaced
from .freeze import freeze
from .lights import LightTable
from .majorants import commit_majorants
from .mesh import Mesh
from .motion import polylines, swept
from .record_owner import RecordOwner
from .shape import Shape, attribute_table
from .vectors import VectorTable
from .world import WorldTable

if TYPE_CHECKING:
    from .description import SceneDescription
    from .trees import Trees


class Scene(RecordOwner):
    """A committed scene: owner of all arrays that kernels reach. It never changes, and its arrays are read-only.

    Its SCENE record is of no frame in particular: what belongs to one (who looks, light tiles) is in a `FrameContext`.
    `cameras` are all that look at it; as the first, `camera`, light tables see emission that depends on the camera.
    `warnings` goes on: what a render finds wrong is added to it.
    `bare` is the scene without what casts shadows on shadow catchers, made of the `whole` one; None: it has none.
    """

    def __init__(
        self, description: SceneDescription, trees: Trees, before: Scene | None = None, whole: Scene | None = None
    ) -> None:
        self.meshes = tuple(whole.meshes if whole else description.meshes)
        self.instances = _catchers(whole.instances) if whole else np.array(description.instances)
        self.material_slots = np.array(description.material_slots, np.int32)
        self.shaders = description.shaders.layout()
        self.cameras = description.cameras
        self.camera = self.cameras[0]
        self.attribute_names = MappingProxyType(dict(description.attribute_names))
        self.warnings = description.warnings
        self.manifests = description.manifests
        self._record = np.zeros(1, rec.SCENE)
        # What addresses point to.
        self._kept: list = [*description.instance_attributes, *description.images.arrays]
        freeze(description.instance_attributes, description.images.arrays)
        self._commit_shading(description.images.records())
        self.image_arrays = tuple(description.images.arrays)
        if not whole:
            self.meshes = displaced(self, trees)
        for mesh in self.meshes:
            mesh.freeze()
        self._commit_shutter(description)
        self._commit_geometry(trees)
        self._note_media(description.world.material)
        if description.vectors is not None and not whole:
            table = VectorTable(self, description.vectors)
            self._record[0]["vectors"] = table.address
            self._kept.append(table)
        self.media_bounds = self._find_media()
        self.world = self._commit_world(description, before)
        self._kept += commit_majorants(self)
        self.lights = self._commit_lights(description.lights.lamps, before)
        self.light_groups = self._group_lights(description)
        freeze(self._record, self.instances, self.material_slots, self.light_groups)
        self.bare = None
        if not whole and self.has_catchers:
            self.bare = Scene(description, trees, before and before.bare, whole=self)
        self._committed = True

    def __setattr__(self, name: str, value: object) -> None:
        if "_committed" in self.__dict__:
            raise AttributeError(f"a committed scene does not change: {name}")
        super().__setattr__(name, value)

    @property
    def has_catchers(self) -> bool:
        """Whether there are shadow catchers."""
        return has_catchers(self.instances)

    def _share(self, field: str, array: np.ndarray) -> None:
        freeze(array)
        self._record[0][field] = address(array)
        self._kept.append(array)

    def _commit_shutter(self, description: SceneDescription) -> None:
        """How long what is seen takes, and what moves meanwhile; self.steps: matrices (steps, 12) by instance.

        What is between two of them goes on a line.
        """
        self.steps = {}
        self._record[0]["time"] = 0.5
        if description.shutter is None:
            return
        shutter, table = description.shutter.record()
        self._share("shutter", shutter)
        self._kept.append(table)
        fixed = self.have_flag(rec.MATERIAL_MEDIUM_VARIES)  # the bounds of its extinction are those of one place
        for instances, matrices in description.instance_steps:
            if fixed[instances].any():
                text = "what has a volume that varies in space stands still in motion blur"
                self.warnings.add("Render", "Volumes", text)
            moves = ~fixed[instances]
            instances, matrices = instances[moves], matrices[moves]
            if len(instances):
                meshes, mesh_of = np.unique(self.instances["mesh"][instances], return_inverse=True)
                boxes = np.array([_box(self.meshes[mesh]) for mesh in meshes.tolist()])[mesh_of]
                self.steps |= zip(instances.tolist(), polylines(matrices, boxes), strict=True)
        for index, matrices in self.steps.items():
            steps = self.steps[index] = np.ascontiguousarray(matrices, np.float32)
            self.instances["n_steps"][index], self.instances["steps"][index] = len(steps), address(steps)

    def _commit_geometry(self, trees: Trees) -> None:
        record, instances = self._record[0], self.instances
        masks = self._instance_masks()
        users = np.bincount(instances["mesh"][masks != 0], minlength=len(self.meshes))
        scatters = np.zeros(len(self.meshes), bool)
        scatters[instances["mesh"][self.have_flag(rec.MATERIAL_SUBSURFACE)]] = True
        record["flags"] |= rec.SCENE_HAS_TRANSPARENT if self._lets_through().any() else 0
        record["flags"] |= rec.SCENE_HAS_SUBSURFACE if scatters.any() else 0
        moving = np.zeros(len(self.meshes), bool)
        moving[instances["mesh"][instances["n_steps"] != 0]] = True
        alone = np.array([isinstance(mesh, Mesh) for mesh in self.meshes], bool)  # may go into the world's tree
        # Beside what moves, what deforms is behind an instance as well: see `_gathered`.
        deforming = np.array([bool(self.steps) and mesh.steps is not None for mesh in self.meshes], bool)
        own = ((users > 1) | (scatters | moving | deforming | ~alone) & (users > 0)).tolist()
        bottom = [trees.of(mesh) if has else None for mesh, has in zip(self.meshes, own, strict=True)]
        self._kept.append(bottom)
        meshes = np.zeros(len(self.meshes), rec.MESH)
        for index, (mesh, tree) in enumerate(zip(self.meshes, bottom, strict=True)):
            attributes = attribute_table(mesh.attributes)
            self._kept.append(attributes)
            meshes[index] = mesh.record(attributes)
            meshes[index]["embree"] = tree.handle if tree else 0
        self._share("meshes", meshes)
        record["n_meshes"] = len(meshes)
        self._share("shape_entries", shape_entries(meshes["shape"]))
        record["own_filter"] = own_filter.address

        transforms = np.ascontiguousarray(instances["to_world"], np.float32)
        content = [
            _placed(self.meshes[mesh], bottom[mesh], transform, mask, trees)
            for mesh, transform, mask in zip(instances["mesh"].tolist(), transforms, masks.tolist(), strict=True)
        ]
        for index, matrices in self.steps.items():
            content[index] = replace(content[index], steps=matrices)
        top = WorldScene(_gathered(content))
        self._kept.append(top)
        record["embree"] = top.handle
        record["instances"], record["n_instances"] = address(instances), len(instances)
        record["material_slots"] = address(self.material_slots)
        lower, upper = top.bounds()
        record["bounds"] = (*lower, *upper) if len(instances) and masks.any() else (0.0,) * 6

    def _instance_masks(self) -> np.ndarray:
        """Embree masks: visibility, shadow rays told apart by whether a material lets them through and by blockers."""
        seen_by = self.instances["seen_by"] & rec.RAY_ALL
        shadow = (seen_by & rec.RAY_SHADOW) != 0
        lets_through = self._lets_through()
        shadow_bits = np.where(lets_through, rec.RAY_SHADOW_TRANSPARENT, rec.RAY_SHADOW_OPAQUE)
        sets = self.instances["blocker_set"]
        shadow_bits = np.where(sets > 0, np.where(lets_through, 1 << 22, 1 << 15) << sets, shadow_bits)
        return (seen_by & ~rec.RAY_SHADOW) | np.where(shadow, shadow_bits, 0)

    def _lets_through(self) -> np.ndarray:
        """Which instances let shadow rays through, bool (n_instances,)."""
        return self.have_flag(rec.MATERIAL_TRANSPARENT | self._hideable())

    def _hideable(self) -> int:
        """MATERIAL_MEDIUM where media differ in priority: shadow rays inside one pass boundaries of others."""
        materials = self.shaders.materials
        priorities = materials["medium_priority"][(materials["flags"] & rec.MATERIAL_MEDIUM) != 0]
        return rec.MATERIAL_MEDIUM if len(np.unique(priorities)) > 1 else 0

    def _note_media(self, world: int) -> None:
        """Put to the flags what media there are, that of the world's material included."""
        flags = [self.shaders.materials["flags"][world]] if world >= 0 else []
        in_world = any(flag & rec.MATERIAL_MEDIUM for flag in flags)
        has = in_world or self.have_flag(rec.MATERIAL_MEDIUM).any()
        vary = any(flag & rec.MATERIAL_MEDIUM_VARIES for flag in flags)
        vary = vary or self.have_flag(rec.MATERIAL_MEDIUM_VARIES).any()
        self._record[0]["flags"] |= (
            (rec.SCENE_HAS_MEDIA if has else 0)
            | (rec.SCENE_HAS_VARYING_MEDIA if vary else 0)
            | (rec.SCENE_WORLD_MEDIUM if in_world else 0)
        )

    def _find_media(self) -> tuple[tuple[np.ndarray, np.ndarray], ...]:
        """Lower and upper corner, (3,) each, of all instances with a medium inside."""
        found = []
        for index in np.flatnonzero(self.have_flag(rec.MATERIAL_MEDIUM)).tolist():
            instance = self.instances[index]
            mesh = self.meshes[instance["mesh"]]
            points = mesh.places
            if not len(points):
                continue
            if index in self.steps:
                found.append(swept(_box(mesh), self.steps[index]))
                continue
            points = points @ instance["to_world"].reshape(3, 4)[:, :3].T + instance["to_world"].reshape(3, 4)[:, 3]
            found.append((points.min(0), points.max(0)))
        return tuple(found)

    def _in_media(self, lamps: np.ndarray) -> np.ndarray:
        """Which lamps, LIGHT (n,), are points or spots within the bounds of a medium, bool (n,)."""
        found = np.zeros(len(lamps), bool)
        for low, high in self.media_bounds:
            found |= ((lamps["center"] >= low) & (lamps["center"] <= high)).all(1)
        return found & np.isin(lamps["kind"], (rec.LIGHT_POINT, rec.LIGHT_SPOT))

    def changing(self) -> np.ndarray:
        """Which instances move or change their shape while the shutter is open, bool (n_instances,)."""
        deforming = np.array([mesh.steps is not None for mesh in self.meshes], bool)
        return (self.instances["n_steps"] != 0) | deforming[self.instances["mesh"]]

    def reach(self, index: int) -> float:
        """About how far points of an instance are from where they are in the middle of the shutter, at most; 0: not."""
        instance = self.instances[index]
        mesh = self.meshes[instance["mesh"]]
        matrices = self.steps.get(index, instance["to_world"][None]).reshape(-1, 3, 4)
        middle = instance["to_world"].reshape(3, 4)
        box = np.array([mesh.vertices.min(0), mesh.vertices.max(0)])
        corners = np.array(list(product(*box.T)))
        away = (matrices - middle)[:, :, :3] @ corners.T + (matrices - middle)[:, :, 3:]
        result = float(np.linalg.norm(away, axis=1).max())
        if mesh.steps is not None:
            size = np.linalg.norm(middle[:, :3], axis=0).max()
            offsets = mesh.steps[:, :-2] - mesh.vertices
            result += float(size * np.linalg.norm(offsets, axis=2).max())
        return result

    def have_flag(self, flag: int) -> np.ndarray:
        """Which instances have a material with one of these MATERIAL_* bits, bool (n_instances,)."""
        slots = (self.shaders.materials["flags"] & flag) != 0
        counts = np.concatenate([[0], np.cumsum(slots[self.material_slots])])
        start = self.instances["materials"]
        return counts[start + self.instances["n_materials"]] > counts[start]

    def _commit_shading(self, images: np.ndarray) -> None:
        record = self._record[0]
        for field in ("materials", "code", "constants", "tables"):
            self._share(field, getattr(self.shaders, field))
        record["n_materials"] = len(self.shaders.materials)
        self._share("images", images)
        record["n_images"] = len(images)
        self._share("shader_entries", shader_entries(self.shaders.code))
        self._share("lobe_tables", lobe_tables())
        self._share("camera", np.array([self.camera.record()], rec.CAMERA))

    def looks_up_as(self, before: Scene) -> bool:
        """Whether programs of `before` find the images and tables that they found there."""
        images, tables = before.image_arrays, before.shaders.tables
        return (
            len(self.image_arrays) >= len(images)
            and all(a is b for a, b in zip(self.image_arrays, images, strict=False))
            and np.array_equal(self.shaders.tables[: len(tables)], tables)
        )

    def _commit_world(self, description: SceneDescription, before: Scene | None) -> WorldTable:
        record, world, portals = self._record[0], description.world, description.lights.portals
        record["world_material"], record["world_seen_by"] = world.material, world.seen_by
        keeps = before and before.world.serves(self, world, portals, before)
        table = before.world if keeps else WorldTable(self, world, portals)
        record["world_table"] = table.address
        return table

    def _group_lights(self, description: SceneDescription) -> np.ndarray:
        """LIGHT_GROUPS (1,), for passes of light groups."""
        world = description.world
        table = np.zeros(1, rec.LIGHT_GROUPS)
        table["count"] = len(description.light_groups)
        table["lights"], table["instances"] = address(self.lights.lamps), address(self.instances)
        table["world"], table["world_medium"] = world.light_group, world.medium_group
        return table

    def _commit_lights(self, lamps: np.ndarray, before: Scene | None) -> LightTable:
        record = self._record[0]
        known = before.lights.groups if before and self.looks_up_as(before) else {}
        lamps = lamps.copy()
        lamps["flags"] |= np.where(self._in_media(lamps), rec.LIGHT_IN_MEDIUM, 0)
        table = LightTable(self, lamps, known)
        self.instances["lights"] = table.first_emitters
        record["lights"], record["n_lights"] = address(table.lamps), len(table.lamps)
        record["light_table"] = table.address
        beside = (table.lamps["kind"] != rec.LIGHT_SUN) & (table.lamps["seen_by"] & rec.RAY_VOLUME != 0)
        if record["flags"] & rec.SCENE_HAS_MEDIA and beside.any():
            record["flags"] |= rec.SCENE_HAS_PIVOTS
        return table


def has_catchers(instances: np.ndarray) -> bool:
    """Whether an INSTANCE array has shadow catchers."""
    return bool((instances["flags"] & rec.INSTANCE_SHADOW_CATCHER).any())


def _catchers(instances: np.ndarray) -> np.ndarray:
    """INSTANCE array in whose rows there is nothing, no material either, but where a shadow catcher is."""
    result = instances.copy()
    others = result["flags"] & rec.INSTANCE_SHADOW_CATCHER == 0
    result["seen_by"][others] = result["n_materials"][others] = 0
    return result


def _placed(mesh: Shape, bottom: ShapeScene | None, transform: np.ndarray, mask: int, trees: Trees) -> Placed:
    """A shape in the world: an instance of its structure `bottom`, or what `trees` makes of the place of a mesh."""
    if not mask or bottom:
        return Placed(mask, transform, scene=bottom)
    return trees.place(mesh, transform, mask)


def _gathered(content: list[Placed]) -> list[Placed]:
    """The same, with instances that stand still among those that move where these are more.

    Embree has a tree of its own for either kind, and a ray goes through both.
    """
    instances = [index for index, placed in enumerate(content) if placed.mask and placed.scene is not None]
    still = [index for index in instances if content[index].steps is None]
    if 2 * len(still) > len(instances):
        return content
    for index in still:
        content[index] = replace(content[index], steps=np.stack([content[index].transform] * 2))
    return content


def _box(mesh: Shape) -> np.ndarray:
    """Lower and upper corner of where a shape is at all times, (2, 3); zeros where it is nowhere."""
    points = mesh.places
    return np.array([points.min(0), points.max(0)], np.float64) if len(points) else np.zeros((2, 3))
