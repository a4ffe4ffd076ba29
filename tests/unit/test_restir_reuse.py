"""Reuse leaves the mean alone: in space, in time, both, and from frame to frame while objects, lamps and camera move.

Means over independent renders are accepted within 3.5 standard errors; planted errors miss by more than 6.
"""

import math

import numpy as np
import pytest
from light_scenes import matrix
from pictures import QUAD, Builder, checkered, coated, diffuse, look, render, scaled

from restir_engine.film import Film
from restir_engine.integrators.restir.integrator import RestirIntegrator
from restir_engine.integrators.restir.passes import Passes, ReusePlan
from restir_engine.scene.lamps import area_lamp
from restir_engine.settings import RenderSettings, required_passes

SIZE = 24
TILE = (0, 0, SIZE, SIZE)


def frames_of(scenes, seed: int, plan: ReusePlan, samples: int = 1, seen: bool = False):
    """The mean of the samples of the last scene, (size, size, 3); each scene inherits from the one before.

    With `seen` (that mean, V of the last sample's reservoirs).
    """
    passes = Passes(plan)
    for number, scene in enumerate(scenes):
        settings = RenderSettings(seed=seed * 16 + number, max_bounces=0)
        film = Film(SIZE, SIZE, required_passes(settings.passes, False), 1.0)
        integrator = RestirIntegrator(scene, settings, film, plan, passes)
        scratch = integrator.scratch()
        for sample in range(samples):
            for stage in integrator.stages(sample, 1):
                for item in stage.items or [TILE]:
                    stage.run(item, scratch)
                stage.finish()
        integrator.close()
    film.samples = samples
    picture = film.pass_array("Combined")[:, :, :3]
    return (picture, integrator.visibility()) if seen else picture


def moving(step: int):
    """A frame of an animation: a lamp, a luminous quad, a shadow-casting box and the camera move."""
    b = Builder()
    b.add(QUAD, coated((0.6, 0.55, 0.5), 0.4), scaled(matrix(), 3.0, 3.0, 1.0))
    x = 0.35 * step
    b.add(QUAD, diffuse((0.6, 0.2, 0.2)), scaled(matrix((-0.6 + x, 0.0, 0.6), (0.0, 0.2, 1.0)), 0.5, 0.3, 1.0))
    glow = checkered((9.0, 5.0, 2.0), (1.0, 3.0, 9.0), 3.0)
    b.add(QUAD, glow, scaled(matrix((1.0 - x, 0.5, 0.8), (-1.0, -0.2, -0.4)), 0.4 + 0.1 * step, 0.3, 1.0))
    b.lamp(area_lamp(matrix((-0.4 + x, -0.4, 1.8), (0.0, 0.0, 1.0)), 25.0 * np.ones(3), 0.7 + 0.2 * step, 0.5, key=1))
    scene = b.finish(look((0.4 + 0.1 * step, -2.6, 1.9), (0.0, 0.1, 0.2), SIZE))
    scene.instances["key"] = np.arange(len(scene.instances)) + 1
    return scene


def off(pictures: np.ndarray, truths: np.ndarray) -> np.ndarray:
    """z-scores of the mean of all pixels by channel, and of the halves of the picture."""

    def parts(x):
        return np.concatenate([x.mean((1, 2)), x[:, : SIZE // 2].mean((1, 2)), x[:, :, : SIZE // 2].mean((1, 2))], 1)

    a, b = parts(pictures), parts(truths)
    error = np.hypot(a.std(0, ddof=1) / math.sqrt(len(a)), b.std(0, ddof=1) / math.sqrt(len(b)))
    return (a.mean(0) - b.mean(0)) / error


@pytest.fixture(scope="module")
def animation():
    """Three frames, and the last one by PATH."""
    scenes = [moving(step) for step in range(3)]
    truth = np.stack([render(scenes[-1], 256, seed=seed, integrator="PATH", max_bounces=0) for seed in range(6)])
    return scenes, truth


def over_seeds(scenes, plan: ReusePlan, seeds: int = 160) -> np.ndarray:
    return np.stack([frames_of(scenes, seed, plan) for seed in range(seeds)])


@pytest.mark.parametrize("mis", ["BALANCE", "DEFENSIVE"])
@pytest.mark.parametrize("target", ["TARGET", "SHADED"])
def test_history_of_a_moving_scene_keeps_the_mean(animation, mis, target):
    scenes, truth = animation
    plan = ReusePlan(temporal=True, options={"mis": mis, "visibility": target})
    assert np.abs(off(over_seeds(scenes, plan), truth)).max() < 3.5


def test_spatial_reuse_of_history_keeps_the_mean(animation):
    scenes, truth = animation
    plan = ReusePlan(temporal=True, rounds=1)
    assert np.abs(off(over_seeds(scenes, plan), truth)).max() < 3.5


def test_history_is_used_and_lessens_noise(animation):
    scenes, truth = animation
    alone = over_seeds(scenes[-1:], ReusePlan(), 24)
    history = over_seeds(scenes, ReusePlan(temporal=True), 24)
    noise = [((pictures - truth.mean(0)) ** 2).mean() for pictures in (alone, history)]
    assert noise[1] < 0.8 * noise[0]


def test_weights_by_confidence_are_found_to_be_biased(animation):
    scenes, truth = animation
    plan = ReusePlan(temporal=True, options={"mis": "CONFIDENCE"})
    assert np.abs(off(over_seeds(scenes, plan), truth)).max() > 6.0


@pytest.mark.parametrize("mis", ["BALANCE", "PAIRWISE", "DEFENSIVE", "CONTRIBUTION"])
@pytest.mark.parametrize("target", ["TARGET", "SHADED"])
def test_spatial_reuse_keeps_the_mean(animation, mis, target):
    scenes, truth = animation
    plan = ReusePlan(rounds=2, options={"mis": mis, "visibility": target})
    assert np.abs(off(over_seeds(scenes[-1:], plan, 100), truth)).max() < 3.5
