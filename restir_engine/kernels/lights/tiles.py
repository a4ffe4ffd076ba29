"""Light tiles: points of all lights, drawn by power once a frame, from which light samples are resampled.

A tile is a list of TILE_ENTRY, stratified over the lights. A light sample takes `candidates` entries in a row from
anywhere in any tile and chooses one by the light that it would send without shadow (RIS, algorithms of Talbot 2005 and
Bitterli 2020; tiles: Wyman and Panteleev 2021). Its density is not known, only its contribution weight W, of
expectation 1 / density: `ls.pdf` becomes 1 / W. What MIS weighs it by is the number of candidates times the density by
which tiles draw the point, and the same for light that a ray of the BSDF finds (Lin et al. 2026, RIS-based NEE).

Densities are in the measure of `places` unless solid angle is said.
"""

import math

from .. import rng
from ..emission import luminance, off_surface, run_emission, shadow_point, world_point
from ..interaction import surface_point
from ..jit import device, entry, inlined, kernel
from ..lobes import bsdf_eval
from ..lobes.closure import LOBE_LAMBERT
from ..memory import load_f32, load_f64, load_i32
from ..records import (
    LIGHT_AREA,
    LIGHT_DELTA,
    LIGHT_ELLIPSE,
    LIGHT_SPOT,
    LIGHT_SUN,
    MATERIAL_VARYING_EMISSION,
    POINT_NOWHERE,
    POINT_ON_LAMP,
    POINT_ON_WORLD,
    SCRATCH_LIGHT_SAMPLE,
    SCRATCH_POINT,
    SHAPE_BALL,
    SHAPE_CONE,
    SHAPE_DIRECTION,
    SHAPE_FACE,
    SHAPE_GRID,
    SHAPE_TWO_SIDED,
    closure_at,
    emitter_at,
    emitter_group_at,
    light_at,
    light_sample_at,
    light_table_at,
    light_tiles_at,
    material_at,
    scene_at,
    shading_point_at,
    tile_entry_at,
    world_table_at,
)
from ..vec import add, cross, dot, length, madd, mul, neg, normalize, put, scale, sub, vec
from ..warp import alias_pick, cone_at, disk, octahedral
from ..world import draw_world
from .area import normal_of
from .ball import spot_axis
from .places import light_point
from .select import lamp_share
from .sun import sun_direction
from .triangle import even_barycentrics, triangle_vertices

# What a light whose emission varies is taken to send at least, beside what it shows at the point that was drawn: its
# emission may depend on the direction, and what may light a point must be chosen sometimes.
_UNSEEN, _LEAST = 0.05, 1e-6

# The same of a lamp with a size, which is weighed by its centre: share of a lamp behind the surface, outside its cone.
_BEHIND = 0.02

# What receives light: a Lambert lobe alone, for which a cosine is enough; any lobes; a point of a medium.
_LAMBERT, _LOBES, _VOLUME = 0, 1, 2


# Drawing ------------------------------------------------------------------------------------------------


@kernel
def fill_tiles(scene, scratch, seed, first, last):
    """Draw the entries of tiles [first, last) anew; the same for any division of the tiles among threads."""
    table = light_table_at(scene.light_table, 0)
    tiles = light_tiles_at(table.tiles, 0)
    sp = shading_point_at(scratch + SCRATCH_POINT, 0)
    for tile in range(first, last):
        key = rng.key(seed, tile, 0, 0)
        for i in range(tiles.size):
            e = tile_entry_at(tiles.entries, tile * tiles.size + i)
            e.pdf = 0.0
            e.primitive = POINT_NOWHERE
            u = rng.sample1(key, i, 0)
            u0, u1 = rng.sample2(key, i, 1)
            if u < table.lamps:
                _draw_lamp(scene, tiles, sp, scratch, u / table.lamps, u0, u1, e)
                e.pdf *= table.lamps
            elif u < table.lamps + table.triangles:
                _draw_triangle(scene, table, sp, scratch, (u - table.lamps) / table.triangles, u0, u1, e)
                e.pdf *= table.triangles
            elif table.world > 0.0:
                _draw_world(scene, sp, scratch, (u - table.lamps - table.triangles) / table.world, u0, u1, e)
                e.pdf *= table.world


@device
def _lamp_at(cdf, n, u):
    """The lamp whose share of the distribution contains u."""
    low = 0
    high = n
    while high - low > 1:
        middle = (low + high) >> 1
        if load_f64(cdf, middle) <= u:
            low = middle
        else:
            high = middle
    return low


@device
def _draw_lamp(scene, tiles, sp, scratch, u, u0, u1, e):
    i = _lamp_at(tiles.lamp_cdf, scene.n_lights, u)
    light = light_at(scene.lights, i)
    e.source = i
    e.primitive = POINT_ON_LAMP
    e.pdf = lamp_share(tiles, i)
    e.focus[0] = 0.0
    e.focus[1] = 0.0
    x, y = disk(u0, u1)
    p = vec(light.center)
    n = (0.0, 0.0, 0.0)
    size = 1.0  # strength to power
    if light.kind == LIGHT_SUN:
        p = sun_direction(light)
        if light.flags & LIGHT_DELTA == 0:
            p = cone_at(p, light.p[3], x, y)
            size = 2.0 * math.pi * light.p[3]
        e.shape = SHAPE_DIRECTION
    elif light.kind == LIGHT_AREA:
        n = normal_of(light)
        if light.flags & LIGHT_DELTA:
            p = neg(n)
            e.shape = SHAPE_DIRECTION
        else:
            ellipse = light.flags & LIGHT_ELLIPSE != 0
            x, y = (0.5 + 0.5 * x, 0.5 + 0.5 * y) if ellipse else (u0, u1)
            size = light.p[3] * light.p[7] * (0.25 * math.pi if ellipse else 1.0)
            p = madd(p, (light.p[0], light.p[1], light.p[2]), (x - 0.5) * light.p[3])
            p = madd(p, (light.p[4], light.p[5], light.p[6]), (y - 0.5) * light.p[7])
            e.shape = SHAPE_GRID if light.p[12] > 0.0 else SHAPE_FACE
            e.focus[0] = light.p[11]
            e.focus[1] = light.p[12]
    else:
        if light.flags & LIGHT_DELTA == 0:
            size = math.pi * light.radius * light.radius
        e.shape = SHAPE_BALL
        e.focus[0] = light.radius
        if light.kind == LIGHT_SPOT:
            n = spot_axis(light)
            e.shape = SHAPE_CONE
            e.focus[0] = 1.0 - light.p[2]
            e.focus[1] = light.p[1]
    e.u = x
    e.v = y
    put(e.p, p)
    put(e.n, n)
    power = scale(vec(light.strength), size)
    if light.material >= 0:
        power = mul(power, _lamp_color(scene, sp, scratch, i, light, p, n, x, y))
    _put_power(e, power)


@inlined
def _put_power(e, power):
    e.power[0] = abs(power[0])
    e.power[1] = abs(power[1])
    e.power[2] = abs(power[2])


@device
def _lamp_color(scene, sp, scratch, index, light, p, n, x, y):
    """About what a lamp's program emits: at the point of an area lamp, on average of the others."""
    estimate = vec(material_at(scene.materials, light.material).emission_estimate)
    if light.kind != LIGHT_AREA:
        return (
            add(estimate, (_LEAST, _LEAST, _LEAST))
            if max(estimate[0], max(estimate[1], estimate[2])) > 0.0
            else (1.0, 1.0, 1.0)
        )
    point = shadow_point(scratch, sp)
    off_surface(point, light.material, index, p, n, neg(n), 1.0, x, y)
    return _at_least(run_emission(scene, point), estimate)


@inlined
def _at_least(emission, estimate):
    """Emission that was seen at a point, with a part of what is expected."""
    emission = (abs(emission[0]) + _LEAST, abs(emission[1]) + _LEAST, abs(emission[2]) + _LEAST)
    return madd(emission, estimate, _UNSEEN)


@device
def _draw_triangle(scene, table, sp, scratch, u, u0, u1, e):
    i, u = alias_pick(table.emitter_alias, table.n_emitters, u)
    emitter = emitter_at(table.emitters, i)
    group = emitter_group_at(table.groups, emitter.group)
    i, u = alias_pick(group.alias, group.n, u)
    primitive = load_i32(group.primitives, i)
    a, b, c = triangle_vertices(scene, emitter.instance, primitive)
    normal = cross(sub(b, a), sub(c, a))
    size = length(normal)
    if size == 0.0:
        return
    x, y = even_barycentrics(u0, u1)
    n = scale(normal, 1.0 / size)
    e.source = emitter.instance
    e.primitive = primitive
    e.u = x
    e.v = y
    e.pdf = emitter.probability * load_f32(group.probabilities, primitive)
    e.shape = SHAPE_TWO_SIDED
    put(e.p, madd(madd(a, sub(b, a), x), sub(c, a), y))
    put(e.n, n)
    point = shadow_point(scratch, sp)
    aside = madd(n, normalize(sub(b, a)), 0.7)  # not straight on, where some emission ends
    surface_point(scene, point, emitter.instance, primitive, x, y, 1.0, neg(normalize(aside)))
    material = material_at(scene.materials, point.material)
    estimate = vec(material.emission_estimate)
    if material.flags & MATERIAL_VARYING_EMISSION:
        front = run_emission(scene, point)
        point = shadow_point(scratch, sp)
        surface_point(scene, point, emitter.instance, primitive, x, y, 1.0, normalize(aside))
        estimate = _at_least(scale(add(front, run_emission(scene, point)), 0.5), estimate)
    _put_power(e, scale(estimate, 0.5 * size))


@device
def _draw_world(scene, sp, scratch, u, u0, u1, e):
    d, pdf = draw_world(world_table_at(scene.world_table, 0), u0, u1, u)
    e.source = 0
    e.primitive = POINT_ON_WORLD
    e.u, e.v = octahedral(d)
    e.pdf = pdf
    e.shape = SHAPE_DIRECTION
    put(e.p, d)
    put(e.n, neg(d))
    point = shadow_point(scratch, sp)
    world_point(scene, point, d)
    _put_power(e, _at_least(run_emission(scene, point), (0.0, 0.0, 0.0)))


# Choosing -----------------------------------------------------------------------------------------------


@inlined
def _arrival(e, o):
    """(direction to an entry, irradiance at normal incidence at o by its power)."""
    if e.shape == SHAPE_DIRECTION:
        return vec(e.p), 1.0
    w = sub(vec(e.p), o)
    d2 = dot(w, w)
    if d2 <= 0.0:
        return w, 0.0
    d = scale(w, 1.0 / math.sqrt(d2))
    if e.shape == SHAPE_BALL:
        return d, 1.0 / max(d2, e.focus[0] * e.focus[0])
    cos = -dot(vec(e.n), d)
    if e.shape == SHAPE_TWO_SIDED:
        return d, abs(cos) / d2
    if e.shape == SHAPE_CONE:
        f = min(max((cos - e.focus[0]) * e.focus[1], 0.0), 1.0)
        return d, max(f * f * (3.0 - 2.0 * f), _BEHIND) / d2
    if cos <= 0.0:
        return d, 0.0
    if e.shape == SHAPE_GRID:
        return d, cos * max((e.focus[0] - math.sqrt(max(1.0 - cos * cos, 0.0)) / cos) * e.focus[1], 0.0) / d2
    return d, cos / d2


@inlined
def _response(sp):
    if sp.n_closures == 0:
        return _VOLUME
    return _LAMBERT if sp.n_closures == 1 and closure_at(sp.closures, 0).kind == LOBE_LAMBERT else _LOBES


@inlined
def unshadowed(scene, sp, e, response):
    """The target: about the luminance that an entry sends through sp without shadow; 0 only where there is none.

    response: what receives the light, `_response(sp)`.
    """
    d, arriving = _arrival(e, vec(sp.p))
    if arriving <= 0.0:
        return 0.0
    if response == _VOLUME:
        return luminance(e.power[0], e.power[1], e.power[2]) * arriving
    loose = e.shape == SHAPE_BALL or e.shape == SHAPE_CONE
    if response == _LAMBERT:
        c = closure_at(sp.closures, 0)
        cos = max(dot(vec(c.n), d), _BEHIND if loose else 0.0) * arriving
        return luminance(c.weight[0] * e.power[0], c.weight[1] * e.power[1], c.weight[2] * e.power[2]) * cos
    dr, dg, db, gr, gg, gb, tr, tg, tb, _ = bsdf_eval(scene, sp, d)
    f = (dr + gr + tr, dg + gg + tg, db + gb + tb)
    if loose:
        f = add(f, (_BEHIND, _BEHIND, _BEHIND))
    return luminance(f[0] * e.power[0], f[1] * e.power[1], f[2] * e.power[2]) * arriving


@device
def choose_entry(scene, sp, u0, u1, u2):
    """(index of an entry or -1, its contribution weight W) for sp; u1 and u2 say where candidates are, u0 chooses."""
    tiles = light_tiles_at(light_table_at(scene.light_table, 0).tiles, 0)
    start = min(int(u1 * tiles.n_tiles), tiles.n_tiles - 1) * tiles.size
    at = min(int(u2 * tiles.size), tiles.size - 1)
    response = _response(sp)
    total = 0.0
    chosen = -1
    target = 0.0
    for _ in range(tiles.candidates):
        e = tile_entry_at(tiles.entries, start + at)
        if e.pdf > 0.0:
            t = unshadowed(scene, sp, e, response)
            if t > 0.0:
                w = t / e.pdf
                total += w
                p = w / total
                if u0 < p:
                    chosen = start + at
                    target = t
                    u0 /= p
                else:
                    u0 = min((u0 - p) / (1.0 - p), 0.99999999)
        at += 1
        if at == tiles.size:
            at = 0
    return chosen, total / (tiles.candidates * target) if chosen >= 0 else 0.0


@entry
def sample_tiles(scene, sp, scratch, _a, _b):
    """light_sample from tiles: random numbers in ls.uv and ls.distance; ls.pdf stays 0 without sample."""
    scene = scene_at(scene, 0)
    sp = shading_point_at(sp, 0)
    ls = light_sample_at(scratch + SCRATCH_LIGHT_SAMPLE, 0)
    chosen, weight = choose_entry(scene, sp, float(ls.uv[0]), float(ls.uv[1]), ls.distance)
    ls.pdf = 0.0
    if chosen < 0 or weight <= 0.0:
        return
    tiles = light_tiles_at(light_table_at(scene.light_table, 0).tiles, 0)
    e = tile_entry_at(tiles.entries, chosen)
    if not light_point(scene, sp, scratch, int(e.source), int(e.primitive), float(e.u), float(e.v)):
        ls.pdf = 0.0
        return
    ls.mis_pdf = tiles.candidates * e.pdf * ls.pdf
    ls.pdf /= weight
