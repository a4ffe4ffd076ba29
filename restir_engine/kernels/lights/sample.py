"""Next event estimation: one light, one point on it."""

from ..core.jit import device, inlined
from ..core.memory import call_entry, load_i64, record_address
from ..core.records import (
    LIGHT_DELTA,
    LIGHT_HITTABLE,
    LIGHT_NO_SHADOW,
    LIGHT_SAMPLE_DELTA,
    LIGHT_SAMPLE_NO_SHADOW,
    light_at,
    light_sample_in,
    light_table_at,
    light_tiles_at,
)
from ..core.vec import mul, put, scale, vec
from .choice import note_choice
from .emission import off_surface, run_emission, shadow_point
from .entries import SAMPLE, TRIANGLE, WORLD
from .linking import EVERYTHING, reaches
from .select import choose_lamp


@inlined
def _sample_lamp(scene, table, sp, scratch, u, ls):
    """Choose a lamp by u and a point by ls.uv; ls.pdf leaves out the choice between lamps, triangles and world."""
    o = vec(sp.p)
    i, probability = choose_lamp(scene, o, vec(sp.receiver), sp.receiver_set, u)
    if probability <= 0.0:
        return False
    light = light_at(scene.lights, i)
    if sp.depth > light.max_bounces:
        return False
    put(ls.p, o)
    call_entry(load_i64(table.entries, light.kind), record_address(light), record_address(ls), SAMPLE, 0, 0)
    factor = ls.radiance[0]
    if factor <= 0.0:
        return False
    complete_sample(scene, sp, scratch, i, light, factor, ls)
    ls.pdf *= probability
    return True


@inlined
def complete_sample(scene, sp, scratch, index, light, factor, ls):
    """Complete ls, whose geometry is that of a lamp's point, with what the lamp sends to sp from there."""
    radiance = scale(vec(light.strength), factor)
    if light.material >= 0:
        point = shadow_point(scratch, sp)
        u, v = float(ls.uv[0]), float(ls.uv[1])
        off_surface(point, light.material, index, vec(ls.p), vec(ls.ng), vec(ls.wi), ls.distance, u, v)
        radiance = mul(radiance, run_emission(scene, point))
    ls.light = index
    ls.blockers = light.blockers
    alone = light.flags & LIGHT_DELTA or not light.flags & LIGHT_HITTABLE or light.blockers != EVERYTHING
    ls.flags = (LIGHT_SAMPLE_DELTA if alone else 0) | (LIGHT_SAMPLE_NO_SHADOW if light.flags & LIGHT_NO_SHADOW else 0)
    ls.seen_by = light.seen_by if reaches(light.links, sp.light_set) else 0
    ls.instance = -1
    ls.primitive = -1
    put(ls.radiance, radiance)


@device
def _sample_by(entry, scene, sp, scratch, u, ls):
    """Let an entry fill ls; u chooses within its kind of light."""
    ls.distance = u
    call_entry(entry, record_address(scene), record_address(sp), scratch, SAMPLE, 0)
    return ls.pdf > 0.0


@inlined
def light_is_sampled(scene):
    """Whether light_sample can find anything in this scene."""
    if scene.light_table == 0:
        return False
    table = light_table_at(scene.light_table, 0)
    return table.lamps + table.triangles + table.world > 0.0


@inlined
def samples_tiles(scene):
    """Whether light samples come from tiles."""
    return scene.light_table != 0 and light_table_at(scene.light_table, 0).tiles != 0


@device
def light_sample(scene, sp, scratch, u0, u1, u2):
    """Choose a light and a point or direction on it for sp.p, and fill the LIGHT_SAMPLE in scratch.

    u2 chooses the light, u0 and u1 the point; with tiles see `tiles`, where 1 / pdf is an estimate and not known for
    other points: MIS goes by ls.mis_pdf. ls.control_variate counts even where there is no sample. Returns False where
    there is nothing else to add: no light, a sample without density, or no radiance. Does not trace rays; ls.seen_by
    says which parts of the BSDF count.
    """
    ls = light_sample_in(scratch)
    put(ls.control_variate, (0.0, 0.0, 0.0))
    if scene.light_table == 0:
        return False
    table = light_table_at(scene.light_table, 0)
    ls.uv[0] = u0
    ls.uv[1] = u1
    if table.tiles != 0:
        code = light_tiles_at(table.tiles, 0).code
        return table.lamps + table.triangles + table.world > 0.0 and _sample_by(code, scene, sp, scratch, u2, ls)
    note_choice(scene, sp)
    lamps, triangles, world = vec(sp.light_shares)
    if u2 < lamps:
        share = lamps
        done = _sample_lamp(scene, table, sp, scratch, u2 / share, ls)
    elif u2 < lamps + triangles:
        share = triangles
        done = _sample_by(load_i64(table.entries, TRIANGLE), scene, sp, scratch, (u2 - lamps) / share, ls)
    elif world > 0.0:
        share = world
        u = min((u2 - lamps - triangles) / share, 0.99999999)
        done = _sample_by(load_i64(table.entries, WORLD), scene, sp, scratch, u, ls)
    else:
        return False
    ls.pdf *= share
    ls.mis_pdf = ls.pdf
    return done and ls.pdf > 0.0 and (ls.radiance[0] != 0.0 or ls.radiance[1] != 0.0 or ls.radiance[2] != 0.0)
