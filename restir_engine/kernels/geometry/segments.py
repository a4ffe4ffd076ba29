"""Segments from one point, eight at a time: which of them are free of one object's surface.

Embree follows a packet of rays of one origin in half the time that it takes for each by itself. Processors without
vectors of eight numbers are served by its own emulation.
"""

from numba import types

from ...embree import library
from ..core.jit import inlined
from ..core.memory import load_f32, store_f32, store_i64, store_u32
from ..core.records import RAY_ALL
from ..core.records.scratch import shared_area
from .intersect import CONTEXT

library.load()  # registers the symbol that compiled code refers to

_QUERY = types.void(types.int64, types.int64, types.int64, types.int64)
rtc_occluded8 = types.ExternalFunction("restir_rtcOccluded8", _QUERY)

AT_ONCE = 8
_COHERENT, _ALL_FEATURES = 1 << 16, 0xFFFFFFFF
# Behind one another: RTCRay8, which rays are valid (int32 [8]), RTCOccludedArguments and its context.
_VALID, _ARGUMENTS = 12 * 4 * AT_ONCE, 12 * 4 * AT_ONCE + 64
SEGMENTS_BYTES = _ARGUMENTS + CONTEXT + 64
_SEGMENTS = shared_area(1024 + SEGMENTS_BYTES) + 1024  # behind what walks note


@inlined
def begin_segments(scratch):
    """Make room for up to AT_ONCE segments; their address."""
    segments = scratch + _SEGMENTS
    arguments = segments + _ARGUMENTS
    store_u32(arguments, 0, _COHERENT)
    store_u32(arguments, 1, _ALL_FEATURES)
    for word in (1, 2, 3):
        store_i64(arguments, word, 0)
    store_i64(arguments, 1, arguments + CONTEXT)
    for word in (0, 1):
        store_i64(arguments + CONTEXT, word, -1)
    for k in range(AT_ONCE):
        store_u32(segments + _VALID, k, 0)
    return segments


@inlined
def put_segment(segments, k, o, d, near, far, time):
    """The k-th segment: o + d x for x from `near` to `far`, in object space."""
    store_f32(segments, k, o[0])
    store_f32(segments, AT_ONCE + k, o[1])
    store_f32(segments, 2 * AT_ONCE + k, o[2])
    store_f32(segments, 3 * AT_ONCE + k, near)
    store_f32(segments, 4 * AT_ONCE + k, d[0])
    store_f32(segments, 5 * AT_ONCE + k, d[1])
    store_f32(segments, 6 * AT_ONCE + k, d[2])
    store_f32(segments, 7 * AT_ONCE + k, time)
    store_f32(segments, 8 * AT_ONCE + k, far)
    store_u32(segments, 9 * AT_ONCE + k, RAY_ALL)
    store_u32(segments, 10 * AT_ONCE + k, 0)
    store_u32(segments, 11 * AT_ONCE + k, 0)
    store_u32(segments + _VALID, k, 0xFFFFFFFF)


@inlined
def trace_segments(structure, segments):
    """Find which segments are free of the surface in a structure, for `is_free`."""
    rtc_occluded8(segments + _VALID, structure, segments, segments + _ARGUMENTS)


@inlined
def is_free(segments, k):
    """Whether the k-th segment has met nothing."""
    return load_f32(segments, 8 * AT_ONCE + k) >= 0.0
