"""One frame of RESTIR after sixteen of a moving camera, beside PATH: `python -m benchmarks.moving_camera`.

Lamps over a floor with boxes, one sample a pixel and frame, one thread. PATH takes as many samples as fit into the time
that a frame of RESTIR takes on the CPU (of both the least that was measured: other load on the machine only adds).
Prints the ratio of their relMSE against a converged picture; direct light alone where no bounces are asked for.
"""

from __future__ import annotations

import argparse
import time

import numpy as np

from benchmarks.bias import relmse
from restir_engine.context import FrameContext
from restir_engine.film import Film
from restir_engine.integrators.path import PathIntegrator
from restir_engine.integrators.restir.integrator import RestirIntegrator
from restir_engine.scene.lamps import point_lamp
from restir_engine.settings import RenderSettings, required_passes
from testing.scenes.lights import emission_program, matrix
from testing.scenes.moving import reuse_of
from testing.scenes.rooms import UNSEEN, Builder, coated, diffuse, look, render, scaled
from testing.scenes.shapes import CUBE, QUAD

FRAMES = 17


def lanterns(lamps: int, glowing: bool, size: int):
    """A floor, a wall and boxes under coloured lamps, or cubes that glow in one colour; the camera sees no light."""
    random = np.random.default_rng(5)
    b = Builder()
    b.add(QUAD, coated((0.6, 0.55, 0.5), 0.4), scaled(matrix(), 5.0, 5.0, 1.0))
    b.add(QUAD, diffuse((0.6, 0.6, 0.6)), scaled(matrix((0.0, 2.5, 0.0), (0.0, -1.0, 0.0)), 5.0, 5.0, 1.0))
    for x, y in random.uniform(-2.0, 2.0, (12, 2)):
        b.add(CUBE, diffuse(random.uniform(0.2, 0.8, 3)), scaled(matrix((x, y, 0.2)), 0.2, 0.2, 0.2))
    for place in random.uniform((-2.5, -2.5, 0.8), (2.5, 2.3, 2.4), (lamps, 3)):
        if glowing:
            color = random.uniform(0.2, 1.0) ** 3 * np.array([1.0, 0.8, 0.6]) * 2e5 / lamps
            b.add(CUBE, emission_program(color), scaled(matrix(tuple(place)), 0.02, 0.02, 0.02), UNSEEN)
            continue
        color = random.uniform(0.05, 1.0, 3) ** 2 * 1500.0 / lamps
        b.lamp(point_lamp(matrix(tuple(place)), color, 0.02, seen_by=UNSEEN))
    return b.finish(view(FRAMES - 1, size))


def view(step: int, size: int):
    """The camera of a frame: it walks around the middle and comes closer."""
    angle = 0.02 * step
    return look((3.2 * np.sin(angle), -3.2 * np.cos(angle), 1.9 - 0.01 * step), (0.0, 0.0, 0.3), size)


def frame(integrator, sample: int, samples: int, tiles) -> float:
    """Render samples on this thread; seconds of it."""
    scratch = integrator.scratch()
    start = time.process_time()
    for stage in integrator.stages(sample, samples):
        for item in stage.items or tiles:
            stage.run(item, scratch)
        stage.finish()
    return time.process_time() - start


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--lamps", type=int, default=400)
    parser.add_argument("--glowing", action="store_true", help="cubes of triangles in place of lamps")
    parser.add_argument("--size", type=int, default=128)
    parser.add_argument("--bounces", type=int, default=0)
    parser.add_argument("--reference", type=int, default=120, help="samples of PATH")
    args = parser.parse_args()
    size = args.size
    tiles = [(x, y, min(x + 32, size), min(y + 32, size)) for y in range(0, size, 32) for x in range(0, size, 32)]
    scene = lanterns(args.lamps, args.glowing, size)
    near = {"radius": 4.0}
    plans = {
        "no reuse": reuse_of(),
        "temporal": reuse_of(temporal=True),
        "both": reuse_of(temporal=True, rounds=1),
        "both, within 4 pixels": reuse_of(temporal=True, rounds=1, **near),
        "both, by channel": reuse_of(temporal=True, rounds=1, by_channel=True),
        "both, by channel, within 4 pixels": reuse_of(temporal=True, rounds=1, by_channel=True, **near),
    }
    result = {}
    for name, plan in plans.items():
        history = None
        times = []
        for step in range(FRAMES):
            settings = RenderSettings(seed=step, max_bounces=args.bounces, reuse=plan)
            film = Film(size, size, required_passes(settings.passes, False), 1.0)
            integrator = RestirIntegrator(FrameContext(scene, view(step, size)), settings, film, history)
            history = integrator.history
            times.append(frame(integrator, 0, 1, tiles))
        film.samples = 1
        result[name] = min(times[FRAMES // 2 :]), film.pass_array("Combined")[:, :, :3]
    reference = render(scene, args.reference, seed=99, integrator="PATH", max_bounces=args.bounces)
    for name, (seconds, ours) in result.items():
        film = Film(size, size, required_passes(settings.passes, False), 1.0)
        path = PathIntegrator(FrameContext(scene), settings, film)
        count = max(1, round(seconds / min(frame(path, 100, 8, tiles) / 8 for _ in range(4))))
        film.pixels[:] = 0.0
        path_seconds = frame(path, 4, count, tiles)
        film.samples = count
        errors = relmse(ours, reference), relmse(film.pass_array("Combined")[:, :, :3], reference)
        print(
            f"{name}: {seconds:.2f} s, relMSE {errors[0]:.4f}; PATH, {count} samples, {path_seconds:.2f} s, "
            f"relMSE {errors[1]:.4f}; ratio {errors[1] / errors[0]:.1f}",
            flush=True,
        )


if __name__ == "__main__":
    main()
