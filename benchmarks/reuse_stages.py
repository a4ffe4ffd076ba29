"""What a frame of RESTIR costs by stage, and its noise: `python -m benchmarks.reuse_stages [LIGHT …] [--seeds N]`.

The room of testing/scenes/rooms.py at 128 × 128 pixels, two bounces: a single frame of one sample, and the sixth of a
history. relMSE against 250 frames with four light samples; milliseconds of one thread, the least of all seeds; noise ×
time is relative to a frame without reuse.
"""

from __future__ import annotations

import argparse
import time

import numpy as np

from restir_engine.context import FrameContext
from restir_engine.film import Film
from restir_engine.integrators.restir.integrator import RestirIntegrator
from restir_engine.reuse_settings import ReuseSettings
from restir_engine.settings import RenderSettings, required_passes
from testing.scenes.rooms import LIGHTS, picture_scene

from .bias import relmse

SIZE, TILE, HISTORY = 128, 32, 6
STAGES = ("_candidates", "_temporal", "_spatial", "_shade")


def variants() -> dict[str, dict]:
    """Options by name; `radius` and `neighbours` for both patterns."""
    found: dict[str, dict] = {"no reuse": {}}
    for neighbours, radius in ((3, 16.0), (3, 8.0), (3, 4.0), (5, 8.0)):
        for pattern in ("DISK", "PAIRS"):
            options = {"rounds": 1, "pattern": pattern, "neighbours": neighbours, "radius": radius}
            found[f"{pattern}, {neighbours} within {radius:g}"] = options
    return found


def frames(scene, seed: int, count: int, **options) -> tuple[np.ndarray, dict[str, float]]:
    """The mean of `count` frames, or the last one of a history; and the last one's milliseconds by stage."""
    settings = RenderSettings(seed=seed, max_bounces=2, reuse=ReuseSettings(**options))
    film = Film(SIZE, SIZE, required_passes(settings.passes, False), 1.0)
    integrator = RestirIntegrator(FrameContext(scene), settings, film)
    integrator.prepare()
    scratch = integrator.scratch()
    tiles = [(x, y, x + TILE, y + TILE) for y in range(0, SIZE, TILE) for x in range(0, SIZE, TILE)]
    for sample in range(count):
        spent: dict[str, float] = {}
        if settings.reuse.temporal:
            film.pixels[:] = 0.0
        for stage in integrator.stages(sample, 1):
            start = time.thread_time()
            for item in tiles if stage.items is None else stage.items:
                stage.run(item, scratch)
            stage.finish()
            name = getattr(stage.run, "func", stage.run).__name__
            spent[name] = spent.get(name, 0.0) + 1e3 * (time.thread_time() - start)
    film.samples = 1 if settings.reuse.temporal else count
    return film.pass_array("Combined")[:, :, :3], spent


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("lights", nargs="*", default=["many", "area"], help=", ".join(LIGHTS))
    parser.add_argument("--seeds", type=int, default=3)
    args = parser.parse_args()
    stages = " | ".join(name[1:] for name in STAGES)
    print(f"| light | reuse | relMSE | frame, ms | {stages} | noise × time |\n|{'---|' * (5 + len(STAGES))}")
    for light in args.lights:
        scene = picture_scene(light, SIZE)
        reference, _ = frames(scene, 999, 250, light_samples=4)
        for temporal in (False, True):
            base = None
            for name, options in variants().items():
                count = HISTORY if temporal else 1
                runs = [frames(scene, seed, count, temporal=temporal, **options) for seed in range(args.seeds)]
                noise = np.mean([relmse(picture, reference) for picture, _ in runs])
                spent = {stage: min(ms.get(stage, 0.0) for _, ms in runs) for stage in runs[0][1]}
                total = sum(spent.values())
                base = base or noise * total
                row = " | ".join(f"{spent.get(stage, 0.0):.1f}" for stage in STAGES)
                name = f"temporal, {name}" if temporal else name
                print(
                    f"| {light} | {name} | {noise:.3f} | {total:.1f} | {row} | {noise * total / base:.2f} |", flush=True
                )


if __name__ == "__main__":
    main()
