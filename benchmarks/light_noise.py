"""Noise at equal samples under lights of many kinds, beside Cycles: `python -m benchmarks.light_noise [SET-UP …]`.

Noise is the variance between seeds over (mean² + 0.01), without the worst 0.1 % of the pixels. It needs no reference:
both engines are measured against their own mean. RESTIR takes light tiles in every set-up. Prints Markdown: Cycles'
noise, and ours as a multiple of it, above 1 where ours is noisier.
"""

from __future__ import annotations

import argparse
import os
import platform
import sys
from collections.abc import Callable

import bpy
import numpy as np

from testing.blender import kit, render
from testing.blender.registry import Scene
from testing.measures import noise

SIZE, SAMPLES, SEEDS, BOUNCES = (128, 72), 16, 6, 4


def things(skin: bool = False) -> None:
    """A head, a ball, a cube and a wall on a floor; the head diffuse or of skin."""
    flesh = kit.principled(
        Base_Color=(0.8, 0.5, 0.4, 1.0), Subsurface_Weight=1.0, Subsurface_Radius=(1.0, 0.35, 0.2),
        Subsurface_Scale=0.1, Roughness=0.4,
    )  # fmt: skip
    kit.floor()
    kit.put("monkey", flesh if skin else kit.diffuse((0.8, 0.5, 0.3)), (-1.3, 0.0, 0.9), 0.8)
    kit.put("ball", kit.principled(Base_Color=(0.3, 0.5, 0.8, 1.0), Roughness=0.3), (0.6, 0.4, 0.6), 0.6)
    kit.put("cube", kit.diffuse((0.4, 0.7, 0.4)), (2.0, 0.0, 0.5), 0.5, rotation=(0, 0, 30))
    kit.put("plane", kit.diffuse(), (0.0, 3.0, 2.0), 3.0, rotation=(90, 0, 0))


def dark() -> None:
    kit.world(lambda node: node("Background", Strength=0.0))


def sky(strength: float) -> None:
    kit.world(lambda node: node("Background", Color=node("TexSky", sun_disc=True), Strength=strength))


def lamps(count: int, energy: float) -> None:
    """Small coloured lamps all about."""
    random = np.random.default_rng(5)
    for place, color in zip(
        random.uniform((-3, -3, 0.3), (3, 2.5, 3), (count, 3)), random.uniform(0.2, 1, (count, 3)), strict=True
    ):
        kit.light("POINT", energy, place, shadow_soft_size=0.05, color=color)


def glowing(count: int, strength: float) -> None:
    """Small luminous cubes of twelve triangles all about."""
    random = np.random.default_rng(6)
    material = kit.emission((1.0, 0.7, 0.3), strength)
    for place in random.uniform((-3, -2, 0.2), (3, 2.5, 2.5), (count, 3)):
        kit.put("cube", material, place, 0.05)


def screen(strength: float) -> None:
    """A luminous picture."""
    pixels = np.zeros((64, 64, 4), np.float32)
    pixels[..., 3] = 1.0
    pixels[8:20, 8:20, :3], pixels[40:56, 30:34, :3] = (1.0, 0.2, 0.1), (0.1, 0.4, 1.0)
    picture = kit.image("screen", pixels)
    material = kit.material(lambda node: node("Emission", Color=node("TexImage", image=picture), Strength=strength))
    kit.put("plane", material, (-3.2, 0.5, 1.6), 1.2, rotation=(0, 90, 0))


def room() -> None:
    """Walls all round with a window, which the camera's side is open to."""
    wall = kit.diffuse((0.7, 0.7, 0.7))
    kit.put("plane", wall, (0.0, 0.0, 4.0), 4.0)
    kit.put("plane", wall, (4.0, 0.0, 2.0), (2.0, 4.0, 1.0), rotation=(0, 90, 0))
    kit.put("plane", wall, (-4.0, -2.5, 2.0), (2.0, 1.5, 1.0), rotation=(0, 90, 0))
    kit.put("plane", wall, (-4.0, 2.5, 2.0), (2.0, 1.5, 1.0), rotation=(0, 90, 0))


def portal() -> None:
    """What shows where the room's window is."""
    thing = kit.light("AREA", 1.0, (-4.0, 0.0, 2.0), (0.0, 0.0, 2.0), shape="RECTANGLE", size=2.0, size_y=4.0)
    thing.data.cycles.is_portal = True


SETUPS: dict[str, list[Callable[[], object]]] = {
    "area": [things, dark, lambda: kit.lamp(300)],
    "suns": [
        things, dark, lambda: kit.light("SUN", 3.0, (3, -3, 5), angle=0.1),
        lambda: kit.light("SUN", 1.0, (-4, -1, 3), angle=0.01, color=(0.4, 0.6, 1.0)),
    ],
    "hdri": [things, lambda: kit.hdri("courtyard", 1.0)],
    "few lamps": [things, dark, lambda: lamps(12, 20.0)],
    "400 lamps": [things, dark, lambda: lamps(400, 1.0)],
    "hdri, area": [things, lambda: kit.hdri("studio", 0.5), lambda: kit.lamp(300)],
    "hdri, area, skin": [lambda: things(True), lambda: kit.hdri("studio", 0.5), lambda: kit.lamp(300)],
    "hdri, dim area": [things, lambda: kit.hdri("courtyard", 1.0), lambda: kit.lamp(15)],
    "sky, sun, window": [
        things, room, lambda: sky(0.3), lambda: kit.light("SUN", 2.0, (-6, 1, 3), target=(0, 0, 0), angle=0.01),
    ],
    "window, lamp": [
        things, room, lambda: sky(0.1), lambda: kit.light("POINT", 60.0, (1.5, -0.5, 2.5), shadow_soft_size=0.1),
    ],
    "portal, hdri": [things, room, portal, lambda: kit.hdri("courtyard", 1.0)],
    "portal, even world": [things, room, portal, lambda: kit.world(lambda node: node("Background", Strength=2.0))],
    "portal, sky, lamp": [
        things, room, portal, lambda: sky(0.1),
        lambda: kit.light("POINT", 60.0, (1.5, -0.5, 2.5), shadow_soft_size=0.1),
    ],
    "picture": [things, dark, lambda: screen(20.0)],
    "picture, lamp": [things, dark, lambda: screen(20.0), lambda: kit.lamp(100)],
    "glowing cubes": [things, dark, lambda: glowing(80, 40.0)],
    "lamp, 1,000 triangles": [things, dark, lambda: glowing(84, 20.0), lambda: kit.lamp(100)],
    "cubes, hdri": [things, lambda: glowing(40, 20.0), lambda: kit.hdri("night", 1.0)],
    "400 lamps, hdri, cubes": [
        things, lambda: lamps(400, 0.5), lambda: glowing(20, 20.0), lambda: kit.hdri("forest", 0.3),
    ],
}  # fmt: skip


def prepare(name: str) -> None:
    """Build a set-up in an empty file."""
    limits = dict.fromkeys(("max_bounces", "diffuse_bounces", "glossy_bounces", "transmission_bounces"), BOUNCES)

    def build() -> None:
        kit.camera((0.0, -6.5, 2.2), (0.2, 0.0, 0.9))
        for step in SETUPS[name]:
            step()

    render.prepare(Scene(name, build, 0, 1, SIZE, limits))


def noise_of(engine: str, samples: int, seeds: int) -> float:
    """Noise of the current scene."""
    with render.quiet():
        return noise(np.stack([render.render(engine, samples, seed)[..., :3] for seed in range(seeds)]))


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("setups", nargs="*", help=f"{', '.join(SETUPS)}; all if none is named")
    parser.add_argument("--samples", type=int, default=SAMPLES)
    parser.add_argument("--seeds", type=int, default=SEEDS)
    options = parser.parse_args()
    print(f"Blender {bpy.app.version_string}, {platform.machine()}, {SIZE[0]} × {SIZE[1]}, {options.samples} samples\n")
    print("| lights | Cycles' noise | PATH / Cycles | RESTIR / Cycles |\n|---|---|---|---|")
    render.register()
    for name in options.setups or SETUPS:
        prepare(name)
        theirs = noise_of("CYCLES", options.samples, options.seeds)
        row = []
        bpy.context.scene.restir.reuse.pilot = False  # by light tiles, whether they pay or not
        for integrator in ("PATH", "RESTIR"):
            bpy.context.scene.restir.integrator = integrator
            row.append(noise_of("RESTIR", options.samples, options.seeds) / theirs)
        print(f"| {name} | {theirs:.4f} | {row[0]:.2f} | {row[1]:.2f} |", flush=True)


if __name__ == "__main__":
    main()
    sys.stdout.flush()
    os._exit(0)  # bpy 4.5 can hang at a normal exit
