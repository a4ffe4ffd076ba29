"""The interpreter of shader programs (docs/architecture.md, Programs)."""

import numpy as np

from ..core.jit import Entry, device, entry, inlined, load
from ..core.memory import call_entry, load_f32, load_f64, load_i32, load_i64, record_address, store_f32, store_f64
from ..core.records import (
    MATERIAL_BUMP_UNCORRECTED,
    MATERIAL_LAMBERT,
    RAY_NO_LOBES,
    RAY_SHADOW,
    material_at,
    scene_at,
    shading_point_at,
)
from ..core.vec import LARGEST_RADIANCE, normalize, put, store3_f64, vec
from ..lobes.closure import LOBE_LAMBERT, add_closure
from ..lobes.entries import BSDF_ENTRIES, COMPANIONS, FIBRE_ENTRIES, FILM_ENTRIES, makes_no_lobes
from ..volume.program import medium_op
from . import opcodes as ops
from .bump_ops import bump_op
from .color_ops import color_op
from .input_ops import input_op
from .math_ops import clamp, math_op
from .operands import number, triple
from .ray_ops import ray_op
from .shape_ops import shape_op
from .textures import TEXTURE_ENTRIES

_PROGRAM = ops.END  # in the table of entries


@device
def _mix_weights(registers, code, at):
    weight = triple(registers, code, at + 2)
    t = clamp(number(registers, code, at + 3), 0.0, 1.0)
    s = 1.0 - t
    store3_f64(registers, load_i32(code, at), (weight[0] * s, weight[1] * s, weight[2] * s))
    store3_f64(registers, load_i32(code, at + 1), (weight[0] * t, weight[1] * t, weight[2] * t))


@device
def _emission(sp, registers, code, at):
    weight, color = triple(registers, code, at), triple(registers, code, at + 1)
    strength = number(registers, code, at + 2)
    for k in range(3):
        radiance = weight[k] * color[k] * strength
        if abs(radiance) <= LARGEST_RADIANCE:  # as in Cycles' film, what is not finite is black
            sp.emission[k] += radiance


@device
def _write_aov(sp, registers, code, at):
    channel, count, value = load_i32(code, at), load_i32(code, at + 1), load_i32(code, at + 2)
    for k in range(min(count, 3)):
        store_f32(sp.aovs, channel + k, load_f32(sp.aovs, channel + k) + load_f64(registers, value + k))
    if count == 4:
        store_f32(sp.aovs, channel + 3, load_f32(sp.aovs, channel + 3) + 1.0)


@device
def _flow_op(op, sp, registers, code, at):
    """Run an instruction of the opcodes 2–9."""
    if op == ops.MIX_WEIGHTS:
        _mix_weights(registers, code, at)
    elif op == ops.EMISSION:
        _emission(sp, registers, code, at)
    elif op == ops.HOLDOUT:
        weight = triple(registers, code, at)
        sp.holdout += (weight[0] + weight[1] + weight[2]) * (1.0 / 3.0)
    elif op == ops.DISPLACE:
        put(sp.emission, triple(registers, code, at))
    elif op == ops.AOV:
        _write_aov(sp, registers, code, at)
    elif op == ops.SET_NORMAL:
        n = normalize(triple(registers, code, at))
        if n[0] != 0.0 or n[1] != 0.0 or n[2] != 0.0:
            put(sp.n, n)


@device
def _arithmetic_op(op, registers, code, at):
    """Run an instruction of the opcodes 14–19: one or three components."""
    out, count = load_i32(code, at), load_i32(code, at + 1)
    a, b = load_i32(code, at + 2), load_i32(code, at + 3)
    for k in range(count):
        x, y = load_f64(registers, a + k), load_f64(registers, b + k)
        if op == ops.ADD:
            x += y
        elif op == ops.SUBTRACT:
            x -= y
        elif op == ops.MULTIPLY:
            x *= y
        else:
            t = number(registers, code, at + 4)
            x = x * (1.0 - t) + y * t
        store_f64(registers, out + k, x)


@device
def _conversion_op(op, registers, code, at):
    """Run an instruction of the opcodes 10–13."""
    out = load_i32(code, at)
    x, y, z = number(registers, code, at + 1), 0.0, 0.0
    if op == ops.SPLAT:
        y = x
        z = x
    elif op == ops.COMBINE:
        y = number(registers, code, at + 2)
        z = number(registers, code, at + 3)
    else:
        _, y, z = triple(registers, code, at + 1)
        if op == ops.LUMINANCE:
            store_f64(registers, out, 0.2126729 * x + 0.7151522 * y + 0.0721750 * z)
        else:
            store_f64(registers, out, (x + y + z) * (1.0 / 3.0))
        return
    store3_f64(registers, out, (x, y, z))


@inlined
def _reset(sp):
    """Clear what programs write."""
    put(sp.emission, (0.0, 0.0, 0.0))
    put(sp.transparent, (0.0, 0.0, 0.0))
    sp.holdout = 0.0
    sp.n_closures = 0


@device
def _start(scene, sp, material):
    """Clear what programs write and copy the constants."""
    _reset(sp)
    for index in range(material.n_constants):
        store_f64(sp.registers, index, load_f64(scene.constants, material.constants + index))


@device
def _run_program(scene, sp, at):
    material = material_at(scene.materials, sp.material)
    _start(scene, sp, material)
    if at < 0:
        return
    registers, code, entries = sp.registers, scene.code, scene.shader_entries
    op = load_i32(code, at)
    while op != ops.END:
        first = at + 2
        at = first + load_i32(code, at + 1)
        if op == ops.JUMP_ZERO:
            if number(registers, code, first) == 0.0:
                at += load_i32(code, first + 1)
        elif op == ops.JUMP_SHADOW:
            if sp.ray_flags & RAY_SHADOW:
                at += load_i32(code, first)
        elif op < 10:
            _flow_op(op, sp, registers, code, first)
        elif op < 14:
            _conversion_op(op, registers, code, first)
        elif op < 20:
            _arithmetic_op(op, registers, code, first)
        elif not makes_no_lobes(op, sp):
            call_entry(load_i64(entries, op), record_address(scene), record_address(sp), registers, code, first)
        op = load_i32(code, at)


@device
def shader_eval(scene, sp):
    """Run the program of sp.material: sets the closures, emission, transparent and holdout of sp.

    With one of RAY_NO_LOBES among sp.ray_flags no closures with a BSDF are made.
    """
    material = material_at(scene.materials, sp.material)
    sp.bump_uncorrected = 1 if material.flags & MATERIAL_BUMP_UNCORRECTED else 0
    if material.flags & MATERIAL_LAMBERT:
        _reset(sp)
        if sp.ray_flags & RAY_NO_LOBES == 0:
            add_closure(sp, LOBE_LAMBERT, vec(material.lambert), vec(sp.n))
        return
    call_entry(load_i64(scene.shader_entries, _PROGRAM), record_address(scene), record_address(sp), material.code, 0, 0)


@device
def medium_eval(scene, sp):
    """Run the program of the medium behind sp.material: see kernels.volume.program for what it leaves in sp."""
    start = material_at(scene.materials, sp.material).medium
    call_entry(load_i64(scene.shader_entries, _PROGRAM), record_address(scene), record_address(sp), start, 0, 0)


@device
def write_aovs(scene, sp, aovs):
    """Run what AOV Output nodes of sp.material add to a pixel's AOVs, whose floats begin at an address.

    What the surface's program has left in sp is lost.
    """
    start = material_at(scene.materials, sp.material).aovs
    if start >= 0:
        sp.aovs = aovs
        call_entry(load_i64(scene.shader_entries, _PROGRAM), record_address(scene), record_address(sp), start, 0, 0)


@device
def displacement_eval(scene, sp):
    """How far the displacement of sp.material moves the point sp, in world space: to sp.emission."""
    start = material_at(scene.materials, sp.material).displacement
    call_entry(load_i64(scene.shader_entries, _PROGRAM), record_address(scene), record_address(sp), start, 0, 0)


@entry
def _program(scene, sp, start, _code, _at):
    _run_program(scene_at(scene, 0), shading_point_at(sp, 0), start)


# What is called by address, by opcode. An entry is compiled once, on its own, when a scene first needs it, so that the
# kernels that run programs stay small. Those of instructions are given the addresses of scene, shading point, registers
# and code, and the index of the first operand word.
_FAMILIES = {ops.MATH: math_op, ops.MIX_COLOR: color_op, ops.GEOMETRY: input_op, ops.BUMP: bump_op}  # twenty each
_ENTRIES: dict[int, Entry] = {
    _PROGRAM: _program,
    **{first + k: family for first, family in _FAMILIES.items() for k in range(20)},
    **TEXTURE_ENTRIES,
    **BSDF_ENTRIES,
    **FILM_ENTRIES,
    **FIBRE_ENTRIES,
    **dict.fromkeys((ops.AMBIENT_OCCLUSION, ops.RAYCAST, ops.BEVEL), ray_op),
    ops.SHAPE_INFO: shape_op,
    **dict.fromkeys(range(ops.VOLUME_SCATTER, ops.VOLUME_ATTRIBUTE + 1), medium_op),
}


def opcodes_in(code: np.ndarray) -> set[int]:
    """The opcodes of the instructions in `code`."""
    words, at, found = code.tolist(), 0, set()
    while at < len(words):
        found.add(words[at])
        at += 2 + words[at + 1]
    return found


def shader_entries(code: np.ndarray) -> np.ndarray:
    """Addresses by opcode of what runs these programs, compiled where it is not yet; 0 for what none of them needs."""
    table = np.zeros(max(_ENTRIES) + 1, np.int64)
    found = opcodes_in(code)
    needed = {_PROGRAM} | (found & _ENTRIES.keys()) | {COMPANIONS[op] for op in found & COMPANIONS.keys()}
    load(_ENTRIES[op] for op in needed)
    for op in needed:
        table[op] = _ENTRIES[op].address
    return table
