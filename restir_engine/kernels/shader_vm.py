"""The interpreter of shader programs (docs/architecture.md, Programs)."""

from . import opcodes as ops
from .jit import device
from .lobes import bsdf_op
from .memory import load_f64, load_i32, store_f64
from .records import material_at
from .textures import texture_op
from .vec import normalize, put, store3_f64
from .vm_bump import bump_op
from .vm_color import color_op
from .vm_inputs import input_op
from .vm_math import clamp, math_op, number, triple


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
        sp.emission[k] += weight[k] * color[k] * strength


@device
def _flow_op(op, scene, sp, registers, code, at):
    """Run an instruction of the opcodes 2–9."""
    if op == ops.MIX_WEIGHTS:
        _mix_weights(registers, code, at)
    elif op == ops.EMISSION:
        _emission(sp, registers, code, at)
    elif op == ops.HOLDOUT:
        weight = triple(registers, code, at)
        sp.holdout += (weight[0] + weight[1] + weight[2]) * (1.0 / 3.0)
    elif op == ops.SET_NORMAL:
        n = normalize(triple(registers, code, at))
        if n[0] != 0.0 or n[1] != 0.0 or n[2] != 0.0:
            put(sp.n, n)


@device
def _start(scene, sp, material):
    """Clear what programs write and copy the constants."""
    for k in range(3):
        sp.emission[k] = 0.0
        sp.transparent[k] = 0.0
    sp.holdout = 0.0
    sp.n_closures = 0
    for index in range(material.n_constants):
        store_f64(sp.registers, index, load_f64(scene.constants, material.constants + index))


@device
def shader_eval(scene, sp):
    """Run the program of sp.material: sets the closures, emission, transparent and holdout of sp.

    With RAY_SHADOW or RAY_EMISSION among sp.ray_flags no closures with a BSDF are made.
    """
    material = material_at(scene.materials, sp.material)
    _start(scene, sp, material)
    if material.code < 0:
        return
    registers, code = sp.registers, scene.code
    at = material.code
    op = load_i32(code, at)
    while op != ops.END:
        first = at + 2
        at = first + load_i32(code, at + 1)
        if op == ops.JUMP_ZERO:
            if number(registers, code, first) == 0.0:
                at += load_i32(code, first + 1)
        elif op < 10:
            _flow_op(op, scene, sp, registers, code, first)
        elif op < 40:
            math_op(op, registers, code, first)
        elif op < 60:
            color_op(op, scene, registers, code, first)
        elif op < 80:
            input_op(op, scene, sp, registers, code, first)
        elif op < 100:
            bump_op(op, scene, sp, registers, code, first)
        elif op < 200:
            texture_op(op, scene, sp, registers, code, first)
        else:
            bsdf_op(op, scene, sp, registers, code, first)
        op = load_i32(code, at)
