"""What moves while the shutter is open: the frames before and after the one that is rendered, read for what differs.

For the pass Vector, which there is without blur alone, the whole frames before and after are read in the same way.

Cycles' rules: an object has 2^k + 1 steps over the shutter (Motion Blur > Steps is k), the middle one being where it is
rendered without blur; an instance has the most that it or its instancer has, and both must want blur. Times between the
steps of some are not looked at for the others. Lamps do not move. A mesh that has a `velocity` attribute goes along it
instead: its vertices need not be the same ones in other frames.

Reading another time evaluates the whole depsgraph: nothing of Blender that was taken from it before may be used after.
"""

from __future__ import annotations

import copy
import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import NamedTuple

import numpy as np

from ..kernels.core.records import DOMAIN_CORNER
from ..scene.camera import Camera
from ..scene.description import SceneDescription
from ..scene.instances import InstanceSteps, usable
from ..scene.mesh import Mesh, empty_vertices
from ..scene.motion import differ
from ..scene.shape import Shape
from ..scene.shutter import Shutter
from ..scene.vectors import Vectors
from ..scene.warnings import Warnings
from .views import Views

VELOCITY = "velocity"  # vertices' way in a second, in object space
# Modifiers that give one shape at all times, if what they are given is.
_STILL = {"BEVEL", "EDGE_SPLIT", "MIRROR", "MULTIRES", "PARTICLE_SYSTEM", "SOLIDIFY", "SUBSURF", "TRIANGULATE"}
_STILL |= {"WEIGHTED_NORMAL"}
_CURVE = 257  # values that are read of the shutter's curve
_POSITIONS = {"START": 0.5, "CENTER": 0.0, "END": -0.5}  # of the shutter's middle, in its lengths after the frame


@dataclass(frozen=True)
class Frames:
    """How other times are read. go_to(frame, subframe): RenderEngine.frame_set; stopped(): whether Esc was pressed."""

    go_to: Callable[[int, float], None]
    stopped: Callable[[], bool]

    def show(self, time: float) -> None:
        """Evaluate the depsgraph at a frame with its fraction."""
        frame = math.floor(time)
        self.go_to(frame, time - frame)


@dataclass(frozen=True)
class Blur:
    """The scene's shutter. middle: the frame, with its fraction, at which it has been open half the time.

    shutter: None where nothing is blurred, but frames before and after are read for the pass Vector.
    """

    length: float  # frames
    middle: float
    shutter: Shutter | None

    def time(self, moment: Fraction) -> float:
        """The frame at a moment of the shutter, from -1 where it opens to 1 where it closes."""
        return self.middle + 0.5 * self.length * float(moment)


def blur_of(depsgraph) -> Blur | None:
    """The blur that a scene and its view layer ask for, None: none."""
    scene = depsgraph.scene
    render, cycles = scene.render, getattr(scene, "cycles", None)
    length = render.motion_blur_shutter
    if not (render.use_motion_blur and depsgraph.view_layer.use_motion_blur and length > 0.0):
        return None
    curve = render.motion_blur_shutter_curve
    curve.initialize()
    values = np.array([curve.evaluate(curve.curves[0], x) for x in np.linspace(0.0, 1.0, _CURVE)])
    rolls = getattr(cycles, "rolling_shutter_type", "NONE") != "NONE"
    middle = scene.frame_current_final + _POSITIONS[render.motion_blur_position] * length
    return Blur(length, middle, Shutter(values, cycles.rolling_shutter_duration if rolls else None))


def vectors_of(depsgraph) -> Blur:
    """What is read for the pass Vector: from one frame before to one after."""
    return Blur(2.0, depsgraph.scene.frame_current_final, None)


def steps_of(item, parent=None) -> tuple[int, bool]:
    """(steps of an object over the shutter, 0 where it is not blurred; whether its deformation is)."""
    most, deforms = 0, True
    for owner in (item, parent) if parent is not None else (item,):
        settings = getattr(owner, "cycles", None)
        if not getattr(settings, "use_motion_blur", True):
            return 0, False
        deforms = deforms and getattr(settings, "use_deform_motion", True)
        most = max(most, getattr(settings, "motion_steps", 1))
    return (1 << most) + 1, deforms


def bends(item, data) -> bool:
    """Whether an object's mesh is likely to change its shape in time, by its modifiers and shape keys."""
    moved = any(modifier.type not in _STILL for modifier in item.modifiers)
    return moved or getattr(data, "shape_keys", None) is not None


def moments(steps: int) -> list[Fraction]:
    """When so many steps are, from -1 to 1."""
    return [Fraction(2 * i, steps - 1) - 1 for i in range(steps)]


class Steps(NamedTuple):
    """How a shape changes: its points, and the normals that it has, at each step."""

    points: list[np.ndarray]
    normals: list[np.ndarray] | None

    def apply(self, shape: Shape) -> Shape:
        """The shape with these steps."""
        result = copy.copy(shape)
        rows = len(shape.points) + (2 if isinstance(shape, Mesh) else 0)  # for Embree's reads of 16 bytes
        result.steps = np.zeros((len(self.points), rows, shape.points.shape[1]), np.float32)
        result.steps[:, : len(shape.points)] = self.points
        if self.normals is not None:
            result.normal_steps = np.ascontiguousarray(np.stack(self.normals), np.float32)
        return result


class Moments:
    """What the times beside the middle show of a scene that was read there.

    read(instance, time): the shape of an instance that is no mesh, at the time that is shown; changing: shapes, by
    their index in scene.meshes, whose steps are known. identities: of the entries of depsgraph.object_instances. The
    rest is of what is placed: places: the entry of each; steps: of each, 0 for those that stand still or are not
    rendered; rows: the index of each in scene.instances, -1: none; deforming: an index into scene.meshes by what is
    placed and read for it.
    """

    def __init__(
        self,
        scene: SceneDescription,
        read: Callable[[object, float], Shape | None],
        changing: dict[int, Steps],
        identities: list[tuple],
        places: np.ndarray,
        matrices: np.ndarray,
        steps: np.ndarray,
        rows: np.ndarray,
        deforming: dict[int, int],
    ) -> None:
        self._scene, self._read_shape = scene, read
        self._identities, self._places, self._steps, self._rows = identities, places, steps, rows
        self._deforming, self._changing = deforming, changing
        self._middle = matrices
        self._matrices: dict[Fraction, np.ndarray] = {Fraction(0): matrices}
        self._points: dict[tuple[int, Fraction], np.ndarray] = {}
        self._normals: dict[tuple[int, Fraction], np.ndarray] = {}
        self._changed: set[int] = set()  # meshes whose topology is another at another time

    def read(self, depsgraph, blur: Blur, frames: Frames, views: Views) -> None:
        """Read all times, and put what moves into the scene; the depsgraph then shows the middle no more."""
        camera_steps = [steps_of(item)[0] if blur.shutter else 3 for item in views.objects(depsgraph)]
        counts = {*np.unique(self._steps).tolist(), *camera_steps} - {0}
        looked = {moment for count in camera_steps if count for moment in moments(count)}
        cameras: dict[Fraction, tuple[Camera, ...]] = {Fraction(0): self._scene.cameras}
        for moment in sorted({moment for count in counts for moment in moments(count)} - {Fraction(0)}):
            if frames.stopped():
                return
            frames.show(blur.time(moment))
            self._read_moment(depsgraph, moment, blur.time(moment))
            if moment in looked:
                cameras[moment] = views.cameras(depsgraph, Warnings())
        instances, shapes = self._moved(), self._changing | self._changed_shapes(blur)
        views_steps = [
            tuple(cameras[moment][view] for moment in moments(count)) if count else ()
            for view, count in enumerate(camera_steps)
        ]
        if blur.shutter is None:
            places = {index: np.stack([steps.points[0], steps.points[-1]]) for index, steps in shapes.items()}
            self._scene.vectors = Vectors(instances, places)
            pairs = zip(self._scene.cameras, views_steps, strict=True)
            self._scene.cameras = tuple(replace(camera, around=(steps[0], steps[-1])) for camera, steps in pairs)
            return
        self._scene.shutter = blur.shutter
        self._scene.instance_steps = instances
        for index, steps in shapes.items():
            self._scene.meshes[index] = steps.apply(self._scene.meshes[index])
        self._scene.cameras = tuple(map(_moving, self._scene.cameras, views_steps))

    def _read_moment(self, depsgraph, moment: Fraction, time: float) -> None:
        """Matrices of all entries, and the vertices of what deforms, in the order of the middle."""
        found, matrices = identities(depsgraph), matrices_of(depsgraph)
        if found == self._identities:
            there = self._places
        else:
            places = {identity: place for place, identity in enumerate(found)}
            own = (self._identities[place] for place in self._places.tolist())
            there = np.array([places.get(identity, -1) for identity in own], np.int64)
        shown = there >= 0
        result = self._middle.copy()
        result[shown] = matrices[there[shown]]
        flat = ~usable(result)
        result[flat] = self._middle[flat]
        self._matrices[moment] = result
        wanted: dict[int, list[int]] = {}  # an object's shape, its hair
        for entry, mesh in self._deforming.items():
            if shown[entry] and moment in moments(int(self._steps[entry])):
                wanted.setdefault(int(there[entry]), []).append(mesh)
        if wanted:
            for place, instance in enumerate(depsgraph.object_instances):
                for mesh in wanted.get(place, ()):
                    self._read_points(mesh, instance, moment, time)

    def _read_points(self, index: int, instance, moment: Fraction, time: float) -> None:
        shape = self._scene.meshes[index]
        if isinstance(shape, Mesh):
            self._read_vertices(index, shape, instance.object.data, moment)
            return
        there = self._read_shape(instance, time)
        same = type(there) is type(shape) and len(there.points) == len(shape.points)
        if same and all(np.array_equal(a, b) for a, b in zip(there.form[1:-1], shape.form[1:-1], strict=True)):
            self._points[index, moment] = there.points
        else:
            self._changed.add(index)

    def _read_vertices(self, index: int, mesh: Mesh, data, moment: Fraction) -> None:
        n_normals = 0 if mesh.normals is None else len(mesh.normals)
        corners = mesh.normals_domain == DOMAIN_CORNER
        if len(data.vertices) != len(mesh.vertices) or (corners and len(data.loops) != n_normals):
            self._changed.add(index)
            return
        vertices = empty_vertices(len(mesh.vertices))
        data.attributes["position"].data.foreach_get("vector", vertices.reshape(-1))
        self._points[index, moment] = np.nan_to_num(vertices, copy=False)
        if n_normals:
            normals = np.empty((n_normals, 3), np.float32)
            (data.corner_normals if corners else data.vertex_normals).foreach_get("vector", normals.reshape(-1))
            self._normals[index, moment] = normals

    def _moved(self) -> list[InstanceSteps]:
        """The instances whose matrices are not the same at all steps."""
        found = []
        for count in np.unique(self._steps[self._rows >= 0]).tolist():
            mine = np.flatnonzero((self._steps == count) & (self._rows >= 0)) if count else np.zeros(0, np.int64)
            if not len(mine):
                continue
            matrices = np.stack([self._matrices[moment][mine] for moment in moments(count)], axis=1)
            moves = differ(matrices)
            if moves.any():
                found.append(InstanceSteps(self._rows[mine[moves]], matrices[moves]))
        return found

    def _changed_shapes(self, blur: Blur) -> dict[int, Steps]:
        """The shapes whose points are not the same at all steps, by their index."""
        found = {}
        for entry, index in self._deforming.items():
            shape = self._scene.meshes[index]
            if index in self._changed:
                if blur.shutter:
                    text = "its points are others in other frames: the blur of its deformation is left out"
                    self._scene.warnings.add("Mesh", shape.name, text)
                continue
            times = moments(int(self._steps[entry]))
            if not all(moment == 0 or (index, moment) in self._points for moment in times):
                continue
            points = [shape.points if moment == 0 else self._points[index, moment] for moment in times]
            if all(np.array_equal(points[0], other) for other in points[1:]):
                continue
            normals = None
            if isinstance(shape, Mesh) and shape.normals is not None:
                normals = [shape.normals if moment == 0 else self._normals[index, moment] for moment in times]
            found[index] = Steps(points, normals)
        return found


def _moving(camera: Camera, steps: tuple[Camera, ...]) -> Camera:
    """The camera with its steps, where they are not all the same."""
    return camera if all(steps[0].same_as(step) for step in steps[1:]) else replace(camera, steps=steps)


def identities(depsgraph) -> list[tuple]:
    """What entries of depsgraph.object_instances are known again by at another time: names of objects, and of instances
    what the instancer has numbered them by.
    """
    instances = depsgraph.object_instances
    count = len(instances)
    numbers = np.empty((count, 8), np.int32)
    instances.foreach_get("persistent_id", numbers.reshape(-1))
    random = np.empty(count, np.int32)
    instances.foreach_get("random_id", random)
    is_instance = np.empty(count, bool)
    instances.foreach_get("is_instance", is_instance)
    numbers[~is_instance] = 0
    rows = zip(random.tolist(), map(bytes, numbers), is_instance.tolist(), instances, strict=True)
    return [(random, row) if instanced else (instance.object.name_full,) for random, row, instanced, instance in rows]


def matrices_of(depsgraph) -> np.ndarray:
    """Object to world of all entries of depsgraph.object_instances: float64 (n, 12) by rows."""
    instances = depsgraph.object_instances
    columns = np.empty((len(instances), 4, 4), np.float32)
    instances.foreach_get("matrix_world", columns.reshape(-1))
    return columns.transpose(0, 2, 1)[:, :3].reshape(-1, 12).astype(np.float64)


def along_velocity(shape: Shape, data, seconds: float) -> Steps | None:
    """How a `velocity` attribute moves a shape while a shutter is open for so long; None where it has none."""
    velocity = data.attributes.get(VELOCITY)
    if velocity is None or velocity.domain != "POINT" or velocity.data_type != "FLOAT_VECTOR":
        return None
    if len(velocity.data) != len(shape.points):
        return None
    way = np.zeros_like(shape.points)
    vectors = np.empty((len(way), 3), np.float32)
    velocity.data.foreach_get("vector", vectors.reshape(-1))
    way[:, :3] = np.nan_to_num(vectors) * np.float32(0.5 * seconds)
    if not way.any():
        return None
    normals = [shape.normals] * 3 if isinstance(shape, Mesh) and shape.normals is not None else None
    return Steps([shape.points - way, shape.points, shape.points + way], normals)
