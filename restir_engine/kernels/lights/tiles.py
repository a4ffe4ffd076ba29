"""Light tiles: points of all lights, drawn by power once a frame, from which light samples are resampled.

A tile is a list of TILE_ENTRY, stratified over the lights, in groups of `tile_weights.LANES`. A light sample takes
`candidates` entries from the start of any group on and chooses one by about the light that it would send without
shadow (RIS, algorithms of Talbot 2005 and Bitterli 2020; tiles: Wyman and Panteleev 2021). Its density is not known,
only its contribution weight W, of expectation 1 / density: `ls.pdf` becomes 1 / W. What MIS weighs it by is the number
of candidates times the density by which tiles draw the point, and the same for light that a ray of the BSDF finds (Lin
et al. 2026, RIS-based NEE).

Densities are in the measure of light points unless solid angle is said.
"""

import math

from ..core import rng
from ..core.jit import device, entry, inlined, kernel
from ..core.memory import call_entry, load_f32, load_f64, load_i32, load_i64, record_address
from ..core.records import (
    LIGHT_AREA,
    LIGHT_DELTA,
    LIGHT_ELLIPSE,
    LIGHT_SPOT,
    LIGHT_SUN,
    MATERIAL_VARYING_EMISSION,
    POINT_NOWHERE,
    POINT_ON_LAMP,
    POINT_ON_WORLD,
    SCENE,
    SCRATCH_TILE_WEIGHTS,
    emitter_at,
    emitter_group_at,
    instance_at,
    light_at,
    light_sample_in,
    light_table_at,
    light_tiles_at,
    material_at,
    mesh_at,
    point_in,
    scene_at,
    shading_point_at,
    tile_entry_at,
    world_table_at,
)
from ..core.vec import add, cross, length, madd, mul, neg, normalize, put, scale, sub, vec
from ..core.warp import alias_pick, cone_at, disk, octahedral
from ..geometry.surface import primitive_material, surface_point
from .area import normal_of
from .ball import spot_axis
from .emission import off_surface, run_emission, shadow_point, world_point
from .entries import SAMPLE, WORLD
from .points import light_point
from .receiver import receiver_of
from .select import lamp_share
from .sun import sun_direction
from .tile_weights import (
    GROUP_BYTES,
    LANES,
    face_of,
    pick_lane,
    put_ball,
    put_chance,
    put_cone,
    put_direction,
    put_face,
    put_grid,
    put_power,
    sum_weights,
    weigh_diffuse,
    weigh_glossy,
)
from .triangle import even_barycentrics, place_even, triangle_vertices
from .world import draw_world

# What a light whose emission varies is taken to send at least, beside what it shows at the point that was drawn: its
# emission may depend on the direction, and what may light a point must be chosen sometimes.
_UNSEEN, _LEAST = 0.05, 1e-6


# Drawing ------------------------------------------------------------------------------------------------


@kernel
def fill_tiles(scene: SCENE, scratch, seed, first, last):
    """Draw the entries of tiles [first, last) anew; the same for any division of the tiles among threads."""
    table = light_table_at(scene.light_table, 0)
    tiles = light_tiles_at(table.tiles, 0)
    sp = point_in(scratch)
    size = tiles.groups * LANES
    drawn = 1.0 - tiles.apart
    for tile in range(first, last):
        key = rng.key(seed, tile, 0, 0)
        for i in range(size):
            e = tile_entry_at(tiles.entries, tile * size + i)
            e.pdf = 0.0
            e.primitive = POINT_NOWHERE
            e.size = 0.0
            group = tiles.emission + GROUP_BYTES * (tile * tiles.groups + i // LANES)
            lane = i % LANES
            u = drawn * rng.sample1(key, i, 0)
            u0, u1 = rng.sample2(key, i, 1)
            if u < table.lamps:
                _draw_lamp(scene, tiles, sp, scratch, u / table.lamps, u0, u1, e, group, lane)
                e.pdf *= table.lamps
            elif u < table.lamps + table.triangles:
                _draw_triangle(scene, table, sp, scratch, (u - table.lamps) / table.triangles, u0, u1, e, group, lane)
                e.pdf *= table.triangles
            elif tiles.apart == 0.0 and table.world > 0.0:
                u = (u - table.lamps - table.triangles) / table.world
                _draw_world(scene, sp, scratch, u, u0, u1, e, group, lane)
                e.pdf *= table.world
            put_chance(group, lane, e.pdf)


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
def _draw_lamp(scene, tiles, sp, scratch, u, u0, u1, e, group, lane):
    i = _lamp_at(tiles.lamp_cdf, scene.n_lights, u)
    light = light_at(scene.lights, i)
    e.source = i
    e.primitive = POINT_ON_LAMP
    e.pdf = lamp_share(tiles, i)
    x, y = disk(u0, u1)
    p = vec(light.center)
    n = (0.0, 0.0, 0.0)
    size = 1.0  # strength to power
    if light.kind == LIGHT_SUN:
        p = sun_direction(light)
        if light.flags & LIGHT_DELTA == 0:
            p = cone_at(p, light.p[3], x, y)
            size = 2.0 * math.pi * light.p[3]
        put_direction(group, lane, p)
    elif light.kind == LIGHT_AREA:
        n = normal_of(light)
        if light.flags & LIGHT_DELTA:
            p = neg(n)
            put_direction(group, lane, p)
        else:
            ellipse = light.flags & LIGHT_ELLIPSE != 0
            x, y = (0.5 + 0.5 * x, 0.5 + 0.5 * y) if ellipse else (u0, u1)
            size = light.p[3] * light.p[7] * (0.25 * math.pi if ellipse else 1.0)
            p = madd(p, (light.p[0], light.p[1], light.p[2]), (x - 0.5) * light.p[3])
            p = madd(p, (light.p[4], light.p[5], light.p[6]), (y - 0.5) * light.p[7])
            if light.p[12] > 0.0:
                put_grid(group, lane, p, n, light.p[11], light.p[12])
            else:
                put_face(group, lane, p, n, 0.0)
    else:
        if light.flags & LIGHT_DELTA == 0:
            size = math.pi * light.radius * light.radius
        if light.kind == LIGHT_SPOT:
            n = spot_axis(light)
            put_cone(group, lane, p, n, light.radius, 1.0 - light.p[2], light.p[1])
        else:
            put_ball(group, lane, p, light.radius)
    e.u = x
    e.v = y
    power = scale(vec(light.strength), size)
    if light.material >= 0:
        power = mul(power, _lamp_color(scene, sp, scratch, i, light, p, n, x, y))
    put_power(group, lane, power)


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
def _draw_triangle(scene, table, sp, scratch, u, u0, u1, e, group, lane):
    i, u = alias_pick(table.emitter_alias, table.n_emitters, u)
    emitter = emitter_at(table.emitters, i)
    triangles = emitter_group_at(table.groups, emitter.group)
    i, u = alias_pick(triangles.alias, triangles.n, u)
    primitive = load_i32(triangles.primitives, i)
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
    e.pdf = emitter.probability * load_f32(triangles.probabilities, primitive)
    p = madd(madd(a, sub(b, a), x), sub(c, a), y)
    moves = emitter.reach > 0.0
    if moves:  # it may face any way when a path asks
        put_ball(group, lane, p, emitter.reach)
    else:
        put_face(group, lane, p, n, 1.0)
    placed = instance_at(scene.instances, emitter.instance)
    index = primitive_material(scene, placed, mesh_at(scene.meshes, placed.mesh), primitive)
    material = material_at(scene.materials, index)
    estimate = vec(material.emission_estimate)
    if material.flags & MATERIAL_VARYING_EMISSION:
        point = shadow_point(scratch, sp)
        aside = madd(n, normalize(sub(b, a)), 0.7)  # not straight on, where some emission ends
        surface_point(scene, point, emitter.instance, primitive, x, y, 1.0, neg(normalize(aside)))
        front = run_emission(scene, point)
        point = shadow_point(scratch, sp)
        surface_point(scene, point, emitter.instance, primitive, x, y, 1.0, normalize(aside))
        estimate = _at_least(scale(add(front, run_emission(scene, point)), 0.5), estimate)
    elif not moves:
        e.size = size
        put(e.p, p)
    put_power(group, lane, scale(estimate, 0.5 * size))


@device
def _draw_world(scene, sp, scratch, u, u0, u1, e, group, lane):
    d, pdf = draw_world(world_table_at(scene.world_table, 0), u0, u1, u)
    e.source = 0
    e.primitive = POINT_ON_WORLD
    e.u, e.v = octahedral(d)
    e.pdf = pdf
    put_direction(group, lane, d)
    point = shadow_point(scratch, sp)
    world_point(scene, point, d)
    put_power(group, lane, _at_least(run_emission(scene, point), (0.0, 0.0, 0.0)))


# Choosing -----------------------------------------------------------------------------------------------


@inlined
def _sent(out, lane):
    """What a lane sends: rgb, luminance."""
    color = (load_f64(out, lane), load_f64(out, LANES + lane), load_f64(out, 2 * LANES + lane))
    return color, load_f64(out, 3 * LANES + lane)


@device
def choose_entry(scene, scratch, sp, u0, u1, u2):
    """(index of an entry or -1, contribution weight W by its target, target, variate) for sp.

    u1 and u2 say in which group candidates begin, u0 chooses. The variate (rgb) is what all candidates send, on the
    mean, less what the chosen one stands for: its expectation is 0, and its luminance always.
    """
    tiles = light_tiles_at(light_table_at(scene.light_table, 0).tiles, 0)
    start = min(int(u1 * tiles.n_tiles), tiles.n_tiles - 1) * tiles.groups
    at = min(int(u2 * tiles.groups), tiles.groups - 1)
    receiver = receiver_of(sp)
    glossy = receiver.gloss_scale > 0.0
    o = vec(sp.p)
    out = scratch + SCRATCH_TILE_WEIGHTS
    total = 0.0
    chosen = -1
    weight = 0.0
    mean = color = (0.0, 0.0, 0.0)
    left = tiles.candidates
    while left > 0:
        group = tiles.emission + GROUP_BYTES * (start + at)
        if glossy:
            weigh_glossy(group, o, receiver, out)
        else:
            weigh_diffuse(group, o, receiver, out)
        n = min(left, LANES)
        c, w = sum_weights(out, n)
        if w > 0.0:
            total += w
            p = w / total
            mean = add(mean, c)
            if u0 < p:
                lane, u0 = pick_lane(out, n, u0 / p * w)
                chosen = LANES * (start + at) + lane
                color, weight = _sent(out, lane)
            else:
                u0 = min((u0 - p) / (1.0 - p), 0.99999999)
        left -= LANES
        at += 1
        if at == tiles.groups:
            at = 0
    if chosen < 0:
        return -1, 0.0, mean
    s = 1.0 / tiles.candidates
    return chosen, total / weight * s, scale(madd(mean, color, -total / weight), s)


@inlined
def _place(scene, sp, scratch, tiles, index, e, ls):
    """light_point for an entry e, the index-th; of a triangle that emits evenly no memory is read but the tile's."""
    if e.size == 0.0:
        return light_point(scene, sp, scratch, int(e.source), int(e.primitive), float(e.u), float(e.v))
    n, power = face_of(tiles.emission + GROUP_BYTES * (index // LANES), index % LANES)
    radiance = scale(power, 2.0 / e.size)
    source, primitive = int(e.source), int(e.primitive)
    return place_even(scene, sp, source, primitive, float(e.u), float(e.v), vec(e.p), n, float(e.size), radiance, ls)


@entry
def sample_tiles(scene, sp, scratch, _a, _b):
    """light_sample from tiles: random numbers in ls.uv and ls.distance; ls.pdf stays 0 without sample."""
    scene = scene_at(scene, 0)
    sp = shading_point_at(sp, 0)
    ls = light_sample_in(scratch)
    table = light_table_at(scene.light_table, 0)
    tiles = light_tiles_at(table.tiles, 0)
    u = float(ls.distance)
    if u < tiles.apart:
        ls.distance = u / tiles.apart
        call_entry(load_i64(table.entries, WORLD), record_address(scene), record_address(sp), scratch, SAMPLE, 0)
        ls.pdf *= tiles.apart
        ls.mis_pdf, ls.point_pdf = ls.pdf, 1.0
        return
    u = (u - tiles.apart) / (1.0 - tiles.apart)
    chosen, weight, variate = choose_entry(scene, scratch, sp, float(ls.uv[0]), float(ls.uv[1]), u)
    ls.pdf = 0.0
    put(ls.control_variate, variate if tiles.control_variates else (0.0, 0.0, 0.0))
    if chosen < 0:
        return
    e = tile_entry_at(tiles.entries, chosen)
    if not _place(scene, sp, scratch, tiles, chosen, e, ls):
        ls.pdf = 0.0
        return
    # The point's own contribution weight is `weight` / e.pdf.
    ls.point_pdf = ls.pdf
    ls.mis_pdf = tiles.candidates * e.pdf * ls.pdf
    ls.pdf *= e.pdf / weight
