"""A coarse picture in finer pixels: what lies on the same surface is interpolated, edges stay where they are.

Joint bilateral upsampling (Kopf et al. 2007): the guide is a G-buffer of the first surfaces in the finer pixels, which
costs a ray a pixel; a coarse pixel is known by the surface at its middle.
"""

import math

import numpy as np

from ..core.jit import device, kernel
from ..core.memory import load_f32, record_at, store_f32
from ..core.records import CAMERA, RAY_CAMERA, SCENE, tile_point
from ..core.vec import is_black, vec
from ..geometry.camera import camera_ray, camera_reach
from ..geometry.intersect import intersect
from ..geometry.surface import surface_point

GUIDE = np.dtype(  # a pixel's first surface; distance 0: there is none
    [("instance", np.float32), ("normal", np.float32, 3), ("distance", np.float32)]
)
_WORDS = GUIDE.itemsize // 4

UPSCALE = np.dtype(
    [
        # Addresses: GUIDE [height, width], float32 [coarse_height, coarse_width, 4], float32 [height, width, 4].
        ("guide", np.int64),
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

# Of the weights by distance on the film, in coarse pixels; by the cosine of normals, its power; by the relative
# difference of distances. A pixel whose surface no coarse one near it shows takes the mean of them all.
_WIDTH, _SHARPNESS, _DEPTH, _LEAST = 0.6, 16.0, 0.05, 1e-6
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


@device
def _likeness(guide, a, b):
    """From 0 to 1 how well two pixels of the guide go together."""
    here = load_f32(guide, a + 4)
    there = load_f32(guide, b + 4)
    if here == 0.0 or there == 0.0:
        return 1.0 if here == there else 0.0
    if load_f32(guide, a) != load_f32(guide, b):
        return 0.0
    cosine = 0.0
    for k in range(1, 4):
        cosine += load_f32(guide, a + k) * load_f32(guide, b + k)
    apart = (here - there) / (_DEPTH * here)
    return _SAME + (1.0 - _SAME) * max(cosine, 0.0) ** _SHARPNESS * math.exp(-apart * apart)


@kernel
def upscale_rows(up: UPSCALE, y0, y1):
    """Fill rows [y0, y1) of the fine picture."""
    for y in range(y0, y1):
        place_y = up.offset[1] + up.scale[1] * (y + 0.5)
        for x in range(up.width):
            place_x = up.offset[0] + up.scale[0] * (x + 0.5)
            here = y * up.width + x
            red = green = blue = alpha = total = 0.0
            for row in range(math.floor(place_y) - 1, math.floor(place_y) + 2):
                for column in range(math.floor(place_x) - 1, math.floor(place_x) + 2):
                    i = min(max(column, 0), up.coarse_width - 1)
                    j = min(max(row, 0), up.coarse_height - 1)
                    middle_x = min(max(int((i + 0.5 - up.offset[0]) / up.scale[0]), 0), up.width - 1)
                    middle_y = min(max(int((j + 0.5 - up.offset[1]) / up.scale[1]), 0), up.height - 1)
                    like = _likeness(up.guide, _WORDS * here, _WORDS * (middle_y * up.width + middle_x))
                    off_x = (column + 0.5 - place_x) / _WIDTH
                    off_y = (row + 0.5 - place_y) / _WIDTH
                    weight = (like + _LEAST) * math.exp(-0.5 * (off_x * off_x + off_y * off_y))
                    pixel = 4 * (j * up.coarse_width + i)
                    red += weight * load_f32(up.coarse, pixel)
                    green += weight * load_f32(up.coarse, pixel + 1)
                    blue += weight * load_f32(up.coarse, pixel + 2)
                    alpha += weight * load_f32(up.coarse, pixel + 3)
                    total += weight
            store_f32(up.fine, 4 * here, red / total)
            store_f32(up.fine, 4 * here + 1, green / total)
            store_f32(up.fine, 4 * here + 2, blue / total)
            store_f32(up.fine, 4 * here + 3, alpha / total)
