"""Operands of instructions: a word of code is the index of a register, or an immediate."""

import math

from ...core.jit import device
from ...core.memory import bits_float, float_bits, load_f64, load_i32, store_f64


@device
def value(registers, code, at):
    """The float that operand word `at` names."""
    return load_f64(registers, load_i32(code, at))


@device
def vector(registers, code, at):
    """The three floats that operand word `at` names."""
    first = load_i32(code, at)
    return (load_f64(registers, first), load_f64(registers, first + 1), load_f64(registers, first + 2))


@device
def write(registers, first, v):
    """Store three floats from register `first` on."""
    store_f64(registers, first, v[0])
    store_f64(registers, first + 1, v[1])
    store_f64(registers, first + 2, v[2])


@device
def single(x):
    """x rounded to float32, as a lattice multiplies what rounding coordinates have; 0 for what has no lattice cell."""
    if not abs(x) < 1e15:
        return 0.0
    return bits_float(float_bits(x))


@device
def wrap(x, period):
    """x modulo a period, with the sign of x."""
    return x - period * float(int(x / period))


@device
def floor(x):
    """The whole part as a float (math.floor gives an integer in compiled code)."""
    return float(math.floor(x))


@device
def off_grid(x):
    """x moved and shrunk by a millionth, with Cycles' roundings, so that faces at whole numbers do not flicker."""
    return single(single(single(x) + 1e-6) * 0.9999989867210388)
