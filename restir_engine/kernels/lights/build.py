"""Kernels that the light table is built with: alias tables, and emission measured on triangles."""

import math

from ..core.jit import device, kernel
from ..core.memory import load_f64, load_i32, store_f32, store_f64, store_i32
from ..core.records import SCENE, point_in
from ..core.rng import sample2
from ..core.vec import cross, neg, normalize, sub
from ..geometry.surface import surface_point
from .cells import cell
from .emission import luminance, run_emission, shadow_point
from .triangle import triangle_vertices


@kernel
def build_alias(weights, n, table, scratch):
    """Fill an alias table (Vose 1991) from n float64 weights of positive sum; scratch: float64 [n] and int32 [n]."""
    total = 0.0
    for i in range(n):
        total += load_f64(weights, i)
    todo = scratch + 8 * n
    small = 0
    large = n
    for i in range(n):
        share = load_f64(weights, i) * n / total
        store_f64(scratch, i, share)
        store_f32(table, 2 * i, 1.0)
        store_i32(table, 2 * i + 1, i)
        if share < 1.0:
            store_i32(todo, small, i)
            small += 1
        else:
            large -= 1
            store_i32(todo, large, i)
    while small > 0 and large < n:
        small -= 1
        low = load_i32(todo, small)
        high = load_i32(todo, large)
        share = load_f64(scratch, low)
        store_f32(table, 2 * low, share)
        store_i32(table, 2 * low + 1, high)
        share = load_f64(scratch, high) - (1.0 - share)
        store_f64(scratch, high, share)
        if share < 1.0:
            large += 1
            store_i32(todo, small, high)
            small += 1


@kernel
def measure_emission(scene: SCENE, scratch, instance, primitives, n, cells, points, values):
    """Store the root of the mean square of luminance over some points of each cell of n triangles to float64 values.

    primitives: int32 [n]; values: [n, cells²]. Both sides are asked in turn. Light samples are the noisier the more
    emission varies: that is what they go by.
    """
    state = point_in(scratch)
    count = cells * cells
    for i in range(n):
        primitive = load_i32(primitives, i)
        a, b, c = triangle_vertices(scene, instance, primitive)
        normal = normalize(cross(sub(b, a), sub(c, a)))
        for k in range(count):
            first, second, side = cell(cells, k)
            square = _mean_square(scene, scratch, state, instance, primitive, normal, first, second, side, points)
            store_f64(values, i * count + k, math.sqrt(square))


@device
def _mean_square(scene, scratch, state, instance, primitive, normal, first, second, side, points):
    """Of the luminance over some points of a cell (kernels.lights.cells)."""
    total = 0.0
    for k in range(points):
        u, v = sample2(primitive, k, 0)
        if u + v > 1.0:
            u, v = 1.0 - u, 1.0 - v
        point = shadow_point(scratch, state)
        d = normal if (primitive + k) & 1 else neg(normal)
        surface_point(scene, point, instance, primitive, first + side * u, second + side * v, 1.0, d)
        e = run_emission(scene, point)
        y = luminance(e[0], e[1], e[2])
        total += y * y if 0.0 < y < 1e15 else 0.0
    return total / points
