"""Reuse leaves the mean alone: in space, in time, both, and from frame to frame while objects, lamps and camera move.

Means over independent renders; planted errors miss by far more.
"""

import numpy as np
import pytest

from restir_engine.reuse_settings import ReuseSettings
from testing.scenes.moving import LUMINANCE, MOVES, animation, bias, frames_of, histories, off, reuse_of
from testing.scenes.rooms import render

SIZE, SEEDS = 64, 32
MOST = 0.005  # of the bias, which must also lie within three standard errors


@pytest.fixture(scope="module")
def truth():
    """The last frame of all animations by PATH, (renders, height, width, 3)."""
    scene = animation("all", SIZE)[-1]
    return np.stack([render(scene, 256, seed=900 + seed, integrator="PATH", max_bounces=0) for seed in range(4)])


def biases(moves: str, plan: ReuseSettings, truth, first_seed: int, seeds: int = SEEDS) -> np.ndarray:
    """(relative bias, its standard error) of the picture, its left and its lower half."""
    found = (*histories(animation(moves, SIZE), plan, range(first_seed, first_seed + seeds)), truth @ LUMINANCE)
    half = SIZE // 2
    return np.array([bias(*(x[:, :h, :w] for x in found)) for h, w in ((SIZE, SIZE), (SIZE, half), (half, SIZE))])


def assert_unbiased(moves: str, plan: ReuseSettings, truth, first_seed: int) -> None:
    found, error = biases(moves, plan, truth, first_seed).T
    assert error[0] < 0.5 * MOST
    assert abs(found[0]) < MOST
    assert (np.abs(found) < 3.0 * error).all()


@pytest.mark.deep  # where all moves at once is below
@pytest.mark.parametrize("moves", MOVES)
def test_history_keeps_the_mean_whatever_moves(truth, moves):
    """Four frames; the standard error is about 0.1 %."""
    assert_unbiased(moves, reuse_of(temporal=True), truth, 100 + 50 * MOVES.index(moves))


@pytest.mark.parametrize("mis", ["BALANCE", "DEFENSIVE"])
@pytest.mark.parametrize("target", ["TARGET", "SHADED"])
def test_history_keeps_the_mean_where_all_moves(truth, mis, target):
    plan = reuse_of(temporal=True, mis=mis, visibility=target)
    assert_unbiased("all", plan, truth, 1000 + 100 * (mis == "BALANCE") + 200 * (target == "SHADED"))


@pytest.mark.parametrize(("pattern", "radius"), [("DISK", 16.0), ("PAIRS", 8.0)])
def test_spatial_reuse_of_history_keeps_the_mean(truth, pattern, radius):
    reuse = reuse_of(temporal=True, rounds=1, pattern=pattern, radius=radius)
    found, error = biases("all", reuse, truth, 2000, 48).T
    assert error[0] < 0.004 and (np.abs(found) < 3.0 * error).all()


@pytest.mark.parametrize("options", [{"mis": "CONFIDENCE"}, {"history_target": "NOW"}])
def test_what_asks_the_wrong_frame_or_none_is_found_to_be_biased(truth, options):
    found, error = biases("all", reuse_of(temporal=True, **options), truth, 3000).T
    assert abs(found[0]) > 6.0 * error[0] and abs(found[0]) > MOST


def test_history_is_used_and_lessens_noise(truth):
    found = histories(animation("camera", SIZE), reuse_of(temporal=True), range(8))
    history, candidates = (((x - truth.mean(0) @ LUMINANCE) ** 2).mean() for x in found)
    assert history < 0.8 * candidates


@pytest.mark.parametrize("mis", ["BALANCE", "PAIRWISE", "DEFENSIVE", "CONTRIBUTION"])
@pytest.mark.parametrize("target", ["TARGET", "SHADED"])
def test_spatial_reuse_keeps_the_mean(truth, mis, target):
    """Two rounds in a frame without history, accepted within 3.5 standard errors of all parts and channels."""
    scene = animation("all", SIZE)[-1]
    plan = reuse_of(rounds=2, mis=mis, visibility=target)
    assert np.abs(off(np.stack([frames_of([scene], seed, plan)[0] for seed in range(16)]), truth)).max() < 3.5
