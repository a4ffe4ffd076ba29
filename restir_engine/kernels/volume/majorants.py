"""Bounds of a medium that varies in space, met cell by cell along a ray.

A ray goes through the cells of MAJORANTS by the distances to their next planes (Amanatides and Woo 1987). Tentative
collisions have the density μ(t) exp(-∫ μ), which within a cell is that of a constant.
"""

import math

from ..core.jit import device, inlined
from ..core.memory import load_u16, load_u32
from ..core.records import majorants_at, walk_at
from ..core.vec import average, put, transform_point, transform_vector, vec

_NEVER = 1.0e300


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
def _step(d):
    """How far along a ray two planes of an axis are apart, below 0 where they are met downwards; 0: it meets none."""
    return 1.0 / d if d != 0.0 else 0.0


@inlined
def _plane(o, step, i):
    """Where the ray leaves the cell i along an axis."""
    if step == 0.0:
        return _NEVER
    return ((i + 1 if step > 0.0 else i) - o) * step


@inlined
def next_cell(planes, steps, t, last, cell):
    """(where the ray leaves the cell, the planes at which it leaves the next one, the next cell)."""
    x, y, z = planes
    i, j, k = cell
    leave = min(x, min(y, z))
    if x <= leave:
        i += 1 if steps[0] > 0.0 else -1
        x += abs(steps[0])
    elif y <= leave:
        j += 1 if steps[1] > 0.0 else -1
        y += abs(steps[1])
    else:
        k += 1 if steps[2] > 0.0 else -1
        z += abs(steps[2])
    return max(t, min(leave, last)), (x, y, z), (i, j, k)


@inlined
def index_of(grid, cell):
    """The index of a cell among those of MAJORANTS."""
    return (cell[0] * grid.ny + cell[1]) * grid.nz + cell[2]


@inlined
def control_of(grid, cell):
    """(bound of the difference of the extinction to the cell's mean, that mean, by the colour of MAJORANTS)."""
    both = load_u32(grid.means, index_of(grid, cell))
    return (both & 0xFFFF) * grid.residual_unit, (both >> 16) * grid.mean_unit


@inlined
def inside_cells(grid, cell):
    """Whether there is such a cell."""
    return 0 <= cell[0] < grid.nx and 0 <= cell[1] < grid.ny and 0 <= cell[2] < grid.nz


@inlined
def start_cells(grid, o, d, begin, end):
    """(planes, steps, t, last, cell): where a ray leaves its first cell along each axis, what lies from plane to plane,
    the part of begin … end within the cells, and the first cell."""
    p = transform_point(grid.to_grid, o)
    v = transform_vector(grid.to_grid, d)
    t, last = _clip(p[0], v[0], float(grid.nx), begin, end)
    t, last = _clip(p[1], v[1], float(grid.ny), t, last)
    t, last = _clip(p[2], v[2], float(grid.nz), t, last)
    i, j, k = -1, -1, -1
    if t < last:
        i = _cell(p[0] + v[0] * t, grid.nx)
        j = _cell(p[1] + v[1] * t, grid.ny)
        k = _cell(p[2] + v[2] * t, grid.nz)
    steps = _step(v[0]), _step(v[1]), _step(v[2])
    return (_plane(p[0], steps[0], i), _plane(p[1], steps[1], j), _plane(p[2], steps[2], k)), steps, t, last, (i, j, k)


@device
def begin_walk(address, walk, o, d, end):
    """Fill the WALK of a ray up to `end` through MAJORANTS, both at addresses; o, d: the ray in world space."""
    planes, steps, t, last, cell = start_cells(majorants_at(address, 0), o, d, 0.0, end)
    w = walk_at(walk, 0)
    put(w.planes, planes)
    put(w.steps, steps)
    w.t = t
    w.last = last
    w.end = end
    w.i, w.j, w.k = cell


@device
def next_collision(address, walk, depth):
    """(t, rate) where ∫ rate from the last collision of a WALK on reaches `depth`; (its end, 0) where it does not."""
    grid = majorants_at(address, 0)
    w = walk_at(walk, 0)
    planes, steps, cell = vec(w.planes), vec(w.steps), (w.i, w.j, w.k)
    t, last = w.t, w.last
    while t < last and inside_cells(grid, cell):
        rate = load_u16(grid.bounds, index_of(grid, cell)) * grid.bound_unit
        leave, planes_behind, cell_behind = next_cell(planes, steps, t, last, cell)
        inside = (leave - t) * rate
        if inside >= depth and rate > 0.0:
            w.t = t + depth / rate
            put(w.planes, planes)
            w.i, w.j, w.k = cell
            return w.t, rate
        depth -= inside
        t, planes, cell = leave, planes_behind, cell_behind
    return w.end, 0.0


@device
def mean_depth(address, o, d, begin, end):
    """∫ of the means of the extinction along a ray, an average over the channels."""
    grid = majorants_at(address, 0)
    planes, steps, t, last, cell = start_cells(grid, o, d, begin, end)
    depth = 0.0
    while t < last and inside_cells(grid, cell):
        _, mean = control_of(grid, cell)
        leave, planes, cell = next_cell(planes, steps, t, last, cell)
        depth += mean * (leave - t)
        t = leave
    return depth * average(vec(grid.color))


@device
def mean_at(address, p):
    """The mean of the extinction in the cell of a point, an average over the channels; 0 outside."""
    grid = majorants_at(address, 0)
    q = transform_point(grid.to_grid, p)
    if not (0.0 <= q[0] <= grid.nx and 0.0 <= q[1] <= grid.ny and 0.0 <= q[2] <= grid.nz):
        return 0.0
    _, mean = control_of(grid, (_cell(q[0], grid.nx), _cell(q[1], grid.ny), _cell(q[2], grid.nz)))
    return mean * average(vec(grid.color))
