"""Shader instructions that trace rays of their own: Ambient Occlusion and Raycast."""

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
    scene_at,
    shading_point_at,
)
from ..core.vec import frame, is_black, length, madd, neg, normalize, scale, store3_f64, to_world, vec
from ..core.warp import disk
from ..geometry.intersect import intersect, occluded
from ..geometry.surface import hit_normal, offset_origin
from . import opcodes as ops
from .operands import number, opcode, triple

# Where a program's own rays stand, from its registers on: behind them.
_RAYS = 8 * MAX_REGISTERS
_CROSSINGS = 64  # of other objects, by rays that only their own counts for


@device
def _own_hit(scene, rays, instance, o, d, tmax):
    """The nearest hit with an instance, or -1 for its distance: (t, instance, primitive, u, v)."""
    tmin = 0.0
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
            _t, hit, _primitive, _u, _v = _own_hit(scene, rays, sp.instance, o, d, tmax)
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
        t, hit, primitive, u, v = _own_hit(scene, rays, sp.instance, o, unit, tmax * size)
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


@entry
def ray_op(scene, sp, registers, code, at):
    """Run one instruction of this family."""
    scene, sp = scene_at(scene, 0), shading_point_at(sp, 0)
    if opcode(code, at) == ops.AMBIENT_OCCLUSION:
        store_f64(registers, load_i32(code, at), _occlusion(scene, sp, registers, code, at))
    else:
        _raycast(scene, sp, registers, code, at)
