"""Bounds of a medium that varies in space, met cell by cell along a ray.

A ray goes through the cells of MAJORANTS by the distances to their next planes (Amanatides and Woo 1987). Tentative
collisions have the density μ(t) exp(-∫ μ), which within a cell is that of a constant.
"""

import math

from ..core.jit import device, inlined
from ..core.memory import load_f32
from ..core.records import MAJORANT_FIELDS, majorants_at
from ..core.vec import load3_f32, madd, transform_point, transform_vector

_NEVER = 1.0e300

BOUND, RESIDUAL, MEAN = 0, 1, 2  # fields of MAJORANTS.cells


@inlined
def _clip(o, d, n, begin, end):
    """The part of begin … end in which o + t d lies in 0 … n."""
    if d == 0.0:
        return begin, end if 0.0 <= o <= n else begin - 1.0
    a = -o / d
    b = (n - o) / d
    return max(begin, min(a, b)), min(end, max(a, b))


@inlined
def _cell(x, n):
    return min(max(math.floor(x), 0), n - 1)


@inlined
def _plane(o, d, i):
    """Where the ray leaves the cell i along an axis."""
    if d == 0.0:
        return _NEVER
    return ((i + 1 if d > 0.0 else i) - o) / d


@inlined
def next_cell(grid, p, v, t, last, i, j, k):
    """(where the ray leaves the cell (i, j, k), the next cell)."""
    x = _plane(p[0], v[0], i)
    y = _plane(p[1], v[1], j)
    z = _plane(p[2], v[2], k)
    leave = min(x, min(y, z))
    if x <= leave:
        i += 1 if v[0] > 0.0 else -1
    elif y <= leave:
        j += 1 if v[1] > 0.0 else -1
    else:
        k += 1 if v[2] > 0.0 else -1
    return max(t, min(leave, last)), i, j, k


@inlined
def inside_cells(grid, i, j, k):
    """Whether there is such a cell."""
    return 0 <= i < grid.nx and 0 <= j < grid.ny and 0 <= k < grid.nz


@inlined
def start_cells(grid, o, d, begin, end):
    """The ray in the space of cells, the part of begin … end within them, and the first cell."""
    p = transform_point(grid.to_grid, o)
    v = transform_vector(grid.to_grid, d)
    t, last = _clip(p[0], v[0], float(grid.nx), begin, end)
    t, last = _clip(p[1], v[1], float(grid.ny), t, last)
    t, last = _clip(p[2], v[2], float(grid.nz), t, last)
    i = j = k = -1
    if t < last:
        i = _cell(p[0] + v[0] * t, grid.nx)
        j = _cell(p[1] + v[1] * t, grid.ny)
        k = _cell(p[2] + v[2] * t, grid.nz)
    return p, v, t, last, i, j, k


@device
def next_collision(address, o, d, begin, end, depth, field):
    """(t, rate) where ∫ rate from `begin` on reaches `depth`; (end, 0) where it does not.

    address: MAJORANTS; o, d: the ray in world space; field: BOUND, RESIDUAL.
    """
    grid = majorants_at(address, 0)
    p, v, t, last, i, j, k = start_cells(grid, o, d, begin, end)
    while t < last and inside_cells(grid, i, j, k):
        rate = load_f32(grid.cells, MAJORANT_FIELDS * ((i * grid.ny + j) * grid.nz + k) + field)
        leave, i, j, k = next_cell(grid, p, v, t, last, i, j, k)
        inside = (leave - t) * rate
        if inside >= depth and rate > 0.0:
            return min(t + depth / rate, end), rate
        depth -= inside
        t = leave
    return end, 0.0


@device
def mean_depth(address, o, d, begin, end):
    """∫ of the means of the extinction along a ray, rgb."""
    grid = majorants_at(address, 0)
    p, v, t, last, i, j, k = start_cells(grid, o, d, begin, end)
    depth = (0.0, 0.0, 0.0)
    while t < last and inside_cells(grid, i, j, k):
        mean = load3_f32(grid.cells + 4 * (MAJORANT_FIELDS * ((i * grid.ny + j) * grid.nz + k) + MEAN), 0)
        leave, i, j, k = next_cell(grid, p, v, t, last, i, j, k)
        depth = madd(depth, mean, leave - t)
        t = leave
    return depth


@device
def mean_at(address, p):
    """The mean of the extinction in the cell of a point, rgb; 0 outside."""
    grid = majorants_at(address, 0)
    q = transform_point(grid.to_grid, p)
    if not (0.0 <= q[0] <= grid.nx and 0.0 <= q[1] <= grid.ny and 0.0 <= q[2] <= grid.nz):
        return (0.0, 0.0, 0.0)
    i, j, k = _cell(q[0], grid.nx), _cell(q[1], grid.ny), _cell(q[2], grid.nz)
    return load3_f32(grid.cells + 4 * (MAJORANT_FIELDS * ((i * grid.ny + j) * grid.nz + k) + MEAN), 0)
