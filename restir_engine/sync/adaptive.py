"""Subdivision by size in the picture: which objects ask for it, how finely, and what it needs of Blender's mesh.

Each face is subdivided until its edges are as short as the picture wants them. Blender hands out a mesh at the levels
of the modifier, whose points are on the limit surface; it is subdivided further from there.
"""

from __future__ import annotations

import copy
from collections.abc import Callable
from typing import NamedTuple

import bpy
import numpy as np

from ..scene import names
from ..scene.camera import Camera
from ..scene.mesh import Mesh
from ..scene.recent import Recent
from ..scene.subdivision import SHARP, Cage, Options, Surface, subdivided
from .camera import sync_camera

MOST_QUADS = 1 << 21  # of one mesh


def adaptive_modifier(item, depsgraph) -> bpy.types.SubsurfModifier | None:
    """The modifier by which Cycles would subdivide an evaluated object by its size, if any."""
    if not item.modifiers or item.type != "MESH":
        return None
    last = item.modifiers[-1]
    shown = last.show_render if depsgraph.mode == "RENDER" else last.show_viewport
    experimental = bpy.app.version >= (5, 0, 0) or depsgraph.scene.cycles.feature_set == "EXPERIMENTAL"
    return last if last.type == "SUBSURF" and shown and experimental and is_adaptive(item, last) else None


def is_adaptive(item, modifier) -> bool:
    """Whether a modifier subdivides by size: a switch of the object, later of the modifier."""
    own = getattr(getattr(item, "cycles", None), "use_adaptive_subdivision", False)
    return bool(getattr(modifier, "use_adaptive_subdivision", own))


class _Diced(NamedTuple):
    mesh: Mesh  # as it was
    result: Mesh
    crowded: bool


def diced(scene, item, data, mesh: Mesh, modifier, depsgraph, kept: Recent) -> Mesh:
    """The mesh of an evaluated object, subdivided until its edges are of the size that is asked for.

    kept: what earlier frames have made; what a mesh with the same size and settings has become is found there.
    """
    cycles, in_render = depsgraph.scene.cycles, depsgraph.mode == "RENDER"
    rate = cycles.dicing_rate if in_render else cycles.preview_dicing_rate
    done = modifier.render_levels if in_render else modifier.levels
    in_space = getattr(modifier, "adaptive_space", "PIXEL") == "OBJECT"
    longest = rate * (modifier.adaptive_object_edge_length if in_space else _pixel_size(item, modifier))
    smooth = modifier.subdivision_type == "CATMULL_CLARK"
    options = Options(smooth, modifier.boundary_smooth == "PRESERVE_CORNERS")
    matrix, camera = np.array(item.matrix_world), _camera(scene, depsgraph)
    view = camera.kind, camera.to_world.tobytes(), camera.screen, camera.width, camera.clip_start, matrix.tobytes()
    key = (
        id(mesh), longest, options, done, modifier.use_creases, modifier.uv_smooth, modifier.use_limit_surface,
        cycles.max_subdivisions, in_space or (cycles.offscreen_dicing_scale, *view),
    )  # fmt: skip
    known = kept.get(key)
    if known is not None:
        return _told(scene, item, known)
    counts = _read(data.polygons, "loop_total", len(data.polygons), np.int32)
    vertices = _read(data.loops, "vertex_index", len(data.loops), np.int32)
    uv_maps = frozenset(scene.attribute_name(name) for name in (names.UV, *(layer.name for layer in data.uv_layers)))
    surface = Surface(
        counts, vertices, _creases(data) if modifier.use_creases else None, _sharp_points(data, modifier.use_creases),
        uv_maps, modifier.uv_smooth != "NONE", done > 0 and modifier.use_limit_surface,
    )  # fmt: skip

    def pixel(centres: np.ndarray, radii: np.ndarray) -> np.ndarray | float:
        return 1.0 if in_space else _pixels(centres, radii, camera, cycles.offscreen_dicing_scale)

    to_world = np.eye(4) if in_space else matrix
    need, cage = _Need(to_world, pixel, max(longest, 1e-9), cycles.max_subdivisions), copy.copy(mesh)
    normal = scene.attribute_names.get(names.VERTEX_NORMAL)
    cage.attributes = [item for item in mesh.attributes if item.name != normal]
    result = subdivided(cage, surface, need, options)
    return _told(scene, item, kept.put(key, _Diced(mesh, result, need.crowded)))


def _told(scene, item, diced: _Diced) -> Mesh:
    if diced.crowded:
        scene.warnings.add("Object", item.name, "subdivided less finely: faces would be too many")
    return diced.result


def _pixel_size(item, modifier) -> float:
    """An object's own dicing rate: of the modifier, before of the object."""
    if hasattr(modifier, "adaptive_pixel_size"):
        return modifier.adaptive_pixel_size
    return item.cycles.dicing_rate


class _Need:
    """By how many levels faces should be finer, until their edges are about `length` pixels long on the mean.

    to_world: to where lengths are measured; pixel: the size of one there, of spheres round faces (centres, radii).
    crowded: whether faces would have been too many.
    """

    def __init__(self, to_world: np.ndarray, pixel: Callable, length: float, most: int) -> None:
        self._matrix, self._pixel, self._length, self._most = to_world[:3], pixel, length, most
        self.crowded = False

    def __call__(self, cage: Cage, level: int) -> np.ndarray:
        corners = (cage.points[:, :3] @ self._matrix[:, :3].T + self._matrix[:, 3])[cage.corner_points]
        first = np.flatnonzero(np.diff(cage.corner_faces, prepend=-1))
        sizes = np.diff(np.append(first, len(corners)))
        centres = np.add.reduceat(corners, first, axis=0) / sizes[:, None]
        radii = np.maximum.reduceat(np.linalg.norm(corners - centres[cage.corner_faces], axis=1), first)
        edges = np.add.reduceat(np.linalg.norm(corners - corners[cage.preceding], axis=1), first) / sizes
        wanted = edges / (self._pixel(centres, radii) * self._length)
        need = np.minimum(np.rint(np.log2(np.maximum(wanted, 1.0))).astype(np.int64), self._most - level)
        if cage.faces + 3 * (need > 0).sum() > MOST_QUADS:
            self.crowded = True
            need[:] = 0
        return need


def _camera(scene, depsgraph) -> Camera:
    """The camera by whose picture sizes go."""
    chosen = depsgraph.scene.cycles.dicing_camera
    return sync_camera(depsgraph, scene.warnings, chosen) if chosen is not None else scene.camera


def _read(collection, field: str, count: int, dtype) -> np.ndarray:
    result = np.empty(count, dtype)
    collection.foreach_get(field, result)
    return result


def _creases(data) -> tuple[np.ndarray, np.ndarray] | None:
    """Pairs of vertices and the sharpness of the edge between them."""
    found = data.attributes.get("crease_edge")
    if found is None or found.domain != "EDGE":
        return None
    values = SHARP * _read(found.data, "value", len(data.edges), np.float32)
    edges = _read(data.attributes[".edge_verts"].data, "value", 2 * len(data.edges), np.int32).reshape(-1, 2)
    return edges[values > 0.0], values[values > 0.0]


def _sharp_points(data, use: bool) -> np.ndarray | None:
    found = data.attributes.get("crease_vert") if use else None
    if found is None or found.domain != "POINT":
        return None
    return SHARP * _read(found.data, "value", len(data.vertices), np.float32)


def _pixels(centres: np.ndarray, radii: np.ndarray, camera: Camera, offscreen: float) -> np.ndarray:
    """The size of a pixel where spheres are nearest to the camera; beside the picture `offscreen` times as large."""
    axes = camera.to_world[:, :3] / np.maximum(np.linalg.norm(camera.to_world[:, :3], axis=0), 1e-30)
    left, right, bottom, top = camera.screen
    x, y, z = ((centres - camera.to_world[:, 3]) @ axes).T
    distance = np.maximum(np.sqrt(x * x + y * y + z * z) - radii, max(camera.clip_start, 1e-6))
    if camera.kind == "PANO":
        return 2.0 * np.pi * distance / camera.width
    pixel = (right - left) / camera.width * (distance if camera.kind == "PERSP" else np.ones(len(distance)))
    # How wide the picture is at that depth, and the sphere there.
    depth = np.maximum(-z, 1e-6) if camera.kind == "PERSP" else np.ones(len(distance))
    beside = np.maximum(
        np.maximum(left * depth - x, x - right * depth), np.maximum(bottom * depth - y, y - top * depth)
    )
    seen = (beside <= 1.5 * radii) & (z < radii)
    return np.where(seen, pixel, pixel * offscreen)
