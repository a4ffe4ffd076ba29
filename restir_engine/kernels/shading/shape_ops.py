"""The instruction behind Curves Info and Point Info: what a hit of strands or spheres has besides attributes."""

import math

from ..core.jit import device, entry
from ..core.memory import load_i32, load_u32, store_f64
from ..core.records import (
    SHAPE_SPHERES,
    SHAPE_STRANDS,
    mesh_at,
    scene_at,
    shading_point_at,
)
from ..core.vec import dot, length, madd, normalize, store3_f64, transform_point, transform_vector, vec
from ..geometry.placed import placed_at, point


@device
def _world_size(placed, size):
    """A length of an object in the world: that of one in the direction (1, 1, 1), as in Cycles."""
    s = size / math.sqrt(3.0)
    return length(transform_vector(placed.to_world, (s, s, s)))


@device
def _tangent_normal(sp):
    """The direction across the strand that is nearest to the ray's."""
    along, wo = vec(sp.dpdu), vec(sp.wo)
    return normalize(madd(wo, along, -dot(along, wo) / max(dot(along, along), 1e-60)))


@entry
def shape_op(scene, sp, registers, code, at):
    """SHAPE_INFO: see kernels.shading.opcodes."""
    scene, sp = scene_at(scene, 0), shading_point_at(sp, 0)
    out, shape = load_i32(code, at), load_i32(code, at + 1)
    there = sp.instance >= 0 and (sp.shape >= SHAPE_STRANDS if shape == SHAPE_STRANDS else sp.shape == SHAPE_SPHERES)
    v = (0.0, 0.0, 0.0)
    size = 0.0
    if there:
        placed = placed_at(scene, sp.instance)
        mesh = mesh_at(scene.meshes, sp.mesh)
        if shape == SHAPE_SPHERES:
            x, y, z, radius = point(mesh, scene.time, sp.primitive)
            v = transform_point(placed.to_world, (x, y, z))
            size = _world_size(placed, radius)
        else:
            v = _tangent_normal(sp)
            first = load_u32(mesh.segments, sp.primitive) + 1  # behind the point that its end doubles
            _x, _y, _z, a = point(mesh, scene.time, first)
            _x, _y, _z, b = point(mesh, scene.time, first + 1)
            size = _world_size(placed, 2.0 * (a + (b - a) * sp.u))
    store3_f64(registers, out, v)
    store_f64(registers, out + 3, size)
    store_f64(registers, out + 4, 1.0 if there else 0.0)
