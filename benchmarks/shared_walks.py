"""Random walks that neighbours share, beside PATH: `RESTIR_ASSETS=… python -m benchmarks.shared_walks [ENTRY …]`.

A head of skin under one lamp (testing/scenes/head.py), from distances at which pixels are so many mean free paths of
red light apart; light enters diffusely, by refraction, or as into skin. The error is the variance of a pixel between
seeds over (mean² + 0.01), of as many samples, averaged over pixels and channels; time is that of the processor, on one
thread, both ways taken by turns; what is printed last is error × time by PATH's, and its standard error between seeds.
"""

from __future__ import annotations

import argparse
import time

import numpy as np

from restir_engine.context import FrameContext
from restir_engine.film import Film
from restir_engine.integrators.base import Integrator
from restir_engine.integrators.path import PathIntegrator
from restir_engine.integrators.restir.walks import SharedWalks
from restir_engine.settings import RenderSettings, required_passes
from testing.scenes.head import camera_for, head_scene

ENTRIES = ("DIFFUSE", "SKIN", "REFRACTIVE")
SPACINGS = (0.01, 0.03, 0.1, 0.3, 1.0)
WAYS = {"PATH": PathIntegrator, "shared": SharedWalks}


def render(context: FrameContext, kind: type[Integrator], settings: RenderSettings) -> tuple[np.ndarray, float]:
    """(the picture, (height, width, 3), seconds of the processor)."""
    film = Film(*context.camera.film_size, required_passes(frozenset(), False))
    integrator = kind(context, settings, film)
    integrator.prepare()
    scratch, start = Integrator.scratch(), time.process_time()
    for stage in integrator.stages(0, settings.samples):
        for tile in film.tiles() if stage.items is None else stage.items:
            stage.run(tile, scratch)
        stage.finish()
    return film.sums("Combined")[..., :3] / settings.samples, time.process_time() - start


def measure(context: FrameContext, args) -> str:
    """A row's numbers."""
    pictures, seconds = {name: [] for name in WAYS}, dict.fromkeys(WAYS, 0.0)
    for seed in range(-1, args.seeds):
        settings = RenderSettings(samples=args.samples, seed=seed, max_bounces=args.bounces, threads=1)
        for name, kind in WAYS.items():
            picture, taken = render(context, kind, settings)
            if seed >= 0:  # the first warms up
                pictures[name].append(picture)
                seconds[name] += taken
    mean = np.mean([np.mean(found, 0) for found in pictures.values()], 0)
    noise = {name: np.var(found, 0, ddof=1) / (mean**2 + 0.01) for name, found in pictures.items()}
    path, shared = (noise[name].mean((0, 1)) for name in WAYS)
    slower = seconds["shared"] / seconds["PATH"]
    by_channel = " ".join(f"{ratio:.2f}" for ratio in shared / path)
    halves = [
        np.mean([np.square(found[k] - found[k + 1]) / (mean**2 + 0.01) for found in (pictures[name],)])
        for name in WAYS
        for k in range(0, args.seeds - 1, 2)
    ]
    ratios = np.array(halves[len(halves) // 2 :]) / np.array(halves[: len(halves) // 2])
    spread = slower * ratios.std(ddof=1) / np.sqrt(len(ratios))
    off = np.mean(pictures["shared"]) / np.mean(pictures["PATH"]) - 1.0
    product = slower * shared.mean() / path.mean()
    return f"{path.mean():.4f} | {by_channel} | {slower:.2f} | {off:+.2%} | **{product:.2f}** ± {spread:.2f}"


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("entries", nargs="*", metavar="ENTRY", help=f"{', '.join(ENTRIES)}; all if none is named")
    parser.add_argument("--size", type=int, default=128, help="pixels along each side")
    parser.add_argument("--samples", type=int, default=4)
    parser.add_argument("--seeds", type=int, default=8)
    parser.add_argument("--bounces", type=int, default=4)
    args = parser.parse_args()
    print("| entry | pixel / mean free path | PATH's error | shared: r g b | time | mean | error × time |")
    print("|---|---|---|---|---|---|---|")
    for entry in args.entries or ENTRIES:
        scene = head_scene(entry)
        for spacing in SPACINGS:
            row = measure(FrameContext(scene, camera_for(spacing, args.size)), args)
            print(f"| {entry.lower()} | {spacing} | {row} |", flush=True)


if __name__ == "__main__":
    main()
