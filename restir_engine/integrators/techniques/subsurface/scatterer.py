"""The closure below which a pixel's light scatters, whether or not the path takes it."""

from ....kernels.core import rng
from ....kernels.core.jit import device
from ....kernels.core.records import closure_at
from ....kernels.lobes.closure import LOBE_SUBSURFACE
from ....kernels.lobes.dispatch import pick_closure
from ....kernels.path.state import DIM_LOBE

_CLOSURE = 0x53535343  # of the key by which a closure is chosen where the path takes another lobe


@device
def scatterer_of(sp, path):
    """(closure that scatters, its share in all that do, whether the path takes it, the chance that it takes any).

    -1: there is none.
    """
    scatters, total = 0.0, 0.0
    for i in range(sp.n_closures):
        c = closure_at(sp.closures, i)
        total += c.sample_weight
        if c.kind == LOBE_SUBSURFACE:
            scatters += c.sample_weight
    if not scatters > 0.0:
        return -1, 0.0, False, 0.0
    chosen, _, _ = pick_closure(sp, rng.sample1(path.key, path.sample, path.dimension + DIM_LOBE))
    taken = chosen >= 0 and closure_at(sp.closures, chosen).kind == LOBE_SUBSURFACE
    if not taken:
        left = scatters * rng.sample1(rng.hash_combine(path.key, _CLOSURE), path.sample, path.dimension)
        for i in range(sp.n_closures):
            c = closure_at(sp.closures, i)
            if c.kind == LOBE_SUBSURFACE and c.sample_weight > 0.0 and left >= 0.0:
                chosen = i
                left -= c.sample_weight
    return chosen, closure_at(sp.closures, chosen).sample_weight / scatters, taken, scatters / total
