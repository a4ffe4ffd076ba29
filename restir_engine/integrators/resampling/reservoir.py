"""The reservoir: one sample with its unbiased contribution weight, 64 bytes a pixel, and weighted selection.

The first 32 bytes are the sample itself and belong to the technique; the others are what resampling works with.
"""

import numpy as np

from ...kernels.core.jit import device, inlined
from ...kernels.core.memory import load_i64, record_at, store_i64

RESERVOIR = np.dtype(
    [
        # A point of a light as kernels.lights.points has it; what is not needed is 0.
        ("source", np.int32),  # the lamp, or the instance of an emissive triangle
        ("primitive", np.int32),  # of that instance, or POINT_ON_LAMP, POINT_ON_WORLD; NOTHING: no sample
        ("u", np.float32),
        ("v", np.float32),
        ("seed", np.int32),  # of the numbers that made the sample: its identity
        ("age", np.int32),  # frames since the sample was made
        ("spare", np.int32, (2,)),
        # Resampling:
        ("contribution_weight", np.float32),  # W, an unbiased estimate of 1/pdf; 0: a null sample
        ("confidence", np.float32),  # how many independent samples it is worth
        ("target", np.float32),  # p̂ of the sample in its own pixel
        ("bsdf_ratio", np.float32),  # p_bsdf / p_lights of the one kept, while candidates are drawn
        ("visibility", np.float32, (3,)),  # V̄, by colour channel or three times the same
        ("padding", np.int32),
    ]
)
SAMPLE_BYTES = 32
NOTHING = -3  # in place of a primitive
UNKNOWN = -1.0  # in place of visibility[0]: no shadow ray has been traced for the sample at its pixel

reservoir_at = record_at(RESERVOIR)


@inlined
def copy_sample(to, source):
    """Copy the sample of the reservoir at address `source` to the one at address `to`; W and the rest stay."""
    store_i64(to, 0, load_i64(source, 0))
    store_i64(to, 1, load_i64(source, 1))
    store_i64(to, 2, load_i64(source, 2))
    store_i64(to, 3, load_i64(source, 3))


@inlined
def clear(reservoir, confidence):
    """Make a null sample of that confidence: nothing was found, and that counts."""
    reservoir.source = -1
    reservoir.primitive = NOTHING
    reservoir.u = 0.0
    reservoir.v = 0.0
    reservoir.seed = 0
    reservoir.age = 0
    reservoir.contribution_weight = 0.0
    reservoir.confidence = confidence
    reservoir.target = 0.0
    reservoir.bsdf_ratio = 0.0
    reservoir.visibility[0] = UNKNOWN
    reservoir.visibility[1] = 0.0
    reservoir.visibility[2] = 0.0


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
