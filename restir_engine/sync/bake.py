"""What Blender wants baked: an object's surface, and which point of it each pixel of an image stands for."""

from __future__ import annotations

import bpy
import numpy as np

from ..kernels.core.records import INSTANCE_SHADOW_CATCHER
from ..scene.camera import Camera
from ..scene.description import SceneDescription
from ..scene.errors import SceneError
from ..scene.mesh import Mesh
from ..scene.scene import Scene
from ..scene.texels import Texels
from .adaptive import adaptive_modifier
from .camera import frame_size
from .depsgraph import read_scene
from .identity import identity
from .kept import Kept
from .objects import placed_by


class BakedScene:
    """The scene in which objects are baked, read once for all of them that it is the same for."""

    def __init__(self) -> None:
        self.kept = Kept()
        self._scene: SceneDescription | Scene | None = None
        self._read_for: tuple = ()

    def read(self, depsgraph, settings, item, kind: str) -> tuple[SceneDescription | Scene, int]:
        """The scene in which an evaluated object is baked, committed where it is known; which of its instances that is.

        Raises SceneError where there is no such instance.
        """
        scene = depsgraph.scene
        is_own = kind == "SHADOW" or adaptive_modifier(item, depsgraph) is not None
        wanted = (
            *(settings, kind, scene.name_full, depsgraph.view_layer.name, scene.frame_current_final),
            *(len(depsgraph.object_instances), item.name_full if is_own else ""),
        )
        if wanted != self._read_for:
            self._read_for = ()
            self.kept.begin(wanted)
            width, height = frame_size(scene.render)
            camera = None if scene.camera else Camera(width=width, height=height)
            self._scene = read_scene(depsgraph, settings, camera=camera, meshes=self.kept.meshes, baked=item)
            if kind == "SHADOW":
                self._scene.instances["flags"][_instance_of(self._scene, depsgraph, item)] |= INSTANCE_SHADOW_CATCHER
            self._read_for = wanted
        return self._scene, _instance_of(self._scene, depsgraph, item)

    def note(self, scene: Scene) -> None:
        """Keep what has been committed."""
        self._scene = scene


def _instance_of(scene: SceneDescription, depsgraph, item) -> int:
    """The index of the instance that is an object itself, or, of a curve or a text, its mesh."""
    for entry in depsgraph.object_instances:
        own = entry.object.name_full == placed_by(entry).name_full == item.name_full
        if own and isinstance(entry.object.data, bpy.types.Mesh):
            for index in np.flatnonzero(scene.instances["key"] == identity(entry)):
                mesh = scene.meshes[scene.instances["mesh"][index]]
                if isinstance(mesh, Mesh) and not mesh.problem:
                    return int(index)
                raise SceneError(f"“{item.name}” cannot be baked: {mesh.problem or 'it has no faces'}.")
    raise SceneError(f"“{item.name}” cannot be baked: it has no faces, or no ray sees it.")


def read_texels(result: bpy.types.RenderResult, instance: int, jittered: bool, from_camera: bool) -> Texels:
    """The points that Blender has put into the result of a bake.

    Its barycentrics are those of a triangle's first and second corner.
    """
    passes, (width, height) = result.layers[0].passes, (result.resolution_x, result.resolution_y)

    def values(name: str) -> np.ndarray:
        found = passes[name]
        array = np.empty((height, width, found.channels), np.float32)
        found.rect.foreach_get(array.reshape(-1))
        return array

    points = values("BakePrimitive")
    primitives = points.view(np.int32)[..., 2]
    # Weights of the first and the second corner, their derivatives by x and by y; anything where there is no triangle.
    weights = np.concatenate([points[..., :2], values("BakeDifferential")], 2)
    weights[primitives < 0] = 0.0
    seeds = None
    if "BakeSeed" in passes:  # corners of faces, of which those of one vertex share a seed
        seeds = values("BakeSeed").view(np.int32)[..., 0]
    first, second = weights[..., [0, 2, 3]], weights[..., [1, 4, 5]]
    third = np.array([1.0, 0.0, 0.0], np.float32) - first - second
    places = np.stack([second, third], 3).reshape(*primitives.shape, 6)
    return Texels(instance, primitives, places[..., [0, 1, 2, 4, 3, 5]], seeds, jittered, from_camera)


def chosen_parts(bits: int) -> frozenset[str]:
    """The names of what a bake is asked to contain, of which Blender hands the bits."""
    parts = bpy.types.BakeSettings.bl_rna.properties["pass_filter"].enum_items
    return frozenset(part.identifier for part in parts if part.value & bits)
