"""The sample of light that crosses straight, x₁ → x₂ → x₃: a direction of entry ω and the point x₃ of a light.

ω is kept as the point x₂ that it leads to, so that the sample is laid out as that of subsurface light
(`subsurface.sample`), with E(x₂, x₃).
"""

import numpy as np

from ....kernels.core.jit import inlined
from ....kernels.core.memory import record_at
from ....kernels.core.records import closure_at
from ...resampling.inputs import point_at

REFRACTION = 4  # TECHNIQUE.id

ENTRY = np.dtype(  # what is kept of a pixel
    [
        ("weight", np.float32, (3,)),  # of the closure, by its share in those that are served
        ("sigma_t", np.float32, (3,)),  # 1/length
        ("closure", np.int32),  # by which light enters; NOT_SERVED: there is none
        ("unused", np.int32),
    ]
)
NOT_SERVED = -1
_entry_at = record_at(ENTRY)


@inlined
def entry_of(frame, pixel):
    """The ENTRY of a pixel."""
    return _entry_at(frame.domains, pixel)


@inlined
def closure_of(frame, pixel):
    """The closure by which light enters at a pixel that is served."""
    return closure_at(point_at(frame, pixel).closures, entry_of(frame, pixel).closure)
