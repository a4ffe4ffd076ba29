"""Kernels that are called by the addresses of their records, by who calls them for little work at a time.

Numba takes a microsecond to look at a record that it is given, and a step of a small tile is given five.
"""

from __future__ import annotations

import ctypes
from functools import cached_property

from numba.core import types

from .jit import compile_here


class Direct:
    """A kernel whose parameters are numbers and, in place of records, their addresses; who calls it keeps these alive.

    Called from Python it lets other threads run, and returns what the kernel does (an int; of none 0).
    """

    def __init__(self, kernel) -> None:
        self._kernel = kernel

    @cached_property
    def _function(self):
        if not self._kernel.overloads:
            compile_here(self._kernel)
        (result,) = self._kernel.overloads.values()
        address = result.library.get_pointer_to_function(result.fndesc.llvm_func_name)
        numbers = [ctypes.c_double if kind == types.float64 else ctypes.c_int64 for kind in result.signature.args]
        # By Numba's convention: where the result goes, where an exception goes, the arguments.
        return ctypes.CFUNCTYPE(ctypes.c_int32, ctypes.c_void_p, ctypes.c_void_p, *numbers)(address)

    def __call__(self, *arguments) -> int:
        result, exception = ctypes.c_int64(0), ctypes.c_void_p()
        if self._function(ctypes.byref(result), ctypes.byref(exception), *arguments):
            raise RuntimeError(f"{self._kernel.py_func.__name__} has failed")
        return result.value
