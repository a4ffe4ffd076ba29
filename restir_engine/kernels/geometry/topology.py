"""Connected parts of a mesh."""

from ..core.jit import device, kernel
from ..core.memory import load_i32, store_i32


@device
def _root(parents, x):
    while load_i32(parents, x) != x:
        parent = load_i32(parents, x)
        store_i32(parents, x, load_i32(parents, parent))
        x = parent
    return x


@kernel
def connect(edges, n_edges, parents, ranks, n_points):
    """Union-find by rank over edges (int32 [n_edges, 2]): afterwards parents[i] is the representative of point i.

    parents, ranks: int32 [n_points]; parents[i] = i and ranks zero at the start.
    """
    for e in range(n_edges):
        a = _root(parents, load_i32(edges, 2 * e))
        b = _root(parents, load_i32(edges, 2 * e + 1))
        if a == b:
            continue
        if load_i32(ranks, a) < load_i32(ranks, b):
            store_i32(parents, a, b)
        else:
            store_i32(parents, b, a)
            if load_i32(ranks, a) == load_i32(ranks, b):
                store_i32(ranks, a, load_i32(ranks, a) + 1)
    for i in range(n_points):
        store_i32(parents, i, _root(parents, i))
