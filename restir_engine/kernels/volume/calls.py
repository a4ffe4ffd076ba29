"""Where integrators meet media: small tests, and calls of the code that `entries` compiles for scenes with media.

INTEGRATOR.media is a table of that code, in the order of the numbers below. Each gets the addresses of the SCENE, the
INTEGRATOR, the FILM, the scratch memory and one more argument; PATH and SHADING_POINT are those of the scratch. SEGMENT
returns the path's next event.
"""

import math

from ..core.jit import inlined
from ..core.memory import call_entry, call_for_outcome, load_i64, record_address
from ..core.records import (
    MATERIAL_BOUNDARY,
    MATERIAL_MEDIUM,
    RAY_CAMERA,
    SCENE_HAS_MEDIA,
    SCENE_HAS_TRANSPARENT,
    SCRATCH_MEDIA,
    SCRATCH_SHADOW,
    material_at,
    media_at,
    shadow_at,
)
from ..core.vec import dot, mul, put, vec
from ..path.state import ARRIVES, DIMENSIONS, next_after

BEGIN, AROUND, SEGMENT, CROSS, SHADOW_RAY, TRACK, THROUGH, BESIDE_LAMPS = range(8)

_MOST_BOUNDARIES = 1024  # invisible boundaries that a path may pass, as in Cycles


@inlined
def _call(which, scene, integrator, film, scratch, argument):
    code = load_i64(integrator.media, which)
    call_entry(code, record_address(scene), record_address(integrator), film, scratch, argument)


@inlined
def goes_behind(scene, sp, d):
    """Whether a ray along d from a point crosses the boundary of a medium there; scattering points have no surface."""
    if sp.instance < 0 or not material_at(scene.materials, sp.material).flags & MATERIAL_MEDIUM:
        return False
    return dot(vec(sp.ng), d) < 0.0


@inlined
def start_segment(scene, integrator, scratch, path, sp):
    """Before the path's ray is traced: find the media that it starts in, sp being the surface that it leaves.

    Only here does a path cross boundaries: where its ray goes on behind the surface.
    """
    if not scene.flags & SCENE_HAS_MEDIA:
        return
    if path.flags & RAY_CAMERA and path.tmin == 0.0:
        media_at(scratch + SCRATCH_MEDIA, 0).count = 0
        if scene.camera_in_media:
            _call(BEGIN, scene, integrator, 0, scratch, 0)
    elif goes_behind(scene, sp, vec(path.d)):
        _call(CROSS, scene, integrator, 0, scratch, 0)


@inlined
def media_around(scene, integrator, scratch, path, sp):
    """Find the media before the surface at sp, where another kernel takes up a path that was left there."""
    if not scene.flags & SCENE_HAS_MEDIA:
        return
    media_at(scratch + SCRATCH_MEDIA, 0).count = 0
    if scene.camera_in_media or path.bounce + path.boundaries + path.transparent_bounce > 0:
        _call(AROUND, scene, integrator, 0, scratch, record_address(sp))


@inlined
def pass_media(scene, integrator, film, scratch, path, t, instance):
    """Follow the path through media to where its ray ends at t (instance -1: never), and return its next event.

    ARRIVES: it gets there. GOES_ON: it has scattered, direct light has been added, and it has its next ray. Or ENDS.
    """
    if not scene.flags & SCENE_HAS_MEDIA or media_at(scratch + SCRATCH_MEDIA, 0).count == 0:
        return ARRIVES
    path.t = t
    code = load_i64(integrator.media, SEGMENT)
    addresses = record_address(scene), record_address(integrator), record_address(film)
    return call_for_outcome(code, addresses[0], addresses[1], addresses[2], scratch, instance)


@inlined
def through_media(scene, integrator, scratch, path, t):
    """The share of light from the distance t on the path's ray that reaches its origin through the present media."""
    if not scene.flags & SCENE_HAS_MEDIA or media_at(scratch + SCRATCH_MEDIA, 0).count == 0:
        return (1.0, 1.0, 1.0)
    media = media_at(scratch + SCRATCH_MEDIA, 0)
    s = max(t - segment_start(path), 0.0)
    share = (math.exp(-media.sigma_t[0] * s), math.exp(-media.sigma_t[1] * s), math.exp(-media.sigma_t[2] * s))
    if media.varying > 0:
        ray = shadow_at(scratch + SCRATCH_SHADOW, 0)
        put(ray.o, vec(path.o))
        put(ray.d, vec(path.d))
        share = mul(share, through_varying(scene, integrator, scratch, scratch + SCRATCH_MEDIA, t - s, t))
    return share


@inlined
def through_varying(scene, integrator, scratch, media, begin, end):
    """The same, by an estimate, of the media at an address that vary, for a part of the scratch's SHADOW."""
    ray = shadow_at(scratch + SCRATCH_SHADOW, 0)
    ray.begin = begin
    ray.end = end
    before = vec(ray.transmittance)
    _call(THROUGH, scene, integrator, 0, scratch, media)
    result = vec(ray.transmittance)
    put(ray.transmittance, before)
    return result


@inlined
def segment_start(path):
    """Where on the path's ray the present media begin."""
    return path.medium_start if path.tmin > 0.0 else 0.0


@inlined
def is_hidden(scene, media, material):
    """Whether a boundary does not exist for a ray: nothing but a boundary, or inside a medium of higher priority."""
    record = material_at(scene.materials, material)
    return record.flags & MATERIAL_BOUNDARY != 0 or (media.count > 0 and media.top > record.medium_priority)


@inlined
def pass_boundary(scene, scratch, path, sp):
    """Whether the path goes straight on at sp, where a medium has its boundary."""
    if not is_hidden(scene, media_at(scratch + SCRATCH_MEDIA, 0), sp.material):
        return False
    path.boundaries += 1
    if path.boundaries > _MOST_BOUNDARIES:
        return False
    path.tmin = next_after(sp.t)
    path.dimension += DIMENSIONS
    return True


@inlined
def media_transmittance(scene, integrator, scratch, sp, o, d, tmax):
    """The share of light that a shadow ray lets through in a scene with media; sp as in `shadow.transmittance`."""
    inside = media_at(scratch + SCRATCH_MEDIA, 0).count > 0 or goes_behind(scene, sp, d)
    if not inside and not scene.flags & SCENE_HAS_TRANSPARENT:
        return (1.0, 1.0, 1.0)
    shadow = shadow_at(scratch + SCRATCH_SHADOW, 0)
    put(shadow.o, o)
    put(shadow.d, d)
    shadow.tmax = tmax
    _call(SHADOW_RAY, scene, integrator, 0, scratch, record_address(sp))
    return vec(shadow.transmittance)
