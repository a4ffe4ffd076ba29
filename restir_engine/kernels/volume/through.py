"""Shadow rays through media, and the media around a point."""

from ..core.jit import device
from ..core.memory import copy_words, record_address
from ..core.records import (
    MATERIAL_MEDIUM,
    MAX_MEDIA,
    RAY_CAMERA,
    RAY_SHADOW,
    SCENE_HAS_TRANSPARENT,
    SCRATCH_MEDIA,
    SCRATCH_SHADOW,
    SCRATCH_SHADOW_MEDIA,
    SCRATCH_SHADOW_POINT,
    SHADING_POINT,
    light_sample_in,
    material_at,
    media_at,
    shadow_at,
    shadow_point_in,
)
from ..core.vec import max3, mul, put, vec
from ..geometry.intersect import intersect
from ..geometry.surface import surface_point
from ..lights.linking import transparent_blockers
from ..path.state import FAR, inherit, next_after
from ..shading.interpreter import shader_eval
from .calls import goes_behind, is_hidden, through_varying
from .stack import copy_for_shadow, cross, decay, enter, find, only_world

_POINT_WORDS = SHADING_POINT.itemsize // 8


@device
def cross_at(scene, integrator, scratch, media, sp):
    """Go through the boundary at sp, which keeps its closures."""
    copy_words(scratch + SCRATCH_SHADOW_POINT, record_address(sp), _POINT_WORDS)
    cross(scene, integrator, media, shadow_point_in(scratch))


@device
def shadow_through_media(scene, integrator, scratch, path, sp):
    """Fill `transmittance` of the scratch's SHADOW: through media and surfaces that let light through."""
    ray = shadow_at(scratch + SCRATCH_SHADOW, 0)
    o = vec(ray.o)
    d = vec(ray.d)
    media = scratch + SCRATCH_SHADOW_MEDIA
    inside = media_at(media, 0)
    copy_for_shadow(scene, scratch + SCRATCH_MEDIA, media)
    if goes_behind(scene, sp, d):
        cross_at(scene, integrator, scratch, media, sp)
    put(ray.transmittance, (0.0, 0.0, 0.0))
    result = (1.0, 1.0, 1.0)
    tmin = 0.0
    start = 0.0
    mask = transparent_blockers(light_sample_in(scratch).blockers)
    for crossed in range(integrator.transparent_bounces - path.transparent_bounce):
        t, instance, primitive, u, v = ray.tmax, -1, -1, 0.0, 0.0
        if scene.flags & SCENE_HAS_TRANSPARENT:
            t, instance, primitive, u, v = intersect(scene, scratch, o, d, tmin, ray.tmax, mask)
        if inside.count > 0:
            result = mul(result, decay(vec(inside.sigma_t), t - start))
            if inside.varying > 0:
                result = mul(result, through_varying(scene, integrator, scratch, media, start, t))
        if instance < 0:
            put(ray.transmittance, result)
            return
        point = shadow_point_in(scratch)
        inherit(point, path, t)
        surface_point(scene, point, instance, primitive, u, v, t, d)
        point.depth = path.bounce
        point.transparent_depth = path.transparent_bounce + crossed
        point.ray_flags = (path.flags & ~RAY_CAMERA) | RAY_SHADOW
        if not is_hidden(scene, inside, point.material):
            shader_eval(scene, point)
            result = mul(result, vec(point.transparent))
        if max3(result) <= 0.0:
            return
        if material_at(scene.materials, point.material).flags & MATERIAL_MEDIUM:
            cross(scene, integrator, media, point)
        start = t
        tmin = next_after(t)


@device
def find_world_medium(scene, integrator, scratch, path, o):
    """Fill the MEDIA at o with the world's alone."""
    point = shadow_point_in(scratch)
    inherit(point, path, 0.0)
    put(point.p, o)
    only_world(scene, integrator, scratch + SCRATCH_MEDIA, point)


@device
def find_media_along(scene, integrator, scratch, path, end):
    """Fill the MEDIA at the distance `end` on a path's ray from the camera, which has passed boundaries alone.

    They are those that the path has found on its way, also where meshes are not closed.
    """
    media = scratch + SCRATCH_MEDIA
    media_at(media, 0).count = 0
    if scene.camera_in_media:
        find_media(scene, integrator, scratch, path, vec(path.o))
    point = shadow_point_in(scratch)
    tmin = 0.0
    for _ in range(path.boundaries + path.transparent_bounce):
        t, instance, primitive, u, v = intersect(scene, scratch, vec(path.o), vec(path.d), tmin, end, RAY_CAMERA)
        if instance < 0 or t >= end:
            return
        tmin = next_after(t)
        inherit(point, path, t)
        surface_point(scene, point, instance, primitive, u, v, t, vec(path.d))
        if material_at(scene.materials, point.material).flags & MATERIAL_MEDIUM:
            cross(scene, integrator, media, point)


@device
def find_media(scene, integrator, scratch, path, o):
    """Fill the MEDIA around o: the world's, and those of meshes that a ray upwards leaves without entering."""
    find_world_medium(scene, integrator, scratch, path, o)
    media = scratch + SCRATCH_MEDIA
    entered = scratch + SCRATCH_SHADOW_MEDIA
    media_at(entered, 0).count = 0
    point = shadow_point_in(scratch)
    tmin = 0.0
    for _ in range(4 * MAX_MEDIA):
        d = (0.0, 0.0, 1.0)
        t, instance, primitive, u, v = intersect(scene, scratch, o, d, tmin, FAR, RAY_CAMERA)
        if instance < 0:
            return
        tmin = next_after(t)
        inherit(point, path, t)
        surface_point(scene, point, instance, primitive, u, v, t, d)
        if not material_at(scene.materials, point.material).flags & MATERIAL_MEDIUM:
            continue
        if point.backfacing == 0:
            enter(scene, integrator, entered, point)
        elif find(entered, instance, point.material) < 0:
            enter(scene, integrator, media, point)
