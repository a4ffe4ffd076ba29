"""Compiles kernels into the cache that tests load them from.

python -m testing.compile [--processes N] [--blender]
"""

import argparse
import time

from restir_engine.kernels.core import jit, workers

# What tests that touch Blender do without: each of these compiles when something needs it all the same.
REUSE = (
    "integrators.blocks.",
    "integrators.resampling.",
    "integrators.techniques.path.",
    "integrators.techniques.refraction.",
    "integrators.techniques.subsurface.",
    "integrators.techniques.walks.",
    "kernels.subsurface.irradiance_cache",
)


def main() -> None:
    """Compile; prints what it took."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--processes", type=int, default=1)
    parser.add_argument("--blender", action="store_true", help="only what tests that touch Blender need")
    options = parser.parse_args()
    start = time.perf_counter()
    names = [name for name in jit.all_units() if not (options.blender and name.startswith(REUSE))]
    pool = workers.Workers(options.processes)
    pool.wait(pool.submit([name for name in names if not jit.is_kept(jit.named(name))], urgent=True))
    missing = [name for name in names if not jit.is_kept(jit.named(name))]
    if missing:
        raise SystemExit(f"kernels could not be compiled: {', '.join(missing)}")
    print(f"{len(names)} kernels compiled in {time.perf_counter() - start:.0f} s")


if __name__ == "__main__":
    main()
