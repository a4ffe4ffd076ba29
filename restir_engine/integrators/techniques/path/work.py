"""How much work whole paths have been, by which their time is known before a render: three counts in working memory."""

import numpy as np

from ....kernels.core.jit import inlined
from ....kernels.core.memory import load_i64, store_i64
from ...resampling.inputs import COUNTS, WORK_COUNTS

VERTICES, SHIFTS, RAYS = range(COUNTS)  # of paths as they are made; shifts tried, and bounces that these have replayed


@inlined
def count(scratch, what, times):
    """Count something so many times."""
    at = WORK_COUNTS // 8 + what
    store_i64(scratch, at, load_i64(scratch, at) + times)


def work_done(scratch: np.ndarray) -> np.ndarray:
    """The counts in a thread's working memory, int64 (COUNTS,): a reference."""
    return scratch[WORK_COUNTS : WORK_COUNTS + 8 * COUNTS].view(np.int64)
