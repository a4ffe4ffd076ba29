"""Light that a ray finds: which lamps, and what they add; with what density light sampling finds the world's."""

from ..core.jit import device, inlined
from ..core.memory import call_entry, load_f64, load_i64, record_address
from ..core.records import (
    LIGHT_AREA,
    LIGHT_HITTABLE,
    LIGHT_SUN,
    light_at,
    light_sample_in,
    light_table_at,
    light_tiles_at,
    world_table_at,
)
from ..core.vec import dot, load3_f64, mul, put, scale, sub, vec
from ..geometry.surface import surface_point
from .area import area_density, area_pdf, intersect_area
from .ball import ball_pdf, intersect_ball
from .choice import note_choice
from .emission import off_surface, run_emission, shadow_point, visible_to
from .entries import DENSITY, SEE, WORLD
from .select import lamp_probability, lamp_share
from .sun import in_sun, sun_pdf
from .triangle import triangle_pdf
from .world import world_density


@inlined
def lights_intersect(scene, o, d, tmin, tmax, ray_flags):
    """(index, t) of the nearest lamp with a place that the ray meets between tmin and tmax; index -1: none.

    Suns are not among them (`sun_next`). Lamps let rays through: to find the next one, ask again from t on.
    """
    found = -1
    if scene.light_table == 0:
        return found, tmax
    table = light_table_at(scene.light_table, 0)
    width = table.targets_width
    k = 1 if width > 0 else 0
    while k > 0:
        row = 5 * k
        r2 = load_f64(table.targets, row + 3)
        c = sub(load3_f64(table.targets, row), o)
        c2 = dot(c, c)
        along = dot(c, d)
        if c2 - along * along <= r2 and (along >= 0.0 or c2 <= r2):
            if k < width:
                k *= 2
                continue
            i = int(load_f64(table.targets, row + 4))
            light = light_at(scene.lights, i)
            if visible_to(light.seen_by, ray_flags):
                t = intersect_area(light, o, d) if light.kind == LIGHT_AREA else intersect_ball(light, o, d)
                if tmin < t < tmax:
                    tmax = t
                    found = i
        # On to what is right of it: up as long as this is a right child.
        while k & 1:
            k >>= 1
        if k > 0:
            k += 1
    return found, tmax


@inlined
def sun_next(scene, d, first, ray_flags):
    """The first sun at index `first` (0 to begin with) or above that a ray which leaves the scene sees; -1: none."""
    if scene.light_table == 0:
        return -1
    for i in range(max(first, light_table_at(scene.light_table, 0).n_local), scene.n_lights):
        light = light_at(scene.lights, i)
        if light.flags & LIGHT_HITTABLE and visible_to(light.seen_by, ray_flags) and in_sun(light, d):
            return i
    return -1


@device
def light_radiance(scene, scratch, sp, index, o, d, t):
    """(red, green, blue, pdf): what a lamp that the ray met at t adds, and light_sample's mis_pdf for d from o.

    sp is the path's state: how light_sample chose at o stands in it (lights.choice), sp.depth counts the bounces of
    this ray (light_sample for it was asked at one less). Beyond its limit of bounces a lamp is found by rays alone, but
    by MIS as if it was also sampled, once: as in Cycles. Overwrites the LIGHT_SAMPLE in scratch.
    """
    light = light_at(scene.lights, index)
    table = light_table_at(scene.light_table, 0)
    ls = light_sample_in(scratch)
    put(ls.p, o)
    put(ls.wi, d)
    ls.distance = t
    call_entry(load_i64(table.entries, light.kind), record_address(light), record_address(ls), SEE, 0, 0)
    if ls.radiance[0] <= 0.0:
        return 0.0, 0.0, 0.0, 0.0
    radiance = scale(vec(light.strength), float(ls.radiance[0]))
    if light.material >= 0:
        point = shadow_point(scratch, sp)
        off_surface(point, light.material, index, vec(ls.p), vec(ls.ng), d, t, float(ls.uv[0]), float(ls.uv[1]))
        radiance = mul(radiance, run_emission(scene, point))
    if table.tiles != 0:
        tiles = light_tiles_at(table.tiles, 0)
        density = area_density(light, d, t) if light.kind == LIGHT_AREA else ls.pdf
        candidates = tiles.candidates if sp.depth <= light.max_bounces + 1 else 1.0
        chosen = table.lamps * lamp_share(tiles, index) * candidates
        return radiance[0], radiance[1], radiance[2], density * chosen
    chosen = sp.light_shares[0] * lamp_probability(scene, o, vec(sp.receiver), sp.receiver_set, index)
    return radiance[0], radiance[1], radiance[2], ls.pdf * chosen


@device
def world_pdf(scene, scratch, sp, o, d):
    """light_sample's mis_pdf at o for direction d of the world, 0 where it is never sampled. sp: see `light_radiance`.

    Overwrites the LIGHT_SAMPLE in scratch.
    """
    if scene.world_table == 0 or scene.light_table == 0:
        return 0.0
    table = light_table_at(scene.light_table, 0)
    world = world_table_at(scene.world_table, 0)
    if table.tiles != 0:
        tiles = light_tiles_at(table.tiles, 0)
        candidates = tiles.candidates if sp.depth <= world.max_bounces + 1 else 1.0
        share = tiles.apart if tiles.apart > 0.0 else table.world * candidates
    else:
        share = float(sp.light_shares[2])
    if share == 0.0:
        return 0.0
    if world.n_portals == 0:
        return share * world_density(world, d)
    ls = light_sample_in(scratch)
    put(ls.p, o)
    put(ls.wi, d)
    call_entry(load_i64(table.entries, WORLD), record_address(scene), record_address(sp), scratch, DENSITY, 0)
    return share * ls.pdf


@device
def drawn_pdf(scene, scratch, sp):
    """light_sample's mis_pdf at sp for the LIGHT_SAMPLE of light_point, of a light with a size; not of tiles."""
    note_choice(scene, sp)
    ls = light_sample_in(scratch)
    o, d, t = vec(sp.p), vec(ls.wi), float(ls.distance)
    if ls.light >= 0:
        light = light_at(scene.lights, ls.light)
        chosen = sp.light_shares[0] * lamp_probability(scene, o, vec(sp.receiver), sp.receiver_set, ls.light)
        if light.kind == LIGHT_AREA:
            return chosen * area_pdf(light, o, d, t)
        return chosen * (sun_pdf(light) if light.kind == LIGHT_SUN else ball_pdf(light, o, d, t))
    if ls.primitive < 0:
        return world_pdf(scene, scratch, sp, o, d)
    point = shadow_point(scratch, sp)
    surface_point(scene, point, ls.instance, ls.primitive, float(ls.uv[0]), float(ls.uv[1]), t, d)
    put(point.receiver, vec(sp.receiver))
    put(point.light_shares, vec(sp.light_shares))
    return triangle_pdf(scene, point, o)
