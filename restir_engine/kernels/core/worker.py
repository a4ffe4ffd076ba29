"""What a compiling process runs (`workers`): reads names of kernels, or takes all, and answers with "done" or "failed".

python -m restir_engine.kernels.core.worker [--folder FOLDER] [--idle] [--all …]
"""

import argparse
import contextlib
import gc
import logging
import os
import sys
from pathlib import Path

from numba.core.registry import cpu_target

from . import cache, jit, locks, workers
from .compiled import keys

log = logging.getLogger(__name__)


def compile_named(name: str) -> bool:
    """Compile a kernel by name where it is not kept yet; whether that went well.

    Several renders of a machine may ask for the same at once: one compiles it, the others wait for that.
    """
    try:
        unit = jit.named(name)
        if not jit.is_kept(unit):
            with locks.held(locks.folder() / f"kernel-{_key(unit)[:2]}"):
                if not jit.is_kept(unit):
                    jit.compile_here(unit)
    except Exception:
        log.exception("%s could not be compiled", name)
        return False
    return True


def _key(unit) -> str:
    """The name of the file that a kernel is kept in."""
    return keys(*jit.declaration(unit), cpu_target.target_context.codegen())[0]


def compile_everything(processes: int, first: str = "") -> bool:
    """Compile all kernels that are not kept, by so many processes; those of the package `first` at first.

    Prints the names of their files; returns whether all are there.
    """
    names = jit.all_units()
    missing = [name for name in names if not jit.is_kept(jit.named(name))]
    missing.sort(key=lambda name: not (first and name.startswith(first)))
    pool = workers.Workers(processes)
    pool.wait(pool.submit(missing, urgent=True))
    for name in names:
        print(_key(jit.named(name)))
    return all(jit.is_kept(jit.named(name)) for name in names)


def main() -> None:
    """Answer until standard input ends."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--folder", help="where to keep what is compiled; empty: where there is room")
    parser.add_argument("--all", action="store_true", help="compile everything, and end")
    parser.add_argument("--first", default="", help="the package of the integrator whose kernels come first")
    parser.add_argument("--note", help="the key to leave an empty file under when everything is compiled")
    parser.add_argument("--processes", type=int, default=os.cpu_count() or 1, help="for --all")
    parser.add_argument("--idle", action="store_true", help="at the lowest priority")
    options = parser.parse_args()
    if options.folder is not None:
        cache.configure(Path(options.folder) if options.folder else None)
    if options.idle and hasattr(os, "nice"):
        with contextlib.suppress(OSError):
            os.nice(19)
    if options.all:
        complete = compile_everything(options.processes, options.first)
        if complete and options.note:
            cache.store().write(options.note, b"")
        return
    from ...embree.library import load

    load()  # kernels refer to its functions
    gc.freeze()
    gc.set_threshold(100_000)  # a tenth of the time of compiling would go into looking for garbage
    for line in sys.stdin:
        answer = "done" if compile_named(line.strip()) else "failed"
        try:
            print(answer, flush=True)
        except BrokenPipeError:  # who asked is gone
            os._exit(0)


if __name__ == "__main__":
    main()
