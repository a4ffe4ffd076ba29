"""Suns: a disk of directions, or one direction when the angle is 0."""

import math

from ..core.jit import device, inlined
from ..core.records import LIGHT_DELTA
from ..core.vec import add, dot, length, neg, put, sub, vec
from ..core.warp import cone_at, cone_disk


@device
def sun_direction(light):
    """Unit vector towards the middle of the sun."""
    return (light.p[0], light.p[1], light.p[2])


@device
def sun_uv(light, d):
    """Texture coordinates across the disk."""
    m = light.to_object
    # Equal areas of the disk are equal solid angles: its radius goes with the sine of half the angle to the axis.
    chord = length(add(d, sun_direction(light)))
    f = 0.5 / (math.sqrt(0.5 * light.p[3]) * chord) if light.p[3] > 0.0 and chord > 0.0 else 0.0
    return (m[0] * d[0] + m[1] * d[1] + m[2] * d[2]) * f + 0.5, (m[4] * d[0] + m[5] * d[1] + m[6] * d[2]) * f + 0.5


@device
def place_sun(light, x, y, ls):
    """Fill ls with the direction of a point of the unit disk; returns the factor on the lamp's strength."""
    d = sun_direction(light)
    ls.pdf = 1.0
    if light.flags & LIGHT_DELTA == 0:
        d = cone_at(d, light.p[3], x, y)
        ls.pdf = sun_pdf(light)
    put(ls.wi, d)
    put(ls.ng, neg(d))
    put(ls.p, d)
    ls.distance = math.inf
    ls.uv[0], ls.uv[1] = sun_uv(light, d)
    return 1.0


@device
def sun_coordinates(light, d):
    """The point of the unit disk whose direction is d."""
    if light.flags & LIGHT_DELTA:
        return 0.0, 0.0
    return cone_disk(sun_direction(light), light.p[3], d)


@device
def in_sun(light, d):
    """Whether the unit direction d looks at the sun's disk."""
    off = sub(d, sun_direction(light))
    return light.flags & LIGHT_DELTA == 0 and 0.5 * dot(off, off) <= light.p[3]


@device
def sun_pdf(light):
    """Density by solid angle within the disk."""
    return 1.0 / (2.0 * math.pi * light.p[3])


@inlined
def see_sun(light, ls):
    """Complete ls for a ray that sees the disk; returns the factor on its strength."""
    d = vec(ls.wi)
    ls.pdf = sun_pdf(light)
    put(ls.p, d)
    put(ls.ng, neg(d))
    ls.uv[0], ls.uv[1] = sun_uv(light, d)
    return 1.0
