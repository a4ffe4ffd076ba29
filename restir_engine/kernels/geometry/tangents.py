"""Tangents of a UV map, averaged as MikkTSpace does (Mikkelsen 2008, "Simulation of wrinkled surfaces revisited")."""

import math

from ..core.jit import device, kernel
from ..core.memory import load_f32, load_i32, load_u32, store_f32, store_i32
from ..core.records import mesh_at
from ..core.vec import cross, dot, is_black, load3_f32, load3_f64, madd, normalize, scale, store3_f64, sub
from .surface import object_normal

RECORD = 6  # float64 a corner: weighted tangent, normal


@kernel
def mikk_tangents(mesh, uv, work, heads, links, out):
    """Tangents in object space and signs of the bitangents.

    mesh: address of a MESH; uv: float32 [corners, 2]; work: float64 [n_triangles * 3, RECORD]; heads: int32
    [n_vertices], -1 at the start; links: int32 [n_triangles * 3]; out: float32 [corners, 4].
    """
    mesh = mesh_at(mesh, 0)
    for triangle in range(mesh.n_triangles):
        _corner_tangents(mesh, uv, work, triangle)
        for k in range(3):
            corner = 3 * triangle + k
            vertex = load_u32(mesh.triangles, corner)
            store_i32(links, corner, load_i32(heads, vertex))
            store_i32(heads, vertex, corner)
    for corner in range(3 * mesh.n_triangles):
        sign = _sign(mesh, uv, corner)
        total = _group_sum(mesh, uv, work, heads, links, corner, sign)
        at = 4 * load_u32(mesh.corners, corner)
        store_f32(out, at, total[0])
        store_f32(out, at + 1, total[1])
        store_f32(out, at + 2, total[2])
        store_f32(out, at + 3, sign)


@device
def _uv_area(mesh, uv, triangle):
    """(s and t from corner 0 to 1, s and t from corner 0 to 2)."""
    a = 2 * load_u32(mesh.corners, 3 * triangle)
    b = 2 * load_u32(mesh.corners, 3 * triangle + 1)
    c = 2 * load_u32(mesh.corners, 3 * triangle + 2)
    s, t = load_f32(uv, a), load_f32(uv, a + 1)
    return load_f32(uv, b) - s, load_f32(uv, b + 1) - t, load_f32(uv, c) - s, load_f32(uv, c + 1) - t


@device
def _sign(mesh, uv, corner):
    s1, t1, s2, t2 = _uv_area(mesh, uv, corner // 3)
    return 1.0 if s1 * t2 - t1 * s2 > 0.0 else -1.0


@device
def _corner_tangents(mesh, uv, work, triangle):
    """Each corner's normal, and the direction of growing s across it weighted by the corner's angle."""
    a = load3_f32(mesh.vertices, load_u32(mesh.triangles, 3 * triangle))
    b = load3_f32(mesh.vertices, load_u32(mesh.triangles, 3 * triangle + 1))
    c = load3_f32(mesh.vertices, load_u32(mesh.triangles, 3 * triangle + 2))
    s1, t1, s2, t2 = _uv_area(mesh, uv, triangle)
    area = s1 * t2 - t1 * s2
    along = madd(scale(sub(b, a), t2), sub(c, a), -t1)
    if area <= 0.0:
        along = scale(along, -1.0 if area < 0.0 else 0.0)
    flat = cross(sub(b, a), sub(c, a))
    for k in range(3):
        normal = object_normal(mesh, 0.5, triangle, 1.0 if k == 1 else 0.0, 1.0 if k == 2 else 0.0)
        if is_black(normal):
            normal = flat
        normal = normalize(normal)
        here, ahead, behind = a, b, c
        if k == 1:
            here, ahead, behind = b, c, a
        if k == 2:
            here, ahead, behind = c, a, b
        cosine = dot(_flattened(sub(ahead, here), normal), _flattened(sub(behind, here), normal))
        angle = math.acos(max(-1.0, min(1.0, cosine)))
        at = RECORD * (3 * triangle + k)
        store3_f64(work, at, scale(_flattened(along, normal), angle))
        store3_f64(work, at + 3, normal)


@device
def _flattened(v, n):
    """The unit direction of v within the plane of n."""
    return normalize(madd(v, n, -dot(v, n)))


@device
def _group_sum(mesh, uv, work, heads, links, corner, sign):
    """The mean tangent over the corners at a vertex that agree with this one in uv, normal and orientation."""
    own = 2 * load_u32(mesh.corners, corner)
    normal = load3_f64(work, RECORD * corner + 3)
    total = (0.0, 0.0, 0.0)
    other = load_i32(heads, load_u32(mesh.triangles, corner))
    while other >= 0:
        at = 2 * load_u32(mesh.corners, other)
        same_uv = load_f32(uv, at) == load_f32(uv, own) and load_f32(uv, at + 1) == load_f32(uv, own + 1)
        same_normal = dot(load3_f64(work, RECORD * other + 3), normal) > 1.0 - 1e-6
        if same_uv and same_normal and _sign(mesh, uv, other) == sign:
            total = madd(total, load3_f64(work, RECORD * other), 1.0)
        other = load_i32(links, other)
    total = normalize(total)
    if is_black(total):
        total = (1.0, 0.0, 0.0)
    return total
