"""Spheres, which stand for points: what rays hit of them."""

from ..core.jit import entry
from ..core.memory import store_f32
from ..core.records import mesh_at, scene_at, shading_point_at
from ..core.vec import cross, is_black, load3_f32, madd, normalize, put, store3_f64, sub, transform_point, vec
from ..core.warp import octahedral, octahedral_direction
from .placed import placed_at, point
from .surface import POSITION_ERROR, largest, magnitude


@entry
def sphere_hit(_scene, ray, _a, _b, _c):
    """SHAPE_HIT: u and v are the direction from the centre, in object space."""
    n = load3_f32(ray, 4)
    if is_black(n):
        n = (0.0, 0.0, 1.0)
    u, v = octahedral(n)
    store_f32(ray, 15, u)
    store_f32(ray, 16, v)


@entry
def sphere_surface(scene, sp, _a, _b, _c):
    """SHAPE_SURFACE; as in Cycles the normal leads away from the centre in the world, of stretched spheres too."""
    scene, sp = scene_at(scene, 0), shading_point_at(sp, 0)
    placed = placed_at(scene, sp.instance)
    x, y, z, radius = point(mesh_at(scene.meshes, sp.mesh), scene.time, sp.primitive)
    centre = (x, y, z)
    p = transform_point(placed.to_world, madd(centre, octahedral_direction(sp.u, sp.v), radius))
    n = normalize(sub(p, transform_point(placed.to_world, centre)))
    if is_black(n):
        n = vec(sp.wo)
    dpdu = (n[2] - n[1], n[0] - n[2], n[1] - n[0])  # Cycles' tangents
    if is_black(dpdu):
        dpdu = (n[2] - n[1], n[0] + n[2], -n[1] - n[0])
    dpdu = normalize(dpdu)
    put(sp.p, p)
    sp.error = POSITION_ERROR * magnitude(placed.to_world, largest(centre) + radius)
    put(sp.n, n)
    put(sp.ng, n)
    put(sp.dpdu, dpdu)
    put(sp.dpdv, cross(n, dpdu))


@entry
def sphere_centre(scene, sp, mesh, out, _c):
    """SHAPE_CENTRE: where sp stands on that sphere of another frame's mesh, float64 [3]."""
    scene, sp = scene_at(scene, 0), shading_point_at(sp, 0)
    x, y, z, radius = point(mesh_at(scene.meshes, mesh), scene.time, sp.primitive)
    store3_f64(out, 0, madd((x, y, z), octahedral_direction(sp.u, sp.v), radius))
