"""Integer hashes: Bob Jenkins' lookup3 (http://burtleburtle.net/bob/c/lookup3.c) and PCG of several dimensions.

The lookup3 hashes are emitted as 32-bit instructions: int64 arithmetic with masks runs at half the speed, and
every lattice noise is nothing but hashes. Keys and results are int64, of which the low 32 bits count.
"""

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from ...core.jit import device
from ...core.memory import float_bits

_U32 = ir.IntType(32)
_SEED = 0xDEADBEEF + 13
# lookup3's two mixers on a, b, c = 0, 1, 2: (target, rotated, added, rotation) and (target, rotated, rotation).
_MIX = ((0, 2, 1, 4), (1, 0, 2, 6), (2, 1, 0, 8), (0, 2, 1, 16), (1, 0, 2, 19), (2, 1, 0, 4))
_FINAL = ((2, 1, 14), (0, 2, 11), (1, 0, 25), (2, 1, 16), (0, 2, 4), (1, 0, 14), (2, 1, 24))


def splat(kind, value):
    """A constant of an LLVM type, in all lanes of a vector."""
    if isinstance(kind, ir.VectorType):
        return ir.Constant(kind, [ir.Constant(kind.element, value)] * kind.count)
    return ir.Constant(kind, value)


def _rotate(builder, value, bits):
    left = builder.shl(value, splat(value.type, bits))
    return builder.or_(left, builder.lshr(value, splat(value.type, 32 - bits)))


def emit_lookup3(builder, keys):
    """Instructions for the hash of one to four i32 values, or of vectors of them."""
    state = [splat(keys[0].type, (_SEED + 4 * len(keys)) & 0xFFFFFFFF)] * 3
    for i, key in enumerate(keys[:3]):
        state[i] = builder.add(state[i], key)
    if len(keys) == 4:
        for target, rotated, added, bits in _MIX:
            difference = builder.sub(state[target], state[rotated])
            state[target] = builder.xor(difference, _rotate(builder, state[rotated], bits))
            state[rotated] = builder.add(state[rotated], state[added])
        state[0] = builder.add(state[0], keys[3])
    for target, rotated, bits in _FINAL:
        mixed = builder.xor(state[target], state[rotated])
        state[target] = builder.sub(mixed, _rotate(builder, state[rotated], bits))
    return state[2]


@intrinsic
def lookup3(typingctx, keys):
    """lookup3 of a tuple of one to four 32-bit keys, in 0 … 2³² - 1."""

    def codegen(context, builder, signature, args):
        keys = [builder.trunc(key, _U32) for key in cgutils.unpack_tuple(builder, args[0])]
        return builder.zext(emit_lookup3(builder, keys), ir.IntType(64))

    return types.int64(keys), codegen


TO_UNIT = 1.0 / 4294967296.0
ONE_BITS = 0x3F800000  # of 1.0 and 2.0 as float32: they tell the components of one key apart
TWO_BITS = 0x40000000


@device
def cell_color(dimensions, x, y, z, w):
    """Three numbers in [0, 1) from the float32 bits of the first `dimensions` coordinates (1D: x)."""
    i = float_bits(x)
    if dimensions == 1:
        a, b, c = lookup3((i,)), lookup3((i, ONE_BITS)), lookup3((i, TWO_BITS))
        return (a * TO_UNIT, b * TO_UNIT, c * TO_UNIT)
    j = float_bits(y)
    if dimensions == 2:
        a, b, c = lookup3((i, j)), lookup3((i, j, ONE_BITS)), lookup3((i, j, TWO_BITS))
        return (a * TO_UNIT, b * TO_UNIT, c * TO_UNIT)
    k = float_bits(z)
    if dimensions == 3:
        a, b, c = lookup3((i, j, k)), lookup3((i, j, k, ONE_BITS)), lookup3((i, j, k, TWO_BITS))
        return (a * TO_UNIT, b * TO_UNIT, c * TO_UNIT)
    m = float_bits(w)
    a, b, c = lookup3((i, j, k, m)), lookup3((k, i, m, j)), lookup3((m, k, j, i))
    return (a * TO_UNIT, b * TO_UNIT, c * TO_UNIT)


@device
def cell_point(dimensions, x, y, z, w):
    """A point in the unit cube of `dimensions` from the float32 bits of the coordinates; 0 beyond."""
    i = float_bits(x)
    if dimensions == 1:
        return (lookup3((i,)) * TO_UNIT, 0.0, 0.0, 0.0)
    j = float_bits(y)
    if dimensions == 2:
        return (lookup3((i, j)) * TO_UNIT, lookup3((i, j, ONE_BITS)) * TO_UNIT, 0.0, 0.0)
    if dimensions == 3:
        a, b, c = cell_color(3, x, y, z, 0.0)
        return (a, b, c, 0.0)
    k, m = float_bits(z), float_bits(w)
    a, b, c, d = lookup3((i, j, k, m)), lookup3((m, i, j, k)), lookup3((k, m, i, j)), lookup3((j, k, m, i))
    return (a * TO_UNIT, b * TO_UNIT, c * TO_UNIT, d * TO_UNIT)


@device
def _signed(x):
    """The low 32 bits as a two's complement number."""
    return ((x & 0xFFFFFFFF) ^ 0x80000000) - 0x80000000


@device
def _fold(x):
    x = _signed(x)
    return x ^ (x >> 16)


@device
def pcg_point(dimensions, i, j, k, m):
    """A point in the unit cube of 2 to 4 dimensions from integers (Jarzynski and Olano 2020, signed variant)."""
    i = i * 1664525 + 1013904223
    j = j * 1664525 + 1013904223
    k = k * 1664525 + 1013904223
    m = m * 1664525 + 1013904223
    for turn in range(2):
        if dimensions == 2:
            i += j * 1664525
            j += i * 1664525
        elif dimensions == 3:
            i += j * k
            j += k * i
            k += i * j
        else:
            i += j * m
            j += k * i
            k += i * j
            m += j * k
        if turn == 0:
            i, j, k, m = _fold(i), _fold(j), _fold(k), _fold(m)
    scale = 1.0 / 2147483648.0
    a, b, c, d = i & 0x7FFFFFFF, j & 0x7FFFFFFF, k & 0x7FFFFFFF, m & 0x7FFFFFFF
    return (
        a * scale,
        b * scale,
        c * scale if dimensions > 2 else 0.0,
        d * scale if dimensions > 3 else 0.0,
    )
