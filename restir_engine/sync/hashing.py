"""The hashes by which Cycles turns names and indices into "random" numbers (Jenkins' lookup3)."""

import numpy as np


def _rotate(x, bits):
    return ((x << np.uint64(bits)) | (x >> np.uint64(32 - bits))) & np.uint64(0xFFFFFFFF)


def _final(a, b, c):
    mask = np.uint64(0xFFFFFFFF)
    for bits in (14, 11, 25, 16, 4, 14, 24):
        # Each step: c ^= b; c -= rotate(b); then the three change places.
        c = ((c ^ b) + np.uint64(1 << 32) - _rotate(b, bits)) & mask
        a, b, c = b, c, a
    return b


def hash_uint2(x, y):
    """32-bit hashes of pairs of 32-bit integers, uint64 that hold 32 bits."""
    start = np.uint64(0xDEADBEEF + (2 << 2) + 13)
    mask = np.uint64(0xFFFFFFFF)
    a = (start + np.asarray(x, np.uint64)) & mask
    b = (start + np.asarray(y, np.uint64)) & mask
    return _final(a, b, np.broadcast_to(start, a.shape))


def hash_uint(x):
    """32-bit hashes of 32-bit integers."""
    start = np.uint64(0xDEADBEEF + (1 << 2) + 13)
    a = (start + np.asarray(x, np.uint64)) & np.uint64(0xFFFFFFFF)
    return _final(a, np.broadcast_to(start, a.shape), np.broadcast_to(start, a.shape))


def hash_string(text: str) -> int:
    """A 32-bit hash of a name's UTF-8 bytes."""
    value = 0
    for byte in text.encode():
        value = (value * 37 + byte) & 0xFFFFFFFF
    return value


def to_unit(hashes):
    """32-bit integers to [0, 1]."""
    return np.asarray(hashes, np.float64) / 0xFFFFFFFF
