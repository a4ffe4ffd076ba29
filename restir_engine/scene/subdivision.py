"""Catmull–Clark subdivision of a cage of polygons, towards its limit surface, or linear where the artist asks for that.

Catmull and Clark 1978, "Recursively Generated B-Spline Surfaces on Arbitrary Topological Meshes"; creases: DeRose,
Kass, Truong 1998, "Subdivision Surfaces in Character Animation". Every face becomes a quad a corner, from its vertex
to the middle of the next edge, the face's middle, and that of the edge before. So the edges of the finer level are
known without a search: halves 2 e and 2 e + 1 of an edge e, and one for each corner, from its edge to the face.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ..kernels.core.records import DOMAIN_CORNER, DOMAIN_POINT
from .mesh import Mesh
from .shape import Attribute

SHARP = 10.0  # sharpness of what stays sharp at every level


@dataclass(frozen=True)
class Cage:
    """Polygons of one level. Corner c of a face is followed by the edge `corner_edges`[c]."""

    points: np.ndarray  # float64 (n, d)
    corner_points: np.ndarray  # int (corners,)
    corner_faces: np.ndarray  # int (corners,), ascending
    corner_edges: np.ndarray  # int (corners,)
    preceding: np.ndarray  # int (corners,)
    edges: np.ndarray  # int (edges, 2)
    creases: np.ndarray  # float (edges,), sharpness
    corners: np.ndarray  # float (n,), sharpness of points
    faces: int


class Options(NamedTuple):
    """How a cage is subdivided."""

    smooth: bool = True  # Catmull–Clark, else linear
    boundary_corners: bool = False  # points of a single face stay where they are
    fixed_boundary: bool = False  # so do all at boundaries, as for UV maps


_SMOOTH = Options()


def cage(points, corner_points, corner_faces, creases=None, corners=None, options: Options = _SMOOTH) -> Cage:
    """A Cage of polygons. creases: pairs of points (n, 2) and their sharpness; corners: that of points."""
    corner_points = np.asarray(corner_points, np.int64)
    corner_faces = np.asarray(corner_faces, np.int64)
    count = len(corner_points)
    first = np.flatnonzero(np.diff(corner_faces, prepend=-1))
    sizes = np.diff(np.append(first, count))
    following = np.arange(count) + 1
    following[first + sizes - 1] = first
    preceding = np.empty(count, np.int64)
    preceding[following] = np.arange(count)
    ends = np.sort(np.stack([corner_points, corner_points[following]], 1), 1)
    keys, corner_edges = np.unique(ends[:, 0] * len(points) + ends[:, 1], return_inverse=True)
    edges = np.stack([keys // len(points), keys % len(points)], 1)
    sharp = np.zeros(len(edges))
    if creases is not None:
        pairs, values = creases
        pairs = np.sort(np.asarray(pairs, np.int64), 1)
        wanted = pairs[:, 0] * len(points) + pairs[:, 1]
        place = np.minimum(np.searchsorted(keys, wanted), len(keys) - 1)
        found = keys[place] == wanted
        sharp[place[found]] = np.asarray(values)[found]
    used = np.bincount(corner_edges, minlength=len(edges))
    sharp[used != 2] = SHARP * SHARP
    pointed = np.zeros(len(points)) if corners is None else np.array(corners, float)
    boundary = np.zeros(len(points), bool)
    boundary[edges[used != 2].ravel()] = True
    if options.boundary_corners:
        pointed[boundary & (np.bincount(corner_points, minlength=len(points)) == 1)] = SHARP * SHARP
    if options.fixed_boundary:
        pointed[boundary] = SHARP * SHARP
    return Cage(
        np.asarray(points, np.float64), corner_points, corner_faces, corner_edges.reshape(-1), preceding, edges, sharp,
        pointed, len(first),
    )  # fmt: skip


def _sums(index: np.ndarray, values: np.ndarray, count: int) -> np.ndarray:
    """Sums (count, d) of values (n, d) by index."""
    return np.stack([np.bincount(index, column, count) for column in values.T], 1)


def _creased(cage: Cage, smooth: np.ndarray, creased: np.ndarray) -> np.ndarray:
    """Places of points by the sharpness about them: smooth, along two sharp edges, or where they are."""
    n = len(cage.points)
    sharp = cage.creases > 0.0
    ends = cage.edges[sharp].ravel()
    count = np.bincount(ends, minlength=n)
    mean = np.bincount(ends, np.repeat(cage.creases[sharp], 2), n) / np.maximum(count, 1)
    others = _sums(ends, cage.points[cage.edges[sharp][:, ::-1].ravel()], n)
    weight = np.where(count >= 2, np.minimum(mean, 1.0), 0.0)[:, None]
    target = np.where((count == 2)[:, None], creased[0] * cage.points + creased[1] * others, cage.points)
    result = smooth + weight * (target - smooth)
    pointed = np.minimum(cage.corners, 1.0)[:, None]
    return result + pointed * (cage.points - result)


def finer(cage: Cage, options: Options) -> Cage:
    """The next level."""
    n, n_edges, n_corners = len(cage.points), len(cage.edges), len(cage.corner_points)
    sizes = np.bincount(cage.corner_faces, minlength=cage.faces)
    corner_values = cage.points[cage.corner_points]
    face_points = _sums(cage.corner_faces, corner_values, cage.faces) / sizes[:, None]
    middles = 0.5 * (cage.points[cage.edges[:, 0]] + cage.points[cage.edges[:, 1]])
    edge_points, points = middles, cage.points
    if options.smooth:
        around = face_points[cage.corner_faces]
        both = _sums(cage.corner_edges, around, n_edges)
        smooth = 0.5 * middles + 0.25 * both
        weight = np.minimum(cage.creases, 1.0)[:, None]
        edge_points = smooth + weight * (middles - smooth)
        n_faces = np.bincount(cage.corner_points, minlength=n)[:, None]
        ends = cage.edges.ravel()
        valence = np.maximum(np.bincount(ends, minlength=n), 1)[:, None]
        mean_face = _sums(cage.corner_points, around, n) / np.maximum(n_faces, 1)
        mean_edge = _sums(ends, np.repeat(middles, 2, axis=0), n) / valence
        smooth = (mean_face + 2.0 * mean_edge + (valence - 3.0) * cage.points) / valence
        points = _creased(cage, np.where(n_faces > 0, smooth, cage.points), (0.75, 0.125))
    corners = np.arange(n_corners)
    corner_points = np.stack([
        cage.corner_points, n + cage.corner_edges, n + n_edges + cage.corner_faces,
        n + cage.corner_edges[cage.preceding],
    ], 1)  # fmt: skip
    before = cage.corner_edges[cage.preceding]
    corner_edges = np.stack([
        2 * cage.corner_edges + (cage.corner_points != cage.edges[cage.corner_edges, 0]),
        2 * n_edges + corners,
        2 * n_edges + cage.preceding,
        2 * before + (cage.corner_points != cage.edges[before, 0]),
    ], 1)  # fmt: skip
    halves = np.stack([cage.edges.ravel(), n + np.repeat(np.arange(n_edges), 2)], 1)
    inner = np.stack([n + cage.corner_edges, n + n_edges + cage.corner_faces], 1)
    quads = 4 * corners[:, None]
    creases = np.concatenate([np.repeat(np.maximum(cage.creases - 1.0, 0.0), 2), np.zeros(n_corners)])
    return Cage(
        np.concatenate([points, edge_points, face_points]),
        corner_points.ravel(),
        np.repeat(corners, 4),
        corner_edges.ravel(),
        (quads + np.array([3, 0, 1, 2])).ravel(),
        np.concatenate([halves, inner]),
        creases,
        np.concatenate([np.maximum(cage.corners - 1.0, 0.0), np.zeros(n_edges + cage.faces)]),
        n_corners,
    )


def on_limit(cage: Cage) -> np.ndarray:
    """Where the points of a cage of quads come to lie in the limit (Halstead, Kass, DeRose 1993)."""
    n = len(cage.points)
    ends = cage.edges.ravel()
    valence = np.maximum(np.bincount(ends, minlength=n), 1)[:, None]
    near = _sums(ends, cage.points[cage.edges[:, ::-1].ravel()], n)
    opposite = cage.corner_points.reshape(-1, 4)[:, [2, 3, 0, 1]].ravel()
    far = _sums(cage.corner_points, cage.points[opposite], n)
    smooth = (valence**2 * cage.points + 4.0 * near + far) / (valence * (valence + 5.0))
    used = np.bincount(cage.corner_points, minlength=n)[:, None] > 0
    return _creased(cage, np.where(used, smooth, cage.points), (2.0 / 3.0, 1.0 / 6.0))


def control_points(cage: Cage, sweeps: int = 30) -> np.ndarray:
    """The points of a cage of quads whose limit are the points that it has: what Blender has subdivided already.

    `on_limit` is a mean in which every point weighs 4/9 or more itself, so that adding what is missing converges.
    """
    target = cage.points
    result = target
    for _ in range(sweeps):
        result = result + target - on_limit(replace(cage, points=result))
    return result


class Surface(NamedTuple):
    """What a mesh has beyond triangles: polygons, and what of them is sharp."""

    polygon_corners: np.ndarray  # int (polygons,), how many each has, in the order of corners
    corner_vertices: np.ndarray  # int (corners,)
    creases: tuple[np.ndarray, np.ndarray] | None  # pairs of vertices (n, 2) and their sharpness
    points: np.ndarray | None  # sharpness of vertices
    uv_maps: frozenset[int]  # names of attributes that are UV maps
    smooth_uv: bool
    is_limit: bool  # vertices lie on the limit surface already


def subdivided(mesh: Mesh, surface: Surface, level: int, options: Options) -> Mesh:
    """A mesh of quads, `level` times finer, on the limit surface where it is smooth; with all attributes.

    Attributes of points are subdivided as the points are, UV maps likewise but at their boundaries, and what else
    corners have goes over faces linearly.
    """
    faces = np.repeat(np.arange(len(surface.polygon_corners)), surface.polygon_corners)
    at_points = [item for item in mesh.attributes if item.domain == DOMAIN_POINT]
    values = np.hstack([mesh.vertices, *(item.values for item in at_points)])
    fine = cage(values, surface.corner_vertices, faces, surface.creases, surface.points, options)
    if options.smooth and surface.is_limit and (surface.polygon_corners == 4).all():
        points = fine.points.copy()
        points[:, :3] = control_points(replace(fine, points=points[:, :3]))
        fine = replace(fine, points=points)
    origin = faces
    for _ in range(level):
        fine = finer(fine, options)
        origin = origin if fine.faces == len(origin) else np.repeat(origin, 4)
    limit = on_limit(fine) if options.smooth else fine.points
    limit = np.ascontiguousarray(limit, np.float32)

    quads = np.arange(4 * fine.faces).reshape(-1, 4)
    corners = quads[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3).astype(np.uint32)
    result = replace(
        mesh, vertices=limit[:, :3], triangles=fine.corner_points[corners], corners=corners,
        polygons=np.repeat(origin, 2), attributes=[], normals=None, normals_domain=DOMAIN_POINT,
        steps=None, normal_steps=None,
    )  # fmt: skip
    column = 3
    for item in at_points:
        width = item.values.shape[1]
        result.attributes.append(Attribute(item.name, DOMAIN_POINT, limit[:, column : column + width]))
        column += width
    for item in mesh.attributes:
        if item.domain == DOMAIN_CORNER:
            smooth = options.smooth and surface.smooth_uv and item.name in surface.uv_maps
            values = _over_corners(item.values, surface.corner_vertices, faces, level, smooth)
            result.attributes.append(Attribute(item.name, DOMAIN_CORNER, values))
        elif item.domain != DOMAIN_POINT:
            result.attributes.append(item)
    first = np.zeros(len(surface.polygon_corners), np.int64)
    first[mesh.polygons[::-1]] = np.arange(len(mesh.polygons))[::-1]
    for name in ("smooth", "material_slots"):
        array = getattr(mesh, name)
        if array is not None:
            setattr(result, name, array[first][result.polygons])
    if mesh.normals is not None:
        result.normals = _vertex_normals(result)
    return result


def _over_corners(values, corner_vertices, faces, level: int, smooth: bool) -> np.ndarray:
    """Values of corners, (corners, k), over the corners of a finer level."""
    keys = np.column_stack([corner_vertices, values.view(np.uint32).astype(np.int64)])
    _, first, shared = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    options = Options(smooth=smooth, fixed_boundary=True)
    fine = cage(values[first], shared.reshape(-1), faces, options=options)
    for _ in range(level):
        fine = finer(fine, options)
    points = on_limit(fine) if smooth else fine.points
    return points[fine.corner_points]


def _vertex_normals(mesh: Mesh) -> np.ndarray:
    """The mean normals of the triangles round vertices, by area."""
    a, b, c = (mesh.vertices[mesh.triangles[:, k]] for k in range(3))
    normals = np.repeat(np.cross(b - a, c - a), 3, axis=0)
    sums = _sums(mesh.triangles.ravel(), normals, len(mesh.vertices))
    length = np.linalg.norm(sums, axis=1, keepdims=True)
    return np.where(length > 0.0, sums / np.where(length > 0.0, length, 1.0), np.array([0.0, 0.0, 1.0]))
