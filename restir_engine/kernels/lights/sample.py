"""Next event estimation: one light, one point on it."""

from ..emission import off_surface, run_emission, shadow_point
from ..jit import device
from ..records import (
    LIGHT_AREA,
    LIGHT_DELTA,
    LIGHT_NO_SHADOW,
    LIGHT_SAMPLE_DELTA,
    LIGHT_SAMPLE_NO_SHADOW,
    LIGHT_SUN,
    SCRATCH_LIGHT_SAMPLE,
    light_at,
    light_sample_at,
    light_table_at,
)
from ..vec import mul, put, scale, vec
from ..world import sample_world
from .area import sample_area
from .ball import sample_ball
from .select import choose_lamp, set_receiver
from .sun import sample_sun
from .triangle import sample_triangle


@device
def _sample_lamp(scene, sp, scratch, o, u0, u1, u2, ls):
    i, probability = choose_lamp(scene, o, vec(sp.receiver), u2)
    if probability <= 0.0:
        return False
    light = light_at(scene.lights, i)
    if sp.depth > light.max_bounces:
        return False
    if light.kind == LIGHT_AREA:
        factor = sample_area(light, o, u0, u1, ls)
    elif light.kind == LIGHT_SUN:
        factor = sample_sun(light, u0, u1, ls)
    else:
        factor = sample_ball(light, o, u0, u1, ls)
    if factor <= 0.0:
        return False
    radiance = scale(vec(light.strength), factor)
    if light.material >= 0:
        point = shadow_point(scratch, sp)
        off_surface(
            point, light.material, i, vec(ls.p), vec(ls.ng), vec(ls.wi), ls.distance, float(ls.uv[0]), float(ls.uv[1])
        )
        radiance = mul(radiance, run_emission(scene, point))
    ls.light = i
    ls.flags = (LIGHT_SAMPLE_DELTA if light.flags & LIGHT_DELTA else 0) | (
        LIGHT_SAMPLE_NO_SHADOW if light.flags & LIGHT_NO_SHADOW else 0
    )
    ls.visibility = light.visibility
    ls.instance = -1
    ls.primitive = -1
    ls.pdf *= probability
    put(ls.radiance, radiance)
    return True


@device
def light_sample(scene, sp, scratch, u0, u1, u2):
    """Choose a light and a point or direction on it for sp.p, and fill the LIGHT_SAMPLE in scratch.

    u2 chooses the light, u0 and u1 the point. Returns False where there is nothing to add: no light, a sample
    without density, or no radiance. Does not trace rays; ls.visibility says which parts of the BSDF count.
    """
    if scene.light_table == 0:
        return False
    table = light_table_at(scene.light_table, 0)
    ls = light_sample_at(scratch + SCRATCH_LIGHT_SAMPLE, 0)
    o = vec(sp.p)
    set_receiver(scene, sp)
    if u2 < table.lamps:
        done = _sample_lamp(scene, sp, scratch, o, u0, u1, u2 / table.lamps, ls)
        share = float(table.lamps)
    elif u2 < table.lamps + table.triangles:
        done = sample_triangle(scene, sp, scratch, o, u0, u1, (u2 - table.lamps) / table.triangles, ls)
        share = float(table.triangles)
    elif table.world > 0.0:
        done = sample_world(scene, sp, scratch, u0, u1, (u2 - table.lamps - table.triangles) / table.world, ls)
        share = float(table.world)
    else:
        return False
    ls.pdf *= share
    return done and ls.pdf > 0.0 and (ls.radiance[0] != 0.0 or ls.radiance[1] != 0.0 or ls.radiance[2] != 0.0)
