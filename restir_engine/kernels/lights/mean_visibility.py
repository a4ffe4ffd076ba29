"""What part of a pixel's light samples has been visible so far: the factor of the control variate of light tiles.

A light sample from a tile is one of many candidates and carries its own colour. What all of them would send without
shadow, less what the one stands for, has the mean 0 (LIGHT_SAMPLE.control_variate), and takes the noise of colour away
where it is added times V. Added times any factor that knows nothing of the sample itself it keeps its mean; the best
factor is about the mean of V, here that of the samples before.

Memory of a pixel, float32 [4]: sum of V and number of samples at the first vertex, and at all later ones.
"""

from ..core.jit import inlined
from ..core.memory import load_f32, store_f32
from ..core.vec import average

FIRST, LATER = 0, 2
MEAN_VISIBILITY_BYTES = 16
_MEMORY = 64.0  # samples, so that what moves is forgotten


@inlined
def mean_visibility(place, which):
    """The mean of V, drawn to one half where little is known; place 0: nothing is."""
    if place == 0:
        return 0.5
    return (load_f32(place, which) + 0.5) / (load_f32(place, which + 1) + 1.0)


@inlined
def learn(place, which, v):
    """Take in the transmittance (rgb) towards a light sample."""
    if place == 0:
        return
    total, n = load_f32(place, which) + average(v), load_f32(place, which + 1) + 1.0
    if n > _MEMORY:
        total, n = 0.5 * total, 0.5 * n
    store_f32(place, which, total)
    store_f32(place, which + 1, n)
