"""This build beside an older checkout, in one run: `python -m benchmarks.side_by_side --against PATH`.

Both render the same .blend files, in processes of their own and by turns, so that both meet the same load of the
machine. Prints Markdown: samples a second (the median of the ratios of each turn), the means of the pictures with the
standard error of their difference, the first render of a process with empty and with warm kernel caches, and the most
resident memory. A ratio above 1 speaks for this build; of seconds and memory one below 1 does.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

import bpy
import numpy as np

from testing.blender import render

from . import scenes
from .turns import MARK

ROOT = Path(__file__).resolve().parents[1]
SIZE = (320, 180)
INTEGRATORS = ("PATH", "RESTIR")
SECONDS = 4.0  # of each timed render, about


class Build:
    """A checkout that renders a .blend file in a process of its own."""

    def __init__(self, checkout: Path, blend: Path, cache: Path) -> None:
        environment = os.environ | {"PYTHONPATH": str(checkout), "RESTIR_CACHE": str(cache)}
        environment["RESTIR_WORKER"] = "1"  # kernels are compiled in the process that is measured
        command = [sys.executable, "-W", "ignore", str(ROOT / "benchmarks" / "turns.py"), str(blend)]
        self._process = subprocess.Popen(
            command, env=environment, cwd=checkout, text=True,
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
        )  # fmt: skip

    def render(self, integrator: str, samples: int, seed: int = 0, picture: Path | None = None) -> dict[str, float]:
        """Seconds and memory of a render; raises RuntimeError where it fails."""
        request = {"integrator": integrator, "samples": samples, "seed": seed, "picture": picture and str(picture)}
        self._process.stdin.write(json.dumps(request) + "\n")
        self._process.stdin.flush()
        said = []
        for line in self._process.stdout:
            if line.startswith(MARK):
                return json.loads(line[len(MARK) :])
            said.append(line)
        raise RuntimeError("".join(said[-30:]))

    def close(self) -> None:
        """End the process."""
        self._process.stdin.close()
        self._process.wait()


def pair(checkouts: list[Path], blend: Path, caches: list[Path]) -> list[Build]:
    """A process of each checkout."""
    return [Build(checkout, blend, cache) for checkout, cache in zip(checkouts, caches, strict=True)]


def speed(builds: list[Build], integrator: str, rounds: int) -> str:
    """Samples a second of both, and the median of the ratios of all turns with their range."""
    for build in builds:
        build.render(integrator, 1)
    trial = max(build.render(integrator, 4)["seconds"] for build in builds)
    samples = max(4, round(4 * SECONDS / trial))
    times = []
    for turn in range(rounds):
        order = builds if turn % 2 == 0 else builds[::-1]
        both = {id(build): build.render(integrator, samples, turn)["seconds"] for build in order}
        times.append([both[id(build)] for build in builds])
    rates = [SIZE[0] * SIZE[1] * samples / statistics.median(column) / 1e6 for column in zip(*times, strict=True)]
    ratios = sorted(before / now for before, now in times)
    spread = f"{ratios[0]:.3f} … {ratios[-1]:.3f}"
    return f"{rates[0]:.3f} | {rates[1]:.3f} | {statistics.median(ratios):.3f} | {spread}"


def means(builds: list[Build], integrator: str, seeds: int, samples: int, folder: Path) -> str:
    """Differences of the pictures' means by channel, their largest standard error, and whether pixels are equal."""
    pictures = []
    for build in builds:
        each = []
        for seed in range(seeds):
            path = folder / "picture.exr"
            build.render(integrator, samples, seed, path)
            each.append(render.read(str(path))[:, :, :3].astype(np.float64))
        pictures.append(np.stack(each))
    before, now = pictures
    off = now.mean((1, 2)) - before.mean((1, 2))  # by seed: what both share of the noise cancels
    scale = before.mean((0, 1, 2))
    error = off.std(0, ddof=1) / np.sqrt(seeds) / scale
    equal = np.isclose(before, now, rtol=1e-4, atol=1e-6).all(-1).mean()
    shown = ", ".join(f"{value:+.3%}" for value in off.mean(0) / scale)
    return f"{shown} | {error.max():.3%} | {equal:.1%}"


def first(checkouts: list[Path], blend: Path, caches: list[Path], integrator: str) -> str:
    """Processor seconds (and seconds) of the first render of a process, file and imports included; memory in MiB."""
    shown = []
    for checkout, cache in zip(checkouts, caches, strict=True):
        build = Build(checkout, blend, cache)
        result = build.render(integrator, 1)
        build.close()
        shown.append(result)
    processor = [result["alive_processor"] for result in shown]
    memory = [result["peak_mib"] for result in shown]
    seconds = " / ".join(f"{result['alive']:.1f}" for result in shown)
    times = f"{processor[0]:.1f} | {processor[1]:.1f} | {processor[1] / processor[0]:.2f} | {seconds}"
    return f"{times} | {memory[0]:.0f} | {memory[1]:.0f} | {memory[1] / memory[0]:.2f}"


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--against", type=Path, required=True, help="the checkout of the older build")
    parser.add_argument("--scenes", nargs="*", default=["diffuse", "skin", "lanterns"])
    parser.add_argument("--parts", nargs="*", default=["speed", "means", "first"])
    parser.add_argument("--rounds", type=int, default=7, help="turns of each timing")
    parser.add_argument("--seeds", type=int, default=8, help="pictures of each build for the means")
    options = parser.parse_args()
    checkouts = [options.against.resolve(), ROOT]
    load = "/".join(f"{value:.1f}" for value in os.getloadavg())
    print(f"Blender {bpy.app.version_string}, {platform.machine()}, {os.cpu_count()} cores, load before {load}")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        blends = {}
        for scene in options.scenes:
            with render.quiet():
                scenes.prepare(scene, SIZE)
                blends[scene] = folder / f"{scene}.blend"
                bpy.ops.wm.save_as_mainfile(filepath=str(blends[scene]), copy=True)
        caches = [folder / "before", folder / "now"]
        if "first" in options.parts:
            print("\n| first render | cache | before, CPU s | now | ratio | seconds | before, MiB | now | ratio |")
            print("|---|---|---|---|---|---|---|---|---|")
            for integrator in INTEGRATORS:
                for state in ("empty", "warm"):
                    row = first(checkouts, blends[options.scenes[0]], caches, integrator)
                    print(f"| {options.scenes[0]}, {integrator} | {state} | {row} |", flush=True)
        for part, head in (
            ("speed", "| | before, 10⁶ samples/s | now | ratio | range |\n|---|---|---|---|---|"),
            ("means", "| | now − before, by channel | standard error | equal pixels |\n|---|---|---|---|"),
        ):
            if part not in options.parts:
                continue
            print(f"\n{head}")
            for scene in options.scenes:
                builds = pair(checkouts, blends[scene], caches)
                for integrator in INTEGRATORS:
                    if part == "speed":
                        row = speed(builds, integrator, options.rounds)
                    else:
                        row = means(builds, integrator, options.seeds, 8, folder)
                    print(f"| {scene}, {integrator} | {row} |", flush=True)
                for build in builds:
                    build.close()


if __name__ == "__main__":
    render.register()
    main()
    sys.stdout.flush()
    os._exit(0)  # bpy 4.5 can hang at a normal exit
