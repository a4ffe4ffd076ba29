"""A technique with a real Jacobian and shifts that fail runs through the kernels that reuse light, and errors are seen.

Means of 32 independent frames, accepted within 4.5 standard errors (of some fifty); planted errors must miss by more
than 8.
"""

import numpy as np
import pytest

from restir_engine.reuse_settings import ReuseSettings
from testing.kernels import reuse_toy as toy
from testing.kernels.toy_technique import Toy

SEEDS = 32
UNBIASED = ("BALANCE", "PAIRWISE", "DEFENSIVE", "CONTRIBUTION")
NEAR = {"radius": 2.0}  # where all other places of the toy are


def off(planted: int = toy.NO_ERROR, fail: float = 0.0, **options) -> float:
    """The largest deviation of a place's mean, in standard errors."""
    return float(np.abs(Toy(ReuseSettings(**NEAR | options), planted, fail).z_scores(SEEDS)).max())


def test_candidates_alone_find_the_integrals():
    frames = [Toy(ReuseSettings()).candidates(0, seed) for seed in range(SEEDS)]
    which = frames[0].points["closures"]
    for i, row in enumerate(np.unique(which)):
        light = [(f.light[..., 0] * f.reservoirs[0]["contribution_weight"])[which == row].mean() for f in frames]
        assert np.mean(light) == pytest.approx(toy.integral(i), abs=4.5 * np.std(light, ddof=1) / np.sqrt(SEEDS))


@pytest.mark.parametrize("pattern", ["DISK", "PAIRS"])
@pytest.mark.parametrize("mis", UNBIASED)
def test_spatial_reuse_finds_the_integrals(mis, pattern):
    assert off(rounds=2, mis=mis, pattern=pattern) < 4.5


@pytest.mark.parametrize("mis", UNBIASED)
def test_temporal_reuse_between_domains_that_differ_finds_the_integrals(mis):
    assert off(temporal=True, mis=mis) < 4.5


@pytest.mark.parametrize("pattern", ["DISK", "PAIRS"])
def test_null_samples_count(pattern):
    assert off(fail=0.4, temporal=True, rounds=1, pattern=pattern) < 4.5


@pytest.mark.parametrize("pattern", ["DISK", "PAIRS"])
@pytest.mark.parametrize("planted", [toy.NO_JACOBIAN, toy.NULL_UNCOUNTED, toy.WEIGHT_UNSCALED])
def test_planted_errors_are_found(planted, pattern):
    assert off(planted, 0.4, rounds=1, pattern=pattern) > 8.0


def test_planted_errors_of_temporal_reuse_are_found():
    assert off(toy.NO_JACOBIAN, temporal=True) > 8.0


def test_weights_by_confidence_are_found_to_be_biased():
    assert off(rounds=1, mis="CONFIDENCE") > 8.0


def test_reuse_lessens_noise():
    made = Toy(ReuseSettings(**NEAR, rounds=1)), Toy(ReuseSettings(**NEAR, rounds=1, pattern="PAIRS"))
    frame = made[0].candidates(0, 1)
    alone = (frame.light[..., 0] * frame.reservoirs[0]["contribution_weight"])[::2, ::2].var()
    for one in made:
        assert one.frame(1).light[::2, ::2, 0].var() < 0.7 * alone
