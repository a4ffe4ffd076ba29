"""Rays that leave an object through its surface, and what touches it there: a floor under glass, under skin.

Origins of rays lie off the surface by what positions may be wrong by, beyond whatever lies as near. So a ray that comes
out of an object begins before that surface, and is let through what is the object's own until it has left it. So does
what goes back from a surface that is touched. Other rays that go back need none of this: what touches their surface
would have been met before.
"""

from ..core.jit import entry, inlined
from ..core.memory import load_f32, load_f64, load_i64, load_u32, store_f32, store_f64, store_i64, store_u32
from ..core.records import SCRATCH_LEAVING, SCRATCH_RAY, SCRATCH_SHADOW_RAY
from ..core.vec import dot, madd, vec
from .intersect import (
    CONTEXT,
    FIRST_OWN,
    INVALID,
    complete,
    occluded,
    put_filter,
    put_ray,
    rtc_intersect1,
    rtc_occluded1,
    start,
)

_INSTANCE, _UNTIL = FIRST_OWN, FIRST_OWN + 1  # in the context that the filter is given
_MARGIN, _GRAZING = 2.5, 1e-2  # of the position's error, and the least cosine that it is divided by


@entry
def own_filter(arguments):
    """Embree's filter (RTCFilterFunctionNArguments, one ray) that refuses what is the object's own, at the start."""
    context, ray, hit = load_i64(arguments, 2), load_i64(arguments, 3), load_i64(arguments, 4)
    instance = load_u32(hit, 7)
    if instance == INVALID:
        instance = load_u32(hit, 6)
    if instance == load_i64(context, _INSTANCE) and load_f32(ray, 8) <= load_f64(context, _UNTIL):
        store_u32(load_i64(arguments, 0), 0, 0)


@inlined
def run_up(sp, wi):
    """How far before its origin a ray from sp towards wi (unit) has to begin; 0: it does not come out of the object."""
    cos = dot(vec(sp.ng), wi)
    if sp.touches == 0 and (cos < 0.0) == (sp.from_inside != 0):
        return 0.0
    return _MARGIN * sp.error / max(abs(cos), _GRAZING)


@inlined
def _arguments(scene, scratch, instance, until):
    """The address of the arguments of a query by which an instance is left."""
    arguments = scratch + SCRATCH_LEAVING
    put_filter(arguments, scene.own_filter)
    store_i64(arguments + CONTEXT, _INSTANCE, instance)
    store_f64(arguments + CONTEXT, _UNTIL, until)
    return arguments


@inlined
def trace_leaving(scene, scratch, o, d, before, tmax, mask, instance):
    """As `trace`, of a ray that begins so far before its origin and leaves an instance."""
    ray = scratch + SCRATCH_RAY
    start(ray, madd(o, d, -before), d, 0.0, tmax + before, mask, scene.time)
    rtc_intersect1(scene.embree, ray, _arguments(scene, scratch, instance, before))
    complete(scene, ray)
    store_f32(ray, 8, max(load_f32(ray, 8) - before, 0.0))


@inlined
def occluded_from(scene, scratch, sp, o, d, tmax, mask):
    """As `occluded`, of a ray from o on the surface sp, whatever that touches there."""
    before = run_up(sp, d)
    if before > 0.0:
        return _occluded_leaving(scene, scratch, o, d, before, tmax, mask, sp.instance)
    return occluded(scene, scratch, o, d, tmax, mask)


@inlined
def _occluded_leaving(scene, scratch, o, d, before, tmax, mask, instance):
    """As `occluded`, of a ray that begins so far before its origin and leaves an instance."""
    ray = scratch + SCRATCH_SHADOW_RAY
    put_ray(ray, madd(o, d, -before), d, 0.0, tmax + before, mask, scene.time)
    rtc_occluded1(scene.embree, ray, _arguments(scene, scratch, instance, before))
    return load_f32(ray, 8) < 0.0
