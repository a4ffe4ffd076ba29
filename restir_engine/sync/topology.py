"""Attributes that come from how a mesh hangs together: pointiness, a number for each island, tangents."""

import numpy as np

from ..kernels.core.memory import address
from ..kernels.core.records import MESH
from ..kernels.geometry.tangents import RECORD, mikk_tangents
from ..kernels.geometry.topology import connect
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


def tangents(mesh: Mesh, uv: np.ndarray) -> np.ndarray:
    """MikkTSpace tangents (corners, 4) of a UV map (corners, 2): object space, w is the sign of the bitangent."""
    record = np.zeros(1, MESH)
    record[0] = mesh.record()
    uv = np.ascontiguousarray(uv, np.float32)
    count = 3 * len(mesh.triangles)
    work = np.empty((count, RECORD))
    heads = np.full(len(mesh.vertices), -1, np.int32)
    links = np.empty(count, np.int32)
    result = np.zeros((len(uv), 4), np.float32)
    mikk_tangents(address(record), address(uv), address(work), address(heads), address(links), address(result))
    return result
