"""Arithmetic of single precision for loops over rows of floats, which LLVM makes vector code of.

What `memory` loads is float64 at once. Here loads are float32 and stay it, as long as all that they meet is float32
too: constants are np.float32 of the module. Rows that a loop reads and writes should have one base address in common,
so that LLVM sees that they are apart.
"""

import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from .jit import inlined

_LOG2_E, _ROUND = np.float32(1.4426950408889634), np.float32(12582912.0)  # 1.5 2^23
_LEAST = np.float32(-125.0)
# 2^f for f in [-1/2, 1/2], to 2e-7: Taylor's series.
_C0, _C1, _C2 = np.float32(1.0), np.float32(0.6931471805599453), np.float32(0.2402265069591007)
_C3, _C4, _C5 = np.float32(0.05550410866482158), np.float32(0.009618129107628477), np.float32(0.0013333558146428443)


def _pointer(builder, base, index):
    return builder.gep(builder.inttoptr(base, ir.FloatType().as_pointer()), [index])


@intrinsic
def load_single(typingctx, base, index):
    """The float32 of an index from an address."""

    def codegen(context, builder, signature, args):
        return builder.load(_pointer(builder, *args))

    return types.float32(types.int64, types.int64), codegen


@intrinsic
def store_single(typingctx, base, index, value):
    """Set it."""

    def codegen(context, builder, signature, args):
        builder.store(args[2], _pointer(builder, *args[:2]))
        return context.get_dummy_value()

    return types.void(types.int64, types.int64, types.float32), codegen


@intrinsic
def _power_of_two(typingctx, rounded):
    """2^k for k + _ROUND, whose lowest bits are those of the integer k."""

    def codegen(context, builder, signature, args):
        word = ir.IntType(32)
        bits = builder.add(builder.bitcast(args[0], word), word(127))
        return builder.bitcast(builder.shl(bits, word(23)), ir.FloatType())

    return types.float32(types.float32), codegen


@inlined
def exp_single(x):
    """e^x for x <= 0, right to 1e-6 of it plus 1e-7 x; below e^-86 it stays there."""
    t = max(x * _LOG2_E, _LEAST)
    rounded = t + _ROUND
    f = t - (rounded - _ROUND)
    return (_C0 + f * (_C1 + f * (_C2 + f * (_C3 + f * (_C4 + f * _C5))))) * _power_of_two(rounded)
