"""Which emissive triangle: by about the light that it sends to a point, from a tree over clusters of triangles.

Conty Estevez and Kulla 2018, "Importance Sampling of Many Lights with Adaptive Tree Splitting", as a heap: node k has
the children 2k and 2k + 1, the leaves are the nodes from `width` on, so that the way to a leaf is its number in binary
and needs no links. At the top, TOP nodes are weighed against one another at once: their sum is what all triangles
bring. A leaf is one triangle, or a run of a mesh's triangles, in which power decides.
"""

import math

from ..core.jit import device, inlined
from ..core.memory import load_f32, load_f64, load_i32
from ..core.records import emitter_at, emitter_group_at, emitter_tree_at
from ..core.vec import dot, load3_f32, sub
from ..core.warp import stream_choice

TOP = 16
# Columns of a node, float32: centre and radius of a bounding sphere; mean intensity; for leaves of one triangle the
# normal, its length 2 where both sides emit and 1 where one does; zero for all else.
CENTER, RADIUS, INTENSITY, NORMAL = 0, 3, 4, 5
NODE = 8

# Least cosine that a triangle or a receiver counts with: bounds and shading normals may be wrong about what is behind.
_BEHIND = 0.05


@inlined
def _clamped(h, r, distance):
    """The cosine h / distance, as large as a sphere of radius r about the point allows."""
    return max(min((h + r) / distance, 1.0), _BEHIND)


@inlined
def node_importance(tree, k, o, n):
    """About the irradiance at o with normal n (zero: any) of a node's triangles; more than 0 where they emit."""
    node = NODE * k
    intensity = load_f32(tree.nodes, node + INTENSITY)
    if intensity <= 0.0:
        return 0.0
    w = sub(load3_f32(tree.nodes + 4 * (node + CENTER), 0), o)
    r = load_f32(tree.nodes, node + RADIUS)
    d2 = dot(w, w)
    if d2 <= r * r or d2 == 0.0:
        return intensity / (r * r) if r > 0.0 else intensity
    distance = math.sqrt(d2)
    result = intensity / d2
    m = load3_f32(tree.nodes + 4 * (node + NORMAL), 0)
    length2 = dot(m, m)
    if length2 > 2.0:
        result *= _clamped(0.5 * abs(dot(m, w)), r, distance)
    elif length2 > 0.0:
        result *= _clamped(-dot(m, w), r, distance)
    if n[0] != 0.0 or n[1] != 0.0 or n[2] != 0.0:
        result *= _clamped(dot(n, w), r, distance)
    return result


@device
def triangles_bring(table, o, n):
    """About the irradiance at o of all emissive triangles, as if nothing were in their way."""
    if table.emitter_tree == 0:
        return 0.0
    tree = emitter_tree_at(table.emitter_tree, 0)
    total = 0.0
    for k in range(tree.top, 2 * tree.top):
        total += node_importance(tree, k, o, n)
    return total


@device
def _choose_leaf(tree, o, n, u):
    """(place of a leaf, its probability, u made uniform again)."""
    chosen, weight, total = tree.top, 0.0, 0.0
    for k in range(tree.top, 2 * tree.top):
        w = node_importance(tree, k, o, n)
        if w > 0.0:
            total += w
            taken, u = stream_choice(u, w / total)
            if taken:
                chosen, weight = k, w
    if total <= 0.0:
        return chosen, 0.0, u
    probability = weight / total
    while chosen < tree.width:
        left = node_importance(tree, 2 * chosen, o, n)
        p = left / (left + node_importance(tree, 2 * chosen + 1, o, n))
        taken, u = stream_choice(u, p)
        chosen = 2 * chosen + (0 if taken else 1)
        probability *= p if taken else 1.0 - p
    return chosen - tree.width, probability, u


@device
def _leaf_probability(tree, o, n, place):
    """The probability with which `_choose_leaf` chooses the leaf at a place."""
    total = 0.0
    for k in range(tree.top, 2 * tree.top):
        total += node_importance(tree, k, o, n)
    node = tree.width + place
    probability = 1.0
    while node >= 2 * tree.top:
        own = node_importance(tree, node, o, n)
        probability *= own / (own + node_importance(tree, node ^ 1, o, n))
        node >>= 1
    return probability * node_importance(tree, node, o, n) / total if total > 0.0 else 0.0


@inlined
def _span(group, run, length):
    """The cells [first, last) of a run of triangles."""
    count = group.cells * group.cells
    return run * length * count, min((run + 1) * length, group.n) * count


@inlined
def triangle_weight(group, position):
    """What a triangle counts for among those of its group."""
    count = group.cells * group.cells
    return load_f64(group.cumulated, (position + 1) * count) - load_f64(group.cumulated, position * count)


@inlined
def cell_share(group, position, cell):
    """The probability with which `choose_triangle` chooses a cell of a triangle, where it has chosen that."""
    at = position * group.cells * group.cells + cell
    own = load_f64(group.cumulated, at + 1) - load_f64(group.cumulated, at)
    total = triangle_weight(group, position)
    return own / total if total > 0.0 else 0.0


@device
def choose_triangle(table, o, n, u):
    """(emitter, index in its group's list, cell, probability) of an emissive triangle for o with normal n.

    The probability is that of the triangle; for that of the cell (kernels.lights.cells) in it see `cell_share`.
    """
    tree = emitter_tree_at(table.emitter_tree, 0)
    place, probability, u = _choose_leaf(tree, o, n, u)
    emitter = load_i32(tree.leaves, 2 * place)
    group = emitter_group_at(table.groups, emitter_at(table.emitters, emitter).group)
    low, high = _span(group, load_i32(tree.leaves, 2 * place + 1), tree.run)
    base = load_f64(group.cumulated, low)
    span = load_f64(group.cumulated, high) - base
    count = group.cells * group.cells
    if span <= 0.0:
        return emitter, low // count, 0, 0.0
    while high - low > 1:
        middle = (low + high) >> 1
        if load_f64(group.cumulated, middle) - base <= u * span:
            low = middle
        else:
            high = middle
    position = low // count
    return emitter, position, low - position * count, probability * triangle_weight(group, position) / span


@device
def triangle_share(table, emitter, group, primitive, o, n):
    """The probability with which `choose_triangle` chooses a triangle of an emitter."""
    position = load_i32(group.positions, primitive)
    if position < 0:
        return 0.0
    tree = emitter_tree_at(table.emitter_tree, 0)
    run = position // tree.run
    first, last = _span(group, run, tree.run)
    span = load_f64(group.cumulated, last) - load_f64(group.cumulated, first)
    if span <= 0.0:
        return 0.0
    leaf = _leaf_probability(tree, o, n, load_i32(tree.places, emitter.first_leaf + run))
    return leaf * triangle_weight(group, position) / span
