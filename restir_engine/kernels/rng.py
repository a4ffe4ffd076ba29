"""Random numbers without state: a point of a scrambled Sobol' sequence for each (key, index, dimension).

`key` names a pixel, frame and stream, `index` the sample, `dimension` the decision within the sample. The same three
give the same numbers always, so that a path can be replayed from its key. Each pair of dimensions is a (0,2)-sequence
in base 2, shuffled and Owen-scrambled by hashing (Burley 2020, "Practical Hash-based Owen Scrambling"); pairs are
independent of each other. Different keys are independent.
"""

from .jit import device


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


@device
def _reverse(x):
    x = ((x & 0x55555555) << 1) | ((x >> 1) & 0x55555555)
    x = ((x & 0x33333333) << 2) | ((x >> 2) & 0x33333333)
    x = ((x & 0x0F0F0F0F) << 4) | ((x >> 4) & 0x0F0F0F0F)
    x = ((x & 0x00FF00FF) << 8) | ((x >> 8) & 0x00FF00FF)
    return ((x & 0xFFFF) << 16) | (x >> 16)


@device
def _laine_karras(x, seed):
    """Owen scrambling of bit-reversed numbers: a bit is flipped depending on the bits below it."""
    x = (x + seed) & 0xFFFFFFFF
    x = x ^ (x * 0x6C50B47C & 0xFFFFFFFF)
    x = x ^ (x * 0xB82F1E52 & 0xFFFFFFFF)
    x = x ^ (x * 0xC7AFE638 & 0xFFFFFFFF)
    x = x ^ (x * 0x8D22F6E6 & 0xFFFFFFFF)
    return x


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
def sample2(key, index, dimension):
    """Two numbers in [0, 1), jointly stratified over the indices of a key."""
    seed = hash_combine(key, dimension)
    shuffled = _scramble(index, seed)
    a = _laine_karras(shuffled, hash_u32(seed ^ 0x68BC21EB))
    b = _laine_karras(_sobol_second(shuffled), hash_u32(seed ^ 0x02E5BE93))
    return _reverse(a) * (1.0 / 4294967296.0), _reverse(b) * (1.0 / 4294967296.0)


@device
def sample1(key, index, dimension):
    """One number in [0, 1), stratified over the indices of a key."""
    seed = hash_combine(key, dimension)
    shuffled = _scramble(index, seed)
    return _reverse(_laine_karras(shuffled, hash_u32(seed ^ 0x68BC21EB))) * (1.0 / 4294967296.0)
