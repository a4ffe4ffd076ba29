"""The decorators of compiled code: `kernel` is called from Python, `device` and `inlined` from kernels, `entry` by its
address.

Both release the GIL, follow NumPy's error model (a division by zero gives inf) and keep their code on disk.
No fastmath, no inlining by Numba (`inline="always"`), no `parallel=True`: Numba's threading layers abort when two
Python threads enter at once, which a viewport beside a final render does.
"""

import inspect
from collections.abc import Callable, Iterable
from functools import cached_property

import numba
import numpy as np
from numba.core import types
from numba.core.ccallback import CFunc
from numba.np.numpy_support import from_dtype

from .compiled import DEVICE, KERNEL, FunctionCache

_OPTIONS = {"nogil": True, "error_model": "numpy", "no_cfunc_wrapper": True}


def _compile(function, **options):
    dispatcher = numba.njit(**_OPTIONS, **options)(function)
    dispatcher._cache = FunctionCache(function)
    return _without_literals(dispatcher)


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
    """Compile a function that Python calls. A parameter annotated with a dtype is such a record, others are int64."""
    return _compile(function, pipeline_class=KERNEL)


def load(kernels: Iterable) -> None:
    """Compile kernels for the parameters that they declare, or load them from the cache, before they are called."""
    for one in kernels:
        parameters = inspect.signature(one.py_func, eval_str=True).parameters.values()
        declared = (p.annotation for p in parameters)
        one.compile(tuple(from_dtype(d) if isinstance(d, np.dtype) else types.int64 for d in declared))


def device(function):
    """Compile a function that kernels call; it has no wrapper for Python, which takes a quarter less time."""
    return _compile(function, pipeline_class=DEVICE, no_cpython_wrapper=True)


def inlined(function):
    """Compile a function that LLVM puts into its callers, for what is on every path's way.

    LLVM would keep all but the smallest apart, as it cannot know that there is a single caller; a call costs
    5 ns and what stands in registers. PATH is a quarter faster for it, and no slower to compile.
    """
    return _compile(function, pipeline_class=DEVICE, no_cpython_wrapper=True, forceinline=True)


class Entry:
    """A function of five int64 that kernels call by `address` (memory.call_entry).

    It returns nothing, or an int64 where `outcome` is set (memory.call_for_outcome).
    Its code is compiled when the address is first asked for, and never again inside its callers: for what is large,
    rarely needed and not in the innermost loop. Records are passed by their address.
    """

    def __init__(self, function: Callable, outcome: bool = False) -> None:
        self.function = function
        self._result = types.int64 if outcome else types.void

    @cached_property
    def _compiled(self):
        signature = (types.int64,) * 5, self._result
        compiled = CFunc(self.function, signature, {}, {"error_model": "numpy"}, pipeline_class=KERNEL)
        compiled._cache = FunctionCache(self.function)
        compiled.compile()
        return compiled

    @property
    def address(self) -> int:
        """Where the machine code starts; valid as long as this process lives."""
        return self._compiled.address


def entry(function: Callable) -> Entry:
    """Make a function callable by address."""
    return Entry(function)


def outcome_entry(function: Callable) -> Entry:
    """Make a function that returns an int64 callable by address."""
    return Entry(function, outcome=True)
