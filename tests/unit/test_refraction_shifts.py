"""Light that crosses straight: the density of its directions, and its shifts: the identity, there and back, Jacobians
against finite differences, and that none keeps a point which the other pixel does not see.

Samples are those of a frame of three translucent bodies, each shifted to pixels within a radius.
"""

import numpy as np
import pytest

from restir_engine.kernels.lobes.closure import ENTRY_DIFFUSE, ENTRY_REFRACTIVE, ENTRY_SKIN
from testing.kernels.refraction_shifts import Crossings, Entry
from testing.kernels.subsurface_shifts import samples
from testing.scenes.translucent import translucent

SIZE = 40
SHIFTS = ("SPATIAL", "TEMPORAL")
ENTRIES = {
    "diffuse": Entry(ENTRY_DIFFUSE, (0.3, 0.2, 0.8), 1.0, 1.4),
    "tilted": Entry(ENTRY_DIFFUSE, (0.3, 0.2, 0.8), 1.0, 1.4, tilt=(0.5, 0.0, 1.0)),
    "rough": Entry(ENTRY_REFRACTIVE, (0.6, 0.1, 0.5), 0.6, 1.4),
    "smooth": Entry(ENTRY_REFRACTIVE, (-0.2, 0.4, 0.7), 0.2, 1.8),
    "grazing": Entry(ENTRY_REFRACTIVE, (0.95, 0.0, 0.1), 0.5, 1.4, tilt=(-0.1, 0.1, 1.0)),
    "skin": Entry(ENTRY_SKIN, (0.6, 0.1, 0.5), 0.3, 1.4),
}


def moments(d):
    """Functions of directions (n, 3) whose means tell densities apart: (n, 9)."""
    x, y, z = d.T
    return np.stack([np.ones(len(d)), x, y, z, x * x, x * z, z * z, np.exp(-4.0 * (1.0 + z)), np.sin(5.0 * x)], 1)


@pytest.mark.parametrize("name", ENTRIES)
def test_directions_of_entry_have_their_density(name):
    """Means over what is drawn, which does not always enter, beside integrals over the hemisphere."""
    entry = ENTRIES[name]
    enters, drawn = entry.directions(np.random.default_rng(3).random((60_000, 2)))
    values = moments(drawn) * enters[:, None]
    mean, error = values.mean(0), values.std(0, ddof=1) / np.sqrt(len(values))
    u, v = (np.indices((600, 1200)).reshape(2, -1) + 0.5) / [[600.0], [1200.0]]
    side, angle = np.sqrt(1.0 - u * u), 2.0 * np.pi * v
    d = np.stack([side * np.cos(angle), side * np.sin(angle), -u], 1)
    expected = (entry.density(d)[:, None] * moments(d)).mean(0) * 2.0 * np.pi
    np.testing.assert_array_less(np.abs(mean - expected), 4.0 * error + 4e-4)
    assert (entry.density(-d) == 0.0).all()


@pytest.fixture(scope="module")
def crossings():
    """Crossings by name, on one scene."""
    scene, kept = translucent(size=SIZE), {}

    def of(name):
        if name not in kept:
            kept[name] = Crossings(scene, name)
        return kept[name]

    return of


def pairs(one, near=4, seed=2):
    """(starts, tos, reservoirs): pixels with samples, each with some others near them that have a domain."""
    random = np.random.default_rng(seed)
    starts = np.repeat(one.lit, 8)
    x, y = random.integers(-near, near + 1, (2, len(starts)))
    tos = np.clip(starts // SIZE + y, 0, SIZE - 1) * SIZE + np.clip(starts % SIZE + x, 0, SIZE - 1)
    there = np.isin(tos, one.domains)
    return starts[there], tos[there], one.reservoirs[starts[there]]


@pytest.mark.parametrize("name", SHIFTS)
def test_to_its_own_pixel_a_sample_stays_what_it_is(name, crossings):
    one = crossings(name)
    found = one.shift(one.lit, one.lit, one.reservoirs[one.lit])
    np.testing.assert_allclose(found["jacobian"], 1.0, atol=1e-6)
    np.testing.assert_allclose(found["target"], one.reservoirs["target"][one.lit], rtol=2e-3)
    before, after = (one.crossings(one.lit, r) for r in (one.reservoirs[one.lit], samples(found)))
    np.testing.assert_allclose(after["direction"], before["direction"], atol=1e-5)
    assert before["off"].max() < 1e-4


@pytest.mark.parametrize("name", SHIFTS)
def test_there_and_back_is_the_identity(name, crossings):
    """What can be shifted one way can be shifted back, to the same sample, and the Jacobians cancel."""
    one = crossings(name)
    starts, tos, reservoirs = pairs(one)
    there = one.shift(starts, tos, reservoirs)
    ok = there["target"] > 0.0
    assert ok.sum() > 300
    back = one.shift(tos[ok], starts[ok], samples(there)[ok])
    assert (back["jacobian"] > 0.0).all()
    np.testing.assert_allclose(back["jacobian"] * there["jacobian"][ok], 1.0, atol=1e-5)
    np.testing.assert_allclose(back["target"], reservoirs["target"][ok], rtol=2e-2)
    before, after = (one.crossings(starts[ok], r) for r in (reservoirs[ok], samples(back)))
    np.testing.assert_allclose(after["direction"], before["direction"], atol=1e-4)
    if name == "SPATIAL":
        assert np.abs(np.log(there["jacobian"][ok])).max() > 0.2  # there is something to be right about


@pytest.mark.parametrize("name", SHIFTS)
def test_shifted_samples_are_what_the_other_pixel_meets_first(name, crossings):
    """And where the shift fails, the point that is kept is hidden, or no light enters towards it."""
    one = crossings(name)
    starts, tos, reservoirs = pairs(one)
    found = one.shift(starts, tos, reservoirs)
    ok = found["jacobian"] > 0.0
    assert (one.crossings(tos[ok], samples(found)[ok])["off"] < 1e-3).all()
    if name == "SPATIAL":
        same = one.frame.points["instance"].reshape(-1)
        same = same[starts] == same[tos]
        kept = one.crossings(tos, reservoirs)
        could = same & (kept["density"] > 0.0) & (kept["off"] < 1e-6)
        assert 0.2 < ok.mean() < 0.999 and (could & ~ok).sum() <= 0.002 * could.sum()


@pytest.mark.parametrize("name", SHIFTS)
def test_jacobian_is_that_of_finite_differences(name, crossings, step=1e-3):
    """|T'| is what a small solid angle about ω is stretched by."""
    one = crossings(name)
    starts, tos, reservoirs = pairs(one)
    moved, ways = [], []
    for field in (None, "u", "v"):
        other = reservoirs.copy()
        if field:
            other[field] += step
        moved.append(one.shift(starts, tos, other))
        ways.append((one.crossings(starts, other)["direction"], one.crossings(tos, samples(moved[-1]))["direction"]))

    def angle(side):
        a, b, c = (way[side] for way in ways)
        return np.linalg.norm(np.cross(b - a, c - a), axis=1)

    ok = np.all([m["target"] > 0.0 for m in moved], 0)
    assert ok.sum() > 300
    error = np.abs(moved[0]["jacobian"][ok] * angle(0)[ok] / angle(1)[ok] - 1.0)
    assert np.median(error) < 5e-3 and np.quantile(error, 0.9) < 0.05
