"""What is compiled for each kind of light only when a scene has it: sampling, and what a ray sees of a lamp.

Entries speak through the LIGHT_SAMPLE record. Sampling a lamp takes the lit point in `p` and two random numbers in
`uv`; it leaves the factor on the lamp's strength in `radiance[0]` (0: no sample). Seeing a lamp takes the ray's origin
in `p`, its direction in `wi` and the distance; it leaves the factor, the density by solid angle, the point, its normal
and texture coordinates. Triangles and the world take a third random number in `distance` and leave a density of 0 for
no sample.
"""

from collections.abc import Iterable

import numpy as np

from ..core.jit import Entry, device, entry
from ..core.records import LIGHT_SPHERE, SCRATCH_LIGHT_SAMPLE, light_at, light_sample_at, scene_at, shading_point_at
from ..core.vec import dot, madd, neg, normalize, put, sub, vec
from .area import area_pdf, area_uv, normal_of, sample_area, spread_factor
from .ball import ball_pdf, ball_uv, falloff, sample_ball
from .sun import sample_sun, sun_pdf, sun_uv
from .triangle import sample_triangle
from .world import sample_world

# Places in the table of entries. SAMPLE and SEEN are followed by one place for each LIGHT_* kind.
SAMPLE, SEEN, SAMPLE_TRIANGLE, SAMPLE_WORLD = 0, 4, 8, 9


@entry
def _sample_ball(light, sample, _a, _b, _c):
    ls = light_sample_at(sample, 0)
    ls.radiance[0] = sample_ball(light_at(light, 0), vec(ls.p), float(ls.uv[0]), float(ls.uv[1]), ls)


@entry
def _sample_area(light, sample, _a, _b, _c):
    ls = light_sample_at(sample, 0)
    ls.radiance[0] = sample_area(light_at(light, 0), vec(ls.p), float(ls.uv[0]), float(ls.uv[1]), ls)


@entry
def _sample_sun(light, sample, _a, _b, _c):
    ls = light_sample_at(sample, 0)
    ls.radiance[0] = sample_sun(light_at(light, 0), float(ls.uv[0]), float(ls.uv[1]), ls)


@entry
def _see_ball(light, sample, _a, _b, _c):
    light = light_at(light, 0)
    ls = light_sample_at(sample, 0)
    o = vec(ls.p)
    d = vec(ls.wi)
    p = madd(o, d, ls.distance)
    ng = normalize(sub(p, vec(light.center))) if light.flags & LIGHT_SPHERE else neg(d)
    ls.radiance[0] = falloff(light, o, d)
    ls.pdf = ball_pdf(light, o, d, ls.distance)
    put(ls.p, p)
    put(ls.ng, ng)
    if light.material >= 0:
        ls.uv[0], ls.uv[1] = ball_uv(light, ng, d)


@entry
def _see_area(light, sample, _a, _b, _c):
    light = light_at(light, 0)
    ls = light_sample_at(sample, 0)
    o = vec(ls.p)
    d = vec(ls.wi)
    p = madd(o, d, ls.distance)
    ng = normal_of(light)
    ls.radiance[0] = spread_factor(light, -dot(d, ng))
    ls.pdf = area_pdf(light, o, d, ls.distance)
    put(ls.p, p)
    put(ls.ng, ng)
    ls.uv[0], ls.uv[1] = area_uv(light, p)


@entry
def _see_sun(light, sample, _a, _b, _c):
    light = light_at(light, 0)
    ls = light_sample_at(sample, 0)
    d = vec(ls.wi)
    ls.radiance[0] = 1.0
    ls.pdf = sun_pdf(light)
    put(ls.p, d)
    put(ls.ng, neg(d))
    ls.uv[0], ls.uv[1] = sun_uv(light, d)


@device
def _end(ls, done):
    if not done:
        ls.pdf = 0.0


@entry
def _sample_triangle(scene, sp, scratch, _a, _b):
    ls = light_sample_at(scratch + SCRATCH_LIGHT_SAMPLE, 0)
    sp = shading_point_at(sp, 0)
    u0, u1, u2 = float(ls.uv[0]), float(ls.uv[1]), float(ls.distance)
    _end(ls, sample_triangle(scene_at(scene, 0), sp, scratch, vec(sp.p), u0, u1, u2, ls))


@entry
def _sample_world(scene, sp, scratch, _a, _b):
    ls = light_sample_at(scratch + SCRATCH_LIGHT_SAMPLE, 0)
    u0, u1, u2 = float(ls.uv[0]), float(ls.uv[1]), float(ls.distance)
    _end(ls, sample_world(scene_at(scene, 0), shading_point_at(sp, 0), scratch, u0, u1, u2, ls))


_LAMPS: tuple[tuple[Entry, Entry], ...] = (
    (_sample_ball, _see_ball),
    (_sample_ball, _see_ball),
    (_sample_area, _see_area),
    (_sample_sun, _see_sun),
)


def light_entries(kinds: Iterable[int], triangles: bool, world: bool) -> np.ndarray:
    """Addresses of what these LIGHT_* kinds, emissive triangles and the world need, compiled where it is not yet."""
    table = np.zeros(10, np.int64)
    for kind in kinds:
        sample, see = _LAMPS[kind]
        table[SAMPLE + kind], table[SEEN + kind] = sample.address, see.address
    table[SAMPLE_TRIANGLE] = _sample_triangle.address if triangles else 0
    table[SAMPLE_WORLD] = _sample_world.address if world else 0
    return table
