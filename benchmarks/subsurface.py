"""Subsurface scattering beside Cycles, one run, as a Markdown table: `python -m benchmarks.subsurface [SCENE…]`.

Samples a second are the best of renders taken by turns; errors are relMSE against converged Cycles after equal seconds
of `bpy.ops.render.render()`, kernels and caches warm. A ratio above 1 speaks for this engine.
"""

from __future__ import annotations

import argparse
import os
import platform
import sys
from collections.abc import Callable, Iterator

import bpy

from testing.blender import kit, render
from testing.blender.registry import Scene
from testing.measures import relmse

from .against_cycles import ENGINES, Row, timed

SIZE, SMALL = (480, 270), (96, 54)
SAMPLES, ERROR_SAMPLES, REFERENCE_SAMPLES = 16, 64, 8192
ROUNDS = 3
BOUNCES = dict.fromkeys(("max_bounces", "diffuse_bounces", "glossy_bounces", "transmission_bounces"), 4)


def _monkey(method: str, color: tuple, radius: tuple, scale: float, **inputs) -> None:
    """Suzanne, close and alone, of one medium."""

    def build(node):
        return node(
            "BsdfPrincipled", Base_Color=color, Subsurface_Weight=1.0, Subsurface_Radius=radius, Subsurface_Scale=scale,
            subsurface_method=method, **inputs,
        )  # fmt: skip

    monkey = kit.put("monkey", kit.material(build))
    monkey.modifiers.new("Subdivision", "SUBSURF").render_levels = 2
    kit.camera((0.0, -3.2, 0.4), (0.0, 0.0, 0.0))


def skin() -> None:
    """Skin with short ways, under an HDRI and an area light."""
    _monkey("RANDOM_WALK_SKIN", (0.8, 0.5, 0.4, 1.0), (1.0, 0.35, 0.2), 0.1, Roughness=0.4)
    kit.lamp(300)
    kit.hdri("studio", 0.5)


def marble() -> None:
    """A white medium in which light goes far, under an area light."""
    _monkey("RANDOM_WALK", (0.9, 0.88, 0.8, 1.0), (1.0, 0.8, 0.5), 0.5, Roughness=0.3)
    kit.lamp(300)
    kit.world(lambda node: node("Background", Strength=0.0))


def wax() -> None:
    """A coloured medium, dense beside the size of the object, under even light."""
    _monkey("RANDOM_WALK", (0.8, 0.4, 0.1, 1.0), (1.0, 0.5, 0.2), 0.05, Roughness=0.5)
    kit.world(lambda node: node("Background", Strength=1.0))


SCENES: dict[str, Callable[[], None]] = {build.__name__: build for build in (skin, marble, wax)}


def prepare(name: str, size: tuple[int, int]) -> None:
    """Build the scene of this name in an empty file."""
    render.prepare(Scene(name, SCENES[name], 0, 1, size, BOUNCES))


def speed(name: str) -> Iterator[Row]:
    """Millions of samples a second."""
    prepare(name, SIZE)
    for engine in ENGINES:
        timed(engine, 1)
    rounds = [[timed(engine, SAMPLES)[1] for engine in ENGINES] for _ in range(ROUNDS)]
    rates = (SIZE[0] * SIZE[1] * SAMPLES / seconds / 1e6 for seconds in map(min, zip(*rounds, strict=True)))
    yield f"{name}: samples", *rates, "10⁶/s"


def error(name: str) -> Iterator[Row]:
    """relMSE after equal samples and after equal seconds."""
    prepare(name, SMALL)
    reference, _ = timed("CYCLES", REFERENCE_SAMPLES, 99)
    theirs, seconds = timed("CYCLES", ERROR_SAMPLES)
    timed("RESTIR", 1)
    same, trial = timed("RESTIR", ERROR_SAMPLES)
    yield f"{name}: relMSE, {ERROR_SAMPLES} samples", relmse(theirs, reference), relmse(same, reference), ""
    ours, our_seconds = timed("RESTIR", max(1, round(ERROR_SAMPLES * seconds / trial)), 1)
    yield f"{name}: seconds spent", seconds, our_seconds, "s"
    yield f"{name}: relMSE after them", relmse(theirs, reference), relmse(ours, reference), ""


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scenes", nargs="*", help=f"{', '.join(SCENES)}; all if none is named")
    parser.add_argument("--speed-only", action="store_true", help="leave out the errors")
    options = parser.parse_args()
    load = "/".join(f"{value:.1f}" for value in os.getloadavg())
    print(f"Blender {bpy.app.version_string}, {platform.machine()}, {os.cpu_count()} cores, load before {load}\n")
    print("| | Cycles | ReSTIR | ratio |\n|---|---|---|---|")
    render.register()
    for name in options.scenes or SCENES:
        for part in (speed,) if options.speed_only else (speed, error):
            for what, theirs, ours, unit in part(name):
                ratio = ours / theirs if unit == "10⁶/s" else theirs / ours
                print(f"| {what} | {theirs:.4g} {unit} | {ours:.4g} {unit} | {ratio:.2f} |", flush=True)


if __name__ == "__main__":
    main()
    sys.stdout.flush()
    os._exit(0)  # bpy 4.5 can hang at a normal exit
