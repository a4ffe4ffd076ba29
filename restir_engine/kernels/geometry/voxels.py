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


@device
def voxel_values(address, p):
    """The first four components (those that are not there 0, the fourth 1) of the VOXELS at an address, at p."""
    grid = voxels_at(address, 0)
    q = transform_point(grid.to_index, p)
    i, x0, x1 = _corners(q[0], grid.nx)
    j, y0, y1 = _corners(q[1], grid.ny)
    k, z0, z1 = _corners(q[2], grid.nz)
    if x0 + x1 == 0.0 or y0 + y1 == 0.0 or z0 + z1 == 0.0:
        return (0.0, 0.0, 0.0, 1.0 if grid.components < 4 else 0.0)
    i0, i1 = max(i, 0), min(i + 1, grid.nx - 1)
    j0, j1 = max(j, 0), min(j + 1, grid.ny - 1)
    k0, k1 = max(k, 0), min(k + 1, grid.nz - 1)
    n = grid.components
    a = ((i0 * grid.ny + j0) * grid.nz + k0) * n
    b = ((i0 * grid.ny + j1) * grid.nz + k0) * n
    c = ((i1 * grid.ny + j0) * grid.nz + k0) * n
    d = ((i1 * grid.ny + j1) * grid.nz + k0) * n
    step = (k1 - k0) * n
    values = grid.values
    first = _blend(values, a, b, c, d, step, x0, x1, y0, y1, z0, z1)
    if n == 1:
        return (first, first, first, 1.0)
    second = _blend(values, a + 1, b + 1, c + 1, d + 1, step, x0, x1, y0, y1, z0, z1)
    third = 0.0
    fourth = 1.0
    if n > 2:
        third = _blend(values, a + 2, b + 2, c + 2, d + 2, step, x0, x1, y0, y1, z0, z1)
    if n > 3:
        fourth = _blend(values, a + 3, b + 3, c + 3, d + 3, step, x0, x1, y0, y1, z0, z1)
    return (first, second, third, fourth)


@device
def voxel_at(address, q):
    """The first component of the VOXELS at an address, at the index q."""
    grid = voxels_at(address, 0)
    i, x0, x1 = _corners(q[0], grid.nx)
    j, y0, y1 = _corners(q[1], grid.ny)
    k, z0, z1 = _corners(q[2], grid.nz)
    if x0 + x1 == 0.0 or y0 + y1 == 0.0 or z0 + z1 == 0.0:
        return 0.0
    i0, i1 = max(i, 0), min(i + 1, grid.nx - 1)
    j0, j1 = max(j, 0), min(j + 1, grid.ny - 1)
    k0, k1 = max(k, 0), min(k + 1, grid.nz - 1)
    n = grid.components
    a = ((i0 * grid.ny + j0) * grid.nz + k0) * n
    b = ((i0 * grid.ny + j1) * grid.nz + k0) * n
    c = ((i1 * grid.ny + j0) * grid.nz + k0) * n
    d = ((i1 * grid.ny + j1) * grid.nz + k0) * n
    return _blend(grid.values, a, b, c, d, (k1 - k0) * n, x0, x1, y0, y1, z0, z1)


@inlined
def _blend(values, a, b, c, d, step, x0, x1, y0, y1, z0, z1):
    low = x0 * (y0 * load_f32(values, a) + y1 * load_f32(values, b))
    low += x1 * (y0 * load_f32(values, c) + y1 * load_f32(values, d))
    high = x0 * (y0 * load_f32(values, a + step) + y1 * load_f32(values, b + step))
    high += x1 * (y0 * load_f32(values, c + step) + y1 * load_f32(values, d + step))
    return z0 * low + z1 * high
