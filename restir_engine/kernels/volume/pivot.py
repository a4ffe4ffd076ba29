"""A lamp beside a segment of a ray through media, and the points of the segment by the angle under which it sees them.

See `equiangular`.
"""

import math

from ..core.jit import device, inlined
from ..core.records import RAY_VOLUME, light_at, light_table_at, media_at
from ..core.vec import dot, length, madd, sub, vec
from ..path.state import mis_weight

_MOST = 16  # lamps that are weighed; among more, one is taken at random


@inlined
def _nearest(light, o, d):
    """Where a ray is nearest to a lamp, and how near, at least the lamp's radius."""
    to = sub(vec(light.center), o)
    ahead = dot(to, d)
    return ahead, max(length(madd(to, d, -ahead)), max(light.radius, 1.0e-6 * length(to) + 1.0e-12))


@inlined
def _put(pivot, ahead, away, a, b):
    pivot[0] = ahead
    pivot[1] = away
    pivot[2] = a
    pivot[3] = b


@device
def choose_lamp(scene, o, d, s, u):
    """The lamp that u chooses for the segment s of a ray, which may be a point; -1: there is none.

    Lamps are weighed by their intensity over the square of their distance from the segment.
    """
    n = light_table_at(scene.light_table, 0).n_local
    if n == 0:
        return -1
    if n > _MOST:
        return min(int(u * n), n - 1)
    chosen = -1
    total = 0.0
    for i in range(n):
        light = light_at(scene.lights, i)
        if light.seen_by & RAY_VOLUME == 0:
            continue
        ahead, away = _nearest(light, o, d)
        past = ahead - min(max(ahead, 0.0), s)
        weight = light.importance / (away * away + past * past)
        total += weight
        if u * total < weight:
            chosen = i
            u *= total / weight
        else:
            u = (u * total - weight) / (total - weight)
    return chosen if total > 0.0 else -1


@device
def choose_pivot(scene, media, o, d, s, u):
    """Choose a lamp for the segment s of a ray by u, and leave its angles in MEDIA.pivot; False: there is none."""
    m = media_at(media, 0)
    _put(m.pivot, 0.0, 0.0, 0.0, 0.0)
    chosen = choose_lamp(scene, o, d, s, u)
    if chosen < 0:
        return False
    light = light_at(scene.lights, chosen)
    ahead, away = _nearest(light, o, d)
    a, b = math.atan(-ahead / away), math.atan((s - ahead) / away)
    if not b - a > 1.0e-6:
        return False
    _put(m.pivot, ahead, away, a, b)
    return True


@inlined
def pivot_point(media, u):
    """The distance along the segment at u of the cumulative distribution."""
    pivot = media_at(media, 0).pivot
    return pivot[0] + pivot[1] * math.tan(pivot[2] + (pivot[3] - pivot[2]) * u)


@inlined
def pivot_density(media, t):
    """The density by distance of `pivot_point`; 0 without a pivot."""
    pivot = media_at(media, 0).pivot
    if pivot[1] <= 0.0:
        return 0.0
    off = t - pivot[0]
    return pivot[1] / ((pivot[3] - pivot[2]) * (pivot[1] * pivot[1] + off * off))


@inlined
def own_share(media, t, density):
    """The MIS weight of direct light where the path itself has scattered, at t with that density."""
    p = pivot_density(media, t)
    return 1.0 if p == 0.0 else mis_weight(density, p)
