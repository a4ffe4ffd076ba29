"""Points of lights that outlive the surface point they were sampled for: kept, and lit by again from anywhere.

A point is (source, primitive, u, v), 16 bytes in a reservoir or a tile:

    emissive triangle   instance, primitive, barycentrics
    lamp                its index, POINT_ON_LAMP, and (u, v):
        point, spot         of the unit disk: what turns towards the receiver, or the cone in which it sees a sphere
        sun                 of the unit disk, as which its cone is seen
        area                texture coordinates
        without size        0, 0
    world               0, POINT_ON_WORLD, the direction as a point of the octahedral square

Points are measured by the share of their lamp or triangle that they make up (so that points uniform over a lamp's
disk, cone or face have density 1), by solid angle on the world; a lamp without size counts as 1. To go from one
receiver to another with the same four numbers has Jacobian 1 in this measure, also when lamps and meshes move.

`light_point` gives what is lit by a point. It leaves in `ls.pdf` the solid-angle density that corresponds to 1 in the
measure of points (1 for a lamp without size), thus

    integrand                       BSDF(ls.wi) ls.radiance / ls.pdf
    density of a light_sample       its ls.pdf / this ls.pdf, which is `point_pdf_of` it
    density of a BSDF sample        its pdf / this ls.pdf; 0 for lamps without size (LIGHT_SAMPLE_DELTA)
"""

from ..core.jit import device
from ..core.memory import call_entry, load_i64, record_address
from ..core.records import (
    LIGHT_AREA,
    LIGHT_DELTA,
    LIGHT_SUN,
    POINT_ON_LAMP,
    POINT_ON_WORLD,
    light_at,
    light_sample_in,
    light_table_at,
)
from ..core.vec import madd, vec
from ..core.warp import octahedral
from .area import area_density, area_uv
from .ball import ball_coordinates, ball_pdf
from .entries import PLACE, TRIANGLE, WORLD
from .sample import complete_sample
from .sun import sun_coordinates, sun_pdf
from .triangle import even_density


@device
def light_point(scene, sp, scratch, source, primitive, u, v):
    """Fill the LIGHT_SAMPLE in scratch with a kept point as it lights sp; False where it does not.

    A point seen from behind, beyond a lamp's or the world's limit of bounces, or outside a spread does not.
    """
    ls = light_sample_in(scratch)
    table = light_table_at(scene.light_table, 0)
    ls.uv[0] = u
    ls.uv[1] = v
    if primitive == POINT_ON_LAMP:
        light = light_at(scene.lights, source)
        if sp.depth > light.max_bounces:
            return False
        ls.p[0], ls.p[1], ls.p[2] = sp.p[0], sp.p[1], sp.p[2]
        call_entry(load_i64(table.entries, light.kind), record_address(light), record_address(ls), PLACE, 0, 0)
        factor = ls.radiance[0]
        if factor <= 0.0:
            return False
        complete_sample(scene, sp, scratch, source, light, factor, ls)
    else:
        ls.instance = source
        ls.primitive = primitive
        code = load_i64(table.entries, TRIANGLE if primitive >= 0 else WORLD)
        if code == 0:
            return False
        call_entry(code, record_address(scene), record_address(sp), scratch, PLACE, 0)
    ls.mis_pdf = ls.point_pdf = ls.pdf
    return ls.pdf > 0.0 and (ls.radiance[0] != 0.0 or ls.radiance[1] != 0.0 or ls.radiance[2] != 0.0)


@device
def point_of_sample(scene, sp, ls):
    """(source, primitive, u, v) of a LIGHT_SAMPLE that light_sample filled for sp."""
    if ls.light >= 0:
        u, v = point_of_lamp(scene, ls.light, vec(sp.p), vec(ls.wi), ls.distance)
        return ls.light, POINT_ON_LAMP, u, v
    if ls.primitive >= 0:
        return ls.instance, ls.primitive, float(ls.uv[0]), float(ls.uv[1])
    u, v = octahedral(vec(ls.wi))
    return 0, POINT_ON_WORLD, u, v


@device
def point_pdf_of(scene, sp, ls):
    """What light_point would leave in ls.pdf for a LIGHT_SAMPLE that light_sample filled for sp."""
    o, d = vec(sp.p), vec(ls.wi)
    if ls.light >= 0:
        light = light_at(scene.lights, ls.light)
        if light.flags & LIGHT_DELTA:
            return 1.0
        if light.kind == LIGHT_AREA:
            return area_density(light, d, ls.distance)
        return sun_pdf(light) if light.kind == LIGHT_SUN else ball_pdf(light, o, d, ls.distance)
    if ls.primitive >= 0:
        return even_density(scene, ls.instance, ls.primitive, vec(ls.p), o)
    return 1.0


@device
def point_of_lamp(scene, light, o, d, t):
    """The coordinates (u, v) of the point of a lamp that a ray from o along d meets at distance t (suns: any)."""
    lamp = light_at(scene.lights, light)
    if lamp.kind == LIGHT_SUN:
        return sun_coordinates(lamp, d)
    if lamp.kind == LIGHT_AREA:
        return area_uv(lamp, madd(o, d, t))
    return ball_coordinates(lamp, o, d, t)
