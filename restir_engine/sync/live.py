"""What a 3D view shows, read again and again: of what was read before, all is kept that has not changed."""

from __future__ import annotations

from collections.abc import Hashable

import numpy as np

from ..scene.camera import Camera
from ..scene.description import SceneDescription
from ..scene.shape import Shape
from ..settings import RenderSettings
from .changes import changes
from .depsgraph import read_scene
from .materials import Materials
from .mesh_cache import MeshCache
from .working_space import working_space


class LiveReader:
    """Reads a depsgraph that is updated in place, and keeps programs, images and meshes from reading to reading.

    Meshes and programs are kept where `depsgraph.updates` names none of what they are made from. All else is looked at
    each time: what many properties are changed by raises no flag.
    """

    def __init__(self) -> None:
        self._meshes = MeshCache()
        self._materials: Materials | None = None
        self._read: SceneDescription | None = None
        self._whole: Hashable = None

    def forget(self) -> None:
        """Read all anew: what is known by address or `session_uid` may be another thing by now, as after an undo."""
        self._materials = None

    def read(self, depsgraph, settings: RenderSettings, camera: Camera, space=None) -> SceneDescription | None:
        """The scene as `camera` and the 3D view `space` see it; None where that is what the last reading gave.

        To be called whenever the depsgraph has been updated. Raises SceneError where no picture can come of it.
        """
        named = changes(depsgraph)
        # What programs are compiled from besides their datablocks.
        whole = depsgraph.scene.session_uid, depsgraph.scene.frame_current_final, working_space()
        again = None if whole != self._whole else named
        known, self._materials = self._materials, None  # nothing is known, should this fail
        self._meshes.next_frame(named.shapes if known else None)
        if named.unnamed and again:
            known = None  # all images are read again
        made: list[Materials] = []

        def materials(scene: SceneDescription) -> Materials:
            made.append(known or Materials(scene))
            if known:
                known.go_on(scene, again)
            return made[0]

        scene = read_scene(depsgraph, settings, camera, meshes=self._meshes, materials=materials, space=space)
        self._materials, self._whole = made[0], whole
        if self._read is not None and same_picture(scene, self._read):
            return None
        self._read = scene
        return scene


def same_picture(a: SceneDescription, b: SceneDescription) -> bool:
    """Whether two descriptions of one `LiveReader` are of the same scene, whoever looks at it."""
    return (
        len(a.meshes) == len(b.meshes)
        and all(_same_mesh(*pair) for pair in zip(a.meshes, b.meshes, strict=True))
        and _bytes(a.instances) == _bytes(b.instances)
        and _values(a) == _values(b)
        and np.array_equal(a.material_slots, b.material_slots)
        and a.shaders.same_as(b.shaders)
        and a.images.same_as(b.images)
        and a.lights.lamps.tobytes() == b.lights.lamps.tobytes()
        and list(map(bytes, a.lights.portals)) == list(map(bytes, b.lights.portals))
        and a.world == b.world
        and a.aovs == b.aovs
        and (a.frame, a.time, a.frames_per_second) == (b.frame, b.time, b.frames_per_second)
    )


def _same_mesh(a: Shape, b: Shape) -> bool:
    """Whether two are one mesh, maybe with its normals made for one place twice."""
    if a is b or type(a) is not type(b):
        return a is b
    same = all(value is getattr(b, name) for name, value in vars(a).items() if name != "normals")
    return same and np.array_equal(getattr(a, "normals", None), getattr(b, "normals", None))


def _bytes(instances: np.ndarray) -> bytes:
    """INSTANCE rows without addresses."""
    rows = instances.copy()
    rows["attributes"] = 0
    return rows.tobytes()


def _values(scene: SceneDescription) -> list:
    """What the attributes of instances hold."""
    found = []
    for table, placed in scene.instance_attributes:
        attributes = [*placed.properties, *(attribute for attribute, _ in placed.instancer)]
        found += [(len(table), attribute.name, attribute.values.tobytes()) for attribute in attributes]
    return found
