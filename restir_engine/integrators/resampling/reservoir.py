"""The reservoir: one sample with its unbiased contribution weight, 64 bytes a pixel, and weighted selection.

A header, with which resampling works, and behind it the SAMPLE of the technique whose reservoir it is.
"""

import numpy as np

from ...kernels.core.jit import device, inlined
from ...kernels.core.memory import copy_words, record_at

HEADER = np.dtype(
    [
        ("contribution_weight", np.float32),  # W, an unbiased estimate of 1/pdf; 0: a null sample
        ("confidence", np.float32),  # how many independent samples it is worth
        ("target", np.float32),  # p̂ of the sample in its own domain
        ("seed", np.int32),  # of the numbers that made the sample: its identity, which all copies share
        ("technique", np.int8),  # TECHNIQUE.id: whose SAMPLE follows
        ("light_group", np.int8),  # that its light belongs to, NO_GROUP: to none, or nobody asks
        ("flags", np.int16),  # of the technique, but for INDIRECT
    ]
)
INDIRECT = 1 << 12  # a flag that all techniques share: indirect light, in the passes
RESERVOIR_BYTES = 64
SAMPLE_BYTES = RESERVOIR_BYTES - HEADER.itemsize


def reservoir_dtype(sample: np.dtype) -> np.dtype:
    """The reservoir of a technique: the header and the fields of its SAMPLE, in 64 bytes.

    Raises ValueError where the sample is larger than what the header leaves.
    """
    if sample.itemsize > SAMPLE_BYTES:
        raise ValueError(f"a sample has {SAMPLE_BYTES} bytes at most, not {sample.itemsize}")
    start = HEADER.itemsize
    parts = [(dtype, name, 0) for dtype, name in ((HEADER, n) for n in HEADER.names)]
    parts += [(sample, name, start) for name in sample.names]
    return np.dtype(
        {
            "names": [name for _, name, _ in parts],
            "formats": [dtype.fields[name][0] for dtype, name, _ in parts],
            "offsets": [dtype.fields[name][1] + offset for dtype, name, offset in parts],
            "itemsize": RESERVOIR_BYTES,
        }
    )


RESERVOIR = reservoir_dtype(np.dtype([]))  # of whatever technique

reservoir_at = record_at(RESERVOIR)


@inlined
def copy_reservoir(to, source):
    """Copy the reservoir at the address `source` to the address `to`."""
    copy_words(to, source, RESERVOIR_BYTES // 8)


@inlined
def clear(reservoir, confidence):
    """Make a null sample of that confidence: nothing was found, and that counts."""
    reservoir.contribution_weight = 0.0
    reservoir.confidence = confidence
    reservoir.target = 0.0
    reservoir.seed = 0
    reservoir.flags = 0


@inlined
def accept(weight, total, u):
    """Weighted reservoir sampling (Chao 1982), one candidate: (selected, u for the next candidate).

    `total` is the sum of the weights so far, `weight` included. The part of u that the decision leaves over is uniform
    in [0, 1) again, so that one number does for a stream of candidates.
    """
    if weight <= 0.0:
        return False, u
    p = weight / total
    if u < p:
        return True, u / p
    return False, (u - p) / (1.0 - p)


@device
def contribution_weight(total, target):
    """W_Y = Σ w_i / p̂(Y) (course, eq. 3.2); 0 for a null sample."""
    return total / target if target > 0.0 else 0.0
