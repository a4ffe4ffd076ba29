"""Compiles the engine's kernels into the cache that tests load them from: `python -m testing.compile [--processes N]`.

A render compiles what its integrator calls; what kernels call by address is found in their modules. Functions that
two kernels share are compiled once where the kernels are compiled one after the other, so integrators are.
"""

import argparse
import importlib
import multiprocessing
import pkgutil
import time
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor

from restir_engine import kernels
from restir_engine.kernels.core.jit import Entry
from restir_engine.reuse_settings import ReuseSettings
from restir_engine.session import INTEGRATORS
from testing.scenes.rooms import picture_scene, render


def compile_integrators() -> float:
    """Render a room under every kind of light with each integrator; seconds of the processor."""
    start = time.process_time()
    for name in INTEGRATORS:
        render(picture_scene("all", 8), 2, integrator=name, reuse=ReuseSettings(temporal=True, rounds=1))
    return time.process_time() - start


def modules_with_entries() -> list[str]:
    """The kernel modules that define functions which are called by address."""
    names = [info.name for info in pkgutil.walk_packages(kernels.__path__, kernels.__name__ + ".")]
    return [name for name in names if any(_entries(vars(importlib.import_module(name)).values()))]


def compile_entries(module: str) -> float:
    """Compile the functions of a module that are called by address; seconds of the processor."""
    start = time.process_time()
    for entry in _entries(vars(importlib.import_module(module)).values()):
        _ = entry.address
    return time.process_time() - start


def _entries(values) -> Iterator[Entry]:
    for value in values:
        if isinstance(value, Entry):
            yield value
        elif isinstance(value, dict):
            yield from _entries(value.values())
        elif isinstance(value, (list, tuple)):
            yield from _entries(value)


def main() -> None:
    """Compile everything; prints what it took."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--processes", type=int, default=1)
    options = parser.parse_args()
    start = time.perf_counter()
    with ProcessPoolExecutor(options.processes, multiprocessing.get_context("spawn")) as pool:
        parts = [pool.submit(compile_integrators), *(pool.submit(compile_entries, m) for m in modules_with_entries())]
        processor = sum(part.result() for part in parts)
    print(f"Kernels compiled in {time.perf_counter() - start:.0f} s ({processor:.0f} s of the processor)")


if __name__ == "__main__":
    main()
