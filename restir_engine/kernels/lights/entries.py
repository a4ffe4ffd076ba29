"""What is compiled for each kind of light only when a scene has it.

An entry does one of three things, as it is asked, and speaks through the LIGHT_SAMPLE record:

    SAMPLE  choose a point for the lit point `p` by two random numbers in `uv`
    PLACE   take the point with the coordinates `uv` (see `points`) as `p` sees it
    SEE     (lamps) tell what the ray from `p` along `wi` meets at `distance`

A lamp's leaves the factor on its strength in `radiance[0]` (0: no sample), and the geometry and density by solid angle
of the point. Triangles and the world take a third random number in `distance`, leave radiance, and a density of 0 for
no sample.
"""

from collections.abc import Iterable

import numpy as np

from ..core.jit import Entry, entry
from ..core.records import (
    LIGHT_SPHERE,
    SCRATCH_LIGHT_SAMPLE,
    light_at,
    light_sample_at,
    scene_at,
    shading_point_at,
    world_table_at,
)
from ..core.vec import dot, madd, neg, normalize, put, sub, vec
from ..core.warp import disk, octahedral_direction
from .area import area_pdf, area_uv, normal_of, place_area, sample_area, spread_factor
from .ball import ball_pdf, ball_uv, falloff, place_ball
from .sun import place_sun, sun_pdf, sun_uv
from .triangle import place_triangle, sample_triangle
from .world import draw_world, place_world

SAMPLE, PLACE, SEE = 0, 1, 2
TRIANGLE, WORLD = 4, 5  # in the table of entries, behind the LIGHT_* kinds


@entry
def _ball(light, sample, task, _b, _c):
    light, ls = light_at(light, 0), light_sample_at(sample, 0)
    o = vec(ls.p)
    if task == SEE:
        d = vec(ls.wi)
        p = madd(o, d, ls.distance)
        ng = normalize(sub(p, vec(light.center))) if light.flags & LIGHT_SPHERE else neg(d)
        ls.radiance[0] = falloff(light, o, d)
        ls.pdf = ball_pdf(light, o, d, ls.distance)
        put(ls.p, p)
        put(ls.ng, ng)
        if light.material >= 0:
            ls.uv[0], ls.uv[1] = ball_uv(light, ng, d)
        return
    x, y = float(ls.uv[0]), float(ls.uv[1])
    if task == SAMPLE:
        x, y = disk(x, y)
    ls.radiance[0] = place_ball(light, o, x, y, ls)


@entry
def _area(light, sample, task, _b, _c):
    light, ls = light_at(light, 0), light_sample_at(sample, 0)
    o = vec(ls.p)
    if task == SEE:
        d = vec(ls.wi)
        p = madd(o, d, ls.distance)
        ng = normal_of(light)
        ls.radiance[0] = spread_factor(light, -dot(d, ng))
        ls.pdf = area_pdf(light, o, d, ls.distance)
        put(ls.p, p)
        put(ls.ng, ng)
        ls.uv[0], ls.uv[1] = area_uv(light, p)
    elif task == SAMPLE:
        ls.radiance[0] = sample_area(light, o, float(ls.uv[0]), float(ls.uv[1]), ls)
    else:
        ls.radiance[0] = place_area(light, o, float(ls.uv[0]), float(ls.uv[1]), ls)


@entry
def _sun(light, sample, task, _b, _c):
    light, ls = light_at(light, 0), light_sample_at(sample, 0)
    if task == SEE:
        d = vec(ls.wi)
        ls.radiance[0] = 1.0
        ls.pdf = sun_pdf(light)
        put(ls.p, d)
        put(ls.ng, neg(d))
        ls.uv[0], ls.uv[1] = sun_uv(light, d)
        return
    x, y = float(ls.uv[0]), float(ls.uv[1])
    if task == SAMPLE:
        x, y = disk(x, y)
    ls.radiance[0] = place_sun(light, x, y, ls)


@entry
def _triangle(scene, sp, scratch, task, _c):
    scene, sp = scene_at(scene, 0), shading_point_at(sp, 0)
    ls = light_sample_at(scratch + SCRATCH_LIGHT_SAMPLE, 0)
    u, v = float(ls.uv[0]), float(ls.uv[1])
    if task == SAMPLE:
        done = sample_triangle(scene, sp, scratch, vec(sp.p), u, v, float(ls.distance), ls)
    else:
        done = place_triangle(scene, sp, scratch, ls.instance, ls.primitive, u, v, ls)
    if not done:
        ls.pdf = 0.0


@entry
def _world(scene, sp, scratch, task, _c):
    scene, sp = scene_at(scene, 0), shading_point_at(sp, 0)
    ls = light_sample_at(scratch + SCRATCH_LIGHT_SAMPLE, 0)
    u, v = float(ls.uv[0]), float(ls.uv[1])
    if task == SAMPLE:
        d, pdf = draw_world(world_table_at(scene.world_table, 0), u, v, float(ls.distance))
    else:
        d, pdf = octahedral_direction(u, v), 1.0
    ls.pdf = pdf if place_world(scene, sp, scratch, d, ls) else 0.0


_ENTRIES: tuple[Entry, ...] = (_ball, _ball, _area, _sun, _triangle, _world)


def light_entries(kinds: Iterable[int]) -> np.ndarray:
    """Addresses by kind (LIGHT_*, TRIANGLE, WORLD), compiled where it is not yet; 0 for those that are not wanted."""
    table = np.zeros(len(_ENTRIES), np.int64)
    for kind in kinds:
        table[kind] = _ENTRIES[kind].address
    return table
