"""Operands of instructions: a word of code is the index of a register, or an immediate."""

from ..core.jit import device, inlined
from ..core.memory import load_f64, load_i32
from ..core.vec import load3_f64


@inlined
def opcode(code, at):
    """The opcode of the instruction whose first operand word is that at index `at`."""
    return load_i32(code, at - 2)


@device
def number(registers, code, at):
    """The number in the register that a code word names."""
    return load_f64(registers, load_i32(code, at))


@device
def triple(registers, code, at):
    """The vector or colour in the registers that a code word names."""
    return load3_f64(registers, load_i32(code, at))


@device
def fractal_operands(registers, code, at):
    """(vector, scale, detail, roughness, lacunarity) of a texture that sums octaves; a word of its own is at + 2."""
    p, scale = triple(registers, code, at + 1), number(registers, code, at + 3)
    detail = min(max(number(registers, code, at + 4), 0.0), 15.0)
    roughness = max(number(registers, code, at + 5), 0.0)
    return p, scale, detail, roughness, number(registers, code, at + 6)
