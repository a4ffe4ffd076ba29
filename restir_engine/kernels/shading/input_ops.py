"""Shader instructions 60–79: the shading point, the object, the ray and the camera."""

import math

from ..core.jit import device, entry, inlined
from ..core.memory import load_i32, store_f64
from ..core.records import (
    ATTRIBUTE_UV,
    CAMERA_ORTHOGRAPHIC,
    CAMERA_PANORAMA,
    RAY_CAMERA,
    RAY_DIFFUSE,
    RAY_EMISSION,
    RAY_GLOSSY,
    RAY_REFLECT,
    RAY_SHADOW,
    RAY_SINGULAR,
    RAY_TRANSMIT,
    RAY_VOLUME,
    SHAPE_RIBBONS,
    SHAPE_SPHERES,
    SHAPE_TRIANGLES,
    camera_at,
    light_at,
    material_at,
    mesh_at,
    scene_at,
    shading_point_at,
)
from ..core.vec import (
    cross,
    dot,
    is_black,
    length,
    madd,
    normalize,
    reflect,
    store3_f64,
    sub,
    transform_normal,
    transform_point,
    transform_vector,
    vec,
)
from ..geometry.attributes import generated, mesh_components
from ..geometry.panorama import panorama_place
from ..geometry.placed import placed_at
from ..geometry.surface import object_normal
from . import opcodes as ops
from .math_ops import clamp, divide
from .operands import number, opcode, triple
from .shift import barycentric_shift, footprint_axes, shifted_attribute, shifted_position

_COARSE = 1.5 * 2.0**16  # a double that has no smaller bits than 2⁻³⁶
_FARTHEST = 3.4028234663852886e38  # Ray Length of what has no distance, as Cycles has it


@device
def normal_operand(sp, registers, code, at):
    """The normal that a code word names, of whatever length: a register, or -1 for the shading normal."""
    return vec(sp.n) if load_i32(code, at) < 0 else triple(registers, code, at)


@device
def radial_tangent(scene, sp, axis):
    """The unit tangent that runs around an axis (0, 1, 2) of the object's generated coordinates."""
    if sp.instance < 0:
        return (0.0, 0.0, 0.0)
    g = generated(scene, sp, 0.0, 0.0)
    x, y, z = g[0] - 0.5, g[1] - 0.5, g[2] - 0.5
    around = (-y, x, 0.0)
    if axis == 0:
        around = (0.0, -z, y)
    elif axis == 1:
        around = (-z, 0.0, x)
    instance = placed_at(scene, sp.instance)
    return tangent_along(sp, transform_normal(instance.to_object, around))


@device
def tangent_along(sp, v):
    """The unit tangent of the shading normal's plane nearest to v."""
    n = vec(sp.n)
    return cross(n, normalize(cross(normalize(v), n)))


@device
def camera_space(scene, sp, p):
    """A point in camera space with z along the view; for world shaders, p is a direction."""
    camera = camera_at(scene.camera, 0)
    q = transform_vector(camera.to_camera, p) if sp.instance < 0 else transform_point(camera.to_camera, p)
    return (q[0], q[1], -q[2])


@inlined
def _steady(p):
    """A point to 2⁻³⁶ units: turned faces that lie at whole numbers do not flicker where nodes round coordinates."""
    return (p[0] + _COARSE) - _COARSE, (p[1] + _COARSE) - _COARSE, (p[2] + _COARSE) - _COARSE


@device
def _window(scene, sp, p):
    """The place of a point in the frame, 0 … 1 from the lower left corner."""
    camera = camera_at(scene.camera, 0)
    q = camera_space(scene, sp, p)
    if camera.kind == CAMERA_PANORAMA:
        u, v = panorama_place(camera, normalize((q[0], q[1], -q[2])))
        return (u, v, 0.0)
    depth = 1.0 if camera.kind == CAMERA_ORTHOGRAPHIC else q[2]
    x, y = divide(q[0], depth), divide(q[1], depth)
    width, height = camera.screen[1] - camera.screen[0], camera.screen[3] - camera.screen[2]
    return (divide(x - camera.screen[0], width), divide(y - camera.screen[2], height), 0.0)


@device
def _object_normal(scene, sp, offset, width):
    instance = placed_at(scene, sp.instance)
    if offset > 0:
        du, dv = barycentric_shift(sp, offset, width)
        n = object_normal(mesh_at(scene.meshes, sp.mesh), scene.time, sp.primitive, sp.u + du, sp.v + dv)
        if not is_black(n):
            n = normalize(n)
            return (-n[0], -n[1], -n[2]) if sp.backfacing else n
    return normalize(transform_normal(instance.to_world, vec(sp.n)))


@device
def _placed(scene, sp, what, offset, width):
    """The coordinates that need the object; those of the world have none."""
    if sp.instance < 0:
        if sp.light >= 0 and (what == ops.POINT_OBJECT or what == ops.POINT_GENERATED):
            return transform_point(light_at(scene.lights, sp.light).to_object, vec(sp.p))
        if what == ops.POINT_OBJECT_NORMAL:
            if sp.light >= 0:
                return normalize(transform_normal(light_at(scene.lights, sp.light).to_world, vec(sp.n)))
            return vec(sp.n)
        return vec(sp.p) if what != ops.POINT_TANGENT else (0.0, 0.0, 0.0)
    instance = placed_at(scene, sp.instance)
    if what == ops.POINT_OBJECT:
        return _steady(transform_point(instance.to_object, shifted_position(sp, offset, width)))
    if what == ops.POINT_GENERATED:
        du, dv = barycentric_shift(sp, offset, width)
        return generated(scene, sp, du, dv)
    if what == ops.POINT_OBJECT_NORMAL:
        return _object_normal(scene, sp, offset, width)
    if what == ops.POINT_TANGENT:
        return radial_tangent(scene, sp, 2) if sp.shape == SHAPE_TRIANGLES else normalize(vec(sp.dpdu))
    if what == ops.POINT_INSTANCER_GENERATED:
        return vec(instance.dupli_generated)
    return (instance.dupli_uv[0], instance.dupli_uv[1], 0.0)


@device
def _parametric(sp, offset, width):
    """(u, v) as Cycles has them: what places a hit on tubes, cones and spheres all round is 0 there."""
    du, dv = barycentric_shift(sp, offset, width)
    if sp.instance >= 0 and sp.shape == SHAPE_SPHERES:
        return 0.0, 0.0
    return sp.u + du, sp.v + dv if sp.instance < 0 or sp.shape <= SHAPE_RIBBONS else 0.0


@device
def _geometry(scene, sp, what, offset, width):
    """A vector POINT_* at the point that offset and width name."""
    if what == ops.POINT_POSITION:
        return shifted_position(sp, offset, width)
    if what == ops.POINT_NORMAL:
        return vec(sp.n)
    if what == ops.POINT_TRUE_NORMAL:
        return vec(sp.wo) if sp.instance >= 0 and sp.shape == SHAPE_RIBBONS else vec(sp.ng)
    if what == ops.POINT_INCOMING:
        return vec(sp.wo)
    if what == ops.POINT_PARAMETRIC:
        u, v = _parametric(sp, offset, width)
        return (1.0 - u - v, u, 0.0)
    if what == ops.POINT_CAMERA:
        return camera_space(scene, sp, shifted_position(sp, offset, width))
    if what == ops.POINT_WINDOW:
        return _window(scene, sp, shifted_position(sp, offset, width))
    if what == ops.POINT_REFLECTION:
        return reflect(vec(sp.wo), vec(sp.n)) if sp.instance >= 0 else vec(sp.wo)
    return _placed(scene, sp, what, offset, width)


@device
def _object_info(scene, sp, registers, out):
    for k in range(12):
        store_f64(registers, out + k, 0.0)
    if sp.material >= 0:
        store_f64(registers, out + 8, float(material_at(scene.materials, sp.material).pass_index))
    if sp.light >= 0:
        light = light_at(scene.lights, sp.light)
        m = light.to_world
        store3_f64(registers, out, (float(m[3]), float(m[7]), float(m[11])))
        store_f64(registers, out + 7, float(light.object_index))
    if sp.instance < 0:
        return
    instance = placed_at(scene, sp.instance)
    store3_f64(registers, out, vec(instance.location))
    for k in range(4):
        store_f64(registers, out + 3 + k, instance.color[k])
    store_f64(registers, out + 7, float(instance.object_index))
    store_f64(registers, out + 9, instance.random)
    store_f64(registers, out + 10, instance.particle)


# What the first of LIGHT_PATH_OUTPUTS ask for.
_RAY_FLAGS = (
    RAY_CAMERA,
    RAY_SHADOW,
    RAY_DIFFUSE,
    RAY_GLOSSY,
    RAY_SINGULAR,
    RAY_REFLECT,
    RAY_TRANSMIT,
    RAY_VOLUME,
)


@device
def _flag(sp, bits):
    return 1.0 if sp.ray_flags & bits else 0.0


@device
def _light_path(sp, what):
    if what < 8:
        return _flag(sp, _RAY_FLAGS[what])
    if what == 8:
        return min(sp.t, _FARTHEST)
    if what == 9:  # a shader run for a shadow ray or a light is one bounce further than the point it is run from
        depth = sp.depth + _flag(sp, RAY_SHADOW | RAY_EMISSION)
        return max(depth, 1.0) if sp.instance < 0 else depth
    if what == 10:
        return float(sp.diffuse_depth)
    if what == 11:
        return float(sp.glossy_depth)
    if what == 12:
        return float(sp.transparent_depth)
    if what == 13:
        return float(sp.transmission_depth)
    return 1.0 if sp.backfacing else 0.0


@device
def _fresnel(cosine, eta):
    """Unpolarised reflectance of a dielectric of relative index eta."""
    c = abs(cosine)
    g2 = eta * eta - 1.0 + c * c
    if g2 <= 0.0:
        return 1.0
    g = math.sqrt(g2)
    a = (g - c) / (g + c)
    b = ((g + c) * c - 1.0) / ((g - c) * c + 1.0)
    return 0.5 * a * a * (1.0 + b * b)


@device
def _layer_weight(sp, registers, code, at):
    out = load_i32(code, at)
    weight = number(registers, code, at + 1)
    cosine = dot(vec(sp.wo), normal_operand(sp, registers, code, at + 2))
    eta = max(1.0 - weight, 1e-5)
    store_f64(registers, out, _fresnel(cosine, eta if sp.backfacing else 1.0 / eta))
    facing = abs(cosine)
    if weight != 0.5:
        weight = clamp(weight, 0.0, 1.0 - 1e-5)
        facing = facing ** (2.0 * weight if weight < 0.5 else 0.5 / (1.0 - weight))
    store_f64(registers, out + 1, 1.0 - facing)


@device
def _light_falloff(sp, registers, code, at):
    out = load_i32(code, at)
    strength, smooth = number(registers, code, at + 1), number(registers, code, at + 2)
    distance = sp.t
    if not distance < 1e30:  # suns and the world are at no distance
        store3_f64(registers, out, (strength, strength, strength))
        return
    if smooth > 0.0:
        strength *= distance * distance / (smooth + distance * distance)
    store3_f64(registers, out, (strength, strength * distance, strength * distance * distance))


@inlined
def _transform(kind, matrix, inverse, v):
    """v by a matrix as TRANSFORM_TYPES has it: a point, a vector or a normal (unit)."""
    if kind == 0:
        return transform_point(matrix, v)
    return transform_vector(matrix, v) if kind == 1 else normalize(transform_normal(inverse, v))


@inlined
def _by_camera(kind, matrix, v):
    """v by the camera's matrix, which is rigid, likewise."""
    q = transform_point(matrix, v) if kind == 0 else transform_vector(matrix, v)
    return normalize(q) if kind == 2 else q


@inlined
def _by_owner(kind, owner, back, v):
    """v by the matrix of an instance or a lamp; back: from the world to it."""
    if back:
        return _transform(kind, owner.to_object, owner.to_world, v)
    return _transform(kind, owner.to_world, owner.to_object, v)


@device
def _by_object(scene, sp, kind, back, v):
    """v between the space of what is at sp and the world; the world's own space is that of the world's background."""
    if sp.instance >= 0:
        return _by_owner(kind, placed_at(scene, sp.instance), back, v)
    return _by_owner(kind, light_at(scene.lights, sp.light), back, v) if sp.light >= 0 else v


@device
def _to_world(scene, sp, kind, space, v):
    if space == 2:
        return _by_camera(kind, camera_at(scene.camera, 0).to_world, (v[0], v[1], -v[2]))
    return _by_object(scene, sp, kind, False, v) if space == 1 else v


@device
def _from_world(scene, sp, kind, space, v):
    if space != 2:
        return _by_object(scene, sp, kind, True, v) if space == 1 else v
    q = _by_camera(kind, camera_at(scene.camera, 0).to_camera, v)
    return (q[0], q[1], -q[2])


@device
def _vector_transform(scene, sp, registers, code, at):
    kind, source, target = load_i32(code, at + 1), load_i32(code, at + 2), load_i32(code, at + 3)
    v = triple(registers, code, at + 4)
    if source != target:
        v = _from_world(scene, sp, kind, target, _to_world(scene, sp, kind, source, v))
    store3_f64(registers, load_i32(code, at), v)


@device
def _camera_data(scene, sp, registers, code, at):
    out = load_i32(code, at)
    q = camera_space(scene, sp, vec(sp.p))
    store3_f64(registers, out, normalize(q))
    store_f64(registers, out + 3, q[2])
    store_f64(registers, out + 4, length(q))


@device
def _attribute(scene, sp, registers, code, at):
    out = load_i32(code, at)
    if sp.light >= 0 and load_i32(code, at + 1) == ATTRIBUTE_UV:
        store3_f64(registers, out, (1.0 - sp.u - sp.v, sp.u, 0.0))
        store_f64(registers, out + 3, 1.0)
        return
    width = number(registers, code, at + 3)
    found, x, y, z, w = shifted_attribute(scene, sp, load_i32(code, at + 1), load_i32(code, at + 2), width)
    store3_f64(registers, out, (x, y, z))
    store_f64(registers, out + 3, w if found else 1.0)


@device
def _attribute_factor(scene, sp, registers, code, at):
    name = load_i32(code, at + 1)
    if sp.light >= 0 and name == ATTRIBUTE_UV:
        return (1.0 - sp.v) * (1.0 / 3.0)
    _, x, y, z, _ = shifted_attribute(scene, sp, name, load_i32(code, at + 2), number(registers, code, at + 3))
    if sp.instance >= 0 and mesh_components(scene, sp, name) == 2:
        return x
    return (x + y + z) * (1.0 / 3.0)


@device
def _wireframe(sp, registers, code, at):
    """1 nearer than half the size to an edge of the triangle, else 0."""
    size = number(registers, code, at + 4)
    if load_i32(code, at + 1):
        a, b = footprint_axes(sp)
        wo = vec(sp.wo)
        size *= 0.5 * (length(madd(a, wo, -dot(a, wo))) + length(madd(b, wo, -dot(b, wo))))
    du, dv = barycentric_shift(sp, load_i32(code, at + 2), number(registers, code, at + 3))
    u, v = sp.u + du, sp.v + dv
    ab, ac = vec(sp.dpdu), vec(sp.dpdv)
    half, area = 0.5 * size, length(cross(ab, ac))  # a distance is a barycentric weight times area by the edge's length
    near = v * area < half * length(ab) or u * area < half * length(ac)
    return 1.0 if near or (1.0 - u - v) * area < half * length(sub(ac, ab)) else 0.0


@entry
def input_op(scene, sp, registers, code, at):
    """Run one instruction of this family."""
    scene, sp = scene_at(scene, 0), shading_point_at(sp, 0)
    op = opcode(code, at)
    out = load_i32(code, at)
    if op == ops.GEOMETRY:
        width = number(registers, code, at + 3)
        store3_f64(registers, out, _geometry(scene, sp, load_i32(code, at + 1), load_i32(code, at + 2), width))
    elif op == ops.ATTRIBUTE:
        _attribute(scene, sp, registers, code, at)
    elif op == ops.ATTRIBUTE_FACTOR:
        store_f64(registers, out, _attribute_factor(scene, sp, registers, code, at))
    elif op == ops.OBJECT_INFO:
        _object_info(scene, sp, registers, out)
    elif op == ops.LIGHT_PATH:
        store_f64(registers, out, _light_path(sp, load_i32(code, at + 1)))
    elif op == ops.FRESNEL:
        ior = max(number(registers, code, at + 1), 1e-5)
        cosine = dot(vec(sp.wo), normal_operand(sp, registers, code, at + 2))
        store_f64(registers, out, _fresnel(cosine, 1.0 / ior if sp.backfacing else ior))
    elif op == ops.LAYER_WEIGHT:
        _layer_weight(sp, registers, code, at)
    elif op == ops.LIGHT_FALLOFF:
        _light_falloff(sp, registers, code, at)
    elif op == ops.CAMERA_DATA:
        _camera_data(scene, sp, registers, code, at)
    elif op == ops.WIREFRAME:
        store_f64(registers, out, _wireframe(sp, registers, code, at) if sp.instance >= 0 else 0.0)
    elif op == ops.VECTOR_TRANSFORM:
        _vector_transform(scene, sp, registers, code, at)
