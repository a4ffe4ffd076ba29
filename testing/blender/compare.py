"""Figures for scenes, and side-by-side pictures: Cycles, ReSTIR, and their difference around grey.

python -m testing.blender.compare [SCENE…] [--out DIRECTORY] [--samples FACTOR] [--against CYCLES]
"""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path

import numpy as np

from ..measures import block_error, srgb
from . import render, scenes

ENLARGE = 4
HEADER = ("scene", "R", "G", "B", "A", "± Cycles", "± ours", "FLIP", "seeds", "block", "Cycles s", "ours s")


def picture(result: render.Comparison) -> np.ndarray:
    """sRGB values (height, width, 3): the mean of Cycles' images, of ours, and four times their difference."""
    reference, ours = (np.mean(images, 0) for images in (result.reference, result.ours))
    difference = np.clip(0.5 + 4.0 * (srgb(ours) - srgb(reference)), 0.0, 1.0)
    joined = np.concatenate([srgb(reference), srgb(ours), difference], 1)
    return joined.repeat(ENLARGE, 0).repeat(ENLARGE, 1)


def figures(result: render.Comparison) -> list[str]:
    """The columns of `HEADER`."""
    reference, ours = (np.mean(images, 0) for images in (result.reference, result.ours))
    numbers = [f"{value:.4f}" for value in (result.flip, result.flip_noise, block_error(ours, reference))]
    return [
        result.scene.name,
        *(f"{value:+.2%}" for value in result.difference),
        *(f"{error[:3].max():.2%}" for error in result.errors),
        *numbers,
        *(f"{value:.1f}" for value in result.seconds),
    ]


def main(arguments: list[str] | None = None) -> int:
    """Returns the number of scenes that are out of bounds."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scenes", nargs="*", metavar="SCENE", help=", ".join(scenes.SCENES))
    parser.add_argument("--out", type=Path, help="directory for pictures")
    parser.add_argument("--samples", type=float, default=1.0, help="factor on every scene's samples")
    parser.add_argument("--against", default="RESTIR", help="engine to compare with Cycles")
    options = parser.parse_args(arguments)
    render.register()
    if options.out:
        options.out.mkdir(parents=True, exist_ok=True)
    failed = 0
    print("| " + " | ".join(HEADER) + " |\n" + "|---" * len(HEADER) + "|")
    for name in options.scenes or scenes.SCENES:
        try:
            with render.quiet():
                result = render.compare(scenes.scaled(scenes.SCENES[name], options.samples), options.against)
        except RuntimeError as error:  # the engine's report
            failed += 1
            print(f"| {name} | {error}", flush=True)
            continue
        failures = result.failures()
        failed += bool(failures)
        print("| " + " | ".join(figures(result)) + " |", *failures, sep="\n    ", flush=True)
        if options.out:
            render.save(options.out / f"{name}.png", picture(result))
    return failed


if __name__ == "__main__":
    status = min(main(), 125)
    sys.stdout.flush()
    os._exit(status)  # bpy 4.5 can hang at a normal exit
