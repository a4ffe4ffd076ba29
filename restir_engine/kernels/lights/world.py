"""The world: its radiance, and sampling of its directions by an importance map and a sun's cone.

The map is equirectangular as Blender's: u = 1/2 - azimuth / 2 pi, v = 1 - polar angle / pi, rows bottom to top.
Within a pixel the density is constant by solid angle.
"""

import math

from ..core.jit import device, inlined, kernel
from ..core.memory import load_f32, load_u16, store_f32, store_f64
from ..core.records import (
    LIGHT_SAMPLE_NO_SHADOW,
    RAY_EMISSION,
    SCENE,
    point_in,
    world_table_at,
)
from ..core.vec import dot, load3_f64, neg, put, sub, vec
from ..core.warp import cone
from .emission import luminance, run_emission, shadow_point, visible_to, world_point
from .linking import EVERYTHING


@device
def world_direction(u, z):
    """The direction at map coordinate u and height z on the unit sphere."""
    phi = (0.5 - u) * 2.0 * math.pi
    r = math.sqrt(max(1.0 - z * z, 0.0))
    return (r * math.cos(phi), r * math.sin(phi), z)


@device
def _row_height(row, rows):
    """Height on the unit sphere of the lower edge of a row of the map."""
    return -math.cos(math.pi * row / rows)


@device
def _find(cdf, start, n, u):
    """The largest i < n with cdf[start + i] <= u, cdf rising from 0 to 1 over n + 1 entries."""
    low = 0
    high = n
    while high - low > 1:
        middle = (low + high) >> 1
        if load_f32(cdf, start + middle) <= u:
            low = middle
        else:
            high = middle
    return low


@device
def _sample_map(table, u0, u1):
    """A direction by the map, and the map's density there."""
    n = table.width
    row = _find(table.marginal, 0, table.height, u1)
    at = row * (n + 1)
    column = load_u16(table.guide, row * n + min(int(u0 * n), n - 1))
    while column < n - 1 and load_f32(table.conditional, at + column + 1) <= u0:
        column += 1
    low = load_f32(table.marginal, row)
    row_share = load_f32(table.marginal, row + 1) - low
    t = min((u1 - low) / max(row_share, 1e-30), 1.0)
    low = load_f32(table.conditional, at + column)
    share = load_f32(table.conditional, at + column + 1) - low
    s = min((u0 - low) / max(share, 1e-30), 1.0)
    bottom = _row_height(row, table.height)
    band = _row_height(row + 1, table.height) - bottom
    return world_direction((column + s) / n, bottom + t * band), row_share * share * n / (2.0 * math.pi * band)


@device
def _map_pdf(table, d):
    """Density by solid angle with which `_sample_map` chooses d."""
    n = table.width
    u = 0.5 - math.atan2(d[1], d[0]) / (2.0 * math.pi)
    v = 1.0 - math.acos(min(max(d[2], -1.0), 1.0)) / math.pi
    row = min(max(int(v * table.height), 0), table.height - 1)
    at = row * (n + 1) + min(max(int(u * n), 0), n - 1)
    p = load_f32(table.marginal, row + 1) - load_f32(table.marginal, row)
    p *= load_f32(table.conditional, at + 1) - load_f32(table.conditional, at)
    return p * n / (2.0 * math.pi * (_row_height(row + 1, table.height) - _row_height(row, table.height)))


@inlined
def _sun_pdf(table, d):
    """What the sun adds to the density of the mixture."""
    if table.sun > 0.0:
        off = sub(d, vec(table.sun_direction))
        if 0.5 * dot(off, off) <= table.sun_one_minus_cos:
            return table.sun / (2.0 * math.pi * table.sun_one_minus_cos)
    return 0.0


@device
def draw_world(table, u0, u1, u2):
    """(a direction of the world by map and sun, its density by solid angle)."""
    if u2 < table.map:
        d, pdf = _sample_map(table, u0, u1)
    else:
        d = cone(vec(table.sun_direction), table.sun_one_minus_cos, u0, u1)
        pdf = _map_pdf(table, d)
    return d, table.map * pdf + _sun_pdf(table, d)


@device
def world_density(table, d):
    """The density by solid angle with which `draw_world` chooses d; 0 where the world has no map."""
    return table.map * _map_pdf(table, d) + _sun_pdf(table, d) if table.map > 0.0 else 0.0


@inlined
def place_world(scene, sp, scratch, d, ls):
    """Fill ls, but for its density, with the world in direction d; False where it does not light sp."""
    table = world_table_at(scene.world_table, 0)
    if sp.depth > table.max_bounces:
        return False
    point = shadow_point(scratch, sp)
    world_point(scene, point, d)
    put(ls.radiance, run_emission(scene, point))
    ls.light = -2
    ls.flags = LIGHT_SAMPLE_NO_SHADOW if table.no_shadow else 0
    ls.seen_by = scene.world_seen_by
    ls.blockers = EVERYTHING
    ls.instance = -1
    ls.primitive = -1
    put(ls.wi, d)
    put(ls.p, d)
    put(ls.ng, neg(d))
    ls.distance = math.inf
    ls.uv[0] = 0.0
    ls.uv[1] = 0.0
    return True


@inlined
def world_radiance(scene, scratch, sp, o, d):
    """(red, green, blue) of the world as a ray from o along d sees it.

    sp is the path's state (depths and RAY_* bits; sp.depth counts the bounces of this ray); it may be the shadow
    point itself.
    """
    flags = sp.ray_flags
    if scene.world_material < 0 or not visible_to(scene.world_seen_by, flags):
        return (0.0, 0.0, 0.0)
    point = shadow_point(scratch, sp)
    point.ray_flags = flags | RAY_EMISSION
    world_point(scene, point, d)
    return run_emission(scene, point)


@device
def _lit_by(scene, scratch, d):
    """Luminance that lights see of the world in direction d, negative and infinite values as 0."""
    point = shadow_point(scratch, point_in(scratch))
    world_point(scene, point, d)
    r, g, b = run_emission(scene, point)
    y = luminance(r, g, b)
    return y if 0.0 < y < 1e30 else 0.0


@kernel
def bake_world(scene: SCENE, scratch, values, width, height, first, last):
    """Store the luminance of the world at the pixels of rows [first, last) of a map of float32."""
    for row in range(first, last):
        z = -math.cos(math.pi * (row + 0.5) / height)
        for column in range(width):
            d = world_direction((column + 0.5) / width, z)
            store_f32(values, row * width + column, _lit_by(scene, scratch, d))


@kernel
def measure_world(scene: SCENE, scratch, directions, n, values):
    """Store the luminance of the world in n unit directions (float64 [n, 3]) to float64 values."""
    for i in range(n):
        store_f64(values, i, _lit_by(scene, scratch, load3_f64(directions, 3 * i)))
