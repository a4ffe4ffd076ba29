"""How Numba compiles for us and keeps what it has compiled, beside what it does for others in the same process.

What a kernel calls is kept as LLVM wrote it down, neither optimised nor made machine code: both are done once, in the
kernel that it becomes part of. (Numba would do both for every function with everything that it calls.) What a kernel
calls is known to be called by nobody else, so LLVM can inline it or drop it.

Files are named by a digest of what decides their content: the module's sources, the function, its types, the
versions of Python and Numba, the processor. They hold no import name of this package (`_Pickler`), so that they fit
wherever it is installed, and kernels for a baseline of processors can come with an extension.
"""

import functools
import hashlib
import io
import logging
import pickle
import platform
import sys

import llvmlite.binding as llvm
import numba
from numba.core import compiler
from numba.core.caching import _Cache
from numba.core.codegen import JITCodeLibrary
from numba.core.environment import lookup_environment
from numba.core.runtime import _nrt_python, rtsys
from numba.core.serialize import NumbaPickler

from . import cache, sources, workers

log = logging.getLogger(__name__)

# What kernels that come with an extension may use of a processor, by platform.machine().
BASELINES = {
    "x86_64": ("x86-64-v3", "+avx,+avx2,+bmi,+bmi2,+cx16,+f16c,+fma,+lzcnt,+movbe,+popcnt,+sahf,+sse4.2"),
    "arm64": ("apple-m1", ""),
}
BASELINES["AMD64"] = BASELINES["x86_64"]


def baseline() -> tuple[str, str] | None:
    """LLVM's name and features of the baseline for machines like this; None where there is none."""
    return BASELINES.get(platform.machine())


def _has_baseline() -> bool:
    features = baseline()[1] if baseline() else None
    host = llvm.get_host_cpu_features()
    return features is not None and all(host.get(name.lstrip("+"), False) for name in features.split(",") if name)


class DeviceLibrary(JITCodeLibrary):
    """A function that kernels call, with what it calls: bitcode for kernels, no machine code."""

    def finalize(self) -> None:
        for library in dict.fromkeys(self._linking_libraries):
            if library is not rtsys.library:  # which every kernel links itself
                self._reload_init.update(library._reload_init)
                self._final_module.link_in(library._get_module_for_linking(), preserve=True)
        self._finalize_dynamic_globals()
        self._finalized = True

    def get_pointer_to_function(self, name: str) -> int:
        self._ensure_finalized()
        return 0

    @property
    def codegen(self):
        return self

    def set_env(self, name, environment) -> None:
        """Nothing: the kernel's code has the variable that points to a function's environment."""


class KernelLibrary(JITCodeLibrary):
    """Machine code that Python or an address calls; nothing links it."""

    def _optimize_final_module(self) -> None:
        for function in self._final_module.functions:
            if not function.is_declaration and function.linkage == llvm.Linkage.linkonce_odr:
                function.linkage = "internal"
        super()._optimize_final_module()

    def _finalize_specific(self) -> None:
        super()._finalize_specific()
        for environment in _environments(self):
            self._codegen.set_env(environment.env_name, environment)

    def _get_module_for_linking(self):
        raise TypeError(f"{self.name}: kernels are called from Python, only devices from kernels")


def _environments(library) -> list:
    """The environments (objects that stand for a function's module) that a library's code refers to."""
    names = [v.name for v in library._final_module.global_variables if v.name.startswith("_ZN08NumbaEnv")]
    return [found for found in map(lookup_environment, names) if found is not None and found.can_cache()]


def _pipeline(library: type[JITCodeLibrary]) -> type[compiler.CompilerBase]:
    class Pipeline(compiler.CompilerBase):
        def define_pipelines(self) -> list:
            self.state.library = library(self.state.targetctx.codegen(), self.state.func_id.func_qualname)
            self.state.library.enable_object_caching()
            return [compiler.DefaultPassBuilder.define_nopython_pipeline(self.state)]

    return Pipeline


DEVICE, KERNEL = _pipeline(DeviceLibrary), _pipeline(KernelLibrary)


class FunctionCache(_Cache):
    """What Numba asks for compiled code of a function, and gives it to. Signatures are told apart by their text.

    What is kept needs nothing of what Numba knows of types and functions: where all is found, `refresh`, which takes
    50 MB and a quarter of a second, is never called.
    """

    def __init__(self, function) -> None:
        self._function = function

    @property
    def cache_path(self) -> str:
        return str(cache.store().folder)

    def load_overload(self, signature, target_context):
        _name_runtime()
        for key in keys(self._function, signature, target_context.codegen()):
            payload = cache.store().read(key)
            if payload is not None:
                return _restored(payload, target_context)
        return None

    def save_overload(self, signature, result) -> None:
        if result.library.has_dynamic_globals:
            raise TypeError(f"{self._function.__qualname__} holds an address of this process: it cannot be kept")
        cache.store().write(keys(self._function, signature, result.codegen)[0], _kept(result))

    def enable(self) -> None:
        """It always is."""

    def disable(self) -> None:
        raise NotImplementedError("compiled kernels are always kept")

    def flush(self) -> None:
        raise NotImplementedError("kernels are not compiled again in a process")


@functools.cache
def _name_runtime() -> None:
    """Give LLVM the symbols of Numba's runtime, which code refers to; `rtsys.initialize` compiles something as well."""
    for name, address in _nrt_python.c_helpers.items():
        llvm.add_symbol(name if name.startswith("_") else f"NRT_{name}", address)


class KernelCache(FunctionCache):
    """The same for kernels and entries, which other processes compile where they can."""

    def load_overload(self, signature, target_context):
        found = super().load_overload(signature, target_context)
        if found is None:
            workers.compile_all([sources.name_of(self._function)])
            found = super().load_overload(signature, target_context)
        return found


CACHES = {DEVICE: FunctionCache, KERNEL: KernelCache}


def keys(function, signature, codegen) -> list[str]:
    """Names of the files with a function's code: for this processor, and for the baseline where it has that."""
    made_by = f"{sys.implementation.cache_tag} {numba.__version__}"
    made_of = f"{sources.name_of(function)} {signature} {made_by}".encode() + sources.digest(function.__module__)
    triple, *processor = codegen.magic_tuple()
    targets = [processor] + ([list(baseline())] if _has_baseline() else [])
    return [hashlib.sha256(f"{triple} {t}".encode() + made_of).hexdigest()[: cache.NAME_LENGTH] for t in targets]


def _kept(result) -> bytes:
    """Compiled code as bytes."""
    library, descriptor = result.library, result.fndesc
    descriptor.typemap = descriptor.calltypes = None  # not needed any more, and large
    if isinstance(library, DeviceLibrary):
        code, symbols, environments = library._get_module_for_linking().as_bitcode(), None, ()
    else:
        names = {descriptor.llvm_func_name, descriptor.llvm_cpython_wrapper_name, descriptor.llvm_cfunc_wrapper_name}
        symbols = names & {function.name for function in library.get_defined_functions()}
        code, environments = library._get_compiled_object(), tuple(_environments(library))
    buffer = io.BytesIO()
    content = (library.name, code, symbols, descriptor, result.environment, result.signature, environments)
    _Pickler(buffer, protocol=4).dump((*content, tuple(result.reload_init)))
    return buffer.getvalue()


def _restored(payload: bytes, target_context):
    """The compile result that `_kept` made the bytes of."""
    content = _Unpickler(io.BytesIO(payload)).load()
    name, code, symbols, descriptor, environment, signature, environments, reload_init = content
    for function in reload_init:
        function()
    codegen = target_context.codegen()
    if symbols is None:
        library = DeviceLibrary(codegen, name)
        library._shared_module = llvm.parse_bitcode(code)
        library._finalized = True
    else:
        library = KernelLibrary(codegen, name)
        library.enable_object_caching()
        library._set_compiled_object(code)
        library._finalize_final_module()
        codegen._engine._defined_symbols.update(symbols)
        for found in environments:
            codegen.set_env(found.env_name, found)
    return compiler.CompileResult(
        typing_context=target_context.typing_context,
        target_context=target_context,
        entry_point=target_context.get_executable(library, descriptor, environment),
        typing_error=None,
        type_annotation=None,
        signature=signature,
        library=library,
        objectmode=False,
        lifted=(),
        fndesc=descriptor,
        call_helper=None,
        environment=environment,
        metadata=None,
        reload_init=reload_init,
        referenced_envs=environments,
    )


class _Pickler(NumbaPickler):
    """Writes names of this package's modules without the package's own name."""

    def persistent_id(self, thing):
        if type(thing) is str and thing.startswith(sources.PACKAGE + "."):
            return thing.removeprefix(sources.PACKAGE)
        return None


class _Unpickler(pickle.Unpickler):
    """Puts the name that this package has here in front of them."""

    def persistent_load(self, name):
        return sources.PACKAGE + name
