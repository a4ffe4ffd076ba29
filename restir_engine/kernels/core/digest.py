"""Digests of memory, by which arrays are found to be what they were."""

import numpy as np

from .jit import inlined, kernel
from .memory import address, load_i64, load_u8, store_i64

# The constants of MurmurHash3, those above 2^63 as the int64 of the same bits.
_C1, _C2 = -0x783C846EEEBDAC2B, 0x4CF5AD432745937F
_F1, _F2 = -0x00AE502812AA7333, -0x3B314601E57A13AD


def digest(array: np.ndarray) -> tuple[int, int]:
    """128 bits of the bytes of a contiguous array: other bytes have the same with a chance of 2^-64 at the most."""
    out = np.zeros(2, np.int64)
    if array.size:
        murmur3(array.ctypes.data, array.nbytes, address(out))
    return int(out[0]), int(out[1])


@kernel
def murmur3(data, n, out):
    """MurmurHash3_x64_128 (Appleby) of n bytes, with a seed of 0: two int64 to `out`."""
    h1 = 0
    h2 = 0
    blocks = n // 16
    for i in range(blocks):
        h1 ^= _mixed_1(load_i64(data, 2 * i))
        h1 = (_rotated(h1, 27) + h2) * 5 + 0x52DCE729
        h2 ^= _mixed_2(load_i64(data, 2 * i + 1))
        h2 = (_rotated(h2, 31) + h1) * 5 + 0x38495AB5
    k1 = 0
    k2 = 0
    for i in range(n - 16 * blocks):
        byte = load_u8(data, 16 * blocks + i)
        if i < 8:
            k1 |= byte << (8 * i)
        else:
            k2 |= byte << (8 * (i - 8))
    h2 ^= _mixed_2(k2)
    h1 ^= _mixed_1(k1)
    h1 ^= n
    h2 ^= n
    h1 += h2
    h2 += h1
    h1 = _final(h1)
    h2 = _final(h2)
    h1 += h2
    h2 += h1
    store_i64(out, 0, h1)
    store_i64(out, 1, h2)


@inlined
def _rotated(x, bits):
    return (x << bits) | ((x >> (64 - bits)) & ((1 << bits) - 1))


@inlined
def _mixed_1(k):
    return _rotated(k * _C1, 31) * _C2


@inlined
def _mixed_2(k):
    return _rotated(k * _C2, 33) * _C1


@inlined
def _final(k):
    """Every bit of k changes every bit of this with a chance of a half."""
    k = (k ^ ((k >> 33) & 0x7FFFFFFF)) * _F1
    k = (k ^ ((k >> 33) & 0x7FFFFFFF)) * _F2
    return k ^ ((k >> 33) & 0x7FFFFFFF)
