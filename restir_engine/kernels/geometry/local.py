"""Rays against one object alone, in its mesh's own acceleration structure: subsurface scattering never leaves it.

Rays are given in world space and traced in object space with a direction that is not normalised there, so that
distances stay those of the world. `trace` takes rays that are in object space already.
"""

from ..core.jit import device, inlined
from ..core.memory import load_f32, load_u32, store_u32
from ..core.records import RAY_ALL, SCRATCH_RAY, mesh_at
from ..core.vec import load3_f32, normalize, transform_normal, transform_point, transform_vector
from .intersect import INVALID, put_ray, rtc_intersect1
from .placed import placed_at


@inlined
def local_ray(scene, ray, instance, o, d, tmin, tmax):
    """Fill an RTCRayHit for a query of one instance; its acceleration structure, 0 when it has none."""
    placed = placed_at(scene, instance)
    o, d = transform_point(placed.to_object, o), transform_vector(placed.to_object, d)
    put_ray(ray, o, d, tmin, tmax, RAY_ALL, scene.time)
    store_u32(ray, 18, INVALID)
    store_u32(ray, 19, INVALID)
    return mesh_at(scene.meshes, placed.mesh).embree


@inlined
def trace(structure, time, ray, o, d, tmin, tmax):
    """The primitive that a ray in object space hits first, -1: none; t, u and v stand in the RTCRayHit."""
    put_ray(ray, o, d, tmin, tmax, RAY_ALL, time)
    store_u32(ray, 18, INVALID)
    store_u32(ray, 19, INVALID)
    rtc_intersect1(structure, ray, 0)
    return -1 if load_u32(ray, 18) == INVALID else load_u32(ray, 17)


@inlined
def hit_distance(ray):
    """t of the hit in an RTCRayHit."""
    return load_f32(ray, 8)


@inlined
def hit_barycentrics(ray):
    """(u, v) of the hit in an RTCRayHit."""
    return load_f32(ray, 15), load_f32(ray, 16)


@inlined
def hit_normal(scene, scratch, instance):
    """The unit normal, by the mesh's winding, of the triangle that local_intersect has hit last; it may be zero."""
    n = load3_f32(scratch + SCRATCH_RAY, 4)
    return normalize(transform_normal(placed_at(scene, instance).to_object, n))


@device
def local_intersect(scene, scratch, instance, o, d, tmin, tmax):
    """Nearest hit with one instance: (t, primitive, u, v); primitive -1 where nothing is hit."""
    ray = scratch + SCRATCH_RAY
    placed = placed_at(scene, instance)
    structure = mesh_at(scene.meshes, placed.mesh).embree
    if structure == 0:
        return tmax, -1, 0.0, 0.0
    o, d = transform_point(placed.to_object, o), transform_vector(placed.to_object, d)
    primitive = trace(structure, scene.time, ray, o, d, tmin, tmax)
    if primitive < 0:
        return tmax, -1, 0.0, 0.0
    u, v = hit_barycentrics(ray)
    return hit_distance(ray), primitive, u, v
