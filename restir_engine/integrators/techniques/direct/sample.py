"""The sample of direct light: a point of a light, and the V with which it was last seen."""

import numpy as np

from ....kernels.core.jit import inlined
from ....kernels.core.memory import record_at
from ...resampling.reservoir import reservoir_dtype

DIRECT_LIGHT = 1  # TECHNIQUE.id
SEEN = 1  # a flag: V̄ is known, a shadow ray has been traced for the sample where it is

SAMPLE = np.dtype(
    [
        # As kernels.lights.points has it; what is not needed is 0. Nothing of it depends on who is lit.
        ("source", np.int32),  # the lamp, or the instance of an emissive triangle
        ("primitive", np.int32),  # of that instance, or POINT_ON_LAMP, POINT_ON_WORLD
        ("u", np.float32),
        ("v", np.float32),
        ("visibility", np.float32, (3,)),  # V̄, by color channel or three times the same
    ]
)
DIRECT_RESERVOIR = reservoir_dtype(SAMPLE)
direct_reservoir_at = record_at(DIRECT_RESERVOIR)


@inlined
def keep(r, v):
    """Store V of the sample."""
    r.visibility[0] = v[0]
    r.visibility[1] = v[1]
    r.visibility[2] = v[2]
    r.flags |= SEEN


@inlined
def forget(r):
    """No shadow ray has been traced for the sample where it is now."""
    r.flags &= ~SEEN
