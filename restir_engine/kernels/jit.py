"""The two decorators of compiled code: `kernel` is called from Python, `device` from kernels.

Both release the GIL, follow NumPy's error model (a division by zero gives inf) and keep their code on disk.
No fastmath, no inlining hints, no `parallel=True`: Numba's threading layers abort when two Python threads
enter at once, which a viewport beside a final render does.
"""

import numba

from . import cache


def _compile(function):
    before = numba.config.CACHE_DIR
    numba.config.CACHE_DIR = str(cache.module_folder(function.__module__))
    try:
        return numba.njit(nogil=True, cache=True, error_model="numpy")(function)
    finally:
        numba.config.CACHE_DIR = before


def kernel(function):
    """Compile a function that Python calls."""
    return _compile(function)


def device(function):
    """Compile a function that kernels call."""
    return _compile(function)
