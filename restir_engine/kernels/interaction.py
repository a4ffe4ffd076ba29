"""From a hit to a shading point, and from a shading point to the origin of the next ray."""

from .jit import device
from .memory import load_i32, load_u8, load_u32
from .records import DOMAIN_CORNER, instance_at, mesh_at
from .vec import (
    add,
    cross,
    dot,
    is_black,
    load3_f32,
    madd,
    neg,
    normalize,
    put,
    scale,
    sub,
    transform_normal,
    transform_point,
    transform_vector,
    vec,
)

# What single precision (Embree's rays, vertices and matrices) may be wrong by, relative to the largest of the numbers
# that a position is worked out from: sixteen units of the last place.
POSITION_ERROR = 16.0 * 2.0**-24


@device
def surface_point(scene, sp, instance, primitive, u, v, t, d):
    """Fill the geometry of `sp` at barycentrics (u, v) of a triangle that a ray along d (unit) hit at distance t.

    Normals and tangents are turned to the ray's side; the position comes from the triangle, not from the ray.
    """
    placed = instance_at(scene.instances, instance)
    mesh = mesh_at(scene.meshes, placed.mesh)
    a = load3_f32(mesh.vertices, load_u32(mesh.triangles, 3 * primitive))
    ab = sub(load3_f32(mesh.vertices, load_u32(mesh.triangles, 3 * primitive + 1)), a)
    ac = sub(load3_f32(mesh.vertices, load_u32(mesh.triangles, 3 * primitive + 2)), a)
    p = transform_point(placed.to_world, madd(madd(a, ab, u), ac, v))
    ab_world = transform_vector(placed.to_world, ab)
    ac_world = transform_vector(placed.to_world, ac)
    wo = neg(d)

    flat = cross(ab, ac)
    ng = normalize(transform_normal(placed.to_object, flat))
    if is_black(ng):  # a triangle without area
        ng = wo
    n = normalize(transform_normal(placed.to_object, object_normal(mesh, primitive, u, v)))
    if is_black(n):
        n = ng

    sp.backfacing = 0
    if dot(ng, wo) < 0.0:
        sp.backfacing = 1
        ng = neg(ng)
        n = neg(n)
        ab_world = neg(ab_world)
        ac_world = neg(ac_world)

    sp.instance = instance
    sp.primitive = primitive
    sp.mesh = placed.mesh
    sp.light = -1
    sp.material = _material(scene, placed, mesh, primitive)
    sp.t = t
    sp.u = u
    sp.v = v
    put(sp.p, p)
    sp.error = POSITION_ERROR * _magnitude(placed.to_world, max(largest(a), max(largest(ab), largest(ac))))
    put(sp.n, n)
    put(sp.ng, ng)
    put(sp.wo, wo)
    put(sp.dpdu, ab_world)
    put(sp.dpdv, ac_world)


@device
def object_normal(mesh, primitive, u, v):
    """The interpolated normal of a smooth triangle in object space, not normalised; zero for a flat one."""
    if mesh.normals == 0:
        return (0.0, 0.0, 0.0)
    if mesh.smooth != 0 and load_u8(mesh.smooth, primitive) == 0:
        return (0.0, 0.0, 0.0)
    table = mesh.corners if mesh.normals_domain == DOMAIN_CORNER else mesh.triangles
    a = load3_f32(mesh.normals, load_u32(table, 3 * primitive))
    b = load3_f32(mesh.normals, load_u32(table, 3 * primitive + 1))
    c = load3_f32(mesh.normals, load_u32(table, 3 * primitive + 2))
    return add(scale(a, 1.0 - u - v), add(scale(b, u), scale(c, v)))


@device
def _material(scene, placed, mesh, primitive):
    slot = 0
    if mesh.material_slots != 0:
        slot = max(0, min(load_i32(mesh.material_slots, primitive), placed.n_materials - 1))
    return load_i32(scene.material_slots, placed.materials + slot)


@device
def largest(a):
    """The largest absolute component."""
    return max(abs(a[0]), max(abs(a[1]), abs(a[2])))


@device
def _magnitude(m, size):
    """A bound of the terms that add up to the image of a point whose coordinates are not larger than `size`."""
    x = (abs(m[0]) + abs(m[1]) + abs(m[2])) * size + abs(m[3])
    y = (abs(m[4]) + abs(m[5]) + abs(m[6])) * size + abs(m[7])
    z = (abs(m[8]) + abs(m[9]) + abs(m[10])) * size + abs(m[11])
    return max(x, max(y, z))


@device
def offset_origin(sp, wi):
    """The origin of a ray that leaves the surface towards wi: off it by the position's error, on the side of wi."""
    ng = vec(sp.ng)
    return madd(vec(sp.p), ng, sp.error if dot(ng, wi) >= 0.0 else -sp.error)
