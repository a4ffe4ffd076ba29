"""What is compiled for each kind of light only when a scene has it.

An entry does one of three things, as it is asked, and speaks through the LIGHT_SAMPLE record:

    SAMPLE  choose a point for the lit point `p` by two random numbers in `uv`
    PLACE   take the point with the coordinates `uv` (see `points`) as `p` sees it
    SEE     (lamps) tell what the ray from `p` along `wi` meets at `distance`
    DENSITY (the world behind portals) tell with what density `wi` is chosen for `p`

A lamp's leaves the factor on its strength in `radiance[0]` (0: no sample), and the geometry and density by solid angle
of the point. Triangles and the world take a third random number in `distance`, leave radiance, and a density of 0 for
no sample.
"""

from collections.abc import Iterable

import numpy as np

from ..core.jit import Entry, entry, inlined, load
from ..core.records import light_at, light_sample_at, light_sample_in, scene_at, shading_point_at, world_table_at
from ..core.vec import vec
from ..core.warp import disk, octahedral_direction
from .area import place_area, sample_area, see_area
from .ball import place_ball, see_ball
from .portals import density_with_portals, draw_with_portals
from .sun import place_sun, see_sun
from .triangle import place_triangle, sample_triangle
from .world import draw_world, place_world

SAMPLE, PLACE, SEE, DENSITY = 0, 1, 2, 3
TRIANGLE, WORLD = 4, 5  # in the table of entries, behind the LIGHT_* kinds
WITH_PORTALS = 6  # stands in the place of WORLD where there are portals


@inlined
def _on_disk(ls, task):
    """A point of the unit disk: by the random numbers, or the one that is to be placed."""
    x, y = float(ls.uv[0]), float(ls.uv[1])
    return disk(x, y) if task == SAMPLE else (x, y)


@entry
def _ball(light, sample, task, _b, _c):
    light, ls = light_at(light, 0), light_sample_at(sample, 0)
    x, y = _on_disk(ls, task)
    ls.radiance[0] = see_ball(light, ls) if task == SEE else place_ball(light, vec(ls.p), x, y, ls)


@entry
def _area(light, sample, task, _b, _c):
    light, ls = light_at(light, 0), light_sample_at(sample, 0)
    if task == SAMPLE:
        ls.radiance[0] = sample_area(light, vec(ls.p), float(ls.uv[0]), float(ls.uv[1]), ls)
    elif task == PLACE:
        ls.radiance[0] = place_area(light, vec(ls.p), float(ls.uv[0]), float(ls.uv[1]), ls)
    else:
        ls.radiance[0] = see_area(light, ls)


@entry
def _sun(light, sample, task, _b, _c):
    light, ls = light_at(light, 0), light_sample_at(sample, 0)
    x, y = _on_disk(ls, task)
    ls.radiance[0] = see_sun(light, ls) if task == SEE else place_sun(light, x, y, ls)


@entry
def _triangle(scene, sp, scratch, task, _c):
    scene, sp = scene_at(scene, 0), shading_point_at(sp, 0)
    ls = light_sample_in(scratch)
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
    ls = light_sample_in(scratch)
    u, v = float(ls.uv[0]), float(ls.uv[1])
    drawn = task == SAMPLE
    table = world_table_at(scene.world_table, 0)
    d, pdf = draw_world(table, u, v, float(ls.distance)) if drawn else (octahedral_direction(u, v), 1.0)
    ls.pdf = pdf if place_world(scene, sp, scratch, d, ls) else 0.0


@entry
def _world_with_portals(scene, sp, scratch, task, _c):
    scene, sp = scene_at(scene, 0), shading_point_at(sp, 0)
    ls = light_sample_in(scratch)
    table = world_table_at(scene.world_table, 0)
    if task == DENSITY:
        ls.pdf = density_with_portals(table, vec(ls.p), vec(ls.wi))
        return
    u, v = float(ls.uv[0]), float(ls.uv[1])
    if task == SAMPLE:
        d, pdf = draw_with_portals(table, vec(sp.p), u, v, float(ls.distance), ls)
    else:
        d, pdf = octahedral_direction(u, v), 1.0
    ls.pdf = pdf if pdf > 0.0 and place_world(scene, sp, scratch, d, ls) else 0.0


_ENTRIES: tuple[Entry, ...] = (_ball, _ball, _area, _sun, _triangle, _world, _world_with_portals)


def light_entries(kinds: Iterable[int]) -> np.ndarray:
    """Addresses by kind (LIGHT_*, TRIANGLE, WORLD), compiled where it is not yet; 0 for those that are not wanted."""
    table = np.zeros(len(_ENTRIES), np.int64)
    kinds = set(kinds)
    load(_ENTRIES[kind] for kind in kinds)
    for kind in kinds:
        table[WORLD if kind == WITH_PORTALS else kind] = _ENTRIES[kind].address
    return table
