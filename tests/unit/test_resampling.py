"""Resampling between domains with shifts that stretch and fail: weights, means and their planted errors.

Means are accepted within 4 standard errors; planted errors must miss by more than 8.
"""

import math

import numpy as np
import pytest

from restir_engine.integrators.resampling.mis import BALANCE, CONFIDENCE, CONTRIBUTION, DEFENSIVE, MIS_KINDS, PAIRWISE
from restir_engine.integrators.resampling.neighbours import disk_neighbour, similar
from restir_engine.integrators.resampling.reservoir import HEADER, RESERVOIR, SAMPLE_BYTES, reservoir_dtype
from restir_engine.integrators.techniques.direct.sample import DIRECT_RESERVOIR
from restir_engine.kernels.core.jit import kernel
from restir_engine.kernels.core.memory import address, store_i64
from testing.kernels import reuse_toy as toy

UNBIASED = [BALANCE, PAIRWISE, DEFENSIVE, CONTRIBUTION]
PROPER = [BALANCE, PAIRWISE, DEFENSIVE]  # those whose weights make the vector-valued sum unbiased


def z_score(values: np.ndarray, truth: float) -> float:
    return (values.mean() - truth) / (values.std() / math.sqrt(len(values)))


@pytest.fixture(scope="module")
def truth() -> float:
    return toy.integral()


@pytest.fixture(scope="module")
def points():
    """Points (i, j, θ, φ) to shift from pixel i to pixel j."""
    rng = np.random.default_rng(4)
    pairs = rng.integers(0, toy.PIXELS, (300, 2))
    return [
        (int(i), int(j), rng.uniform(0.05, toy.REACH[i]), rng.uniform(-math.pi, math.pi)) for i, j in pairs.tolist()
    ]


@pytest.mark.parametrize("reservoir", [RESERVOIR, DIRECT_RESERVOIR])
def test_a_reservoir_is_a_header_and_a_sample_in_64_bytes(reservoir):
    assert reservoir.itemsize == HEADER.itemsize + SAMPLE_BYTES == 64
    assert all(reservoir.fields[name] == HEADER.fields[name] for name in HEADER.names)
    assert all(reservoir.fields[n][1] >= HEADER.itemsize for n in reservoir.names if n not in HEADER.names)


def test_a_sample_that_is_too_large_is_refused():
    with pytest.raises(ValueError, match="44 bytes"):
        reservoir_dtype(np.dtype([("x", np.float64, (6,))]))


# Shifts ---------------------------------------------------------------------------------------------------------


def test_the_shift_to_the_same_pixel_changes_nothing(points):
    for i, _, theta, phi in points:
        valid, a, b, jacobian = toy.shifted(i, i, theta, phi)
        assert valid
        np.testing.assert_allclose([a, b, jacobian], [theta, phi, 1.0], rtol=1e-9)


def test_round_trips_return_and_failures_agree(points):
    failures = 0
    for i, j, theta, phi in points:
        valid, a, b, jacobian = toy.shifted(i, j, theta, phi)
        if not valid:
            failures += 1
            continue
        back, c, d, inverse = toy.shifted(j, i, a, b)
        assert back
        np.testing.assert_allclose([c, d, jacobian * inverse], [theta, phi, 1.0], rtol=1e-8)
    assert 0 < failures < len(points) // 2


def test_jacobians_are_ratios_of_volumes(points):
    h = 1e-5
    for i, j, theta, phi in points:
        valid, a, _, jacobian = toy.shifted(i, j, theta, phi)
        if not valid or a < 0.02:  # the azimuth turns too fast at the zenith
            continue
        columns = []
        for dt, dp in ((h, 0.0), (0.0, h)):
            _, a1, b1, _ = toy.shifted(i, j, theta + dt, phi + dp)
            _, a0, b0, _ = toy.shifted(i, j, theta - dt, phi - dp)
            columns.append([(a1 - a0) / (2 * h), math.remainder(b1 - b0, 2 * math.pi) / (2 * h)])
        assert abs(np.linalg.det(np.array(columns))) == pytest.approx(jacobian, rel=2e-4)


# Weights --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", MIS_KINDS)
def test_mis_weights_sum_to_one(kind):
    rng = np.random.default_rng(2)
    covered = 0
    for theta, phi in zip(rng.uniform(0, toy.REACH[0], 500), rng.uniform(0, 2 * math.pi, 500), strict=True):
        total, target = toy.sum_of_weights(MIS_KINDS[kind], theta, phi)
        if target > 0.0:
            covered += 1
            assert total == pytest.approx(1.0, abs=1e-12)
    assert covered > 300


@pytest.mark.parametrize("n", [1, 2, 4])
@pytest.mark.parametrize("kind", UNBIASED)
def test_reuse_finds_the_integral(kind, n, truth):
    rows = toy.run(kind, n)
    assert abs(z_score(rows[:, 0], truth)) < 4.0


@pytest.mark.parametrize("kind", PROPER)
def test_the_vector_valued_sum_finds_it_with_less_noise(kind, truth):
    rows = toy.run(kind)
    assert abs(z_score(rows[:, 1], truth)) < 4.0
    assert rows[:, 1].std() < rows[:, 0].std()


@pytest.mark.parametrize("kind", UNBIASED)
def test_null_samples_count(kind, truth):
    """Candidates that fail with probability 0.4, their weights scaled by 1/0.6, leave the mean alone."""
    assert abs(z_score(toy.run(kind, fail=0.4)[:, 0], truth)) < 4.0


@pytest.mark.parametrize("kind", UNBIASED)
def test_contribution_weights_measure_sets(kind):
    """E[W · 1{y ∈ A}] is the measure of A where the target is positive."""

    def inside(theta, phi):
        return (theta > 0.3) & (theta < 0.9) & (phi % (2 * np.pi) < 2.5)

    rows = toy.run(kind)
    assert abs(z_score(rows[:, 2] * inside(rows[:, 3], rows[:, 4]), toy.integral(where=inside))) < 4.0


@pytest.mark.parametrize("n", [1, 2, 4])
@pytest.mark.parametrize("kind", PROPER)
def test_a_perfect_target_leaves_nothing_to_the_choice(kind, n, truth):
    """With p̂ = f, f·W is the sum of the weights, whichever candidate was selected."""
    rows = toy.run(kind, n, exact=1)
    np.testing.assert_allclose(rows[:, 0], rows[:, 1], rtol=1e-12)
    assert abs(z_score(rows[:, 0], truth)) < 4.0


def test_weights_by_confidence_darken(truth):
    """1/M: candidates whose domain misses a part of the pixel's are taken to cover it."""
    assert z_score(toy.run(CONFIDENCE)[:, 0], truth) < -8.0


@pytest.mark.parametrize("planted", [toy.NO_JACOBIAN, toy.NULL_UNCOUNTED, toy.WEIGHT_UNSCALED])
def test_planted_errors_are_found(planted, truth):
    assert abs(z_score(toy.run(BALANCE, planted=planted)[:, 0], truth)) > 8.0


# Neighbours -----------------------------------------------------------------------------------------------------


@kernel
def disk_kernel(key, n, radius, out):
    for i in range(n):
        a, b = disk_neighbour(key, i, 100, 200, radius)
        store_i64(out, 2 * i, a)
        store_i64(out, 2 * i + 1, b)


@kernel
def similar_kernel(distance, turn, other_material, min_cosine, max_depth):
    n = (0.0, -math.sin(turn), math.cos(turn))
    up = (0.0, 0.0, 1.0)
    p = (0.0, 0.0, 0.0)
    return similar(p, up, 3, 2.0, (0.3, 0.0, distance), n, other_material, 2.0 + distance, min_cosine, max_depth)


def test_neighbours_fill_a_disk_evenly():
    out = np.zeros((1 << 14, 2), np.int64)
    disk_kernel(77, len(out), 12.0, address(out))
    offset = out - [100, 200]
    r = np.hypot(*offset.T)
    assert r.max() < 12.0 + math.sqrt(0.5)
    for share in (0.25, 0.5, 0.75):
        # rounding to pixels moves a rim of half a pixel
        assert (r < 12.0 * math.sqrt(share)).mean() == pytest.approx(share, abs=0.02)
    assert abs(offset.mean(axis=0)).max() < 0.1


def test_surfaces_that_differ_are_rejected():
    assert similar_kernel(0.05, 0.0, 3, 0.5, 0.1)
    assert not similar_kernel(0.5, 0.0, 3, 0.5, 0.1)
    assert not similar_kernel(0.05, 1.2, 3, 0.5, 0.1)
    assert not similar_kernel(0.05, 0.0, 4, 0.5, 0.1)
