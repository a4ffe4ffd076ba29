"""The two decorators of compiled code: `kernel` is called from Python, `device` from kernels.

Both release the GIL, follow NumPy's error model (a division by zero gives inf) and keep their code on disk.
No fastmath, no inlining hints, no `parallel=True`: Numba's threading layers abort when two Python threads
enter at once, which a viewport beside a final render does.
"""

import numba
from numba.core import types

from . import cache


def _compile(function):
    before = numba.config.CACHE_DIR
    numba.config.CACHE_DIR = str(cache.module_folder(function.__module__))
    try:
        return _without_literals(numba.njit(nogil=True, cache=True, error_model="numpy")(function))
    finally:
        numba.config.CACHE_DIR = before


def _without_literals(dispatcher):
    """Let f(x, 1) and f(x, 2) be the same compiled function: Numba would compile one for each constant."""
    resolve = dispatcher.get_call_template

    def get_call_template(args, kws):
        return resolve(
            tuple(types.unliteral(arg) for arg in args), {name: types.unliteral(arg) for name, arg in kws.items()}
        )

    dispatcher.get_call_template = get_call_template
    return dispatcher


def kernel(function):
    """Compile a function that Python calls."""
    return _compile(function)


def device(function):
    """Compile a function that kernels call."""
    return _compile(function)
