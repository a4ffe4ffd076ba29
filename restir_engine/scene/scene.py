"""Everything that is rendered, and the SCENE record through which kernels reach it."""

from __future__ import annotations

import numpy as np

from ..embree.scenes import MeshScene, Placed, WorldScene
from ..kernels.core import records as rec
from ..kernels.core.memory import address
from ..kernels.lobes import lobe_tables
from ..kernels.shading.interpreter import shader_entries
from . import names
from .camera import Camera
from .images import ImageTable
from .lights import LightTable
from .mesh import Mesh, moved
from .shaders import ShaderTable
from .warnings import Warnings
from .world import World


class Scene:
    """Owner of all arrays that kernels reach. Fill the parts, then `commit`; change a part and commit again.

    `commit` needs no bpy, compiles the instructions that the programs use, and may take its time: it can run on a
    thread of its own.
    """

    def __init__(self) -> None:
        self.meshes: list[Mesh] = []
        self.instances = np.zeros(0, rec.INSTANCE)
        self.material_slots = np.zeros(0, np.int32)
        self.instance_attributes: list = []  # what the instances' attribute tables need to stay alive
        self.shaders = ShaderTable()
        self.images = ImageTable()
        self.lights = LightTable()
        self.world = World()
        self.camera = Camera()
        self.warnings = Warnings()
        self.frame = 1  # what image sequences show
        self.attribute_names: dict[str, int] = {name: index for index, name in enumerate(names.RESERVED)}
        self._bottom: dict[int, tuple[Mesh, MeshScene]] = {}
        self._top: WorldScene | None = None
        self.committed = False
        self._record = np.zeros(1, rec.SCENE)
        self._arrays: list[np.ndarray] = []

    def attribute_name(self, name: str) -> int:
        """The number that stands for an attribute in programs and meshes; "" is the render UV map. See `names`."""
        return self.attribute_names.setdefault(name, len(self.attribute_names))

    @property
    def record(self) -> np.void:
        """The SCENE record for kernels; valid after `commit` and as long as this scene lives."""
        return self._record[0]

    def commit(self) -> None:
        """Build what has changed (acceleration structures, light and world tables) and the record."""
        record = self._record[0]
        self._arrays = []
        self._commit_geometry(record)
        self.media_bounds = self._find_media()
        self._commit_shading(record)
        self.world.commit(self)
        self.lights.commit(self)
        self.committed = True

    def _share(self, record: np.void, field: str, array: np.ndarray) -> None:
        record[field] = address(array)
        self._arrays.append(array)

    def _commit_geometry(self, record: np.void) -> None:
        instances = np.ascontiguousarray(self.instances)
        self.instances = instances
        masks = self._instance_masks()
        users = np.bincount(instances["mesh"][masks != 0], minlength=len(self.meshes))
        scatters = np.zeros(len(self.meshes), bool)
        scatters[instances["mesh"][self._have_flag(rec.MATERIAL_SUBSURFACE)]] = True
        record["flags"] |= rec.SCENE_HAS_SUBSURFACE if scatters.any() else 0
        record["flags"] |= rec.SCENE_HAS_MEDIA if self._have_flag(rec.MATERIAL_MEDIUM).any() else 0
        self._bottom = {
            id(mesh): self._bottom.get(id(mesh)) or (mesh, MeshScene(mesh.vertices, mesh.triangles))
            for mesh, own in zip(self.meshes, (users > 1) | scatters & (users > 0), strict=True)
            if own
        }
        meshes = np.zeros(len(self.meshes), rec.MESH)
        for index, mesh in enumerate(self.meshes):
            meshes[index] = mesh.record()
            if id(mesh) in self._bottom:
                meshes[index]["embree"] = self._bottom[id(mesh)][1].handle
        self._share(record, "meshes", meshes)
        record["n_meshes"] = len(meshes)

        transforms = np.ascontiguousarray(instances["to_world"], np.float32)
        self._top = WorldScene(
            [
                self._place(self.meshes[mesh], transform, mask)
                for mesh, transform, mask in zip(instances["mesh"].tolist(), transforms, masks.tolist(), strict=True)
            ]
        )
        record["embree"] = self._top.handle
        self._share(record, "instances", instances)
        record["n_instances"] = len(instances)
        self._share(record, "material_slots", self.material_slots)
        lower, upper = self._top.bounds()
        record["bounds"] = (*lower, *upper) if len(instances) and masks.any() else (0.0,) * 6

    def _place(self, mesh: Mesh, transform: np.ndarray, mask: int) -> Placed:
        """A mesh in the world: as an instance when it stands there more than once or scatters light inside."""
        if not mask or id(mesh) in self._bottom:
            return Placed(mask, transform, scene=self._bottom[id(mesh)][1] if mask else None)
        matrix = transform.reshape(3, 4)
        return Placed(mask, transform, vertices=moved(mesh.vertices, matrix), triangles=mesh.triangles)

    def _instance_masks(self) -> np.ndarray:
        """Embree masks: the rays that see each, with shadow rays told apart by whether a material lets them through."""
        transparent = self._have_flag(rec.MATERIAL_TRANSPARENT | self._hideable())
        self._record[0]["flags"] = rec.SCENE_HAS_TRANSPARENT if transparent.any() else 0
        seen_by = self.instances["seen_by"] & rec.RAY_ALL
        shadow = (seen_by & rec.RAY_SHADOW) != 0
        shadow_bits = np.where(transparent, rec.RAY_SHADOW_TRANSPARENT, rec.RAY_SHADOW_OPAQUE)
        return (seen_by & ~rec.RAY_SHADOW) | np.where(shadow, shadow_bits, 0)

    def _hideable(self) -> int:
        """MATERIAL_MEDIUM where media differ in priority: shadow rays inside one pass boundaries of others."""
        materials = self.shaders.materials
        priorities = materials["medium_priority"][(materials["flags"] & rec.MATERIAL_MEDIUM) != 0]
        return rec.MATERIAL_MEDIUM if len(np.unique(priorities)) > 1 else 0

    def _find_media(self) -> list[tuple[np.ndarray, np.ndarray]]:
        """Lower and upper corner, (3,) each, of all instances with a medium inside."""
        found = []
        for instance in self.instances[self._have_flag(rec.MATERIAL_MEDIUM)]:
            points = self.meshes[instance["mesh"]].vertices @ instance["to_world"].reshape(3, 4)[:, :3].T
            points = points + instance["to_world"].reshape(3, 4)[:, 3]
            if len(points):
                found.append((points.min(0), points.max(0)))
        return found

    def _have_flag(self, flag: int) -> np.ndarray:
        """Which instances have a material with one of these MATERIAL_* bits, bool (n_instances,)."""
        slots = (self.shaders.materials["flags"] & flag) != 0
        counts = np.concatenate([[0], np.cumsum(slots[self.material_slots])])
        start = self.instances["materials"]
        return counts[start + self.instances["n_materials"]] > counts[start]

    def _commit_shading(self, record: np.void) -> None:
        self.shaders.commit()
        for field in ("materials", "code", "constants", "tables"):
            self._share(record, field, getattr(self.shaders, field))
        record["n_materials"] = len(self.shaders.materials)
        self._share(record, "images", self.images.records())
        record["n_images"] = len(self.images)
        self._share(record, "shader_entries", shader_entries(self.shaders.code))
        self._share(record, "lobe_tables", lobe_tables())
        # Emission that depends on the camera is measured, for the light tables, as the scene's own sees it.
        self._share(record, "camera", np.array([self.camera.record()], rec.CAMERA))
