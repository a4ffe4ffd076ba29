"""The tree in which rays find lamps: bounding spheres in a heap, see kernels.lights.evaluate.lights_intersect."""

from __future__ import annotations

import numpy as np

from .emitter_tree import morton_order


def sphere_tree(centers: np.ndarray, radii: np.ndarray, indices: np.ndarray) -> np.ndarray:
    """A binary heap over spheres (n, 3), (n,): float64 (2 width, 5), rows of centre, radius² and index.

    Node k has the children 2k and 2k + 1, the root is node 1, the leaves are the last `width` rows, of which some may
    be empty: their radius² is negative, so that no ray meets them.
    """
    order = morton_order(centers) if len(centers) else np.zeros(0, np.int64)
    count = len(order)
    width = 1 << max(count - 1, 0).bit_length()
    tree = np.zeros((2 * width, 5))
    tree[:, 3] = -1.0
    # Rounding far from a lamp must not make it smaller.
    radii = radii[order] * (1.0 + 1e-6) + 1e-9
    leaves = tree[width : width + count]
    leaves[:, :3], leaves[:, 3], leaves[:, 4] = centers[order], radii**2, indices[order]
    low, high = np.full((width, 3), np.inf), np.full((width, 3), -np.inf)
    low[:count], high[:count] = centers[order] - radii[:, None], centers[order] + radii[:, None]
    while width > 1:
        width //= 2
        low, high = np.minimum(low[0::2], low[1::2]), np.maximum(high[0::2], high[1::2])
        some = np.isfinite(low[:, 0])
        nodes = tree[width : 2 * width]
        nodes[some, :3] = 0.5 * (low[some] + high[some])
        nodes[some, 3] = 0.25 * ((high[some] - low[some]) ** 2).sum(1)
    return tree
