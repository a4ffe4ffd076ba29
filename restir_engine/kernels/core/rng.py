"""Random numbers without state: a point of a scrambled Sobol' sequence for each (key, index, dimension).

`key` names a pixel, frame and stream, `index` the sample, `dimension` the decision within the sample. The same three
give the same numbers always, so that a path can be replayed from its key. Each pair of dimensions is a (0,2)-sequence
in base 2, shuffled and Owen-scrambled by hashing (Burley 2020, "Practical Hash-based Owen Scrambling"); pairs are
independent of each other. Different keys are independent.

Where nobody knows how many numbers there will be and stratification is of no use any more, deep in a random walk, a
`stream` gives plain random numbers for a tenth of the time.
"""

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from .jit import device, inlined


@device
def hash_u32(x):
    """A bijective 32-bit hash (lowbias32 by Wellons), on int64 that holds 32 bits."""
    x = x & 0xFFFFFFFF
    x ^= x >> 16
    x = (x * 0x7FEB352D) & 0xFFFFFFFF
    x ^= x >> 15
    x = (x * 0x846CA68B) & 0xFFFFFFFF
    x ^= x >> 16
    return x


@device
def hash_combine(a, b):
    """One 32-bit hash of two."""
    return hash_u32(a ^ (hash_u32(b + 0x9E3779B9) * 0x85EBCA6B & 0xFFFFFFFF))


@device
def key(seed, x, y, stream):
    """The 32-bit key of a pixel (x, y) and a stream under a seed."""
    return hash_combine(hash_combine(hash_combine(seed, x), y), stream)


@intrinsic
def _reverse(typingctx, x):
    """The low 32 bits in reverse order."""

    def codegen(context, builder, signature, args):
        word = ir.IntType(32)
        reversal = builder.module.declare_intrinsic("llvm.bitreverse", [word])
        return builder.zext(builder.call(reversal, [builder.trunc(args[0], word)]), ir.IntType(64))

    return types.int64(types.int64), codegen


@device
def _laine_karras(x, seed):
    """Owen scrambling of bit-reversed numbers: bits below it decide whether one is flipped (Vegdahl's constants)."""
    x = x ^ (x * 0x3D20ADEA & 0xFFFFFFFF)
    x = (x + seed) & 0xFFFFFFFF
    x = x * ((seed >> 16) | 1) & 0xFFFFFFFF
    x = x ^ (x * 0x05526C56 & 0xFFFFFFFF)
    return x ^ (x * 0x53A22864 & 0xFFFFFFFF)


@device
def _scramble(x, seed):
    return _reverse(_laine_karras(_reverse(x), seed))


@device
def _sobol_second(x):
    """The second Sobol' dimension of index x, bits reversed (multiplication by Pascal's matrix mod 2)."""
    x ^= x >> 16
    x ^= (x & 0xFF00FF00) >> 8
    x ^= (x & 0xF0F0F0F0) >> 4
    x ^= (x & 0xCCCCCCCC) >> 2
    x ^= (x & 0xAAAAAAAA) >> 1
    return x


@device
def _seed(key, dimension):
    return hash_u32(key + dimension * 0x9E3779B9)


@device
def sample2(key, index, dimension):
    """Two numbers in [0, 1), jointly stratified over the indices of a key."""
    seed = _seed(key, dimension)
    shuffled = _scramble(index, seed)
    a = _laine_karras(shuffled, (seed * 0x2C1B3C6D) & 0xFFFFFFFF)
    b = _laine_karras(_sobol_second(shuffled), (seed * 0x297A2D39) & 0xFFFFFFFF)
    return _reverse(a) * (1.0 / 4294967296.0), _reverse(b) * (1.0 / 4294967296.0)


@device
def sample1(key, index, dimension):
    """One number in [0, 1), stratified over the indices of a key."""
    seed = _seed(key, dimension)
    shuffled = _scramble(index, seed)
    return _reverse(_laine_karras(shuffled, (seed * 0x2C1B3C6D) & 0xFFFFFFFF)) * (1.0 / 4294967296.0)


@intrinsic
def _split_mix(typingctx, state):
    """(next state, two numbers in [0, 1)); an intrinsic, as Numba takes it that signed integers never overflow."""

    def codegen(context, builder, signature, args):
        word = ir.IntType(64)
        state = builder.add(args[0], word(0x9E3779B97F4A7C15))
        z = state
        for shift, factor in ((30, 0xBF58476D1CE4E5B9), (27, 0x94D049BB133111EB)):
            z = builder.mul(builder.xor(z, builder.lshr(z, word(shift))), word(factor))
        z = builder.xor(z, builder.lshr(z, word(31)))
        halves = (builder.trunc(z, ir.IntType(32)), builder.trunc(builder.lshr(z, word(32)), ir.IntType(32)))
        unit = ir.DoubleType()(1.0 / 4294967296.0)
        numbers = [builder.fmul(builder.uitofp(half, ir.DoubleType()), unit) for half in halves]
        return context.make_tuple(builder, signature.return_type, (state, *numbers))

    return types.Tuple((types.int64, types.float64, types.float64))(types.int64), codegen


@device
def stream(key, index, dimension):
    """The first state of a stream of random numbers, for `advance`."""
    return (_seed(key, dimension) << 32) ^ hash_u32(index ^ 0x5BF03635)


@inlined
def advance(state):
    """(next state, two numbers in [0, 1)): SplitMix64 (Steele, Lea and Flood 2014), whose 64 bits make two numbers."""
    return _split_mix(state)
