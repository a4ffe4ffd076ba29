"""Which pixels a pixel takes samples from: decided by pixel coordinates, seeds and surfaces, never by samples.

Rejection by surface keeps the result unbiased: it only changes which domains are resampled from.
"""

import math

from ...kernels.core import rng
from ...kernels.core.jit import device, inlined
from ...kernels.core.vec import dot, sub

# Dimension of the random numbers; keys are the pixel's own.
DIM_NEIGHBOURS = 0


@inlined
def disk_neighbour(key, index, x, y, radius):
    """The index-th neighbour of the pixel (x, y), uniform on a disk of `radius` pixels: (x, y), maybe off the film.

    The indices of a key are stratified over the disk.
    """
    u, v = rng.sample2(key, index, DIM_NEIGHBOURS)
    r = radius * math.sqrt(u)
    angle = 2.0 * math.pi * v
    return x + math.floor(r * math.cos(angle) + 0.5), y + math.floor(r * math.sin(angle) + 0.5)


@device
def similar(p, n, material, t, other_p, other_n, other_material, other_t, min_cosine, max_depth):
    """Whether two surfaces are alike enough for their samples to be of use to each other; symmetric.

    n: shading normals, at most acos(min_cosine) apart; t: distances along the camera's rays. Each point lies in the
    other's tangent plane within max_depth times the smaller t, or their t differ by less than that share.
    """
    if material != other_material or dot(n, other_n) < min_cosine:
        return False
    between = sub(other_p, p)
    limit = max_depth * min(t, other_t)
    off_plane = max(abs(dot(between, n)), abs(dot(between, other_n)))
    return off_plane <= limit or abs(t - other_t) <= limit
