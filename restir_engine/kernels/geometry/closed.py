"""Closed shapes, spheres and cones: Cycles does not let rays meet them from within."""

from ..core.jit import entry
from ..core.memory import load_f32, load_i64, store_i32


@entry
def outside_filter(arguments):
    """Embree's filter (RTCFilterFunctionNArguments) that refuses surfaces behind which the ray comes from."""
    valid, ray, hit = load_i64(arguments, 0), load_i64(arguments, 3), load_i64(arguments, 4)
    cosine = 0.0
    for k in range(3):
        cosine += load_f32(ray, 4 + k) * load_f32(hit, k)
    if cosine > 0.0:
        store_i32(valid, 0, 0)
