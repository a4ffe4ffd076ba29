"""A coarse picture in finer pixels: what lies on the same surface is interpolated, edges stay where they are.

Joint bilateral upsampling (Kopf et al. 2007): the guide is a G-buffer of the first surfaces in the finer pixels, which
costs a ray a pixel; a coarse pixel is known by the surface at its middle.
"""

import math

import numpy as np

from ..core.fastmath import exp
from ..core.jit import inlined, kernel
from ..core.memory import load_f32, record_at, store_f32
from ..core.records import CAMERA, RAY_CAMERA, SCENE, tile_point
from ..core.vec import is_black, vec
from ..geometry.camera import camera_ray, camera_reach
from ..geometry.intersect import intersect
from ..geometry.surface import surface_point

GUIDE = np.dtype(  # a pixel's first surface; distance 0: there is none
    [("instance", np.float32), ("normal", np.float32, 3), ("distance", np.float32)]
)
GUIDE_BYTES = GUIDE.itemsize
_WORDS = GUIDE_BYTES // 4

UPSCALE = np.dtype(
    [
        # Addresses: GUIDE [height, width] and [coarse_height, coarse_width], float32 [coarse_height, coarse_width, 4]
        # and [height, width, 4].
        ("guide", np.int64),
        ("coarse_guide", np.int64),
        ("coarse", np.int64),
        ("fine", np.int64),
        ("width", np.int64),
        ("height", np.int64),
        ("coarse_width", np.int64),
        ("coarse_height", np.int64),
        # A place on the coarse film is offset + scale times that on the fine one, both in pixels from the lower left.
        ("scale", np.float64, 2),
        ("offset", np.float64, 2),
    ]
)
upscale_at = record_at(UPSCALE)

# Of the weights by distance on the film, in coarse pixels; by the relative difference of distances. A pixel whose
# surface no coarse one near it shows takes the mean of them all.
_WIDTH, _DEPTH, _LEAST = 0.6, 0.05, 1e-6
_SAME = 0.01  # the least likeness of two places of one instance: at outlines normals and distances differ much


@kernel
def guide_rows(scene: SCENE, camera: CAMERA, scratch, guide, width, y0, y1):
    """Fill rows [y0, y1) of the guide, GUIDE [height, width], of a camera without a lens."""
    sp = tile_point(scratch)
    for y in range(y0, y1):
        for x in range(width):
            at = _WORDS * (y * width + x)
            for k in range(_WORDS):
                store_f32(guide, at + k, 0.0)
            o, d, _dp, _dd = camera_ray(camera, x + 0.5, y + 0.5, 0.5, 0.5)
            if is_black(d):
                continue
            t, instance, primitive, u, v = intersect(scene, scratch, o, d, 0.0, camera_reach(camera, d), RAY_CAMERA)
            if instance < 0:
                continue
            surface_point(scene, sp, instance, primitive, u, v, t, d)
            n = vec(sp.n)
            store_f32(guide, at, float(instance))
            store_f32(guide, at + 1, n[0])
            store_f32(guide, at + 2, n[1])
            store_f32(guide, at + 3, n[2])
            store_f32(guide, at + 4, max(t, 1e-30))


@inlined
def _likeness(a, b):
    """From 0 to 1 how well two GUIDE at addresses go together; it falls with the 16th power of the normals' cosine."""
    here, there = load_f32(a, 4), load_f32(b, 4)
    if here == 0.0 or there == 0.0:
        return 1.0 if here == there else 0.0
    if load_f32(a, 0) != load_f32(b, 0):
        return 0.0
    cosine = 0.0
    for k in range(1, 4):
        cosine += load_f32(a, k) * load_f32(b, k)
    square = max(cosine, 0.0) ** 2
    fourth = square * square
    eighth = fourth * fourth
    apart = (here - there) / (_DEPTH * here)
    return _SAME + (1.0 - _SAME) * eighth * eighth * _bell(apart * apart)


@inlined
def _bell(x):
    """e^-x."""
    return exp(-min(x, 700.0))


@inlined
def _near(place):
    """(index of the coarse pixel at a place, weights of the one before it, of itself and of the one behind it)."""
    middle = math.floor(place)
    off = (middle + 0.5 - place) / _WIDTH
    before, behind = off - 1.0 / _WIDTH, off + 1.0 / _WIDTH
    return middle, (_bell(0.5 * before * before), _bell(0.5 * off * off), _bell(0.5 * behind * behind))


@kernel
def upscale_rows(up: UPSCALE, y0, y1):
    """Fill rows [y0, y1) of the fine picture."""
    for y in range(y0, y1):
        row, by_row = _near(up.offset[1] + up.scale[1] * (y + 0.5))
        for x in range(up.width):
            column, by_column = _near(up.offset[0] + up.scale[0] * (x + 0.5))
            here = up.guide + GUIDE_BYTES * (y * up.width + x)
            red = green = blue = alpha = total = 0.0
            for j in range(3):
                first = min(max(row + j - 1, 0), up.coarse_height - 1) * up.coarse_width
                for i in range(3):
                    at = first + min(max(column + i - 1, 0), up.coarse_width - 1)
                    weight = by_row[j] * by_column[i] * (_likeness(here, up.coarse_guide + GUIDE_BYTES * at) + _LEAST)
                    red += weight * load_f32(up.coarse, 4 * at)
                    green += weight * load_f32(up.coarse, 4 * at + 1)
                    blue += weight * load_f32(up.coarse, 4 * at + 2)
                    alpha += weight * load_f32(up.coarse, 4 * at + 3)
                    total += weight
            pixel = 4 * (y * up.width + x)
            store_f32(up.fine, pixel, red / total)
            store_f32(up.fine, pixel + 1, green / total)
            store_f32(up.fine, pixel + 2, blue / total)
            store_f32(up.fine, pixel + 3, alpha / total)
