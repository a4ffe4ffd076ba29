"""Visibility that is carried along: its noise, and the signs and sizes of its biases (Tokuyoshi 2024).

A floor under a reddish and a bluish lamp, an opaque card between: shadows of both colours.
"""

import math

import numpy as np
import pytest
from light_scenes import matrix
from moving_scenes import frames_of
from pictures import QUAD, Builder, diffuse, look, render, scaled

from restir_engine.integrators.restir.passes import ReusePlan
from restir_engine.scene.lamps import area_lamp

SIZE, SAMPLES, SEEDS = 24, 8, 48


# What is compared, by name: one reservoir a channel or not, and options; each as in the paper, without the vector sum.
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
    plan = ReusePlan(temporal=True, rounds=1, by_channel=by_channel, options={**options, "vector": False})
    both = [frames_of([scene], seed, plan, SAMPLES) for seed in range(seeds)]
    return np.stack([a for a, _ in both]), np.stack([last.visibility() for _, last in both])


@pytest.fixture(scope="module")
def truth():
    return converged(card())


@pytest.fixture(scope="module")
def rendered():
    """Pictures and V by name of the reuse."""
    scene = card()
    return {name: pictures(scene, *reuse) for name, reuse in REUSES.items()}


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


def test_averaged_visibility_has_less_variance_at_the_same_rays(rendered):
    known = always_known(rendered["reused"][1])
    plain, estimated = (rendered[name][1][:, known].var(0, ddof=1).mean() for name in ("reused", "estimated"))
    assert known.mean() > 0.5 and estimated < 0.7 * plain


def test_the_averaged_visibility_lessens_noise_of_the_picture(rendered):
    plain, estimated = (rendered[name][0].var(0, ddof=1).mean() for name in ("reused", "estimated"))
    assert estimated < plain


def test_discarding_what_is_in_shadow_darkens(rendered, truth):
    for name in ("discard", "discard, estimated"):
        off, error = bias(rendered[name][0], truth)
        assert off < -5.0 * error and off < -0.01


def test_colours_leak_and_not_by_channel(rendered, truth):
    leak = structure(rendered["estimated"][0], truth)
    assert leak > 3.0 * structure(rendered["reused"][0], truth)
    assert structure(rendered["by channel"][0], truth) < 0.4 * leak


def test_leaking_shifts_the_mean_less_than_discarding(rendered, truth):
    leak, dark = (bias(rendered[name][0], truth)[0] for name in ("estimated", "discard"))
    assert abs(leak) < 0.25 * abs(dark)
