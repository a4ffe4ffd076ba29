"""The sequential shift of a BSDF with two lobes: probabilistic inversion is no matter of probes alone.

Means of 32 frames, accepted within 4.5 standard errors; planted errors must miss by more than 8.
"""

import numpy as np
import pytest

from restir_engine.reuse_settings import ReuseSettings
from testing.kernels import two_lobes
from testing.kernels.toy_technique import domains
from testing.kernels.two_lobes import PLACES, TwoLobes, posterior

SEEDS = 32
SETTINGS = {"pattern": "DISK", "neighbours": 3, "radius": 2.0}


def off(planted: int = two_lobes.RIGHT, **options) -> float:
    """The largest deviation of a place's mean, in standard errors."""
    return float(np.abs(TwoLobes(ReuseSettings(**SETTINGS | options), planted).z_scores(SEEDS)).max())


@pytest.mark.parametrize("mis", ["BALANCE", "DEFENSIVE"])
def test_reconnection_and_replay_behind_it_find_the_integrals(mis):
    assert off(rounds=2, mis=mis) < 4.5


@pytest.mark.parametrize("planted", [two_lobes.LOBE_BY_CHANCE, two_lobes.NO_LOBE_RATIO])
def test_planted_errors_are_found(planted):
    assert off(planted, rounds=2) > 8.0


def test_the_lobe_has_its_posterior():
    """After reconnection, whatever lobe had found the point: in all, and where it is likely and unlikely."""
    frame = TwoLobes(ReuseSettings(**SETTINGS, rounds=1)).frame(1)
    reservoirs, which = frame.reservoirs[0], domains()
    surprise, likely = [], []
    for i, place in enumerate(PLACES):
        found = reservoirs[(which == i) & (reservoirs["contribution_weight"] > 0.0)]
        chance = posterior(place, np.column_stack([found["x"], found["y"]]))
        surprise.append((found["flags"] == 0) - chance)
        likely.append(chance)
    surprise, likely = np.concatenate(surprise), np.concatenate(likely)
    assert ((likely > 0.2) & (likely < 0.8)).mean() > 0.2
    for part in (likely >= 0.0, likely < 0.5, likely >= 0.5):
        assert abs(surprise[part].sum()) < 4.5 * np.sqrt((likely[part] * (1.0 - likely[part])).sum())
