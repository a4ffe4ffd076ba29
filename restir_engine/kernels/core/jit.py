"""The decorators of compiled code: `kernel` is called from Python, `device` and `inlined` from kernels, `entry` by its
address.

Both release the GIL, follow NumPy's error model (a division by zero gives inf) and keep their code on disk.
No fastmath, no inlining by Numba (`inline="always"`), no `parallel=True`: Numba's threading layers abort when two
Python threads enter at once, which a viewport beside a final render does.
"""

import importlib
import inspect
import pkgutil
from collections.abc import Callable, Iterable
from functools import cached_property

import numba
from numba.core import types
from numba.core.ccallback import CFunc
from numba.core.dispatcher import Dispatcher
from numba.core.registry import cpu_target
from numba.np.numpy_support import from_dtype

from . import cache, sources, workers
from .compiled import CACHES, DEVICE, KERNEL, KernelCache, keys

_OPTIONS = {"nogil": True, "error_model": "numpy", "no_cfunc_wrapper": True}


_TYPES = {inspect.Parameter.empty: types.int64, float: types.float64}


def _compile(function, **options):
    dispatcher = numba.njit(**_OPTIONS, **options)(function)
    dispatcher._cache = CACHES[options["pipeline_class"]](function)
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
    """Compile a function that Python calls.

    A parameter annotated with a dtype is such a record, with float a float64; others are int64.
    """
    return _compile(function, pipeline_class=KERNEL)


def load(units: Iterable) -> None:
    """Load kernels and entries from the cache; what is missing there is compiled first, by processes of its own."""
    units = list(units)
    workers.compile_all([name_of(unit) for unit in units if not is_kept(unit)])
    for unit in units:
        compile_here(unit)


def begin(units: Iterable) -> None:
    """Have what `load` will be asked for compiled meanwhile, where it is not in the cache."""
    workers.begin([name_of(unit) for unit in units if not is_kept(unit)])


def compile_here(unit) -> None:
    """Load a kernel or an entry from the cache, or compile it in this process."""
    if isinstance(unit, Entry):
        _ = unit.address
    else:
        unit.compile(_declared(unit.py_func))


def is_kept(unit) -> bool:
    """Whether the cache has a kernel (as it is declared) or an entry."""
    return any(map(cache.store().has, keys(*declaration(unit), cpu_target.target_context.codegen())))


def declaration(unit) -> tuple:
    """The function of a kernel or an entry, and Numba's types of its parameters, or its signature."""
    if isinstance(unit, Entry):
        return unit.function, unit.signature
    return unit.py_func, _declared(unit.py_func)


def name_of(unit) -> str:
    """The name by which `named` finds a kernel or an entry in another process."""
    return sources.name_of(declaration(unit)[0])


def named(name: str):
    """The kernel or entry of a name."""
    module, _, function = name.partition(":")
    return getattr(importlib.import_module(f"{sources.PACKAGE}.{module}"), function)


def all_units() -> list[str]:
    """The names of all kernels and entries of this package, those of integrators first, which take longest."""
    found = []
    for package in (f"{sources.PACKAGE}.{name}" for name in ("integrators", "kernels")):
        for info in pkgutil.walk_packages(importlib.import_module(package).__path__, package + "."):
            values = vars(importlib.import_module(info.name)).values()
            found += [name_of(value) for value in values if is_unit(value)]
    return list(dict.fromkeys(found))


def is_unit(value) -> bool:
    """Whether this is a kernel or an entry: what is compiled and kept on its own."""
    return isinstance(value, Entry) or (isinstance(value, Dispatcher) and isinstance(value._cache, KernelCache))


def _declared(function) -> tuple:
    """Numba's types of the parameters that a kernel declares."""
    parameters = inspect.signature(function, eval_str=True).parameters.values()
    return tuple(_TYPES.get(p.annotation) or from_dtype(p.annotation) for p in parameters)


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
    """A function of int64 that is called by `address`: by kernels with five of them (memory.call_entry), or by Embree.

    It returns nothing, or an int64 where `outcome` is set (memory.call_for_outcome).
    Its code is compiled when the address is first asked for, and never again inside its callers: for what is large,
    rarely needed and not in the innermost loop. Records are passed by their address.
    """

    def __init__(self, function: Callable, outcome: bool = False) -> None:
        self.function = function
        self.signature = (types.int64 if outcome else types.void)(*[types.int64] * function.__code__.co_argcount)

    @cached_property
    def _compiled(self):
        compiled = CFunc(
            self.function,
            (self.signature.args, self.signature.return_type),
            {},
            {"error_model": "numpy"},
            pipeline_class=KERNEL,
        )
        compiled._cache = KernelCache(self.function)
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
