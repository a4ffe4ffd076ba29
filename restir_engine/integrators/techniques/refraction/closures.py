"""Which closures are served: whose light that crosses straight is resampled by itself."""

from ....kernels.core.jit import inlined
from ....kernels.lobes.closure import LOBE_SUBSURFACE
from ....kernels.subsurface.entry import spreads


@inlined
def is_served(c):
    """Whether light enters by a closure in directions that have a density."""
    return c.kind == LOBE_SUBSURFACE and c.sample_weight > 0.0 and spreads(c)
