"""Elementary functions for innermost loops: right to 1e-9, inlined where they are used, several of them side by side.

The C library's are right to the last bit, and a call each.
"""

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from .jit import inlined

_ROUND = 6755399441055744.0  # 1.5 2^52: a sum with it has no bits behind the point
_LOG2_E = 1.4426950408889634
_LN_2 = 0.6931471805599453


@intrinsic
def _power_of_two(typingctx, rounded):
    """2^k for k + _ROUND, whose lowest bits are those of the integer k."""

    def codegen(context, builder, signature, args):
        word = ir.IntType(64)
        bits = builder.add(builder.bitcast(args[0], word), word(1023))
        return builder.bitcast(builder.shl(bits, word(52)), ir.DoubleType())

    return types.float64(types.float64), codegen


@intrinsic
def _mantissa_exponent(typingctx, x):
    """(m, e) with x = m 2^e, m in [1/√2, √2), for a positive normal number x."""

    def codegen(context, builder, signature, args):
        word, double = ir.IntType(64), ir.DoubleType()
        # The bits of 1/√2 taken off, what carries into the exponent is the number of doublings above 1/√2.
        shifted = builder.sub(builder.bitcast(args[0], word), word(0x3FE6A09E667F3BCD))
        exponent = builder.ashr(shifted, word(52))
        mantissa = builder.sub(builder.bitcast(args[0], word), builder.shl(exponent, word(52)))
        parts = (builder.bitcast(mantissa, double), builder.sitofp(exponent, double))
        return context.make_tuple(builder, signature.return_type, parts)

    return types.UniTuple(types.float64, 2)(types.float64), codegen


@inlined
def exp(x):
    """e^x for x in [-700, 700]."""
    rounded = x * _LOG2_E + _ROUND
    f = x - (rounded - _ROUND) * _LN_2
    f2 = f * f
    f4 = f2 * f2
    low = 1.0 + f + f2 * (0.5 + f * (1.0 / 6.0))
    high = (1.0 / 24.0 + f * (1.0 / 120.0)) + f2 * (1.0 / 720.0 + f * (1.0 / 5040.0)) + f4 * (1.0 / 40320.0)
    return (low + f4 * high) * _power_of_two(rounded)


@inlined
def log(x):
    """ln x for normal numbers x > 0."""
    m, e = _mantissa_exponent(x)
    s = (m - 1.0) / (m + 1.0)
    s2 = s * s
    series = 1.0 + s2 * (1.0 / 3.0 + s2 * (1.0 / 5.0 + s2 * (1.0 / 7.0 + s2 * (1.0 / 9.0 + s2 * (1.0 / 11.0)))))
    return e * _LN_2 + 2.0 * s * series


@inlined
def circle(u):
    """(cos, sin) of 2 pi u for u in [0, 1]."""
    quarters = 4.0 * u
    q = int(quarters + 0.5)
    x = (quarters - q) * 1.5707963267948966
    x2 = x * x
    tail = 1.0 / 5040.0 - x2 * (1.0 / 362880.0 - x2 * (1.0 / 39916800.0))
    s = x * (1.0 - x2 * (1.0 / 6.0 - x2 * (1.0 / 120.0 - x2 * tail)))
    c = 1.0 - x2 * (0.5 - x2 * (1.0 / 24.0 - x2 * (1.0 / 720.0 - x2 * (1.0 / 40320.0 - x2 * (1.0 / 3628800.0)))))
    if q & 1:
        s, c = c, -s
    return (-c, -s) if q & 2 else (c, s)
