"""The instructions of the Volume socket's programs.

They leave scattering as closures (kind: a PHASE_*, weight: coefficient by scene unit), extinction in `transparent` and
emission in `emission` of the shading point, and add up like Cycles' volume closures.
"""

import math

from ..core.jit import device, entry, inlined
from ..core.memory import load_i32, store_f64
from ..core.records import RAY_SHADOW, closure_at, scene_at, shading_point_at
from ..core.vec import add, mul, put, scale, store3_f64, vec
from ..geometry.attributes import attribute
from ..lobes.closure import add_closure
from ..shading import opcodes as ops
from ..shading.operands import number, opcode, triple
from ..subsurface.parameters import clamp_anisotropy, medium, method_length
from .phase import (
    MOST_ANISOTROPIC,
    PHASE_DRAINE,
    PHASE_FOURNIER_FORAND,
    PHASE_HG,
    PHASE_MIE,
    fournier_forand_parameters,
    mie_mixture,
)

_STEFAN_BOLTZMANN = 5.670373e-8 * 1.0e-6 / math.pi  # in the unit of Principled Volume's blackbody emission


@inlined
def _limit(g):
    return min(max(g, -MOST_ANISOTROPIC), MOST_ANISOTROPIC)


@device
def _add_phase(sp, kind, weight, a, b, c):
    if sp.ray_flags & RAY_SHADOW:
        return
    i = add_closure(sp, kind, weight, (0.0, 0.0, 1.0))
    if i >= 0:
        p = closure_at(sp.closures, i).p
        p[0], p[1], p[2] = a, b, c


@device
def _scatter(sp, kind, weight, a, b):
    """Add a phase function by its node's inputs: g (or IOR, diameter), and α (or backscatter)."""
    if kind == PHASE_MIE:
        g, draine, alpha, share = mie_mixture(a)
        _add_phase(sp, PHASE_HG, scale(weight, 1.0 - share), _limit(g), 0.0, 0.0)
        _add_phase(sp, PHASE_DRAINE, scale(weight, share), _limit(draine), alpha, 0.0)
    elif kind == PHASE_FOURNIER_FORAND:
        nu, per_sine, last = fournier_forand_parameters(b, a)
        _add_phase(sp, kind, weight, nu, per_sine, last)
    else:
        _add_phase(sp, kind, weight, _limit(a), b, 0.0)


@inlined
def _extinguish(sp, coefficient):
    put(sp.transparent, add(vec(sp.transparent), coefficient))


@inlined
def _emit(sp, radiance):
    put(sp.emission, add(vec(sp.emission), radiance))


@entry
def medium_op(scene, sp, registers, code, at):
    """Run an instruction of the family from VOLUME_SCATTER on."""
    sp = shading_point_at(sp, 0)
    op = opcode(code, at)
    if op == ops.VOLUME_ATTRIBUTE:
        found, x, y, z, w = attribute(scene_at(scene, 0), sp, load_i32(code, at + 1), 0.0, 0.0)
        out = load_i32(code, at)
        store3_f64(registers, out, (x, y, z) if found else (1.0, 1.0, 1.0))
        store_f64(registers, out + 3, w if found else 1.0)
        return
    weight = triple(registers, code, at)
    if op == ops.VOLUME_SCATTER:
        w = scale(mul(weight, triple(registers, code, at + 1)), max(number(registers, code, at + 2), 0.0))
        _scatter(sp, load_i32(code, at + 3), w, number(registers, code, at + 4), number(registers, code, at + 5))
        _extinguish(sp, w)
    elif op == ops.VOLUME_ABSORPTION:
        c = triple(registers, code, at + 1)
        density = max(number(registers, code, at + 2), 0.0)
        _extinguish(sp, scale(mul(weight, (1.0 - c[0], 1.0 - c[1], 1.0 - c[2])), density))
    elif op == ops.VOLUME_COEFFICIENTS:
        scattering = mul(weight, triple(registers, code, at + 2))
        kind = load_i32(code, at + 4)
        _scatter(sp, kind, scattering, number(registers, code, at + 5), number(registers, code, at + 6))
        _extinguish(sp, add(scattering, mul(weight, triple(registers, code, at + 1))))
        _emit(sp, mul(weight, triple(registers, code, at + 3)))
    elif op == ops.VOLUME_PRINCIPLED:
        _principled(sp, weight, registers, code, at)
    else:
        _subsurface(sp, weight, registers, code, at)


@device
def _principled(sp, weight, registers, code, at):
    color = triple(registers, code, at + 1)
    density = max(number(registers, code, at + 2), 0.0)
    if density > 0.0:
        absorbing = triple(registers, code, at + 4)
        _scatter(sp, PHASE_HG, scale(mul(weight, color), density), number(registers, code, at + 3), 0.0)
        r = color[0] + max(1.0 - color[0], 0.0) * max(1.0 - math.sqrt(max(absorbing[0], 0.0)), 0.0)
        g = color[1] + max(1.0 - color[1], 0.0) * max(1.0 - math.sqrt(max(absorbing[1], 0.0)), 0.0)
        b = color[2] + max(1.0 - color[2], 0.0) * max(1.0 - math.sqrt(max(absorbing[2], 0.0)), 0.0)
        _extinguish(sp, scale(mul(weight, (r, g, b)), density))
    strength = number(registers, code, at + 5)
    if strength > 0.0:
        _emit(sp, scale(mul(weight, triple(registers, code, at + 6)), strength))
    blackbody = number(registers, code, at + 7)
    if blackbody > 0.0:
        t = max(number(registers, code, at + 9), 0.0)
        power = 1.0 - blackbody + blackbody * t * t * t * t
        tint = mul(triple(registers, code, at + 8), triple(registers, code, at + 10))
        if power > 0.0:
            _emit(sp, scale(mul(weight, tint), _STEFAN_BOLTZMANN * power))


@device
def _subsurface(sp, weight, registers, code, at):
    """The medium of Principled's subsurface parameters, thinned by its weight."""
    weight = scale(weight, min(max(number(registers, code, at + 1), 0.0), 1.0))
    c = triple(registers, code, at + 2)
    color = (max(c[0], 0.0), max(c[1], 0.0), max(c[2], 0.0))
    r = scale(triple(registers, code, at + 3), number(registers, code, at + 4))
    radius = (max(r[0], 0.0), max(r[1], 0.0), max(r[2], 0.0))
    method = load_i32(code, at + 7)
    g = clamp_anisotropy(number(registers, code, at + 5), method, load_i32(code, at + 8))
    ior = min(max(number(registers, code, at + 6), 1.01), 3.8)
    sigma_t, albedo = medium(color, method_length(radius, color, ior, method), g, method)
    _scatter(sp, PHASE_HG, mul(weight, mul(sigma_t, albedo)), g, 0.0)
    _extinguish(sp, mul(weight, sigma_t))
