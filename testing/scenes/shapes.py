"""Meshes: (vertices, triangles) of a quad, boxes, balls and sheets."""

import math

import numpy as np

QUAD = [[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], [[0, 1, 2], [0, 2, 3]]
CUBE = (
    [[x, y, z] for z in (-1, 1) for y in (-1, 1) for x in (-1, 1)],
    [[0, 2, 1], [1, 2, 3], [4, 5, 6], [5, 7, 6], [0, 1, 4], [1, 5, 4], [2, 6, 3], [3, 6, 7], [0, 4, 2], [2, 4, 6],
     [1, 3, 5], [3, 7, 5]],
)  # fmt: skip


OUTWARD = (CUBE[0], [[0, 2, 1], [1, 2, 3], [4, 5, 6], [5, 7, 6], [0, 1, 4], [1, 5, 4], [2, 6, 3], [3, 6, 7], [0, 4, 2],
                     [2, 4, 6], [1, 3, 5], [3, 7, 5]])  # fmt: skip


def box(x, y, z) -> tuple[np.ndarray, np.ndarray]:
    """Vertices and triangles of a box with these half extents; the first two triangles are the top."""
    corners = np.array([(i, j, k) for k in (1, -1) for j in (-1, 1) for i in (-1, 1)]) * (x, y, z)
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return corners, np.array([t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))])


def ball(radius=1.0, n=64) -> tuple[np.ndarray, np.ndarray]:
    """Vertices and triangles of a sphere with n segments and n / 2 rings."""
    theta, phi = np.meshgrid(np.linspace(0, np.pi, n // 2 + 1), np.arange(n) * 2 * np.pi / n, indexing="ij")
    points = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], -1) * radius
    i, j = np.meshgrid(np.arange(n // 2), np.arange(n), indexing="ij")
    a, b = i * n + j, i * n + (j + 1) % n
    lower, upper = np.stack([a, a + n, b + n], -1), np.stack([a, b + n, b], -1)
    return points.reshape(-1, 3), np.concatenate([lower[:-1].reshape(-1, 3), upper[1:].reshape(-1, 3)])


def icosphere(radius: float, rounds: int = 5):
    """Vertices on a sphere, scaled so that the polyhedron has its area."""
    g = (1.0 + math.sqrt(5.0)) / 2.0
    v = [(-1, g, 0), (1, g, 0), (-1, -g, 0), (1, -g, 0), (0, -1, g), (0, 1, g), (0, -1, -g), (0, 1, -g),
         (g, 0, -1), (g, 0, 1), (-g, 0, -1), (-g, 0, 1)]  # fmt: skip
    f = [(0, 11, 5), (0, 5, 1), (0, 1, 7), (0, 7, 10), (0, 10, 11), (1, 5, 9), (5, 11, 4), (11, 10, 2), (10, 7, 6),
         (7, 1, 8), (3, 9, 4), (3, 4, 2), (3, 2, 6), (3, 6, 8), (3, 8, 9), (4, 9, 5), (2, 4, 11), (6, 2, 10),
         (8, 6, 7), (9, 8, 1)]  # fmt: skip
    vertices, faces = np.array(v, float), np.array(f)
    for _ in range(rounds):
        edges = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
        unique, inverse = np.unique(edges, axis=0, return_inverse=True)
        middle = (len(vertices) + inverse.reshape(3, -1)).T
        vertices = np.concatenate([vertices, vertices[unique].mean(axis=1)])
        vertices /= np.linalg.norm(vertices, axis=1, keepdims=True)
        a, b, c = faces.T
        ab, bc, ca = middle.T
        faces = np.concatenate([np.stack(s, 1) for s in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))])
    return radius * vertices, faces


def sheets(*heights, size=3000.0):
    """Horizontal planes, of one triangle each: a ray along an edge meets both of its triangles."""
    vertices = [(x, y, z) for z in heights for x, y in ((-size, -size), (size, -size), (0.0, size))]
    return vertices, np.arange(3 * len(heights)).reshape(-1, 3)
