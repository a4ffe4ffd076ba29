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
)

# What single precision (Embree's rays, vertices and matrices) may be wrong by, relative to a coordinate: sixteen units of
# the last place. Four are the worst measured for a ray that starts on a triangle through an instance's matrix.
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
def offset_origin(p, ng, wi):
    """The origin of a ray that leaves p towards wi, off the surface with normal ng on the side of wi.

    The distance is the error of a position of this size; that of a position near the world's origin is taken for 1/8.
    """
    size = max(0.125, max(abs(p[0]), max(abs(p[1]), abs(p[2]))))
    distance = POSITION_ERROR * size
    return madd(p, ng, distance if dot(ng, wi) >= 0.0 else -distance)
