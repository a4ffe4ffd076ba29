"""Attributes that come from how a mesh hangs together: pointiness, a number for each island, tangents."""

import numpy as np

from ..kernels.memory import address
from ..kernels.records import DOMAIN_CORNER
from ..kernels.topology import connect
from ..scene.mesh import Mesh
from .hashing import hash_uint, to_unit


def islands(n_points: int, edges: np.ndarray) -> np.ndarray:
    """A random number in [0, 1] for each point, the same for points that edges connect."""
    edges = np.ascontiguousarray(edges, np.int32)
    parents = np.arange(n_points, dtype=np.int32)
    ranks = np.zeros(n_points, np.int32)
    connect(address(edges), len(edges), address(parents), address(ranks), n_points)
    return to_unit(hash_uint(parents))


def pointiness(mesh: Mesh, edges: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """For each point the angle between its normal and the mean direction of its edges over pi, blurred over the edges.

    Points at the same place count as one.
    """
    points = mesh.vertices
    _, first, merged = np.unique(_place_keys(points), return_index=True, return_inverse=True)
    count = len(first)
    normal = np.stack([np.bincount(merged, normals[:, axis], count) for axis in range(3)], axis=1)
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-30)
    ends = np.sort(merged[edges], axis=1)
    a, b = np.divmod(np.unique(ends[:, 0] * count + ends[:, 1]), count)
    a, b = a[a != b], b[a != b]
    along = points[first[b]].astype(np.float64) - points[first[a]]
    along /= np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-30)
    degree = np.bincount(a, minlength=count) + np.bincount(b, minlength=count)
    mean = np.stack([np.bincount(a, along[:, i], count) - np.bincount(b, along[:, i], count) for i in range(3)], axis=1)
    mean /= np.maximum(degree, 1)[:, None]
    raw = np.where(degree > 0, np.arccos(np.clip((normal * mean).sum(axis=1), -1.0, 1.0)) / np.pi, 0.0)
    blurred = (raw + np.bincount(a, raw[b], count) + np.bincount(b, raw[a], count)) / (degree + 1)
    return blurred[merged]


def _place_keys(points: np.ndarray) -> np.ndarray:
    """A 64-bit hash for each place; equal places have equal keys, and -0 is 0."""
    bits = (points + np.float32(0.0)).view(np.uint32).astype(np.uint64)
    keys = bits[:, 0] * np.uint64(0x9E3779B97F4A7C15) + bits[:, 1]
    keys = (keys ^ (keys >> np.uint64(29))) * np.uint64(0xBF58476D1CE4E5B9) + bits[:, 2]
    return (keys ^ (keys >> np.uint64(32))) * np.uint64(0x94D049BB133111EB)


def tangents_without_mikk(mesh: Mesh, uv: np.ndarray, n_corners: int) -> np.ndarray:
    """Tangents (n_corners, 4) as MikkTSpace defines them, for meshes that Blender's own implementation refuses.

    The direction of growing u on each triangle, averaged by angle over the corners that share vertex, uv, normal and
    orientation; w is the sign of the bitangent.
    """
    triangles, corners = mesh.triangles.astype(np.int64), mesh.corners.astype(np.int64)
    p = mesh.vertices[triangles].astype(np.float64)
    st = uv[corners].astype(np.float64)
    e1, e2 = p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]
    d1, d2 = st[:, 1] - st[:, 0], st[:, 2] - st[:, 0]
    area = d1[:, 0] * d2[:, 1] - d1[:, 1] * d2[:, 0]
    sign = np.where(area < 0.0, -1.0, 1.0)
    along = (e1 * d2[:, 1:] - e2 * d1[:, 1:]) * sign[:, None]
    flat = np.cross(e1, e2)

    total = np.zeros((n_corners, 3))
    signs = np.ones(n_corners)
    normals = np.zeros((n_corners, 3))
    for k in range(3):
        own = corners[:, k]
        normal = _unit(flat if mesh.normals is None else _corner_normals(mesh, k))
        to_next, to_last = p[:, (k + 1) % 3] - p[:, k], p[:, (k + 2) % 3] - p[:, k]
        angle = np.arccos(np.clip((_unit(to_next) * _unit(to_last)).sum(axis=1), -1.0, 1.0))
        tangent = _unit(along - normal * (along * normal).sum(axis=1, keepdims=True)) * angle[:, None]
        for axis in range(3):
            total[:, axis] += np.bincount(own, tangent[:, axis], n_corners)
        signs[own] = sign
        normals[own] = normal

    vertex = np.zeros(n_corners)
    vertex[corners.ravel()] = triangles.ravel()
    key = np.column_stack([vertex, uv, signs, np.round(normals, 4)])
    _, group = np.unique(key, axis=0, return_inverse=True)
    group = group.reshape(-1)
    merged = np.stack([np.bincount(group, total[:, axis]) for axis in range(3)], axis=1)
    result = np.empty((n_corners, 4), np.float32)
    result[:, :3] = _unit(merged)[group]
    result[:, 3] = signs
    return result


def _corner_normals(mesh: Mesh, k: int) -> np.ndarray:
    table = mesh.corners if mesh.normals_domain == DOMAIN_CORNER else mesh.triangles
    return mesh.normals[table[:, k].astype(np.int64)].astype(np.float64)


def _unit(vectors: np.ndarray) -> np.ndarray:
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    return vectors / np.where(length > 0.0, length, 1.0)
