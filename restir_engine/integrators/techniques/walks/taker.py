"""What a walk brings: the light that its path finds behind it, taken in place of the film (kernels.film.contribute)."""

import numpy as np

from ....kernels.core.jit import inlined, outcome_entry
from ....kernels.core.memory import record_address, record_at
from ....kernels.core.records import SCRATCH_TAKER, TAKER, integrator_at, path_at
from ....kernels.core.vec import LARGEST_RADIANCE, add, put, scale, vec
from ....kernels.film.contribute import DIRECT

WALK_TAKER = np.dtype(
    [
        *((name, *TAKER.fields[name][:1]) for name in TAKER.names),
        ("integrator", np.int64),  # address of INTEGRATOR
        ("direct", np.float64, (3,)),  # sums, each contribution clamped as on its way to the film
        ("indirect", np.float64, (3,)),
    ]
)
walk_taker_at = record_at(WALK_TAKER)


@outcome_entry
def take_from_walk(address, path, kind, source, group):
    """The TAKER of paths that have entered a medium."""
    taker, path = walk_taker_at(address, 0), path_at(path, 0)
    integrator = integrator_at(taker.integrator, 0)
    value = vec(taker.value)
    is_direct = path.bounce + (1 if kind == DIRECT else 0) <= 1
    limit = integrator.clamp_direct if is_direct else integrator.clamp_indirect
    total = abs(value[0]) + abs(value[1]) + abs(value[2])
    if not total <= LARGEST_RADIANCE:
        return 1
    if total > limit:
        value = scale(value, limit / total)
    if is_direct:
        put(taker.direct, add(vec(taker.direct), value))
    else:
        put(taker.indirect, add(vec(taker.indirect), value))
    return 1


@inlined
def begin_taking(integrator, scratch, path, code):
    """From now on what the path finds is taken by the tile's TAKER; code: of `take_from_walk`."""
    taker = walk_taker_at(scratch + SCRATCH_TAKER, 0)
    taker.code = code
    taker.integrator = record_address(integrator)
    put(taker.direct, (0.0, 0.0, 0.0))
    put(taker.indirect, (0.0, 0.0, 0.0))
    path.taker = scratch + SCRATCH_TAKER
