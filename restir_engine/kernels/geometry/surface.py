"""From a hit to a shading point, and from a shading point to the origin of the next ray."""

from ..core.jit import device, inlined
from ..core.memory import call_entry, load_i32, load_i64, load_u8, load_u32, record_address
from ..core.records import DOMAIN_CORNER, SHAPE_ENTRIES, SHAPE_SURFACE, SHAPE_TRIANGLES, mesh_at
from ..core.vec import (
    add,
    cross,
    dot,
    is_black,
    length,
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
from .placed import corners, normal, placed_at

# What single precision (Embree's rays, vertices and matrices) may be wrong by, relative to the largest of the numbers
# that a position is worked out from: sixteen units of the last place.
POSITION_ERROR = 16.0 * 2.0**-24


@inlined
def _corner_and_edges(mesh, time, primitive):
    """The first corner of a triangle and the edges to the two others, in object space."""
    a, b, c = corners(mesh, time, primitive)
    return a, sub(b, a), sub(c, a)


@inlined
def surface_point(scene, sp, instance, primitive, u, v, t, d):
    """Fill the geometry of `sp` at (u, v) of a primitive that a ray along d (unit) hit at distance t.

    Normals and tangents are turned to the ray's side; the position comes from the primitive, not from the ray.
    """
    placed = placed_at(scene, instance)
    mesh = mesh_at(scene.meshes, placed.mesh)
    sp.instance = instance
    sp.primitive = primitive
    sp.mesh = placed.mesh
    sp.light_set = placed.light_set
    sp.shape = mesh.shape
    sp.light = -1
    sp.material = primitive_material(scene, placed, mesh, primitive)
    sp.terminator_frequency = placed.terminator_frequency
    sp.t = t
    sp.u = u
    sp.v = v
    sp.backfacing = sp.from_inside = sp.touches = 0
    put(sp.wo, neg(d))
    if mesh.shape != SHAPE_TRIANGLES:
        entry = load_i64(scene.shape_entries, SHAPE_ENTRIES * mesh.shape + SHAPE_SURFACE)
        call_entry(entry, record_address(scene), record_address(sp), 0, 0, 0)
        return
    a, ab, ac = _corner_and_edges(mesh, scene.time, primitive)
    p = transform_point(placed.to_world, madd(madd(a, ab, u), ac, v))
    ab_world = transform_vector(placed.to_world, ab)
    ac_world = transform_vector(placed.to_world, ac)
    wo = neg(d)

    flat = cross(ab, ac)
    ng = normalize(transform_normal(placed.to_object, flat))
    if is_black(ng):  # a triangle without area
        ng = wo
    n = normalize(transform_normal(placed.to_object, object_normal(mesh, scene.time, primitive, u, v)))
    if is_black(n):
        n = ng

    if dot(ng, wo) < 0.0:
        sp.backfacing = 1
        ng = neg(ng)
        n = neg(n)
        ab_world = neg(ab_world)
        ac_world = neg(ac_world)

    put(sp.p, p)
    sp.error = POSITION_ERROR * magnitude(placed.to_world, max(largest(a), max(largest(ab), largest(ac))))
    put(sp.n, n)
    put(sp.ng, ng)
    put(sp.dpdu, ab_world)
    put(sp.dpdv, ac_world)


@device
def triangle_point(scene, instance, primitive, u, v):
    """The place of barycentrics (u, v) of a triangle in the world, as `surface_point` has it."""
    p, _, _ = triangle_place(scene, instance, primitive, u, v)
    return p


@device
def triangle_place(scene, instance, primitive, u, v):
    """(place of barycentrics (u, v) of a triangle, normal by the mesh's winding, twice the area), in the world."""
    placed = placed_at(scene, instance)
    mesh = mesh_at(scene.meshes, placed.mesh)
    a, ab, ac = _corner_and_edges(mesh, scene.time, primitive)
    p = transform_point(placed.to_world, madd(madd(a, ab, u), ac, v))
    area = length(cross(transform_vector(placed.to_world, ab), transform_vector(placed.to_world, ac)))
    return p, normalize(transform_normal(placed.to_object, cross(ab, ac))), area


@device
def hit_normal(scene, instance, primitive, u, v, d):
    """The shading normal (unit) where a ray along d hit a triangle, on the ray's side."""
    placed = placed_at(scene, instance)
    mesh = mesh_at(scene.meshes, placed.mesh)
    _, ab, ac = _corner_and_edges(mesh, scene.time, primitive)
    ng = normalize(transform_normal(placed.to_object, cross(ab, ac)))
    n = normalize(transform_normal(placed.to_object, object_normal(mesh, scene.time, primitive, u, v)))
    n = ng if is_black(n) else n
    return neg(n) if dot(ng, d) > 0.0 else n


@inlined
def object_normal(mesh, time, primitive, u, v):
    """The interpolated normal of a smooth triangle in object space, not normalised; zero for a flat one."""
    if not is_smooth(mesh, primitive):
        return (0.0, 0.0, 0.0)
    a = _corner_normal(mesh, time, primitive, 0)
    b = _corner_normal(mesh, time, primitive, 1)
    c = _corner_normal(mesh, time, primitive, 2)
    return add(scale(a, 1.0 - u - v), add(scale(b, u), scale(c, v)))


@device
def is_smooth(mesh, primitive):
    """Whether a triangle is shaded with interpolated normals."""
    return mesh.normals != 0 and (mesh.smooth == 0 or load_u8(mesh.smooth, primitive) != 0)


@device
def _corner_normal(mesh, time, primitive, corner):
    table = mesh.corners if mesh.normals_domain == DOMAIN_CORNER else mesh.triangles
    return normal(mesh, time, load_u32(table, 3 * primitive + corner))


@inlined
def primitive_material(scene, placed, mesh, primitive):
    """The index of a primitive's material."""
    slot = 0
    if mesh.material_slots != 0:
        slot = max(0, min(load_i32(mesh.material_slots, primitive), placed.n_materials - 1))
    return load_i32(scene.material_slots, placed.materials + slot)


@inlined
def largest(a):
    """The largest absolute component."""
    return max(abs(a[0]), max(abs(a[1]), abs(a[2])))


@inlined
def magnitude(m, size):
    """A bound of the terms that add up to the image of a point whose coordinates are not larger than `size`."""
    x = (abs(m[0]) + abs(m[1]) + abs(m[2])) * size + abs(m[3])
    y = (abs(m[4]) + abs(m[5]) + abs(m[6])) * size + abs(m[7])
    z = (abs(m[8]) + abs(m[9]) + abs(m[10])) * size + abs(m[11])
    return max(x, max(y, z))


@inlined
def offset_origin(sp, wi):
    """The origin of a ray that leaves the surface towards wi: off it by the position's error, on the side of wi."""
    ng = vec(sp.ng)
    return madd(vec(sp.p), ng, sp.error if dot(ng, wi) >= 0.0 else -sp.error)


@device
def shadow_origin(scene, sp, wi):
    """The origin of a shadow ray towards wi; near the terminator of a smooth triangle it is lifted off it.

    As in Cycles, the lift sets in where wi's cosines with the normals fall below the instance's `terminator`.
    """
    placed = placed_at(scene, sp.instance)
    limit = placed.terminator
    cos_n = dot(vec(sp.n), wi)
    side = 1.0 if cos_n >= 0.0 else -1.0
    cos_n *= side
    cos_g = side * dot(vec(sp.ng), wi)
    o = offset_origin(sp, wi)
    if cos_g >= limit or limit <= 0.0:
        return o
    mesh = mesh_at(scene.meshes, sp.mesh)
    if not is_smooth(mesh, sp.primitive):
        return o
    # On the side of the curved surface; in a corner that does not lift it, the flat one's may be inside the body.
    o = madd(vec(sp.p), vec(sp.ng), side * sp.error)
    amount = 2.0 - (cos_g + cos_n) / limit if cos_n < limit else 1.0 - cos_g / limit
    if amount <= 0.0:
        return o
    return madd(o, _lift(placed, mesh, scene.time, sp, scale(vec(sp.ng), side)), min(amount, 1.0))


@device
def _lift(placed, mesh, time, sp, ng):
    """From the point on a smooth triangle to the curved surface on the side of ng, about along the shading normal.

    The height is that of a paraboloid with the normals of the corners, halved, but not below the lowest of the corners'
    tangent planes, each of them raised until the triangle lies under it.
    """
    u = sp.u
    v = sp.v
    w = 1.0 - u - v
    a = _world_normal(placed, mesh, time, sp.primitive, 0)
    b = _world_normal(placed, mesh, time, sp.primitive, 1)
    c = _world_normal(placed, mesh, time, sp.primitive, 2)
    n = add(scale(a, w), add(scale(b, u), scale(c, v)))
    if dot(n, ng) <= 0.0:
        a, b, c, n = neg(a), neg(b), neg(c), neg(n)
    turned = -1.0 if sp.backfacing != 0 else 1.0
    ab = scale(vec(sp.dpdu), turned)
    ac = scale(vec(sp.dpdv), turned)
    bc = sub(ac, ab)
    to_a = neg(add(scale(ab, u), scale(ac, v)))
    height_a = dot(to_a, a) + max(0.0, max(dot(ab, a), dot(ac, a)))
    height_b = dot(add(to_a, ab), b) + max(0.0, max(-dot(ab, b), dot(bc, b)))
    height_c = dot(add(to_a, ac), c) + max(0.0, max(-dot(ac, c), -dot(bc, c)))
    paraboloid = u * w * dot(sub(b, a), ab) + v * w * dot(sub(c, a), ac) + u * v * dot(sub(c, b), bc)
    return scale(n, max(0.0, max(0.5 * paraboloid, min(height_a, min(height_b, height_c)))))


@device
def _world_normal(placed, mesh, time, primitive, corner):
    return normalize(transform_normal(placed.to_object, _corner_normal(mesh, time, primitive, corner)))
