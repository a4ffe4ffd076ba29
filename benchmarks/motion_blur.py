"""What motion blur costs: `python -m benchmarks.motion_blur`.

Processor time of a picture whose shutter is open, by that of one of its middle, on one thread, after the scene has been
committed. The same samples of the same scenes: a camera that pans; 400 balls that each slide and turn; a sheet of
80,000 triangles that waves; luminous meshes among them; all of these at once.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import replace
from itertools import product

import numpy as np

from restir_engine.scene.description import SceneDescription
from restir_engine.scene.lamps import area_lamp
from restir_engine.scene.scene import Scene
from restir_engine.scene.shutter import Shutter
from restir_engine.session import Session
from restir_engine.settings import RenderSettings
from testing.scenes.blurred import deforming, move, turned
from testing.scenes.lights import emission_program, matrix
from testing.scenes.rooms import Builder, coated, diffuse, look, scaled
from testing.scenes.shapes import QUAD, icosphere

MOVES = ("camera", "objects", "mesh", "lights")
INTEGRATORS = ("PATH", "RESTIR")
GRID = 200


def _sheet() -> np.ndarray:
    """Where a waving sheet of 2 GRID² triangles is at three times, and its triangles."""
    line = np.linspace(-1.0, 1.0, GRID + 1)
    x, y = (a.ravel() for a in np.meshgrid(line, line))
    steps = [np.column_stack([x, y, 0.05 * np.sin(9.0 * x + k) * np.cos(7.0 * y - k)]) for k in (-0.7, 0.0, 0.7)]
    corner = (np.arange(GRID)[:, None] * (GRID + 1) + np.arange(GRID)).ravel()
    a, b, c, d = corner, corner + 1, corner + GRID + 2, corner + GRID + 1
    return np.array(steps), np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])


def scene(moves: frozenset[str], size: int) -> SceneDescription:
    """The scene with those of MOVES in motion."""
    b = Builder()
    b.add(QUAD, coated((0.6, 0.55, 0.5), 0.4), scaled(matrix(), 6.0, 6.0, 1.0))
    steps, triangles = _sheet()
    sheet = deforming(steps, triangles)
    if "mesh" not in moves:
        sheet.steps = None
    b.add(sheet, diffuse((0.3, 0.5, 0.6)), matrix((0.0, 1.2, 0.8), (0.0, -1.0, 0.6)))
    ball = icosphere(1.0, 3)
    random = np.random.default_rng(1)
    ways = {}
    for place, turn, way in zip(
        random.uniform(-1.5, 1.5, (400, 2)),
        random.uniform(-1, 1, 400),
        random.uniform(-0.1, 0.1, (400, 2)),
        strict=True,
    ):
        index = b.add(ball, diffuse((0.7, 0.4, 0.3)), turned(0.0, (*place, 0.06), 0.06, 0.04, 0.06))
        ways[index] = [turned(turn * k, (*(place + k * way), 0.06), 0.06, 0.04, 0.06) for k in (-1, 0, 1)]
    moving = dict(ways) if "objects" in moves else {}
    for k in range(8):
        place = np.array([np.cos(k), np.sin(k), 0.5 + 0.05 * k])
        index = b.add(QUAD, emission_program((8.0, 7.0, 5.0)), scaled(matrix(place, (0.0, 0.3, -1.0)), 0.06, 0.06, 1.0))
        if "lights" in moves:
            moving[index] = [
                scaled(matrix(place + 0.1 * t * np.eye(3)[0], (t, 0.3, -1.0)), 0.06, 0.06, 1) for t in (-1, 0, 1)
            ]
    b.lamp(area_lamp(matrix((0.6, -0.8, 3.0), (0.3, -0.4, 1.0)), 12.0 * np.ones(3), 0.5, 0.4, key=1))
    view = look((0.3, -2.6, 1.9), (0.0, 0.0, 0.35), size)
    result = b.describe(view)
    move(result, moving)
    if "camera" in moves:
        result.camera = replace(
            view, steps=tuple(look((0.3 + 0.1 * k, -2.6, 1.9), (0.15 * k, 0.0, 0.35), size) for k in (-1, 0, 1))
        )
    if moves:
        result.shutter = Shutter()
    return result


def seconds(committed: Scene, integrator: str, samples: int) -> float:
    """Processor time of a render."""
    session = Session(committed, RenderSettings(integrator=integrator, samples=samples, max_bounces=3, threads=1))
    session.prepare()
    start = time.process_time()
    session.render()
    return time.process_time() - start


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--size", type=int, default=160)
    parser.add_argument("--samples", type=int, default=16)
    parser.add_argument("--repeats", type=int, default=5, help="of which the least counts; the cases take turns")
    options = parser.parse_args()
    cases = {"still": frozenset()} | {name: frozenset([name]) for name in MOVES} | {"all": frozenset(MOVES)}
    scenes = {name: scene(moves, options.size).commit() for name, moves in cases.items()}
    least: dict[tuple[str, str], float] = {}
    for _ in range(options.repeats):
        for name, integrator in product(cases, INTEGRATORS):
            taken = seconds(scenes[name], integrator, options.samples)
            least[name, integrator] = min(taken, least.get((name, integrator), taken))
    print("| in motion | PATH s | by still | RESTIR s | by still |\n|---|---|---|---|---|")
    for name in cases:
        row = [(least[name, each], least[name, each] / least["still", each]) for each in INTEGRATORS]
        print(f"| {name} | " + " | ".join(f"{taken:.2f} | {ratio:.2f}" for taken, ratio in row) + " |")


if __name__ == "__main__":
    main()
