"""Every kind of bake beside Cycles', as Markdown: `python -m benchmarks.bakes [--samples N] [--size PIXELS]`.

With `--objects N`: processor time of one bake of N objects, and of one from N objects to an active one.

Two seeds by each engine. *off*: the difference of the means by the root mean square of Cycles', of the channel that is
furthest off, and its standard error; *pixels*: the root mean square of the pixels' difference, and what the noise of
both would make of it; *µs*: of processor time by sample, everything included.
"""

from __future__ import annotations

import argparse
import os
import sys
import time

import bpy
import numpy as np

from testing.blender import bakes, kit, render

LOBES = {"DIFFUSE", "GLOSSY", "TRANSMISSION"}
ALL_PARTS = LOBES | {"EMIT", "DIRECT", "INDIRECT"}
KINDS = [
    ("COMBINED", None),
    ("COMBINED", ALL_PARTS),
    ("COMBINED", {"DIFFUSE", "EMIT", "DIRECT", "INDIRECT"}),
    ("COMBINED", {"EMIT"}),
    *((kind, None) for kind in ("AO", "SHADOW", "POSITION", "NORMAL", "UV", "ROUGHNESS", "EMIT", "ENVIRONMENT")),
    *((kind, parts) for kind in sorted(LOBES) for parts in (None, {"DIRECT"}, {"INDIRECT"}, {"COLOR"})),
]
ENGINES = ("CYCLES", "RESTIR")


def row(item, image, kind: str, parts: set[str] | None, samples: int, view: str) -> str:
    """A line of the table."""
    options = {"pass_filter": parts} if parts else {}
    bpy.context.scene.render.bake.view_from = view
    found, seconds = {}, {}
    for engine in ENGINES:
        start = time.process_time()
        pair = [bakes.bake(engine, item, image, kind, samples, seed, **options).values for seed in (1, 2)]
        seconds[engine] = (time.process_time() - start) / (2 * samples * len(pair[0]))
        found[engine] = np.array(pair)[..., :3].astype(float)
    means = {engine: pair.mean((0, 1)) for engine, pair in found.items()}
    noise = {engine: 0.5 * np.sqrt(((pair[0] - pair[1]) ** 2).mean(0)) for engine, pair in found.items()}
    size = np.sqrt((found["CYCLES"] ** 2).mean((0, 1)))
    size[size == 0.0] = np.inf  # Cycles' is black
    off = (means["RESTIR"] - means["CYCLES"]) / size
    error = np.hypot(*noise.values()) / np.sqrt(found["CYCLES"].shape[1]) / size
    worst = int(np.argmax(np.abs(off)))
    apart = np.sqrt(((found["RESTIR"].mean(0) - found["CYCLES"].mean(0)) ** 2).mean())
    expected = np.sqrt(sum(each**2 for each in noise.values()).mean())
    chosen = "all parts" if parts == ALL_PARTS else ", ".join(sorted(parts or ())).lower()
    name = f"{kind} {chosen}".strip()
    mean = f"{off[worst]:+.2%} ± {error[worst]:.2%}" if np.isfinite(size[worst]) else "–"
    times = " | ".join(f"{1e6 * seconds[engine]:.2f}" for engine in ENGINES)
    return f"| {item.name} | {name} | {mean} | {apart:.4f} / {expected:.4f} | {times} |"


def several(objects: int, size: int, samples: int) -> None:
    """Processor seconds of bakes of several objects at once, of 80,000 triangles each, by both engines."""
    bakes.empty()
    items = [kit.put("ball", kit.diffuse(), (2.5 * i, 0.0, 1.0)) for i in range(objects + 1)]
    for item in items:
        item.modifiers.new("Subdivision", "SUBSURF").levels = item.modifiers[0].render_levels = 3
    low = items.pop()
    low.modifiers.clear()
    images = [bakes.target(item, size) for item in (*items, low)]
    for what, active, selected, options in (
        ("each of", items[0], items[1:], {}),
        ("from", low, items, {"use_selected_to_active": True, "cage_extrusion": 0.1}),
    ):
        for engine in (*ENGINES, *ENGINES):
            start = time.process_time()
            with render.quiet():
                bakes.bake(engine, active, images[0], "AO", samples, selected=selected, **options)
            print(f"{what} {objects} objects, {engine}: {time.process_time() - start:.2f} s", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--samples", type=int, default=256)
    parser.add_argument("--size", type=int, default=64)
    parser.add_argument("--view", default="ABOVE_SURFACE", choices=["ABOVE_SURFACE", "ACTIVE_CAMERA"])
    parser.add_argument("--objects", type=int, default=0)
    options = parser.parse_args()
    if options.objects:
        several(options.objects, options.size, options.samples)
        return
    print("| object | bake | off | pixels | Cycles µs | ours µs |\n|---|---|---|---|---|---|")
    with render.quiet():
        items = bakes.stage()
        images = [bakes.target(item, options.size) for item in items]
    for item, image in zip(items, images, strict=True):
        for kind, parts in KINDS:
            samples = 1 if kind == "POSITION" else options.samples  # Cycles adds it up over the samples
            with render.quiet():
                line = row(item, image, kind, parts, samples, options.view)
            print(line, flush=True)


if __name__ == "__main__":
    main()
    sys.stdout.flush()
    os._exit(0)  # bpy 4.5 can hang at a normal exit
