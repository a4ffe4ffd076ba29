"""Noise that is left after equal processor time, engine by engine; `against_cycles` prints it.

Every engine renders the same files in a process of its own, by turns. Noise is the variance between seeds over (mean² +
0.01), without the worst 0.1 % of the pixels: it needs no reference. As it goes with one over the number of samples, it
is brought to exactly the time that was asked for by the processor time that a picture took.
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import bpy
import numpy as np

from testing.blender import render
from testing.measures import noise

from . import scenes
from .side_by_side import ROOT, Build

SIZE = (192, 108)
SCENES = [
    "skin", "slab", "jade", "room", "lanterns", "screen", "sun_and_sky", "window", "glass", "all_lobes",
]  # fmt: skip
TRIAL = 4  # samples


class Engine(NamedTuple):
    """What renders: a checkout and its integrator, or CYCLES in this one's process."""

    label: str
    checkout: Path
    integrator: str


class Noise(NamedTuple):
    """After so many seconds on all cores; spent: the processor seconds that pictures took on average."""

    seconds: float
    value: float
    samples: int
    spent: float


def engines(against: Path | None) -> list[Engine]:
    """Cycles and ours, and those of an older checkout."""
    found = [Engine(name, ROOT, name) for name in ("CYCLES", "PATH", "RESTIR")]
    if against:
        found += [Engine(f"{name} before", against.resolve(), name) for name in ("PATH", "RESTIR")]
    return found


def measure(scene: str, rows: list[Engine], times: list[float], seeds: int) -> Iterator[tuple[Engine, list[Noise]]]:
    """The noise of each engine after each of some times (seconds on all cores)."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        blend = folder / "scene.blend"
        with render.quiet():
            scenes.prepare(scene, SIZE)
            bpy.ops.wm.save_as_mainfile(filepath=str(blend), copy=True)
        for row in rows:
            # One cache a checkout: its digest tells versions of the sources apart.
            build = Build(row.checkout, blend, Path(os.environ.get("RESTIR_CACHE", folder / row.checkout.name)))
            yield row, [_noise(build, row.integrator, seconds, seeds, folder) for seconds in times]
            build.close()


def _noise(build: Build, integrator: str, seconds: float, seeds: int, folder: Path) -> Noise:
    """Noise of pictures that take about so many seconds."""
    wanted = seconds * (os.cpu_count() or 1)
    first = min(build.render(integrator, 1)["processor"] for _ in range(2))
    trial = build.render(integrator, 1 + TRIAL)["processor"]
    samples = max(1, round(1 + (wanted - first) * TRIAL / max(trial - first, 1e-3)))
    # What a render chooses by its number of samples may be faster than the trial was.
    samples = max(samples, round(samples * min(wanted / build.render(integrator, samples)["processor"], 4.0)))
    pictures, spent = [], 0.0
    for seed in range(seeds):
        path = folder / "picture.exr"
        spent += build.render(integrator, samples, 1 + seed, path)["processor"] / seeds
        pictures.append(render.read(str(path))[:, :, :3])
    return Noise(seconds, noise(np.stack(pictures)) * spent / wanted, samples, spent)


def table(names: list[str], against: Path | None, times: list[float], seeds: int) -> Iterator[str]:
    """A table in Markdown: 1,000 times the noise, and its ratios to Cycles' and to the better of the older build's two.

    Ratios stand in the order of the times.
    """
    rows = engines(against)
    heads = [f"{seconds:g} s" for seconds in times] + ["/ Cycles"] + (["/ better before"] if against else [])
    yield f"| scene | engine | samples | {' | '.join(heads)} |"
    yield f"|{'---|' * (3 + len(heads))}"
    for scene in names:
        found = dict(measure(scene, rows, times, seeds))
        for row, noises in found.items():
            values = [f"{1e3 * item.value:.3g}" for item in noises]
            values.append(_ratios(noises, found[rows[0]]))
            if against:
                better = [
                    min(pair, key=lambda item: item.value) for pair in zip(found[rows[3]], found[rows[4]], strict=True)
                ]
                values.append(_ratios(noises, better))
            yield f"| {scene} | {row.label} | {noises[-1].samples} | {' | '.join(values)} |"


def _ratios(ours: list[Noise], theirs: list[Noise]) -> str:
    return ", ".join(f"{a.value / b.value:.2f}" for a, b in zip(ours, theirs, strict=True))
