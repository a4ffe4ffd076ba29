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
