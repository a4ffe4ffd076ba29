"""Shader instructions 80–89: bent normals, tangents and displacement, as Cycles defines them."""

from ..core.jit import device, entry
from ..core.memory import load_i32
from ..core.records import mesh_at, scene_at, shading_point_at
from ..core.vec import (
    add,
    cross,
    dot,
    is_black,
    lerp,
    madd,
    neg,
    normalize,
    scale,
    store3_f64,
    sub,
    transform_normal,
    transform_vector,
    vec,
)
from ..geometry.attributes import attribute
from ..geometry.placed import placed_at
from ..geometry.surface import object_normal
from . import opcodes as ops
from .input_ops import normal_operand, radial_tangent, tangent_along
from .math_ops import clamp
from .opcodes import BUMP_IN_WORLD
from .operands import number, opcode, triple
from .shift import footprint_axes, undisplaced_axes


@device
def _bump(scene, sp, registers, code, at):
    """The normal bent by the height's gradient over the footprint (Mikkelsen 2010)."""
    n = normal_operand(sp, registers, code, at + 1)
    h = number(registers, code, at + 2)
    dx, dy = number(registers, code, at + 3) - h, number(registers, code, at + 4) - h
    strength = max(number(registers, code, at + 5), 0.0)
    distance, width = number(registers, code, at + 6), number(registers, code, at + 7)
    space = load_i32(code, at + 8) if sp.instance >= 0 else BUMP_IN_WORLD
    a, b = footprint_axes(sp)
    if space != BUMP_IN_WORLD:
        n = normalize(transform_normal(placed_at(scene, sp.instance).to_world, n))
        a, b = undisplaced_axes(scene, sp, space)
    across_a, across_b = cross(b, n), cross(n, a)
    determinant = dot(a, across_a)
    gradient = add(scale(across_a, dx), scale(across_b, dy))
    sign = -distance if determinant >= 0.0 else distance
    bent = normalize(madd(scale(n, width * abs(determinant)), gradient, sign))
    bent = n if is_black(bent) or bent[0] != bent[0] else normalize(lerp(n, bent, strength))
    if space == BUMP_IN_WORLD:
        return bent
    return normalize(transform_normal(placed_at(scene, sp.instance).to_object, bent))


@device
def _map_color(space, c):
    """The vector that a normal map's colour stands for; Blender's own spaces turn y and z around."""
    x, y, z = 2.0 * c[0] - 1.0, 2.0 * c[1] - 1.0, 2.0 * c[2] - 1.0
    return (x, -y, -z) if space >= 3 else (x, y, z)


@device
def _unit_normals(mesh, time, primitive, u, v):
    """The blend of a smooth triangle's normals, each of unit length in object space; zero for a flat triangle.

    A mesh may hold normals of other lengths, see scene.mesh.with_normals_for; the length of the blend tells how far a
    normal map bends it.
    """
    if is_black(object_normal(mesh, time, primitive, u, v)):
        return (0.0, 0.0, 0.0)
    a = normalize(object_normal(mesh, time, primitive, 0.0, 0.0))
    b = normalize(object_normal(mesh, time, primitive, 1.0, 0.0))
    c = normalize(object_normal(mesh, time, primitive, 0.0, 1.0))
    return add(scale(a, 1.0 - u - v), add(scale(b, u), scale(c, v)))


@device
def _tangent_space(scene, sp, name, c, strength, unit):
    """The world normal of a tangent-space colour, sp.n where the mesh has no such tangent.

    unit: the interpolated normal is normalised before it is bent.
    """
    found, x, y, z, sign = attribute(scene, sp, name, 0.0, 0.0)
    if not found:
        return vec(sp.n)
    instance = placed_at(scene, sp.instance)
    n = _unit_normals(mesh_at(scene.meshes, sp.mesh), scene.time, sp.primitive, sp.u, sp.v)
    if is_black(n):  # flat: the geometric normal before it was turned to the ray's side
        n = normalize(transform_normal(instance.to_world, neg(vec(sp.ng)) if sp.backfacing else vec(sp.ng)))
    elif unit:
        n = normalize(n)
    tangent = (x, y, z)
    bitangent = scale(cross(n, tangent), sign)
    depth = 1.0 + (c[2] - 1.0) * clamp(strength, 0.0, 1.0)
    bent = add(madd(scale(tangent, c[0] * strength), bitangent, c[1] * strength), scale(n, depth))
    world = normalize(transform_normal(instance.to_object, normalize(bent)))
    return neg(world) if sp.backfacing else world


@device
def _normal_map(scene, sp, registers, code, at):
    space, c = load_i32(code, at + 1), triple(registers, code, at + 3)
    strength = number(registers, code, at + 4)
    c = _map_color(space, c)
    if space == 0:
        if sp.instance < 0:
            return vec(sp.n)
        n = _tangent_space(scene, sp, load_i32(code, at + 2), c, strength, load_i32(code, at + 5) != 0)
        return vec(sp.n) if is_black(n) else n
    if (space == 1 or space == 3) and sp.instance >= 0:
        c = transform_normal(placed_at(scene, sp.instance).to_object, c)
    n = normalize(c)
    if sp.backfacing:
        n = neg(n)
    if strength != 1.0:
        n = normalize(lerp(vec(sp.n), n, max(strength, 0.0)))
    return vec(sp.n) if is_black(n) else n


@device
def _uv_tangent(scene, sp, name):
    if sp.instance < 0:
        return (0.0, 0.0, 0.0)
    found, x, y, z, _ = attribute(scene, sp, name, 0.0, 0.0)
    if not found:
        return (0.0, 0.0, 0.0)
    instance = placed_at(scene, sp.instance)
    return tangent_along(sp, transform_normal(instance.to_object, (x, y, z)))


@device
def _displacement(scene, sp, registers, code, at):
    n = normal_operand(sp, registers, code, at + 5)
    amount = (number(registers, code, at + 2) - number(registers, code, at + 3)) * number(registers, code, at + 4)
    if load_i32(code, at + 1) == 0 or sp.instance < 0:
        return scale(n, amount)
    instance = placed_at(scene, sp.instance)
    local = normalize(transform_normal(instance.to_world, n))
    return transform_vector(instance.to_world, scale(local, amount))


@device
def _vector_displacement(scene, sp, registers, code, at):
    space, middle = load_i32(code, at + 1), number(registers, code, at + 4)
    d = scale(sub(triple(registers, code, at + 3), (middle, middle, middle)), number(registers, code, at + 5))
    if space == 2 or sp.instance < 0:
        return d
    instance = placed_at(scene, sp.instance)
    if space == 0:
        n = normalize(transform_normal(instance.to_world, vec(sp.n)))
        found, x, y, z, sign = attribute(scene, sp, load_i32(code, at + 2), 0.0, 0.0)
        tangent = normalize((x, y, z)) if found else normalize(vec(sp.dpdu))
        bitangent = scale(normalize(cross(n, tangent)), sign if found else 1.0)
        d = add(madd(scale(tangent, d[0]), n, d[1]), scale(bitangent, d[2]))
    return transform_vector(instance.to_world, d)


@entry
def bump_op(scene, sp, registers, code, at):
    """Run one instruction of this family."""
    scene, sp = scene_at(scene, 0), shading_point_at(sp, 0)
    op = opcode(code, at)
    if op == ops.BUMP:
        result = _bump(scene, sp, registers, code, at)
    elif op == ops.NORMAL_MAP:
        result = _normal_map(scene, sp, registers, code, at)
    elif op == ops.RADIAL_TANGENT:
        result = radial_tangent(scene, sp, load_i32(code, at + 1))
    elif op == ops.UV_TANGENT:
        result = _uv_tangent(scene, sp, load_i32(code, at + 1))
    elif op == ops.DISPLACEMENT:
        result = _displacement(scene, sp, registers, code, at)
    else:
        result = _vector_displacement(scene, sp, registers, code, at)
    store3_f64(registers, load_i32(code, at), result)
