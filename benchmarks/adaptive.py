"""What stopping early costs in brightness, and what it saves: `python -m benchmarks.adaptive [LIGHT …] [--seeds N]`.

The room of testing/scenes/rooms.py at 64 × 64 pixels, two bounces, PATH and tiles: for each noise threshold the
mean number of samples, the relative difference of the mean luminance to that of renders with all samples, and its
standard error over the seeds. Prints Markdown.
"""

from __future__ import annotations

import argparse

import numpy as np

from restir_engine.reuse_settings import ReuseSettings
from restir_engine.session import Session
from restir_engine.settings import RenderSettings
from testing.measures import relmse
from testing.scenes.rooms import LIGHTS, picture_scene

LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
MOST = 1024
THRESHOLDS = (0.2, 0.1, 0.05, 0.02)
METHODS = {"PATH": {"integrator": "PATH"}, "RESTIR": {"integrator": "RESTIR", "reuse": ReuseSettings(pilot=False)}}


def picture(scene, seed: int, threshold: float | None, most: int, **settings) -> tuple[np.ndarray, float]:
    """A render (height, width, 3) and its mean number of samples; threshold None: all samples."""
    adaptive = {"use_adaptive_sampling": threshold is not None, "adaptive_threshold": threshold or 1.0}
    session = Session(scene, RenderSettings(seed=seed, samples=most, max_bounces=2, **adaptive, **settings))
    session.render()
    counts = session.film.pass_array("Debug Sample Count")
    return session.combined()[..., :3], float(counts.mean())


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("lights", nargs="*", default=["point", "world"], help=", ".join(LIGHTS))
    parser.add_argument("--seeds", type=int, default=16)
    args = parser.parse_args()
    print("| light | integrator | threshold | samples | bias % | standard error % | relMSE × samples by all samples' |")
    print(f"|{'---|' * 7}")
    for light in args.lights:
        scene = picture_scene(light)
        # Seeds of their own: what both kinds of render had in common would hide the bias.
        truth = np.stack([picture(scene, 1000 + s, None, MOST, **METHODS["PATH"])[0] for s in range(args.seeds)])
        true_means = (truth @ LUMINANCE).mean((1, 2))
        reference = truth.mean(0)
        for method, settings in METHODS.items():
            plain, count = picture(scene, 500, None, 128, **settings)
            base = relmse(plain, reference) * count
            for threshold in THRESHOLDS:
                runs = [picture(scene, seed, threshold, MOST, **settings) for seed in range(args.seeds)]
                means = np.array([(image @ LUMINANCE).mean() for image, _ in runs])
                samples = np.mean([count for _, count in runs])
                off = means.mean() / true_means.mean() - 1.0
                error = np.hypot(means.std(ddof=1), true_means.std(ddof=1)) / np.sqrt(args.seeds) / true_means.mean()
                worth = np.mean([relmse(image, reference) for image, _ in runs]) * samples / base
                row = f"{threshold:g} | {samples:.0f} | {100 * off:+.3f} | {100 * error:.3f} | {worth:.2f}"
                print(f"| {light} | {method} | {row} |", flush=True)


if __name__ == "__main__":
    main()
