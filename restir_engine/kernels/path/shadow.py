"""Shadow rays: what share of a light's radiance arrives."""

from ..core.jit import device, inlined
from ..core.records import (
    LIGHT_SAMPLE_NO_SHADOW,
    RAY_CAMERA,
    RAY_SHADOW,
    SCENE_HAS_MEDIA,
    SCENE_HAS_TRANSPARENT,
    light_sample_in,
    shadow_point_in,
)
from ..core.vec import length, max3, mul, scale, sub, vec
from ..geometry.intersect import intersect, occluded
from ..geometry.leaving import occluded_from
from ..geometry.surface import shadow_origin, surface_point
from ..lights.linking import opaque_blockers, transparent_blockers
from ..shading.interpreter import shader_eval
from ..volume.calls import media_transmittance
from .state import FAR, inherit, next_after


@inlined
def light_visibility(scene, integrator, scratch, path, sp):
    """V by channel between sp and the scratch's LIGHT_SAMPLE; 1 of light that casts no shadow."""
    ls = light_sample_in(scratch)
    if ls.flags & LIGHT_SAMPLE_NO_SHADOW:
        return (1.0, 1.0, 1.0)
    return transmittance(scene, integrator, scratch, path, sp, vec(ls.wi), ls.distance, vec(ls.p))


@inlined
def transmittance(scene, integrator, scratch, path, sp, wi, distance, target):
    """The share of a LIGHT_SAMPLE's light that a shadow ray lets through: (0, 0, 0) behind anything opaque.

    sp is a point of a surface, or one where a medium scatters (instance -1).
    """
    o = shadow_origin(scene, sp, wi) if sp.instance >= 0 else vec(sp.p)
    d = wi
    tmax = FAR
    if distance < FAR:
        d = sub(target, o)
        tmax = length(d)
        d = scale(d, 1.0 / tmax)
        tmax *= 1.0 - 2.0e-5
    mask = opaque_blockers(light_sample_in(scratch).blockers)
    if sp.instance >= 0:
        is_dark = occluded_from(scene, scratch, sp, o, d, tmax, mask)
    else:
        is_dark = occluded(scene, scratch, o, d, tmax, mask)
    if is_dark:
        return (0.0, 0.0, 0.0)
    if scene.flags & SCENE_HAS_MEDIA:
        return media_transmittance(scene, integrator, scratch, sp, o, d, tmax)
    if scene.flags & SCENE_HAS_TRANSPARENT:
        return transparent_shadow(scene, integrator, scratch, path, o, d, tmax)
    return (1.0, 1.0, 1.0)


@device
def transparent_shadow(scene, integrator, scratch, path, o, d, tmax):
    """Transmittance through surfaces that may be transparent, nearest first."""
    point = shadow_point_in(scratch)
    mask = transparent_blockers(light_sample_in(scratch).blockers)
    result = (1.0, 1.0, 1.0)
    tmin = 0.0
    for crossed in range(integrator.transparent_bounces - path.transparent_bounce):
        t, instance, primitive, u, v = intersect(scene, scratch, o, d, tmin, tmax, mask)
        if instance < 0:
            return result
        inherit(point, path, t)
        surface_point(scene, point, instance, primitive, u, v, t, d)
        point.depth = path.bounce
        point.transparent_depth = path.transparent_bounce + crossed
        point.ray_flags = (path.flags & ~RAY_CAMERA) | RAY_SHADOW
        shader_eval(scene, point)
        result = mul(result, vec(point.transparent))
        if max3(result) <= 0.0:
            return result
        tmin = next_after(t)
    return (0.0, 0.0, 0.0)
