"""What reused visibility is tested on: a floor under a reddish and a bluish lamp, an opaque card between, and the
measures of what reuse makes of it.
"""

import math

import numpy as np

from restir_engine.scene.lamps import area_lamp

from .lights import matrix
from .moving import frames_of, reuse_of
from .rooms import Builder, diffuse, look, render, scaled
from .shapes import QUAD

SIZE, SAMPLES, SEEDS = 24, 8, 48


# What is compared, by name: one reservoir a channel or not, and options.
REUSES = {
    "reused": (False, {"visibility": "REUSED"}),
    "estimated": (False, {"visibility": "ESTIMATED"}),
    "by channel": (True, {"visibility": "ESTIMATED"}),
    "discard": (False, {"visibility": "REUSED", "discard": True}),
    "discard, estimated": (False, {"visibility": "ESTIMATED", "discard": True}),
}


def card():
    """The scene."""
    b = Builder()
    b.add(QUAD, diffuse((0.7, 0.7, 0.7)), scaled(matrix(), 3.0, 3.0, 1.0))
    b.add(QUAD, diffuse((0.5, 0.5, 0.5)), scaled(matrix((0.0, 0.2, 0.5)), 0.35, 0.35, 1.0))
    b.lamp(area_lamp(matrix((-0.8, 0.0, 1.5), (-0.5, 0.0, 1.0)), (12.0, 8.0, 4.0), 0.5, 0.5))
    b.lamp(area_lamp(matrix((0.8, 0.0, 1.5), (0.5, 0.0, 1.0)), (4.0, 8.0, 12.0), 0.5, 0.5))
    return b.finish(look((0.0, -2.0, 2.2), (0.0, 0.2, 0.1), SIZE))


def converged(scene) -> np.ndarray:
    return render(scene, 2048, integrator="PATH", max_bounces=0)


def pictures(scene, by_channel: bool, options: dict, seeds: int = SEEDS) -> tuple[np.ndarray, np.ndarray]:
    """Pictures, the means of SAMPLES, and V of the last sample; (seeds, size, size, 3) each."""
    reuse = reuse_of(temporal=True, rounds=1, by_channel=by_channel, **options)
    both = [frames_of([scene], seed, reuse, SAMPLES) for seed in range(seeds)]
    return np.stack([a for a, _ in both]), np.stack([last.visibility() for _, last in both])


def bias(images: np.ndarray, truth: np.ndarray) -> tuple[float, float]:
    """Relative bias of the mean and its standard error."""
    means = images.mean((1, 2, 3))
    return means.mean() / truth.mean() - 1.0, means.std(ddof=1) / math.sqrt(len(means)) / truth.mean()


def structure(images: np.ndarray, truth: np.ndarray) -> float:
    """RMS of the pixels' biases by the mean light, noise taken off."""
    squared = ((images.mean(0) - truth) ** 2 - images.var(0, ddof=1) / len(images)).mean()
    return math.copysign(math.sqrt(abs(squared)), squared) / truth.mean()


def always_known(v: np.ndarray) -> np.ndarray:
    """Where no render has a null sample, bool (size, size)."""
    return np.isfinite(v).all((0, 3))
