"""Which settings of RESTIR have the lowest error at equal time: `python -m benchmarks.restir_defaults [LIGHT …]`.

The room of testing/scenes/rooms.py at 64 × 64 pixels. Time is that of the processor on one thread, so that a busy
machine does not blur it. Noise is relMSE (the worst 0.1 % of the pixels left out) against many samples of PATH; as it
goes with one over time, `noise x time` ranks settings. Prints a table in Markdown, PATH = 1.
"""

from __future__ import annotations

import argparse
import time

import numpy as np

from restir_engine.reuse_settings import ReuseSettings
from testing.scenes.rooms import LIGHTS, picture_scene, render

from .bias import relmse

SAMPLES = 8
NONE, ONE = {"rounds": 0}, {"rounds": 1}


def variants() -> dict[str, dict]:
    """Settings by name."""
    found = {}
    for m, k in ((16, 1), (32, 1), (64, 1), (128, 1), (64, 2), (64, 4)):
        name = f"no reuse, {m} candidates, {k} light samples"
        found[name] = NONE | {"light_candidates": m, "light_samples": k}
    for neighbours in (1, 3):
        found[f"spatial, {neighbours} neighbours"] = ONE | {"neighbours": neighbours}
    found["spatial, SHADED"] = ONE | {"visibility": "SHADED"}
    found["two rounds"] = {"rounds": 2}
    found["temporal"] = NONE | {"temporal": True}
    found["temporal and spatial"] = ONE | {"temporal": True}
    return found


def measure(scene, reference: np.ndarray, seeds: int, **settings) -> tuple[float, float]:
    """(relMSE, processor seconds) of one picture, on average of some seeds."""
    noise = seconds = 0.0
    for seed in range(100, 100 + seeds):
        start = time.process_time()
        picture = render(scene, SAMPLES, seed=seed, threads=1, **settings)
        seconds += time.process_time() - start
        noise += relmse(picture, reference)
    return noise / seeds, seconds / seeds


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("lights", nargs="*", default=list(LIGHTS))
    parser.add_argument("--seeds", type=int, default=4)
    parser.add_argument("--bounces", type=int, default=12)
    parser.add_argument("--only", default="", help="names that contain this")
    args = parser.parse_args()
    print("| light | settings | relMSE | CPU s | noise | time | noise x time |\n|---|---|---|---|---|---|---|")
    for light in args.lights:
        scene = picture_scene(light, 64)
        reference = render(scene, 2048, seed=1, integrator="PATH", max_bounces=args.bounces)
        rows = {"PATH": {"integrator": "PATH"}}
        rows |= {
            name: {"integrator": "RESTIR", "reuse": ReuseSettings(pilot=False, **options)}
            for name, options in variants().items()
            if args.only in name
        }
        base = None
        for name, settings in rows.items():
            render(scene, 1, threads=1, **settings)  # kernels
            noise, seconds = measure(scene, reference, args.seeds, max_bounces=args.bounces, **settings)
            base = base or (noise, seconds)
            a, b = noise / base[0], seconds / base[1]
            print(f"| {light} | {name} | {noise:.4f} | {seconds:.2f} | {a:.2f} | {b:.2f} | {a * b:.2f} |", flush=True)


if __name__ == "__main__":
    main()
