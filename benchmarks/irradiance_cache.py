"""What the irradiance cache brings HYBRID, as a Markdown table: `python -m benchmarks.irradiance_cache`.

By body, light and mean free path / size, against HYBRID without it: processor time of a sample, variance, their
product, the mean of the picture, and the root of the mean squared bias of pixels and of blocks of 8 × 8, relative as in
relMSE. Two pictures of each, so that no noise is taken for bias; what is left of it makes a bias squared negative now
and then, which is printed as 0. "lamps" are 48 small ones of all colours, close behind and beside the body.
"""

from __future__ import annotations

import argparse
import itertools

import numpy as np

from .hybrid_cost import WIDTH, Renderer, noise_and_bias
from .hybrid_sweep import LIGHTS, area_lamp, matrix, scene_of

COLUMNS = ("time", "variance", "noise × time", "mean", "bias of pixels", "of blocks")
LAMPS, BLOCK = 48, 8


def lamps() -> np.ndarray:
    """LIGHT records of lamps that shine at the middle of the body."""
    rng, found = np.random.default_rng(5), []
    for _ in range(LAMPS):
        around, height, away = rng.uniform(0.15, 0.85) * np.pi, rng.uniform(-0.8, 0.8), rng.uniform(0.8, 1.6)
        place = np.array([away * np.cos(around), away * np.sin(around), height])
        found.append(area_lamp(matrix(place, place / np.linalg.norm(place)), tuple(rng.uniform(0.2, 4.0, 3)), 0.1, 0.1))
    return np.concatenate(found)


def blocks(picture: np.ndarray) -> np.ndarray:
    """Means of the blocks that fit."""
    height, width = (n // BLOCK for n in picture.shape[:2])
    cut = picture[: height * BLOCK, : width * BLOCK]
    return cut.reshape(height, BLOCK, width, BLOCK, 3).mean((1, 3))


def percent(squared: float) -> str:
    """A bias squared as a bias."""
    return f"{100 * max(squared, 0.0) ** 0.5:.1f} %"


def measure(case: tuple, samples: int, size: tuple[int, int]) -> list[str]:
    """The figures of a body, mean free path / size and light."""
    body, length, light = case
    scene = scene_of(body, length, light if light in LIGHTS else "back", "DIFFUSE", size, WIDTH)
    if light not in LIGHTS:
        scene.lights.lamps = lamps()
    with_it, without = (
        [Renderer(scene, "HYBRID", seed, sss_irradiance_cache=on) for seed in seeds]
        for on, seeds in ((True, (1, 2)), (False, (3, 4)))
    )
    seconds = np.array([[r.sample(samples) for r in pair] for pair in zip(with_it, without, strict=True)]).sum(axis=0)
    pictures = [[r.picture() for r in pair] for pair in (with_it, without)]
    variance, bias = noise_and_bias(*pictures)
    _, of_blocks = noise_and_bias(*([blocks(x) for x in pair] for pair in pictures))
    time, noise = seconds[0] / seconds[1], variance / noise_and_bias(*reversed(pictures))[0]
    mean = np.mean(pictures[0]) / np.mean(pictures[1]) - 1.0
    return [f"{time:.2f}", f"{noise:.2f}", f"{time * noise:.2f}", f"{100 * mean:+.2f} %", percent(bias),
            percent(of_blocks)]  # fmt: skip


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--bodies", nargs="+", default=["head", "slab"])
    parser.add_argument("--lengths", nargs="+", type=float, default=[0.05, 0.2, 1.0])
    parser.add_argument("--lights", nargs="+", choices=[*LIGHTS, "lamps"], default=["back", "spot", "lamps"])
    parser.add_argument("--samples", type=int, default=64)
    parser.add_argument("--size", nargs=2, type=int, default=[160, 90], help="pixels")
    asked = parser.parse_args()
    print("| body | light | mfp / size | " + " | ".join(COLUMNS) + " |\n|" + "---|" * (3 + len(COLUMNS)))
    for body, light, length in itertools.product(asked.bodies, asked.lights, asked.lengths):
        cells = measure((body, length, light), asked.samples, tuple(asked.size))
        print("| " + " | ".join([body, light, f"{length:g}", *cells]) + " |", flush=True)


if __name__ == "__main__":
    main()
