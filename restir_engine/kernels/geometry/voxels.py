"""Grids of voxels: values at points of their object's space, interpolated linearly."""

import math

from ..core.jit import device, inlined
from ..core.memory import load_f32
from ..core.records import voxels_at
from ..core.vec import transform_point

_OUTSIDE = 1.0e6  # an index that no grid has


@inlined
def _corners(x, n):
    """(lower index, weight of the upper, weights of lower and upper): a corner outside of the grid has weight 0."""
    x = min(max(x, -_OUTSIDE), _OUTSIDE)
    low = math.floor(x)
    i = int(low)
    f = x - low
    lower = 1.0 - f if 0 <= i < n else 0.0
    upper = f if 0 <= i + 1 < n else 0.0
    return i, lower, upper


@inlined
def _around(grid, q):
    """(where in grid.values the lower voxels along z are that lie around the index q, from there to the upper ones, the
    weights of lower and upper along x, y and z, whether one of them lies in the grid).
    """
    i, x0, x1 = _corners(q[0], grid.nx)
    j, y0, y1 = _corners(q[1], grid.ny)
    k, z0, z1 = _corners(q[2], grid.nz)
    i0, i1 = min(max(i, 0), grid.nx - 1), max(min(i + 1, grid.nx - 1), 0)
    j0, j1 = min(max(j, 0), grid.ny - 1), max(min(j + 1, grid.ny - 1), 0)
    k0, k1 = min(max(k, 0), grid.nz - 1), max(min(k + 1, grid.nz - 1), 0)
    n = grid.components
    lower = (
        ((i0 * grid.ny + j0) * grid.nz + k0) * n,
        ((i0 * grid.ny + j1) * grid.nz + k0) * n,
        ((i1 * grid.ny + j0) * grid.nz + k0) * n,
        ((i1 * grid.ny + j1) * grid.nz + k0) * n,
    )
    inside = x0 + x1 != 0.0 and y0 + y1 != 0.0 and z0 + z1 != 0.0
    return lower, (k1 - k0) * n, (x0, x1, y0, y1, z0, z1), inside


@device
def voxel_values(address, p):
    """The first four components (those that are not there 0, the fourth 1) of the VOXELS at an address, at p."""
    grid = voxels_at(address, 0)
    lower, step, weights, inside = _around(grid, transform_point(grid.to_index, p))
    n = grid.components
    if not inside:
        return (0.0, 0.0, 0.0, 1.0 if n < 4 else 0.0)
    first = _blend(grid.values, 0, lower, step, weights)
    if n == 1:
        return (first, first, first, 1.0)
    second = _blend(grid.values, 1, lower, step, weights)
    third = 0.0
    fourth = 1.0
    if n > 2:
        third = _blend(grid.values, 2, lower, step, weights)
    if n > 3:
        fourth = _blend(grid.values, 3, lower, step, weights)
    return (first, second, third, fourth)


@device
def voxel_at(address, q):
    """The first component of the VOXELS at an address, at the index q."""
    grid = voxels_at(address, 0)
    lower, step, weights, inside = _around(grid, q)
    return _blend(grid.values, 0, lower, step, weights) if inside else 0.0


@inlined
def _blend(values, component, lower, step, weights):
    a, b, c, d = lower
    x0, x1, y0, y1, z0, z1 = weights
    values += 4 * component
    low = x0 * (y0 * load_f32(values, a) + y1 * load_f32(values, b))
    low += x1 * (y0 * load_f32(values, c) + y1 * load_f32(values, d))
    high = x0 * (y0 * load_f32(values, a + step) + y1 * load_f32(values, b + step))
    high += x1 * (y0 * load_f32(values, c + step) + y1 * load_f32(values, d + step))
    return z0 * low + z1 * high
