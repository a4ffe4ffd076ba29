"""Segments of strands: what rays hit of ribbons, tubes and cones.

Ribbons and tubes lie along Catmull-Rom curves through the points of a strand, which a circle of the interpolated
radius sweeps. A ribbon is the cut through it that faces the ray, and is shaded by the normals of the tube in its place;
tubes and cones have a surface of their own. All follow Cycles (`curve_shader_setup`) and Embree's geometry.
"""

import math

from ..core.jit import device, entry
from ..core.memory import load_f32, load_i32, load_i64, load_u32, store_f32, store_i32
from ..core.records import (
    RAY_ALL,
    RAY_SHADOW,
    SHAPE_RIBBONS,
    instance_at,
    mesh_at,
    scene_at,
    shading_point_at,
)
from ..core.vec import (
    add,
    cross,
    dot,
    frame,
    is_black,
    length,
    lerp,
    load3_f32,
    madd,
    neg,
    normalize,
    put,
    scale,
    store3_f64,
    sub,
    transform_normal,
    transform_point,
    transform_vector,
    vec,
)
from .placed import placed_at, point
from .surface import POSITION_ERROR, largest, magnitude

_STEPS = 12  # along a strand
_OF_PATHS = RAY_ALL & ~RAY_SHADOW  # of the mask of a ray: it is none of shadow


@device
def _weighted(mesh, time, primitive, a, b, c, d):
    """The four points of a segment, place and radius, times a … d."""
    first = load_u32(mesh.segments, primitive)
    p, q, r, s = (
        point(mesh, time, first),
        point(mesh, time, first + 1),
        point(mesh, time, first + 2),
        point(mesh, time, first + 3),
    )
    return (
        a * p[0] + b * q[0] + c * r[0] + d * s[0],
        a * p[1] + b * q[1] + c * r[1] + d * s[1],
        a * p[2] + b * q[2] + c * r[2] + d * s[2],
        a * p[3] + b * q[3] + c * r[3] + d * s[3],
    )


@device
def catmull_rom(mesh, time, primitive, u):
    """Place and radius (x, y, z, r) at u of a segment, in object space."""
    a = 0.5 * u * (-1.0 + u * (2.0 - u))
    b = 0.5 * (2.0 + u * u * (3.0 * u - 5.0))
    c = 0.5 * u * (1.0 + u * (4.0 - 3.0 * u))
    d = 0.5 * u * u * (u - 1.0)
    return _weighted(mesh, time, primitive, a, b, c, d)


@device
def _tangent(mesh, time, primitive, u):
    """The derivative of the place by u; where it is zero, the way from the segment's start to its end."""
    a = 0.5 * (-1.0 + u * (4.0 - 3.0 * u))
    b = 0.5 * u * (9.0 * u - 10.0)
    c = 0.5 * (1.0 + u * (8.0 - 9.0 * u))
    d = 0.5 * u * (3.0 * u - 2.0)
    t = _weighted(mesh, time, primitive, a, b, c, d)
    t = (t[0], t[1], t[2])
    if is_black(t):
        t = _weighted(mesh, time, primitive, 0.0, -1.0, 1.0, 0.0)
        t = (t[0], t[1], t[2])
    return t


@device
def _put_strand(placed, sp, p, terms, n, tangent):
    """Fill the rest of `sp`. All in object space; n may be of any length; terms: the largest that p comes from.

    As triangles do, what is seen from within a tube turns normal and tangents to the ray's side.
    """
    n = normalize(transform_normal(placed.to_object, n))
    if is_black(n):
        n = vec(sp.wo)
    along = transform_vector(placed.to_world, tangent)
    if dot(n, vec(sp.wo)) < 0.0 and sp.shape != SHAPE_RIBBONS:
        sp.backfacing = 1
        n = neg(n)
        along = neg(along)
    put(sp.p, transform_point(placed.to_world, p))
    sp.error = POSITION_ERROR * magnitude(placed.to_world, terms)
    put(sp.n, n)
    put(sp.ng, n)
    put(sp.dpdu, along)
    put(sp.dpdv, cross(along, n))


@device
def _terms(size, radius):
    """The terms that Embree finds the surface of a long thin segment from: squares of lengths, for one of a radius."""
    return radius + min(size * size / max(radius, 1e-30), 1e3 * size)


@entry
def ribbon_surface(scene, sp, _a, _b, _c):
    """SHAPE_SURFACE of ribbons. `sp.ng` is the tube's normal too, by which reflection and transmission are told apart.

    The place is that on Embree's flat pieces between points of the curve.
    """
    scene, sp = scene_at(scene, 0), shading_point_at(sp, 0)
    placed = placed_at(scene, sp.instance)
    mesh = mesh_at(scene.meshes, sp.mesh)
    piece = min(math.floor(sp.u * mesh.pieces), mesh.pieces - 1.0)
    a = catmull_rom(mesh, scene.time, sp.primitive, piece / mesh.pieces)
    b = catmull_rom(mesh, scene.time, sp.primitive, (piece + 1.0) / mesh.pieces)
    t = sp.u * mesh.pieces - piece
    centre = lerp((a[0], a[1], a[2]), (b[0], b[1], b[2]), t)
    radius = a[3] + (b[3] - a[3]) * t
    tangent = _tangent(mesh, scene.time, sp.primitive, sp.u)
    wo = normalize(transform_vector(placed.to_object, vec(sp.wo)))
    along = normalize(tangent)
    side = normalize(cross(along, wo))
    if is_black(side):  # along the strand
        side, _other = frame(wo)
    facing = normalize(cross(side, along))
    sine = max(-1.0, min(1.0, float(sp.v)))
    n = add(scale(side, sine), scale(facing, math.sqrt(1.0 - sine * sine)))
    _put_strand(placed, sp, madd(centre, side, sine * radius), largest(centre) + radius, n, tangent)


@device
def _put_angle(ray, axis, n):
    """Store the angle of n about an axis (unit) as v in an RTCRayHit."""
    x, y = frame(axis)
    store_f32(ray, 16, math.atan2(dot(n, y), dot(n, x)))


@device
def _direction(axis, angle):
    """The unit vector across an axis (unit) at an angle about it, in the frame of `_put_angle`."""
    x, y = frame(axis)
    return add(scale(x, math.cos(angle)), scale(y, math.sin(angle)))


@device
def _hit_mesh(scene, ray):
    """The MESH record of the instance that an RTCRayHit names."""
    return mesh_at(scene.meshes, instance_at(scene.instances, load_u32(ray, 19)).mesh)


@entry
def ribbon_hit(_scene, _ray, _a, _b, _c):
    """SHAPE_HIT of ribbons: Embree's u and v say all."""


@entry
def tube_hit(scene, ray, _a, _b, _c):
    """SHAPE_HIT of tubes: v is the angle of Embree's normal about the curve."""
    scene = scene_at(scene, 0)
    mesh = _hit_mesh(scene, ray)
    axis = normalize(_tangent(mesh, scene.time, load_u32(ray, 17), load_f32(ray, 15)))
    _put_angle(ray, axis, load3_f32(ray, 4))


@entry
def tube_surface(scene, sp, _a, _b, _c):
    """SHAPE_SURFACE of tubes; as in Cycles the normal leads away from the curve, however fast the radius changes."""
    scene, sp = scene_at(scene, 0), shading_point_at(sp, 0)
    mesh = mesh_at(scene.meshes, sp.mesh)
    c = catmull_rom(mesh, scene.time, sp.primitive, sp.u)
    centre = (c[0], c[1], c[2])
    tangent = _tangent(mesh, scene.time, sp.primitive, sp.u)
    n = _direction(normalize(tangent), sp.v)
    terms = largest(centre) + _terms(length(tangent), c[3])
    _put_strand(placed_at(scene, sp.instance), sp, madd(centre, n, c[3]), terms, n, tangent)


@device
def _cone(mesh, time, primitive):
    """(start, end, their radii) of a cone."""
    first = load_u32(mesh.segments, primitive)
    a, b = point(mesh, time, first + 1), point(mesh, time, first + 2)
    return (a[0], a[1], a[2]), (b[0], b[1], b[2]), a[3], b[3]


@entry
def cone_hit(scene, ray, _a, _b, _c):
    """SHAPE_HIT of cones: u is the place along the axis, beyond [0, 1] on round ends; v the angle about it."""
    scene = scene_at(scene, 0)
    placed = placed_at(scene, load_u32(ray, 19))
    start, end, _r0, _r1 = _cone(mesh_at(scene.meshes, placed.mesh), scene.time, load_u32(ray, 17))
    axis = sub(end, start)
    p = madd(load3_f32(ray, 0), (load_f32(ray, 4), load_f32(ray, 5), load_f32(ray, 6)), load_f32(ray, 8))
    store_f32(ray, 15, dot(sub(transform_point(placed.to_object, p), start), axis) / max(dot(axis, axis), 1e-60))
    _put_angle(ray, normalize(axis), load3_f32(ray, 4))


@entry
def cone_surface(scene, sp, _a, _b, _c):
    """SHAPE_SURFACE of cones, which touch a sphere round either end; sp.u becomes that of the sphere that touches at p.

    With sin β = (r₀ - r₁) / length the cone touches the spheres at rᵢ sin β along the axis from their centres.
    """
    scene, sp = scene_at(scene, 0), shading_point_at(sp, 0)
    start, end, r0, r1 = _cone(mesh_at(scene.meshes, sp.mesh), scene.time, sp.primitive)
    tangent = sub(end, start)
    size = max(length(tangent), 1e-30)
    axis = scale(tangent, 1.0 / size)
    sine = max(-1.0, min(1.0, (r0 - r1) / size))
    cosine = math.sqrt(1.0 - sine * sine)
    along = sp.u * size
    first, last = r0 * sine, size + r1 * sine
    out = _direction(axis, sp.v)
    if along < first or last <= first:
        place, radius, sine = 0.0, r0, max(-1.0, min(1.0, along / max(r0, 1e-30)))
        if along >= first:
            place, radius, sine = size, r1, max(-1.0, min(1.0, (along - size) / max(r1, 1e-30)))
        cosine = math.sqrt(1.0 - sine * sine)
    elif along > last:
        place, radius, sine = size, r1, max(-1.0, min(1.0, (along - size) / max(r1, 1e-30)))
        cosine = math.sqrt(1.0 - sine * sine)
    else:
        t = (along - first) / (last - first)
        place, radius = t * size, r0 + (r1 - r0) * t
    n = add(scale(out, cosine), scale(axis, sine))
    sp.u = place / size
    p = madd(madd(start, axis, place), n, radius)
    terms = max(largest(start), largest(end)) + _terms(size, max(r0, r1))
    _put_strand(placed_at(scene, sp.instance), sp, p, terms, n, tangent)


@device
def _meets_back(arguments):
    """Of RTCFilterFunctionNArguments: whether a surface is hit from behind; its u, and where the ray has come from.

    What goes on from a hit comes from there; but shadow rays, which count all that lets them through, from their start.
    """
    ray, hit = load_i64(arguments, 3), load_i64(arguments, 4)
    d = (load_f32(ray, 4), load_f32(ray, 5), load_f32(ray, 6))
    behind = dot(d, load3_f32(hit, 0)) > 0.0
    start = load_f32(ray, 3) if load_u32(ray, 9) & _OF_PATHS else 0.0
    return behind, load_f32(hit, 3), madd(load3_f32(ray, 0), d, start)


@device
def _nearest(mesh, time, segment, u, start):
    """(radius, distance) of about the nearest place of a strand to a point, sought from a place on along the strand."""
    strand = load_i32(mesh.strands, segment)
    for _ in range(_STEPS):  # of Newton's method
        c, tangent = catmull_rom(mesh, time, segment, u), _tangent(mesh, time, segment, u)
        step = dot(sub(start, (c[0], c[1], c[2])), tangent) / max(dot(tangent, tangent), 1e-60)
        u += step
        if u < 0.0:
            before = segment > 0 and load_i32(mesh.strands, max(segment - 1, 0)) == strand
            segment -= 1 if before else 0
            u = max(u + 1.0, 0.0) if before else 0.0
        elif u > 1.0:
            after = segment + 1 < mesh.n_segments
            after = after and load_i32(mesh.strands, min(segment + 1, mesh.n_segments - 1)) == strand
            segment += 1 if after else 0
            u = min(u - 1.0, 1.0) if after else 1.0
        elif abs(step) < 0.01:
            break
    c = catmull_rom(mesh, time, segment, u)
    return c[3], length(sub(start, (c[0], c[1], c[2])))


@entry
def tube_filter(arguments):
    """Embree's filter of tubes: a ray that comes from a strand's surface does not meet its walls from behind.

    So light goes through hair in one event. Cycles lets no ray hit the strand that it leaves; here it may be shaded by
    its own strand where that bends.
    """
    behind, u, start = _meets_back(arguments)
    if not behind:
        return
    mesh, primitive = mesh_at(load_i64(arguments, 1), 0), load_u32(load_i64(arguments, 4), 5)
    radius, distance = _nearest(mesh, load_f32(load_i64(arguments, 3), 7), primitive, u, start)
    if abs(distance - radius) < 0.1 * radius:
        store_i32(load_i64(arguments, 0), 0, 0)


@entry
def curve_centre(scene, sp, mesh, out, _c):
    """SHAPE_CENTRE of ribbons and tubes: the place on the curve at sp of another frame's mesh, float64 [3]."""
    scene, sp = scene_at(scene, 0), shading_point_at(sp, 0)
    c = catmull_rom(mesh_at(scene.meshes, mesh), scene.time, sp.primitive, sp.u)
    store3_f64(out, 0, (c[0], c[1], c[2]))


@entry
def cone_centre(scene, sp, mesh, out, _c):
    """SHAPE_CENTRE of cones."""
    scene, sp = scene_at(scene, 0), shading_point_at(sp, 0)
    start, end, _r0, _r1 = _cone(mesh_at(scene.meshes, mesh), scene.time, sp.primitive)
    store3_f64(out, 0, lerp(start, end, sp.u))
