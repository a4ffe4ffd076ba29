"""Closed bodies about one unit across for subsurface scattering, with thick and thin parts."""

import numpy as np

from restir_engine.scene.mesh import Mesh


def box(x: float, y: float, z: float) -> Mesh:
    """A box with these edges."""
    corners = np.array([(i, j, k) for k in (1, -1) for j in (-1, 1) for i in (-1, 1)]) * (0.5 * x, 0.5 * y, 0.5 * z)
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return Mesh(corners, np.array([t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))]))


def _sphere(n: int) -> tuple[np.ndarray, np.ndarray]:
    """Directions and triangles of a sphere of n rings."""
    theta, phi = np.meshgrid(np.linspace(0, np.pi, n + 1), np.arange(2 * n) * np.pi / n, indexing="ij")
    points = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], -1)
    i, j = np.meshgrid(np.arange(n), np.arange(2 * n), indexing="ij")
    a, b = i * 2 * n + j, i * 2 * n + (j + 1) % (2 * n)
    lower, upper = np.stack([a, a + 2 * n, b + 2 * n], -1), np.stack([a, b + 2 * n, b], -1)
    return points.reshape(-1, 3), np.concatenate([lower[:-1].reshape(-1, 3), upper[1:].reshape(-1, 3)])


def _bump(directions: np.ndarray, towards, width) -> np.ndarray:
    """A bell around a direction, with a width for each axis."""
    towards = np.asarray(towards, float) / np.linalg.norm(towards)
    offset = (directions - towards) / width
    return np.exp(-0.5 * (offset**2).sum(axis=1))


def bunny() -> Mesh:
    """A lumpy ball with two ears."""
    d, triangles = _sphere(96)
    r = 0.32 + 0.03 * np.sin(5 * d[:, 0]) * np.sin(4 * d[:, 1] + 1.0) + 0.02 * np.sin(9 * d[:, 2])
    for side in (-1, 1):
        r += 0.3 * _bump(d, (0.35 * side, 0.1, 0.95), (0.12, 0.07, 0.25))
    r += 0.1 * _bump(d, (0.0, -1.0, 0.1), (0.3, 0.3, 0.25))
    return Mesh(d * r[:, None], triangles)


def head() -> Mesh:
    """An ellipsoid with a nose, eye sockets, lips and ears that are flat."""
    d, triangles = _sphere(128)
    r = np.full(len(d), 0.38)
    r += 0.12 * _bump(d, (0.0, -1.0, 0.0), (0.09, 0.4, 0.15)) + 0.03 * _bump(d, (0.0, -1.0, -0.45), (0.16, 0.4, 0.06))
    for side in (-1, 1):
        r -= 0.05 * _bump(d, (0.33 * side, -0.9, 0.2), (0.15, 0.3, 0.1))
        r += 0.16 * _bump(d, (side, 0.1, 0.05), (0.3, 0.06, 0.17))
    return Mesh(d * r[:, None] * (0.85, 1.0, 1.2), triangles)


BODIES = {"cube": lambda: box(0.8, 0.8, 0.8), "slab": lambda: box(1.0, 0.2, 1.0), "bunny": bunny, "head": head}
