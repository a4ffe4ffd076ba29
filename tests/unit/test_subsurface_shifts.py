"""Shifts of subsurface paths: the identity, there and back, Jacobians against finite differences, inverted numbers.

Samples are those of a frame of three translucent bodies, each shifted to pixels within a radius.
"""

import numpy as np
import pytest
from scipy.stats import kstest

from restir_engine.integrators.techniques.subsurface.sample import UNKNOWN_HIT
from testing.kernels.subsurface_shifts import Shifts, samples
from testing.scenes.translucent import translucent

SIZE = 40
# Round of a shift by name: the delayed round of SEQUENTIAL is that of DELAYED with numbers that were redrawn.
ROUNDS = {"RECONNECTION": 0, "DELAYED": 0, "HYBRID": 0, "SEQUENTIAL": 1}


@pytest.fixture(scope="module")
def shifts():
    """Shifts of a round by name, on one scene."""
    scene, kept = translucent(size=SIZE), {}

    def of(name, method="DIFFUSION"):
        if (name, method) not in kept:
            kept[name, method] = Shifts(scene, name, method, ROUNDS[name])
        return kept[name, method]

    return of


def base(one, name):
    """(pixels, reservoirs) of the samples that are shifted."""
    pixels = one.lit
    reservoirs = one.redrawn(pixels) if name == "SEQUENTIAL" else one.reservoirs[pixels]
    known = reservoirs["flags"] >> 7 != UNKNOWN_HIT
    assert known.mean() > 0.999
    return pixels[known], reservoirs[known]


def pairs(one, name, near=6, seed=2):
    """(starts, tos, reservoirs): pixels with samples, each with some others near them that have a domain."""
    random = np.random.default_rng(seed)
    starts, reservoirs = base(one, name)
    starts, reservoirs = np.repeat(starts, 8), np.repeat(reservoirs, 8)
    x, y = random.integers(-near, near + 1, (2, len(starts)))
    tos = np.clip(starts // SIZE + y, 0, SIZE - 1) * SIZE + np.clip(starts % SIZE + x, 0, SIZE - 1)
    there = np.isin(tos, one.domains)
    return starts[there], tos[there], reservoirs[there]


def sample_error(one, pixels, a, b):
    """How far two samples' exits lie apart, in scales of the profile."""
    scale = one.frame.domains["bssrdf"]["d"].reshape(-1, 3).max(1)[pixels]
    return np.linalg.norm(one.places(pixels, a)[0] - one.places(pixels, b)[0], axis=1) / scale


@pytest.mark.parametrize("method", ["DIFFUSION", "HYBRID"])
@pytest.mark.parametrize("name", ROUNDS)
def test_to_its_own_pixel_a_sample_stays_what_it_is(shifts, name, method):
    one = shifts(name, method)
    pixels, reservoirs = base(one, name)
    found = one.shift(pixels, pixels, reservoirs)
    assert (found["jacobian"] > 0.0).all()
    np.testing.assert_allclose(found["jacobian"], 1.0, atol=2e-3)
    assert np.median(np.abs(found["jacobian"] - 1.0)) < 1e-5
    np.testing.assert_allclose(found["target"], reservoirs["target"], rtol=2e-2)
    assert np.median(np.abs(found["target"] / reservoirs["target"] - 1.0)) < 1e-5
    assert sample_error(one, pixels, samples(found), reservoirs).max() < 1e-3


@pytest.mark.parametrize("method", ["DIFFUSION", "HYBRID"])
@pytest.mark.parametrize("name", ROUNDS)
def test_there_and_back_is_the_identity(shifts, name, method):
    """What can be shifted one way can be shifted back, to the same sample, and the Jacobians cancel."""
    one = shifts(name, method)
    starts, tos, reservoirs = pairs(one, name)
    there = one.shift(starts, tos, reservoirs)
    ok = there["target"] > 0.0
    assert ok.sum() > 300
    back = one.shift(tos[ok], starts[ok], samples(there)[ok])
    failed = ~(back["target"] > 0.0)
    assert failed.sum() == 0
    assert sample_error(one, starts[ok], samples(back), reservoirs[ok]).max() < 5e-3
    np.testing.assert_allclose(back["jacobian"] * there["jacobian"][ok], 1.0, atol=2e-2)
    np.testing.assert_allclose(back["target"], reservoirs["target"][ok], rtol=5e-2)
    if name in ("DELAYED", "HYBRID", "SEQUENTIAL"):
        assert np.abs(np.log(there["jacobian"][ok])).max() > 0.2  # there is something to be right about


def finite_differences(one, starts, tos, reservoirs, step=2e-3):
    """|dy₂ / dx₂| of shifts that find y₂, by moving x₂ in its triangle; nan where it leaves y₂'s triangle."""
    moved = [one.shift(starts, tos, reservoirs)]
    at = [one.places(starts, reservoirs)[0]]
    for field in ("u", "v"):
        other = reservoirs.copy()
        other[field] += step
        moved.append(one.shift(starts, tos, other))
        at.append(one.places(starts, other)[0])
    ok = np.all([m["jacobian"] > 0.0 for m in moved], 0)
    same = [(samples(m)["primitive"] == samples(moved[0])["primitive"]) for m in moved]
    to = [one.places(tos, samples(m))[0] for m in moved]

    def area(p):
        return np.linalg.norm(np.cross(p[1] - p[0], p[2] - p[0]), axis=1)

    return np.where(ok & np.all(same, 0), area(to) / area(at), np.nan), moved[0]


@pytest.mark.parametrize("name", ["DELAYED", "SEQUENTIAL"])
def test_jacobian_is_that_of_finite_differences(shifts, name):
    """|T'| of x₂ is what a small patch about x₂ is stretched by, times the ratio of the posteriors of its choice."""
    one = shifts(name)
    starts, tos, reservoirs = pairs(one, name)
    stretched, found = finite_differences(one, starts, tos, reservoirs)
    ok = np.isfinite(stretched) & (found["target"] > 0.0)
    assert ok.sum() > 300
    choice = (reservoirs["flags"] >> 2 & 7) * 3 + (reservoirs["flags"] >> 5 & 3)
    posteriors = []
    for pixels, sample in ((starts, reservoirs), (tos, samples(found))):
        _, density, by_choice = one.places(pixels[ok], sample[ok])
        np.testing.assert_allclose(by_choice.sum(1), density, rtol=1e-6)
        posteriors.append(by_choice[np.arange(ok.sum()), choice[ok]] / density)
    expected = stretched[ok] * posteriors[1] / posteriors[0]
    error = np.abs(found["jacobian"][ok] / expected - 1.0)
    assert np.median(error) < 5e-3 and np.quantile(error, 0.9) < 0.05
    assert np.quantile(np.abs(expected - 1.0), 0.75) > 0.1


def test_redrawn_numbers_have_the_posterior_and_are_uniform(shifts):
    """Line and channel are distributed as those of probes that find x₂ are."""
    one = shifts("SEQUENTIAL")
    pixels, redrawn = base(one, "SEQUENTIAL")
    _, density, by_choice = one.places(pixels, redrawn)
    posterior = by_choice / density[:, None]
    choice = (redrawn["flags"] >> 2 & 7) * 3 + (redrawn["flags"] >> 5 & 3)
    surprise = (choice[:, None] == np.arange(posterior.shape[1])) - posterior
    for likely in (posterior >= 0.0, posterior < 0.5, posterior >= 0.5):
        error = np.sqrt(((surprise * likely) ** 2).sum(0))
        assert (np.abs((surprise * likely).sum(0)) <= 4.5 * error + 1e-9).all()
    cumulative = np.cumsum(posterior, 1)
    row = np.arange(len(choice))
    low, high = cumulative[row, choice] - posterior[row, choice], cumulative[row, choice]
    u = low + np.random.default_rng(3).random(len(row)) * (high - low)
    assert kstest(u, "uniform").pvalue > 0.001
