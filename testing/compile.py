"""Compiles all kernels into the cache that tests load them from: `python -m testing.compile [--processes N]`."""

import argparse
import subprocess
import time

from restir_engine.kernels.core import workers


def main() -> None:
    """Compile everything; prints what it took."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--processes", type=int, default=1)
    options = parser.parse_args()
    start = time.perf_counter()
    arguments = ["--all", f"--processes={options.processes}"]
    compiling = workers.start(arguments, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL)
    if compiling.wait():
        raise SystemExit("kernels could not be compiled")
    print(f"Kernels compiled in {time.perf_counter() - start:.0f} s")


if __name__ == "__main__":
    main()
