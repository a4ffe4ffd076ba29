"""Running a light's or the world's program in the shading point that the scratch memory keeps for it."""

import math

from ..core.jit import device, inlined
from ..core.records import (
    RAY_CAMERA,
    RAY_DIFFUSE,
    RAY_EMISSION,
    RAY_GLOSSY,
    RAY_REFLECT,
    RAY_TRANSMIT,
    RAY_VOLUME,
    shadow_point_in,
)
from ..core.vec import dot, neg, put, vec
from ..shading.interpreter import shader_eval


@inlined
def shadow_point(scratch, sp):
    """The scratch's second shading point with the path's depths, as next event estimation sees emission."""
    point = shadow_point_in(scratch)
    point.ray_flags = RAY_EMISSION
    point.depth = sp.depth
    point.diffuse_depth = sp.diffuse_depth
    point.glossy_depth = sp.glossy_depth
    point.transmission_depth = sp.transmission_depth
    point.transparent_depth = sp.transparent_depth
    point.n_closures = 0
    point.time = sp.time
    point.dp = 0.0
    point.dd = 0.0
    point.light = -1
    return point


@inlined
def run_emission(scene, point):
    """The emission of a prepared point; black without a program."""
    if point.material < 0:
        return (0.0, 0.0, 0.0)
    shader_eval(scene, point)
    return vec(point.emission)


@inlined
def off_surface(point, material, light, p, ng, d, t, u, v):
    """Make `point` a point of a lamp (or of the world, light -1) that a ray along d sees at distance t.

    u and v: texture coordinates. They are kept as barycentrics are: v in `point.u`, the complement in `point.v`.
    """
    wo = neg(d)
    point.instance = -1
    point.primitive = -1
    point.mesh = -1
    point.material = material
    point.light = light
    point.backfacing = 0
    if dot(ng, wo) < 0.0:
        ng = neg(ng)
        point.backfacing = 1
    point.t = t
    point.u = v
    point.v = 1.0 - u - v
    put(point.p, p)
    put(point.n, ng)
    put(point.ng, ng)
    put(point.wo, wo)
    put(point.dpdu, (0.0, 0.0, 0.0))
    put(point.dpdv, (0.0, 0.0, 0.0))


@inlined
def world_point(scene, point, d):
    """Make `point` the world in direction d; its position is the direction itself."""
    off_surface(point, scene.world_material, -1, d, neg(d), d, math.inf, 0.0, 0.0)


@inlined
def visible_to(seen_by, ray_flags):
    """Whether a light or the world with these RAY_* bits is seen by a ray with those; glossy means reflection only."""
    hidden = ray_flags & ~seen_by
    if hidden & (RAY_CAMERA | RAY_DIFFUSE | RAY_TRANSMIT | RAY_VOLUME):
        return False
    return not (hidden & RAY_GLOSSY and ray_flags & RAY_REFLECT)


@device
def luminance(r, g, b):
    """Luminance of scene-linear Rec. 709."""
    return 0.2126 * r + 0.7152 * g + 0.0722 * b
