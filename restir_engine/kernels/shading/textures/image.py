"""Image lookup: extension, interpolation, alpha, and the projections of the Image Texture node.

No mip maps, and colours that are stored encoded are decoded after filtering: both as Cycles does.
"""

import math

from ...core.jit import device, entry, inlined
from ...core.memory import load_f32, load_i32, load_u8, store_f64
from ...core.records import IMAGE_BYTES, IMAGE_DECODE, image_at, scene_at, shading_point_at
from ...core.vec import store3_f64, transform_normal, vec
from ...geometry.placed import placed_at
from ..operands import number, triple
from .rounding import floor

REPEAT, EXTEND, CLIP, MIRROR = 0, 1, 2, 3
LINEAR, CLOSEST, CUBIC = 0, 1, 2
FLAT, SPHERE, TUBE = 0, 1, 2
# Flags of an instruction: extension | interpolation << 4 | projection << 8 | these.
FLAG_UNASSOCIATE = 4096  # divide by alpha

_UNIT_BYTE = 1.0 / 255.0


@device
def _wrap(extension, i, n):
    """The texel that stands at index i of n; -1: none."""
    if 0 <= i < n:
        return i
    if extension == REPEAT:
        return i % n
    if extension == EXTEND:
        return 0 if i < 0 else n - 1
    if extension == CLIP:
        return -1
    i %= 2 * n
    return i if i < n else 2 * n - 1 - i


@device
def _texel(image, x, y, weight):
    """A texel times a weight; nothing outside."""
    if x < 0 or y < 0:
        return (0.0, 0.0, 0.0, 0.0)
    at = 4 * (y * image.width + x)
    if image.flags & IMAGE_BYTES:
        weight *= _UNIT_BYTE
        return (
            load_u8(image.pixels, at) * weight,
            load_u8(image.pixels, at + 1) * weight,
            load_u8(image.pixels, at + 2) * weight,
            load_u8(image.pixels, at + 3) * weight,
        )
    return (
        load_f32(image.pixels, at) * weight,
        load_f32(image.pixels, at + 1) * weight,
        load_f32(image.pixels, at + 2) * weight,
        load_f32(image.pixels, at + 3) * weight,
    )


@device
def _add4(a, b):
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2], a[3] + b[3])


@inlined
def _between(u, size):
    """(index of the texel whose centre lies at u or before it, how far u is past it) of a row of `size` texels."""
    x = u * size - 0.5
    return math.floor(x), x - floor(x)


@device
def bilinear(image, extension, u, v):
    """Linear interpolation of the four texels around (u, v)."""
    i, x = _between(u, image.width)
    j, y = _between(v, image.height)
    i0, i1 = _wrap(extension, i, image.width), _wrap(extension, i + 1, image.width)
    j0, j1 = _wrap(extension, j, image.height), _wrap(extension, j + 1, image.height)
    lower = _add4(_texel(image, i0, j0, (1.0 - x) * (1.0 - y)), _texel(image, i1, j0, x * (1.0 - y)))
    upper = _add4(_texel(image, i0, j1, (1.0 - x) * y), _texel(image, i1, j1, x * y))
    return _add4(lower, upper)


@device
def _spline(n, t):
    """Weight of the n-th of the four texels around a position, t past the second: the cubic B-spline."""
    if n == 0:
        return (1.0 - t) * (1.0 - t) * (1.0 - t) / 6.0
    if n == 1:
        return t * t * (0.5 * t - 1.0) + 2.0 / 3.0
    if n == 2:
        return (1.0 - t) * (1.0 - t) * (-0.5 * t - 0.5) + 2.0 / 3.0
    return t * t * t / 6.0


@device
def _bicubic(image, extension, u, v):
    i, x = _between(u, image.width)
    j, y = _between(v, image.height)
    total = (0.0, 0.0, 0.0, 0.0)
    for b in range(4):
        row = _wrap(extension, j - 1 + b, image.height)
        weight = _spline(b, y)
        for a in range(4):
            column = _wrap(extension, i - 1 + a, image.width)
            total = _add4(total, _texel(image, column, row, weight * _spline(a, x)))
    return total


@device
def _decode(table, x):
    """A table over [0, 1], interpolated; sRGB's formula beyond 1, where a division by alpha may lead."""
    if x > 1.0:
        return ((x + 0.055) / 1.055) ** 2.4
    x = max(x, 0.0) * IMAGE_DECODE
    i = min(int(x), IMAGE_DECODE - 1)
    a = load_f32(table, i)
    return a + (x - i) * (load_f32(table, i + 1) - a)


@device
def image_lookup(scene, index, u, v, flags):
    """Scene-linear (r, g, b, alpha) of an image at (u, v); magenta for index -1, the missing image."""
    if index < 0:
        return (1.0, 0.0, 1.0, 1.0)
    if not (abs(u) < 1e9 and abs(v) < 1e9):
        return (0.0, 0.0, 0.0, 0.0)
    image = image_at(scene.images, index)
    extension = flags & 15
    interpolation = (flags >> 4) & 15
    if interpolation == LINEAR:
        color = bilinear(image, extension, u, v)
    elif interpolation == CLOSEST:
        i, j = math.floor(u * image.width), math.floor(v * image.height)
        color = _texel(image, _wrap(extension, i, image.width), _wrap(extension, j, image.height), 1.0)
    else:
        color = _bicubic(image, extension, u, v)
    if flags & FLAG_UNASSOCIATE and color[3] != 1.0 and color[3] != 0.0:
        s = 1.0 / color[3]
        color = (color[0] * s, color[1] * s, color[2] * s, color[3])
    if image.decode != 0:
        table = image.decode
        color = (_decode(table, color[0]), _decode(table, color[1]), _decode(table, color[2]), color[3])
    return color


@device
def _store_color(registers, out, color):
    store3_f64(registers, out, (color[0], color[1], color[2]))
    store_f64(registers, out + 3, color[3])


@device
def _project(projection, p):
    """(u, v) of a position by the node's projection; sphere and tube stand around the centre of the unit cube."""
    if projection == FLAT:
        return (p[0], p[1])
    x, y, z = 2.0 * p[0] - 1.0, 2.0 * p[1] - 1.0, 2.0 * p[2] - 1.0
    flat = x * x + y * y
    u = 0.5 - math.atan2(x, y) / (2.0 * math.pi) if flat > 0.0 else 0.0
    if projection == TUBE:
        return (u, 0.5 * (z + 1.0) if flat > 0.0 else 0.0)
    if flat + z * z <= 0.0:
        return (0.0, 0.0)
    return (u, 1.0 - math.acos(min(max(z / math.sqrt(flat + z * z), -1.0), 1.0)) / math.pi)


@entry
def image_op(scene, _sp, registers, code, at):
    """Image Texture, flat, sphere or tube: see opcodes.IMAGE."""
    scene = scene_at(scene, 0)
    flags = load_i32(code, at + 3)
    uv = _project((flags >> 8) & 15, triple(registers, code, at + 1))
    _store_color(registers, load_i32(code, at), image_lookup(scene, load_i32(code, at + 2), uv[0], uv[1], flags))


@entry
def image_tiles_op(scene, _sp, registers, code, at):
    """Image Texture of a tiled (UDIM) image; the table at the third word: count, then pairs of tile and image."""
    scene = scene_at(scene, 0)
    flags = load_i32(code, at + 3)
    uv = _project((flags >> 8) & 15, triple(registers, code, at + 1))
    u, v = uv[0], uv[1]
    table = scene.tables + 4 * load_i32(code, at + 2)
    index = -1
    # Truncated, not floored: the strip left of and below the first tile belongs to it.
    if abs(u) < 1e6 and abs(v) < 1e6 and u > -1.0 and v > -1.0 and u < 10.0:
        column, row = int(u), int(v)
        for n in range(int(load_f32(table, 0))):
            if int(load_f32(table, 2 * n + 1)) == 1001 + 10 * row + column:
                index = int(load_f32(table, 2 * n + 2))
                u -= column
                v -= row
                break
    _store_color(registers, load_i32(code, at), image_lookup(scene, index, u, v, flags))


@device
def _box_share(a, b, blend):
    """Weight of the first of two sides that blend."""
    return min(max((a / (a + b) - 0.5 * (1.0 - blend)) / blend, 0.0), 1.0)


@device
def _box_weights(n, blend):
    """Weights of the x, y and z sides for a normal: seven zones of the triangle n sums to."""
    x, y, z = abs(n[0]), abs(n[1]), abs(n[2])
    total = x + y + z
    if total <= 0.0:
        return (1.0, 0.0, 0.0)
    x, y, z = x / total, y / total, z / total
    limit = 0.5 * (1.0 + blend)
    if x > limit * (x + y) and x > limit * (x + z):
        return (1.0, 0.0, 0.0)
    if y > limit * (x + y) and y > limit * (y + z):
        return (0.0, 1.0, 0.0)
    if z > limit * (x + z) and z > limit * (y + z):
        return (0.0, 0.0, 1.0)
    if blend <= 0.0:
        return (1.0, 0.0, 0.0)
    if z < (1.0 - limit) * (y + x):
        a = _box_share(x, y, blend)
        return (a, 1.0 - a, 0.0)
    if x < (1.0 - limit) * (y + z):
        a = _box_share(y, z, blend)
        return (0.0, a, 1.0 - a)
    if y < (1.0 - limit) * (x + z):
        a = _box_share(x, z, blend)
        return (a, 0.0, 1.0 - a)
    s = 1.0 / (2.0 * limit - 1.0)
    return (
        ((2.0 - limit) * x + limit - 1.0) * s,
        ((2.0 - limit) * y + limit - 1.0) * s,
        ((2.0 - limit) * z + limit - 1.0) * s,
    )


@entry
def image_box_op(scene, sp, registers, code, at):
    """Image Texture projected from six sides, by the object-space normal: see opcodes.IMAGE_BOX."""
    scene = scene_at(scene, 0)
    sp = shading_point_at(sp, 0)
    n = vec(sp.n)
    if sp.instance >= 0:
        n = transform_normal(placed_at(scene, sp.instance).to_world, n)
    weights = _box_weights(n, number(registers, code, at + 4))
    p = triple(registers, code, at + 1)
    index, flags = load_i32(code, at + 2), load_i32(code, at + 3)
    total = (0.0, 0.0, 0.0, 0.0)
    for axis in range(3):
        u, v = (p[1] if n[0] >= 0.0 else 1.0 - p[1]), p[2]
        weight = weights[0]
        if axis == 1:
            u, weight = (1.0 - p[0] if n[1] > 0.0 else p[0]), weights[1]
        elif axis == 2:
            u, v, weight = (1.0 - p[1] if n[2] > 0.0 else p[1]), p[0], weights[2]
        if weight > 0.0:
            c = image_lookup(scene, index, u, v, flags)
            total = _add4(total, (c[0] * weight, c[1] * weight, c[2] * weight, c[3] * weight))
    _store_color(registers, load_i32(code, at), total)
