"""This engine and Cycles on the same scenes in one run, as Markdown: `python -m benchmarks.against_cycles`.

First the noise of every scene by Cycles, PATH and RESTIR after 1, 4 and 16 seconds, with `--against CHECKOUT` also by
the integrators of an older build (see `equal_time`): a ratio below 1 speaks for what stands in the row. Then speed,
reading, memory and start: seconds are those of `bpy.ops.render.render()`, everything included, once kernels and caches
are warm, and a ratio above 1 speaks for this engine.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import bpy

from testing.blender import render

from . import equal_time, scenes

SIZE = (640, 360)
SAMPLES = {"diffuse": 32, "all_lobes": 16}
ROUNDS = 3
ENGINES = ("CYCLES", "RESTIR")
Row = tuple[str, float | None, float, str]  # what, Cycles, ours, unit


def task(name: str, *arguments, **environment: str) -> dict:
    """The result of a task in a process of its own."""
    command = [sys.executable, "-W", "ignore", "-m", "benchmarks.tasks", name, *map(str, arguments)]
    output = subprocess.run(command, env=os.environ | environment, capture_output=True, text=True)
    lines = output.stdout.strip().splitlines()
    if output.returncode or not lines:
        raise RuntimeError(f"{name}: {output.stderr[-2000:]}")
    return json.loads(lines[-1])


def timed(engine: str, samples: int, seed: int = 0):
    """A picture of the current scene and the seconds that it took."""
    with render.quiet():
        start = time.perf_counter()
        picture = render.render(engine, samples, seed)
        return picture, time.perf_counter() - start


def speed(name: str) -> Iterator[Row]:
    """Millions of samples a second, the best of some renders, by turns so that both meet the same load."""
    scenes.prepare(name, SIZE)
    for engine in ENGINES:
        timed(engine, 1)
    rounds = [[timed(engine, SAMPLES[name])[1] for engine in ENGINES] for _ in range(ROUNDS)]
    rates = (SIZE[0] * SIZE[1] * SAMPLES[name] / seconds / 1e6 for seconds in map(min, zip(*rounds, strict=True)))
    yield f"{name}: samples", *rates, "10⁶/s"


def reading() -> Iterator[Row]:
    """Seconds of one sample on few pixels of a million triangles, and of reading the scene alone."""
    from restir_engine import properties
    from restir_engine.sync.depsgraph import build_scene

    scenes.prepare("million_triangles", (16, 16))
    yield "million triangles: one sample of 16 × 16", *(min(timed(e, 1)[1] for _ in range(3)) for e in ENGINES), "s"
    depsgraph = bpy.context.evaluated_depsgraph_get()
    settings = properties.render_settings(bpy.context.scene, bpy.context.scene.view_layers[0])
    seconds = []
    for _ in range(3):
        start = time.perf_counter()
        build_scene(depsgraph, settings)
        seconds.append(time.perf_counter() - start)
    yield "million triangles: sync, tree included", None, min(seconds), "s"


def processes() -> Iterator[Row]:
    """What needs a process of its own."""
    added = [task("memory", engine)["added"] / 2**20 for engine in ENGINES]
    yield "million triangles: memory", *added, "MiB"
    yield "first render of a process, one sample", *(task("first_pixel", engine)["seconds"] for engine in ENGINES), "s"
    for name, samples in SAMPLES.items():
        once, twice = (task("kernel_seconds", name, samples, n)["seconds"] for n in (1, 2))
        yield f"{name}: time inside Embree, at least", None, 100.0 * (twice - once) / once, "%"


def compilation(count: int) -> Iterator[str]:
    """Seconds of compilation with an empty cache: the first render of each scene, then the dearest functions."""
    with tempfile.TemporaryDirectory() as folder:
        result = task("compilation", RESTIR_CACHE=folder, TMPDIR=folder)
    for name, seconds in result["first"].items():
        yield f"| first render of {name}, empty cache | {seconds:.1f} |"
    functions = result["functions"]
    yield f"| all {len(functions)} functions | {sum(seconds for _, seconds in functions):.1f} |"
    for name, seconds in functions[:count]:
        yield f"| `{name}` | {seconds:.2f} |"


PARTS = {
    "speed": lambda: (row for name in SAMPLES for row in speed(name)),
    "reading": reading,
    "processes": processes,
}


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("parts", nargs="*", help=f"noise, {', '.join(PARTS)}, compilation; all if none is named")
    parser.add_argument("--against", type=Path, help="the checkout of an older build")
    parser.add_argument("--scenes", nargs="*", default=equal_time.SCENES, help="of the noise")
    parser.add_argument("--times", nargs="*", type=float, default=[1.0, 4.0, 16.0], help="seconds on all cores")
    parser.add_argument("--seeds", type=int, default=4, help="pictures for each noise")
    parser.add_argument("--functions", type=int, default=15, help="how many functions to list")
    options = parser.parse_args()
    wanted = options.parts or ["noise", *PARTS, "compilation"]
    load = "/".join(f"{value:.1f}" for value in os.getloadavg())
    print(f"Blender {bpy.app.version_string}, {platform.machine()}, {os.cpu_count()} cores, load before {load}\n")
    render.register()
    if "noise" in wanted:
        for line in equal_time.table(options.scenes, options.against, options.times, options.seeds):
            print(line, flush=True)
    parts = [part for part in wanted if part in PARTS]
    if parts:
        print("\n| | Cycles | ReSTIR | ratio |\n|---|---|---|---|")
    for part in parts:
        for what, theirs, ours, unit in PARTS[part]():
            ratio = "" if theirs is None else f"{ours / theirs if unit == '10⁶/s' else theirs / ours:.2f}"
            columns = ("" if theirs is None else f"{theirs:.4g} {unit}", f"{ours:.4g} {unit}", ratio)
            print(f"| {what} | {' | '.join(columns)} |", flush=True)
    if "compilation" in wanted:
        print("\n| compilation | seconds |\n|---|---|", *compilation(options.functions), sep="\n")


if __name__ == "__main__":
    main()
    sys.stdout.flush()
    os._exit(0)  # bpy 4.5 can hang at a normal exit
