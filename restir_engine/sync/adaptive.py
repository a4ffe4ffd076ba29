"""Subdivision by size in the picture: which objects ask for it, how finely, and what it needs of Blender's mesh.

The whole of a mesh is subdivided evenly, by the longest of its edges as the picture shows them. Blender hands out a
mesh at the levels of the modifier, whose points are on the limit surface; it is subdivided further from there.
"""

from __future__ import annotations

import bpy
import numpy as np

from ..scene import names
from ..scene.camera import Camera
from ..scene.mesh import Mesh
from ..scene.subdivision import SHARP, Options, Surface, subdivided
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


def diced(scene, item, data, mesh: Mesh, modifier, depsgraph) -> Mesh:
    """The mesh of an evaluated object, subdivided until its edges are of the size that is asked for."""
    cycles, in_render = depsgraph.scene.cycles, depsgraph.mode == "RENDER"
    rate = cycles.dicing_rate if in_render else cycles.preview_dicing_rate
    counts = _read(data.polygons, "loop_total", len(data.polygons), np.int32)
    vertices = _read(data.loops, "vertex_index", len(data.loops), np.int32)
    if getattr(modifier, "adaptive_space", "PIXEL") == "OBJECT":
        lengths = _edges(mesh.vertices, counts, vertices)[0]
        size = float(lengths.max(initial=0.0)) / max(modifier.adaptive_object_edge_length * rate, 1e-9)
    else:
        own = modifier.adaptive_pixel_size if hasattr(modifier, "adaptive_pixel_size") else item.cycles.dicing_rate
        offscreen = cycles.offscreen_dicing_scale
        size = _pixels(
            mesh.vertices, counts, vertices, np.array(item.matrix_world), _camera(scene, depsgraph), offscreen
        )
        size /= max(own * rate, 1e-3)
    wanted = int(np.ceil(np.log2(max(size, 1.0))))
    level = min(wanted, cycles.max_subdivisions, int(np.log2(MOST_QUADS / max(len(counts), 1)) // 2))
    if level < wanted and level < cycles.max_subdivisions:
        scene.warnings.add("Object", item.name, f"subdivided {level} times, not {wanted}: faces would be too many")
    if level < 1:
        return mesh
    done = modifier.render_levels if in_render else modifier.levels
    smooth = modifier.subdivision_type == "CATMULL_CLARK"
    uv_maps = frozenset(scene.attribute_name(name) for name in (names.UV, *(layer.name for layer in data.uv_layers)))
    surface = Surface(
        counts, vertices, _creases(data) if modifier.use_creases else None, _sharp_points(data, modifier.use_creases),
        uv_maps, modifier.uv_smooth != "NONE", done > 0 and modifier.use_limit_surface,
    )  # fmt: skip
    return subdivided(mesh, surface, level, Options(smooth, modifier.boundary_smooth == "PRESERVE_CORNERS"))


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


def _edges(points: np.ndarray, counts: np.ndarray, vertices: np.ndarray) -> tuple[np.ndarray, list[np.ndarray]]:
    """For each corner the length of the edge that follows it; its start, its middle and the middle of its face."""
    faces = np.repeat(np.arange(len(counts)), counts)
    first = np.cumsum(counts) - counts
    following = np.arange(len(vertices)) + 1
    following[first + counts - 1] = first
    start = points[vertices]
    end = start[following]
    centre = np.add.reduceat(start, first, axis=0) / counts[:, None]
    return np.linalg.norm(end - start, axis=1), [start, 0.5 * (start + end), centre[faces]]


def _pixels(points, counts, vertices, matrix: np.ndarray, camera: Camera, offscreen: float) -> float:
    """The longest edge in pixels: its length by the size of a pixel where it is nearest, whatever way it looks.

    What lies beside the picture counts for as much less as `offscreen` says.
    """
    lengths, places = _edges(points @ matrix[:3, :3].T + matrix[:3, 3], counts, vertices)
    axes = camera.to_world[:, :3] / np.maximum(np.linalg.norm(camera.to_world[:, :3], axis=0), 1e-30)
    left, right, bottom, top = camera.screen
    pixel = np.full(len(lengths), np.inf)
    for place in places:
        x, y, z = ((place - camera.to_world[:, 3]) @ axes).T
        distance = np.maximum(np.sqrt(x * x + y * y + z * z), max(camera.clip_start, 1e-6))
        if camera.kind == "PANO":
            pixel = np.minimum(pixel, 2.0 * np.pi * distance / camera.width)
            continue
        depth = np.maximum(-z, 1e-6) if camera.kind == "PERSP" else 1.0
        size = (right - left) / camera.width * (distance if camera.kind == "PERSP" else 1.0)
        seen = (x / depth >= left) & (x / depth <= right) & (y / depth >= bottom) & (y / depth <= top) & (z < 0.0)
        pixel = np.minimum(pixel, np.where(seen, size, size * offscreen))
    return float((lengths / pixel).max(initial=0.0))
