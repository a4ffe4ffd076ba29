"""Point and spot lights: a sphere, or a disk that turns towards the point that is lit ("soft falloff")."""

import math

from ..core.jit import device, inlined
from ..core.records import LIGHT_DELTA, LIGHT_SPHERE, LIGHT_SPOT
from ..core.vec import dot, frame, length, madd, neg, normalize, put, scale, sub, transform_vector, vec
from ..core.warp import cone_at, cone_disk, one_minus_cos


@device
def spot_axis(light):
    return (light.p[3], light.p[4], light.p[5])


@device
def _local_ray(light, d):
    """The direction of travel d of light in the lamp's space, z along the axis of a spot."""
    x, y, z = normalize(transform_vector(light.to_object, d))
    return x, y, -z


@device
def falloff(light, o, d):
    """Factor on a spot's light that arrives at o against direction d (from o to the lamp); 1 for points."""
    if light.kind != LIGHT_SPOT:
        return 1.0
    if light.flags & LIGHT_SPHERE:
        c = sub(o, vec(light.center))
        if dot(c, c) <= light.radius * light.radius:
            return 1.0
    f = (_local_ray(light, (-d[0], -d[1], -d[2]))[2] - light.p[0]) * light.p[1]
    if f <= 0.0:
        return 0.0
    if f >= 1.0:
        return 1.0
    return f * f * (3.0 - 2.0 * f)


@device
def ball_uv(light, ng, d):
    """Texture coordinates: of the sphere for points, of the projected image for spots."""
    if light.kind == LIGHT_SPOT:
        x, y, z = _local_ray(light, (-d[0], -d[1], -d[2]))
        c = min(max(light.p[0], 0.0), 0.99999999)
        f = 0.5 * c / (math.sqrt(1.0 - c * c) * z) if z != 0.0 else 0.0
        return 0.5 + x * f, 0.5 + y * f
    x, y, z = normalize(transform_vector(light.to_object, ng))
    u = 0.5 - math.atan2(x, y) * (0.5 / math.pi) if x != 0.0 or y != 0.0 else 0.0
    return u, 1.0 - math.acos(min(max(z, -1.0), 1.0)) / math.pi


@device
def _sphere_drop(light, d2):
    """1 - cos of the half angle of the cone of directions that `sample_ball` draws from outside a sphere."""
    drop = one_minus_cos(light.radius * light.radius / d2)
    if light.kind == LIGHT_SPOT:
        drop = min(drop, light.p[2])
    return drop


@device
def _sphere_distance(light, o, d):
    """Distance to the first intersection with the sphere from outside, to the only one from inside; -1: none."""
    c = sub(vec(light.center), o)
    b = dot(c, d)
    r2 = light.radius * light.radius
    off = madd(c, d, -b)
    h2 = r2 - dot(off, off)
    if h2 < 0.0:
        return -1.0
    if dot(c, c) > r2:
        return b - math.sqrt(h2)
    return b + math.sqrt(h2)


@device
def _sphere_cone(light, o):
    """(axis, 1 - cos of the half angle) of the cone in which o sees a sphere."""
    axis = sub(vec(light.center), o)
    d2 = dot(axis, axis)
    r2 = light.radius * light.radius
    if d2 <= r2:
        return (0.0, 0.0, 1.0) if d2 == 0.0 else normalize(axis), 2.0
    drop = _sphere_drop(light, d2)
    if drop < one_minus_cos(r2 / d2):  # the spot's cone is the narrower one
        return neg(spot_axis(light)), drop
    return normalize(axis), drop


@device
def _place_sphere(light, o, x, y, ls):
    c = vec(light.center)
    axis, drop = _sphere_cone(light, o)
    d = cone_at(axis, drop, x, y)
    t = _sphere_distance(light, o, d)
    if t < 0.0:
        if drop == 2.0 or light.kind == LIGHT_SPOT:
            return False
        t = max(dot(sub(c, o), d), 0.0)  # rounding at the rim
    ng = normalize(sub(madd(o, d, t), c))
    put(ls.wi, d)
    put(ls.ng, ng)
    put(ls.p, madd(c, ng, light.radius))
    ls.distance = t
    ls.pdf = 1.0 / (2.0 * math.pi * drop)
    return True


@device
def _place_disk(light, o, x, y, ls):
    c = vec(light.center)
    n = normalize(sub(o, c))
    p = c
    r = light.radius
    if light.flags & LIGHT_DELTA == 0:
        t, b = frame(n)
        p = madd(madd(c, t, x * r), b, y * r)
    w = sub(p, o)
    distance = length(w)
    if distance <= 0.0:
        return False
    d = scale(w, 1.0 / distance)
    put(ls.wi, d)
    put(ls.ng, (-d[0], -d[1], -d[2]))
    put(ls.p, p)
    ls.distance = distance
    ls.pdf = 1.0
    if light.flags & LIGHT_DELTA == 0:
        cos = -dot(n, d)
        if cos <= 0.0:
            return False
        ls.pdf = distance * distance / (cos * math.pi * r * r)
    return True


@device
def place_ball(light, o, x, y, ls):
    """Fill ls with the point that o sees at (x, y) of the lamp's unit disk; returns the factor on its strength.

    The disk is what turns towards o, or that of the cone in which o sees the sphere.
    """
    if light.flags & LIGHT_SPHERE:
        done = _place_sphere(light, o, x, y, ls)
    else:
        done = _place_disk(light, o, x, y, ls)
    if not done:
        return 0.0
    d = vec(ls.wi)
    factor = falloff(light, o, d)
    if light.flags & LIGHT_DELTA:
        factor /= ls.distance * ls.distance
    if light.material >= 0:
        ls.uv[0], ls.uv[1] = ball_uv(light, vec(ls.ng), d)
    return factor


@device
def ball_coordinates(light, o, d, t):
    """The point (x, y) of the unit disk for which `place_ball` gives the lamp's point at distance t along d from o."""
    if light.flags & LIGHT_DELTA:
        return 0.0, 0.0
    if light.flags & LIGHT_SPHERE:
        axis, drop = _sphere_cone(light, o)
        return cone_disk(axis, drop, d)
    c = sub(o, vec(light.center))
    a, b = frame(normalize(c))
    w = madd(c, d, t)
    return dot(w, a) / light.radius, dot(w, b) / light.radius


@device
def intersect_ball(light, o, d):
    """Distance along d to the lamp, -1: no hit."""
    c = sub(o, vec(light.center))
    along = dot(c, d)
    if light.kind == LIGHT_SPOT and along >= 0.0:
        return -1.0
    if light.flags & LIGHT_SPHERE:
        return _sphere_distance(light, o, d)
    # A disk through the centre, facing o.
    h2 = dot(c, c)
    if along >= 0.0 or h2 == 0.0:
        return -1.0
    t = -h2 / along
    off = madd(c, d, t)
    if dot(off, off) >= light.radius * light.radius:
        return -1.0
    return t


@device
def ball_pdf(light, o, d, t):
    """Density by solid angle with which `sample_ball` chooses direction d, which meets the lamp at distance t."""
    c = sub(o, vec(light.center))
    d2 = dot(c, c)
    r2 = light.radius * light.radius
    if light.flags & LIGHT_SPHERE:
        drop = _sphere_drop(light, d2) if d2 > r2 else 2.0
        return 1.0 / (2.0 * math.pi * drop)
    cos = -dot(c, d)
    if cos <= 0.0:
        return 0.0
    return t * t * math.sqrt(d2) / (cos * math.pi * r2)


@inlined
def see_ball(light, ls):
    """Complete ls, of which p, wi and distance are a ray's that meets the lamp; returns the factor on its strength."""
    o, d = vec(ls.p), vec(ls.wi)
    p = madd(o, d, ls.distance)
    ng = normalize(sub(p, vec(light.center))) if light.flags & LIGHT_SPHERE else neg(d)
    ls.pdf = ball_pdf(light, o, d, ls.distance)
    put(ls.p, p)
    put(ls.ng, ng)
    if light.material >= 0:
        ls.uv[0], ls.uv[1] = ball_uv(light, ng, d)
    return falloff(light, o, d)
