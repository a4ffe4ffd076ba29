"""Rounding as Cycles does it: coordinates in single precision, lattices that repeat."""

import math

from ...core.jit import device
from ...core.memory import bits_float, float_bits


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
