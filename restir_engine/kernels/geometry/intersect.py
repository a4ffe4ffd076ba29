"""Rays against the scene: Embree's queries, called by symbol."""

from numba import types

from ...embree import library
from ..core.jit import inlined
from ..core.memory import call_entry, load_f32, load_i64, load_u32, record_address, store_f32, store_i64, store_u32
from ..core.records import SCRATCH_RAY, SCRATCH_SHADOW_RAY, SHAPE_ENTRIES, SHAPE_HIT

library.load()  # registers the symbols that compiled code refers to

_QUERY = types.void(types.int64, types.int64, types.int64)
rtc_intersect1 = types.ExternalFunction("restir_rtcIntersect1", _QUERY)
rtc_occluded1 = types.ExternalFunction("restir_rtcOccluded1", _QUERY)

INVALID = 0xFFFFFFFF
_INVOKE_FILTER = 2  # RTC_RAY_QUERY_FLAG_INVOKE_ARGUMENT_FILTER
_ALL_FEATURES = 0xFFFFFFFF
CONTEXT = 64  # where the context of a query stands behind its arguments; both are 64 bytes
FIRST_OWN = 2  # the first word (64 bits) of a context that is not Embree's


@inlined
def put_ray(ray, o, d, tmin, tmax, mask, time):
    """Fill an RTCRay; its layout is that of embree4/rtcore_ray.h."""
    store_f32(ray, 0, o[0])
    store_f32(ray, 1, o[1])
    store_f32(ray, 2, o[2])
    store_f32(ray, 3, tmin)
    store_f32(ray, 4, d[0])
    store_f32(ray, 5, d[1])
    store_f32(ray, 6, d[2])
    store_f32(ray, 7, time)
    store_f32(ray, 8, tmax)
    store_u32(ray, 9, mask)
    store_u32(ray, 10, 0)
    store_u32(ray, 11, 0)


@inlined
def put_filter(arguments, code):
    """Fill a query's arguments (RTCIntersectArguments, RTCOccludedArguments) and its context at an address.

    code: the address of a filter (RTCFilterFunctionNArguments), which finds the context's own words from FIRST_OWN on.
    """
    context = arguments + CONTEXT
    store_u32(arguments, 0, _INVOKE_FILTER)
    store_u32(arguments, 1, _ALL_FEATURES)
    store_i64(arguments, 1, context)
    store_i64(arguments, 2, code)
    store_i64(arguments, 3, 0)
    store_i64(arguments, 4, 0)
    store_i64(context, 0, -1)
    store_i64(context, 1, -1)


@inlined
def trace(scene, scratch, o, d, tmin, tmax, mask):
    """Find the nearest hit of a ray, for `nearest`. mask: RAY_* bits; instances that share none are invisible."""
    ray = scratch + SCRATCH_RAY
    start(ray, o, d, tmin, tmax, mask, scene.time)
    rtc_intersect1(scene.embree, ray, 0)
    complete(scene, ray)


@inlined
def start(ray, o, d, tmin, tmax, mask, time):
    """Fill an RTCRayHit that has hit nothing so far."""
    put_ray(ray, o, d, tmin, tmax, mask, time)
    store_u32(ray, 18, INVALID)
    store_u32(ray, 19, INVALID)


@inlined
def complete(scene, ray):
    """Let the code of a shape that was hit have its say."""
    shape = load_u32(ray, 18)
    # Instances are structures of one geometry, whose ID is its shape; in the world itself stand triangles.
    if shape != 0 and load_u32(ray, 19) != INVALID:
        entry = load_i64(scene.shape_entries, SHAPE_ENTRIES * shape + SHAPE_HIT)
        call_entry(entry, record_address(scene), ray, 0, 0, 0)


@inlined
def nearest(scratch):
    """What the last ray hit: (t, instance, primitive, u, v); instance -1 and t the ray's end where it hit nothing."""
    ray = scratch + SCRATCH_RAY
    geometry = load_u32(ray, 18)
    if geometry == INVALID:
        return load_f32(ray, 8), -1, -1, 0.0, 0.0
    instance = load_u32(ray, 19)
    if instance == INVALID:  # triangles that stand in the world themselves
        instance = geometry
    return load_f32(ray, 8), instance, load_u32(ray, 17), load_f32(ray, 15), load_f32(ray, 16)


@inlined
def put_nearest(scratch, t, instance, primitive, u, v):
    """Let `nearest` tell of a hit that was found before."""
    ray = scratch + SCRATCH_RAY
    store_f32(ray, 8, t)
    store_f32(ray, 15, u)
    store_f32(ray, 16, v)
    store_u32(ray, 17, primitive)
    store_u32(ray, 18, instance)
    store_u32(ray, 19, INVALID)


@inlined
def intersect(scene, scratch, o, d, tmin, tmax, mask):
    """Nearest hit of a ray: (t, instance, primitive, u, v); see `trace` and `nearest`."""
    trace(scene, scratch, o, d, tmin, tmax, mask)
    return nearest(scratch)


@inlined
def occluded(scene, scratch, o, d, tmax, mask):
    """Whether anything visible to `mask` lies on the segment of length tmax."""
    ray = scratch + SCRATCH_SHADOW_RAY
    put_ray(ray, o, d, 0.0, tmax, mask, scene.time)
    rtc_occluded1(scene.embree, ray, 0)
    return load_f32(ray, 8) < 0.0
