"""Catmull–Clark subdivision of a cage of polygons, towards its limit surface, or linear where the artist asks for that.

Catmull and Clark 1978, "Recursively Generated B-Spline Surfaces on Arbitrary Topological Meshes"; creases: DeRose,
Kass, Truong 1998, "Subdivision Surfaces in Character Animation". Every face becomes a quad a corner, from its vertex
to the middle of the next edge, the face's middle, and that of the edge before. So the edges of the finer level are
known without a search: halves 2 e and 2 e + 1 of an edge e, and one for each corner, from its edge to the face.

Faces are refined where they are large (`leaves`), together with those round them, which later points depend on. Faces
that share an edge differ by one level at most: where one of them is finer, the other gets the middle of the edge as a
corner, so that there are no gaps.
"""

from __future__ import annotations

from collections.abc import Callable
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


class Leaves(NamedTuple):
    """The faces at which refinement has ended, quads, of any level; points are told apart by numbers."""

    corners: np.ndarray  # (faces, 4) numbers of points
    middles: np.ndarray  # (faces, 4) those in the middle of the edges that follow; -1: nobody has asked for it
    finer_beside: np.ndarray  # bool (faces, 4): the neighbour across this edge is finer
    origin: np.ndarray  # (faces,) of the polygons of the first cage
    values: np.ndarray  # float64 (numbers, d), on the limit surface where it is smooth
    plan: list[tuple[np.ndarray, np.ndarray]]  # which faces of each level were refined, and which taken along


# Of a cage and its level: by how many levels each of its faces should be finer, int (faces,).
Need = Callable[[Cage, int], np.ndarray]


def leaves(cage: Cage, options: Options, need: Need | None = None, plan=None) -> Leaves:
    """Refine a cage where `need` says so, or as the `plan` of another cage of the same polygons says."""
    numbers, known = np.arange(len(cage.points)), np.zeros(len(cage.points), bool)
    values = np.array(cage.points)
    real, origin = np.ones(cage.faces, bool), np.arange(cage.faces)
    bound = np.full(cage.faces, 1 << 20)
    corners, middles, beside, origins, done = [], [], [], [], []
    for level in range(len(plan) + 1 if plan is not None else 1 << 20):
        quads = len(cage.corner_points) == 4 * cage.faces
        if plan is not None:
            selected, taken = plan[level] if level < len(plan) else (np.zeros(cage.faces, bool),) * 2
        elif not bound.any():  # nobody may go on
            selected = taken = np.zeros(cage.faces, bool)
        else:
            wanted = np.minimum(need(cage, level), bound)
            bound = _balanced(cage, np.where(real, wanted if quads else np.maximum(wanted, 1), 0))
            selected = bound > 0
            near = np.zeros(len(cage.points), bool)
            near[cage.corner_points[selected[cage.corner_faces]]] = True
            taken = np.bincount(cage.corner_faces, near[cage.corner_points], cage.faces) > 0
        final = real & ~selected
        middle = np.full(len(cage.edges), -1)
        if quads:
            points = on_limit(cage) if options.smooth else cage.points
            new = ~known[numbers]
            values[numbers[new]] = points[new]
            sound = np.zeros(len(numbers), bool)
            sound[cage.corner_points.reshape(-1, 4)[real]] = True
            values[numbers[sound]] = points[sound]
            known[numbers[sound]] = True
        split = np.zeros(len(cage.edges), bool)
        split[cage.corner_edges[selected[cage.corner_faces]]] = True
        if selected.any():
            part, at_points, at_edges = _part(cage, taken)
            fine = finer(part, options)
            fresh = len(values) + np.arange(len(fine.points) - len(part.points))
            middle[at_edges] = fresh[: len(part.edges)]
            values = np.concatenate([values, fine.points[len(part.points) :]])
            known = np.concatenate([known, np.zeros(len(fresh), bool)])
        if final.any():
            corners.append(numbers[cage.corner_points].reshape(-1, 4)[final])
            middles.append(middle[cage.corner_edges].reshape(-1, 4)[final])
            beside.append(split[cage.corner_edges].reshape(-1, 4)[final])
            origins.append(origin[final])
        if not selected.any():
            break
        done.append((selected, taken))
        numbers = np.concatenate([numbers[at_points], fresh])
        parent = np.flatnonzero(taken)[part.corner_faces]
        real, origin, bound = selected[parent], origin[parent], bound[parent] - 1
        cage = fine
    return Leaves(*(np.concatenate(each) for each in (corners, middles, beside, origins)), values, done)


def _balanced(cage: Cage, need: np.ndarray) -> np.ndarray:
    """By how many levels faces are finer, at least as many as `need`, so that neighbours differ by one at most."""
    while True:
        across = np.zeros(len(cage.edges), np.int64)
        np.maximum.at(across, cage.corner_edges, need[cage.corner_faces])
        result = need.copy()
        np.maximum.at(result, cage.corner_faces, across[cage.corner_edges] - 1)
        if np.array_equal(result, need):
            return result
        need = result


def _part(cage: Cage, faces: np.ndarray) -> tuple[Cage, np.ndarray, np.ndarray]:
    """The cage of some faces (bool), and which of the points and edges it has."""
    mine = faces[cage.corner_faces]
    at_points, at_edges = np.zeros(len(cage.points), bool), np.zeros(len(cage.edges), bool)
    at_points[cage.corner_points[mine]] = True
    at_edges[cage.corner_edges[mine]] = True
    point, edge, face, corner = (np.cumsum(which) - 1 for which in (at_points, at_edges, faces, mine))
    part = Cage(
        cage.points[at_points], point[cage.corner_points[mine]], face[cage.corner_faces[mine]],
        edge[cage.corner_edges[mine]], corner[cage.preceding[mine]], point[cage.edges[at_edges]],
        cage.creases[at_edges], cage.corners[at_points], int(faces.sum()),
    )  # fmt: skip
    return part, np.flatnonzero(at_points), np.flatnonzero(at_edges)


class Surface(NamedTuple):
    """What a mesh has beyond triangles: polygons, and what of them is sharp."""

    polygon_corners: np.ndarray  # int (polygons,), how many each has, in the order of corners
    corner_vertices: np.ndarray  # int (corners,)
    creases: tuple[np.ndarray, np.ndarray] | None  # pairs of vertices (n, 2) and their sharpness
    points: np.ndarray | None  # sharpness of vertices
    uv_maps: frozenset[int]  # names of attributes that are UV maps
    smooth_uv: bool
    is_limit: bool  # vertices lie on the limit surface already


def subdivided(mesh: Mesh, surface: Surface, need: Need, options: Options) -> Mesh:
    """A mesh as fine as `need` says, on the limit surface where it is smooth; with all attributes.

    Attributes of points are subdivided as the points are, UV maps likewise but at their boundaries, and what else
    corners have goes over faces linearly.
    """
    faces = np.repeat(np.arange(len(surface.polygon_corners)), surface.polygon_corners)
    at_points = [item for item in mesh.attributes if item.domain == DOMAIN_POINT]
    values = np.hstack([mesh.vertices, *(item.values for item in at_points)])
    base = cage(values, surface.corner_vertices, faces, surface.creases, surface.points, options)
    if options.smooth and surface.is_limit and (surface.polygon_corners == 4).all():
        points = base.points.copy()
        points[:, :3] = control_points(replace(base, points=points[:, :3]))
        base = replace(base, points=points)
    found = leaves(base, options, need)
    polygons, corners = _triangles(found.finer_beside)
    slots, corners = _used(corners, 8 * len(found.corners))
    points, vertices = _used(_ring(found)[slots], len(found.values))
    limit = np.ascontiguousarray(found.values[points], np.float32)
    result = replace(
        mesh, vertices=limit[:, :3], triangles=vertices[corners], corners=corners.astype(np.uint32),
        polygons=found.origin[polygons], attributes=[], normals=None, normals_domain=DOMAIN_POINT,
        steps=None, normal_steps=None,
    )  # fmt: skip
    column = 3
    for item in at_points:
        width = item.values.shape[1]
        result.attributes.append(Attribute(item.name, DOMAIN_POINT, limit[:, column : column + width]))
        column += width
    over_corners: dict[tuple[int, bool], np.ndarray] = {}  # a UV map may have two names
    for item in mesh.attributes:
        if item.domain == DOMAIN_CORNER:
            smooth = options.smooth and surface.smooth_uv and item.name in surface.uv_maps
            key = item.values.ctypes.data, smooth
            if key not in over_corners:
                values = _over_corners(item.values, surface.corner_vertices, faces, found.plan, smooth)
                over_corners[key] = values[slots]
            result.attributes.append(Attribute(item.name, DOMAIN_CORNER, over_corners[key]))
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


def _triangles(finer_beside: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(the face of each triangle, its corners (triangles, 3)) of quads (faces, 4) with more corners where true.

    A face has eight corners, from 8 times its number on: a corner, the middle of the edge that follows it, and so on.
    """
    pattern = finer_beside @ np.array([1, 2, 4, 8])
    polygons, corners = [], []
    for kind in np.unique(pattern).tolist():
        mine = np.flatnonzero(pattern == kind)
        ring = [slot for slot in range(8) if slot % 2 == 0 or kind >> (slot // 2) & 1]
        start = next((place for place, slot in enumerate(ring) if slot % 2), 0)  # no corner lies between two others
        ring = ring[start:] + ring[:start]
        fan = np.array([(ring[0], ring[k], ring[k + 1]) for k in range(1, len(ring) - 1)])
        polygons.append(np.repeat(mine, len(fan)))
        corners.append((8 * mine[:, None, None] + fan).reshape(-1, 3))
    return np.concatenate(polygons), np.concatenate(corners)


def _ring(found: Leaves) -> np.ndarray:
    """The numbers of the eight corners of each face, see `_triangles`, (8 faces,)."""
    return np.stack([found.corners, found.middles], axis=2).reshape(-1)


def _used(index: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """What of 0 … count - 1 an index names, ascending, and the index into that."""
    used = np.zeros(count, bool)
    used[index] = True
    return np.flatnonzero(used), (np.cumsum(used) - 1)[index]


def _over_corners(values, corner_vertices, faces, plan, smooth: bool) -> np.ndarray:
    """Values of corners, (corners, k), at the eight corners of each of the faces that a plan makes."""
    keys = np.column_stack([corner_vertices, values.view(np.uint32).astype(np.int64)])
    _, first, shared = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    options = Options(smooth=smooth, fixed_boundary=True)
    found = leaves(cage(values[first], shared.reshape(-1), faces, options=options), options, plan=plan)
    return found.values.astype(np.float32)[_ring(found)]


def _vertex_normals(mesh: Mesh) -> np.ndarray:
    """The mean normals of the triangles round vertices, by area, float32 (n, 3)."""
    a, b, c = (mesh.vertices[mesh.triangles[:, k]] for k in range(3))
    normals = np.repeat(np.cross(b - a, c - a), 3, axis=0)
    sums = _sums(mesh.triangles.ravel(), normals, len(mesh.vertices))
    length = np.linalg.norm(sums, axis=1, keepdims=True)
    normals = np.where(length > 0.0, sums / np.where(length > 0.0, length, 1.0), np.array([0.0, 0.0, 1.0]))
    return normals.astype(np.float32)
