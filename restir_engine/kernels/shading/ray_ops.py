"""Shader instructions that trace rays of their own: Ambient Occlusion, Bevel and Raycast."""

import math

from ..core import rng
from ..core.jit import device, entry
from ..core.memory import load_i32, store_f64
from ..core.records import (
    BLOCKERS_OPAQUE,
    BLOCKERS_TRANSPARENT,
    MAX_REGISTERS,
    RAY_ALL,
    RAY_SHADOW_OPAQUE,
    SHAPE_TRIANGLES,
    scene_at,
    shading_point_at,
)
from ..core.vec import add, dot, frame, is_black, length, madd, neg, normalize, scale, store3_f64, sub, to_world, vec
from ..core.warp import disk
from ..geometry.intersect import intersect, occluded
from ..geometry.surface import hit_normal, offset_origin, triangle_place
from . import opcodes as ops
from .operands import number, opcode, triple

# Where a program's own rays stand, from its registers on: behind them.
_RAYS = 8 * MAX_REGISTERS
_HITS = 4  # of its own object that a probe of Bevel counts, as in Cycles
_ALONG, _ACROSS = 0.5, 0.25  # how often it goes along the normal, and along either tangent
_STEPS = 10
_CROSSINGS = 64  # of other objects, by rays that only their own counts for


@device
def _own_hit(scene, rays, instance, o, d, tmin, tmax):
    """The nearest hit with an instance, or -1 for its distance: (t, instance, primitive, u, v)."""
    for _ in range(_CROSSINGS):
        t, hit, primitive, u, v = intersect(scene, rays, o, d, tmin, tmax, RAY_ALL)
        if hit < 0 or hit == instance:
            return t, hit, primitive, u, v
        tmin = t * (1.0 + 1e-6) + 1e-9
    return tmax, -1, -1, 0.0, 0.0


@device
def _float_bits(x):
    """An int64 that differs where a number does, by less than a millionth too."""
    m, e = math.frexp(x)
    return int(m * 4294967296.0) ^ (int(e) & 0xFF)


@device
def _key(sp):
    """A key for random numbers that differs from point to point."""
    p = vec(sp.p)
    a = rng.hash_combine(_float_bits(p[0]) & 0xFFFFFFFF, _float_bits(p[1]) & 0xFFFFFFFF)
    return rng.hash_combine(a, _float_bits(p[2]) & 0xFFFFFFFF)


@device
def _occlusion(scene, sp, registers, code, at):
    """The share of cosine-weighted directions about a normal in which nothing opaque lies within a distance."""
    tmax = number(registers, code, at + 1)
    count, inside, local = load_i32(code, at + 2), load_i32(code, at + 3), load_i32(code, at + 4)
    if tmax <= 0.0 or sp.instance < 0:
        return 1.0
    n = vec(sp.n)
    if load_i32(code, at + 5) >= 0:
        n = normalize(triple(registers, code, at + 5))
        n = vec(sp.n) if is_black(n) else n
    n = neg(n) if inside else n
    x, y = frame(n)
    key, rays = _key(sp), sp.registers + _RAYS
    free = 0.0
    for i in range(count):
        u0, u1 = rng.sample2(key, i, 0)
        a, b = disk(u0, u1)
        d = to_world((a, b, math.sqrt(max(1.0 - a * a - b * b, 0.0))), x, y, n)
        o = offset_origin(sp, d)
        if local:
            _t, hit, _primitive, _u, _v = _own_hit(scene, rays, sp.instance, o, d, 0.0, tmax)
            free += 1.0 if hit < 0 else 0.0
        elif not occluded(scene, rays, o, d, tmax, RAY_SHADOW_OPAQUE | BLOCKERS_OPAQUE):
            free += 1.0
    return free / count


@device
def _raycast(scene, sp, registers, code, at):
    """Out (9: hit, hit itself, distance, position, normal) of a ray from a point."""
    out = load_i32(code, at)
    p, d = triple(registers, code, at + 1), triple(registers, code, at + 2)
    tmax, local = number(registers, code, at + 3), load_i32(code, at + 4)
    store_f64(registers, out, 0.0)
    store_f64(registers, out + 1, 0.0)
    store_f64(registers, out + 2, tmax)
    store3_f64(registers, out + 3, (0.0, 0.0, 0.0))
    store3_f64(registers, out + 6, (0.0, 0.0, 0.0))
    size = length(d)
    if tmax <= 0.0 or size == 0.0 or sp.instance < 0:
        return
    unit = scale(d, 1.0 / size)
    here = vec(sp.p)
    o = offset_origin(sp, unit) if p[0] == here[0] and p[1] == here[1] and p[2] == here[2] else p
    rays = sp.registers + _RAYS
    if local:
        t, hit, primitive, u, v = _own_hit(scene, rays, sp.instance, o, unit, 0.0, tmax * size)
    else:
        seen = RAY_ALL | BLOCKERS_OPAQUE | BLOCKERS_TRANSPARENT
        t, hit, primitive, u, v = intersect(scene, rays, o, unit, 0.0, tmax * size, seen)
    if hit < 0:
        return
    t /= size
    store_f64(registers, out, 1.0)
    store_f64(registers, out + 1, 1.0 if hit == sp.instance else 0.0)
    store_f64(registers, out + 2, t)
    store3_f64(registers, out + 3, madd(p, d, t))
    store3_f64(registers, out + 6, hit_normal(scene, hit, primitive, u, v, unit))


@device
def _probe_distance(u):
    """x in [0, 1) where 1 - (1 - x)⁴ (1 + 4 x), which a disk of the kernel (1 - x)³ holds within x, is u."""
    low, high = 0.0, 1.0
    x = u
    for _ in range(_STEPS):
        y = 1.0 - x
        off = 1.0 - y * y * y * y * (1.0 + 4.0 * x) - u
        if off > 0.0:
            high = x
        else:
            low = x
        slope = 20.0 * x * y * y * y
        x = x - off / slope if slope > 0.0 else low
        if not low < x < high:
            x = 0.5 * (low + high)
    return x


@device
def _normal_about(scene, sp, radius, probes):
    """The sum of the object's normals within a radius of a point, weighted by a kernel that falls by the cube.

    Probes go along one of three axes through a disk about the point, half of them along the normal, and count by the
    power heuristic of what the axes would find (King et al. 2013, BSSRDF importance sampling).
    """
    n = vec(sp.ng)
    t, b = frame(n)
    key, rays = _key(sp), sp.registers + _RAYS
    total = (0.0, 0.0, 0.0)
    for i in range(probes):
        u0, u1 = rng.sample2(key, i, 0)
        if u0 < _ALONG:
            axis, x, y, u0 = n, t, b, u0 / _ALONG
        elif u0 < _ALONG + _ACROSS:
            axis, x, y, u0 = t, b, n, (u0 - _ALONG) / _ACROSS
        else:
            axis, x, y, u0 = b, n, t, (u0 - _ALONG - _ACROSS) / _ACROSS
        off = _probe_distance(u1)
        phi = 2.0 * math.pi * u0
        height = radius * math.sqrt(1.0 - off * off)
        aside = (radius * off * math.cos(phi), radius * off * math.sin(phi), height)
        o, d = add(vec(sp.p), to_world(aside, x, y, axis)), neg(axis)
        tmin = 0.0
        for _ in range(_HITS):
            distance, hit, primitive, u, v = _own_hit(scene, rays, sp.instance, o, d, tmin, 2.0 * height)
            if hit < 0:
                break
            tmin = distance * (1.0 + 1e-5) + 1e-9
            p, ng, _area = triangle_place(scene, hit, primitive, u, v)
            near = length(sub(p, vec(sp.p))) / radius
            if near < 1.0:
                along, across, third = _ALONG * abs(dot(n, ng)), _ACROSS * abs(dot(t, ng)), _ACROSS * abs(dot(b, ng))
                own = (_ALONG if axis == n else _ACROSS) * abs(dot(axis, ng))
                ratio = (1.0 - near) / (1.0 - off)
                weight = own / (along * along + across * across + third * third) * ratio * ratio * ratio
                total = madd(total, hit_normal(scene, hit, primitive, u, v, (0.0, 0.0, 0.0)), weight)
    return neg(total) if sp.backfacing else total


@device
def _bevel(scene, sp, registers, code, at):
    """The normal of rounded edges, onto which another may be put."""
    n = vec(sp.n)
    radius, probes = number(registers, code, at + 1), load_i32(code, at + 2)
    if radius > 0.0 and probes > 0 and sp.instance >= 0 and sp.shape == SHAPE_TRIANGLES:
        about = normalize(_normal_about(scene, sp, radius, probes))
        n = n if is_black(about) else about
    if load_i32(code, at + 3) >= 0:
        n = normalize(add(triple(registers, code, at + 3), sub(n, vec(sp.n))))
    store3_f64(registers, load_i32(code, at), n)


@entry
def ray_op(scene, sp, registers, code, at):
    """Run one instruction of this family."""
    scene, sp = scene_at(scene, 0), shading_point_at(sp, 0)
    if opcode(code, at) == ops.AMBIENT_OCCLUSION:
        store_f64(registers, load_i32(code, at), _occlusion(scene, sp, registers, code, at))
    elif opcode(code, at) == ops.BEVEL:
        _bevel(scene, sp, registers, code, at)
    else:
        _raycast(scene, sp, registers, code, at)
