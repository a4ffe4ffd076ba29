"""Burley's profile and its single-scattering part against quadrature, closed forms and tables."""

import math

import numpy as np
import pytest

from restir_engine.kernels.core.jit import kernel
from restir_engine.kernels.core.memory import address, load_f64, store_f64
from restir_engine.kernels.core.vec import load3_f64, store3_f64
from restir_engine.kernels.subsurface import profile as p
from restir_engine.kernels.subsurface.cycles_burley import cycles_kernel
from restir_engine.kernels.subsurface.van_de_hulst import scattering_albedo

DENSITY, CDF, RADIUS, SHAPE, SINGLE, MULTIPLE, FACTOR = range(7)


@kernel
def table(what, x, n, sigma_t, alpha, albedo, g, out):
    """n values of one function; d = 1 / sigma_t for the unit profile."""
    for i in range(n):
        v = load_f64(x, i)
        if what == DENSITY:
            y = p.profile(v, 1.0 / sigma_t)
        elif what == CDF:
            y = p.profile_cdf(v, 1.0 / sigma_t)
        elif what == RADIUS:
            y = p.profile_radius(v, 1.0 / sigma_t)
        elif what == SHAPE:
            y = p.profile_shape(v)
        elif what == SINGLE:
            y = p.single_profile(v, sigma_t, alpha, g)
        elif what == MULTIPLE:
            y = p.multiple_profile(v, sigma_t, alpha, albedo, g)
        else:
            y = p.single_factor(alpha, v)
        store_f64(out, i, y)


def values(what, x, sigma_t=1.0, alpha=0.0, albedo=0.0, g=0.0) -> np.ndarray:
    x = np.ascontiguousarray(np.atleast_1d(x), float)
    out = np.zeros(len(x))
    table(what, address(x), len(x), sigma_t, alpha, albedo, g, address(out))
    return out


def plane_integral(what, upper=200.0, **medium) -> float:
    """∫ f(r) 2πr dr by Gauss and Legendre in log r."""
    x, w = np.polynomial.legendre.leggauss(400)
    low, high = math.log(1e-9), math.log(upper)
    r = np.exp(0.5 * (high - low) * (x + 1.0) + low)
    return float(0.5 * (high - low) * (w * r) @ (values(what, r, **medium) * 2.0 * np.pi * r))


def slide_albedo(alpha):
    root = np.sqrt(1.0 - alpha)
    return (1.0 - root) / (1.0 + 1.554 * root)


@pytest.mark.parametrize("d", [0.2, 1.0, 5.0])
def test_the_unit_profile_integrates_to_its_cumulative_distribution(d):
    assert plane_integral(DENSITY, 200.0 * d, sigma_t=1.0 / d) == pytest.approx(1.0, abs=1e-6)
    assert plane_integral(DENSITY, d, sigma_t=1.0 / d) == pytest.approx(values(CDF, d, 1.0 / d)[0], abs=1e-6)


def test_radii_are_the_inverse_of_the_distribution():
    u = np.linspace(0.0, 0.99999, 1000)
    np.testing.assert_allclose(values(CDF, values(RADIUS, u, 0.5), 0.5), u, atol=2e-14)
    assert values(RADIUS, 0.999)[0] == pytest.approx(19.86, abs=0.01)
    assert values(CDF, 16.0)[0] == pytest.approx(0.9963790093708328, abs=1e-12)
    assert pytest.approx(values(CDF, p.REACH)[0], abs=1e-15) == p.F_REACH
    mean = values(RADIUS, (np.arange(200_000) + 0.5) / 200_000).mean()
    assert mean == pytest.approx(2.5, abs=1e-3)


def test_shape_of_an_albedo_of_zero():
    assert values(SHAPE, 0.0)[0] == pytest.approx(4.14) == p.SINGLE_SHAPE


@pytest.mark.parametrize("g", [-0.9, -0.5, 0.0, 0.3, 0.8])
@pytest.mark.parametrize("alpha", [0.1, 0.7, 0.99])
def test_single_scattering_integrates_to_its_albedo(alpha, g):
    factor = values(FACTOR, g, alpha=alpha)[0]
    medium = {"sigma_t": 2.0, "alpha": alpha, "g": g}
    assert plane_integral(SINGLE, 500.0, **medium) == pytest.approx(0.195771 * alpha * factor, rel=2e-5)


def test_single_scattering_at_a_distance():
    """The closed form 0.032248 α (e^(-4.14 r/ℓ) + e^(-1.38 r/ℓ)) / (ℓ r) for g = 0."""
    r, mfp, alpha = np.array([0.01, 0.3, 2.0]), 0.5, 0.8
    expected = alpha * 0.032248 * (np.exp(-4.14 * r / mfp) + np.exp(-1.38 * r / mfp)) / (mfp * r)
    np.testing.assert_allclose(values(SINGLE, r, 1.0 / mfp, alpha), expected, rtol=2e-5)


def test_single_scattering_is_the_first_order_of_the_profile():
    """R₁ = α ∂R/∂α at α = 0, by a small α."""
    r, alpha = np.array([0.1, 0.5, 2.0]), 1e-5
    full = values(MULTIPLE, r, 1.0, alpha, slide_albedo(alpha)) + values(SINGLE, r, 1.0, alpha)
    np.testing.assert_allclose(values(SINGLE, r, 1.0, alpha), full, rtol=1e-4)


def test_factor_of_anisotropy():
    """Own Monte Carlo of the single-scattering albedo, ±.0003; of thin air 1 - g when g < 0."""
    for g, albedo in ((0.2, 0.1596), (0.5, 0.0961), (0.8, 0.0372), (0.9, 0.0186)):
        assert values(FACTOR, g)[0] == pytest.approx(albedo / 0.2046, abs=2.5e-3)
    for g in (-0.9, -0.5, -0.2, 0.0):
        assert values(FACTOR, g)[0] == pytest.approx(1.0 - g)


@pytest.mark.parametrize("g", [-0.9, -0.5, -0.2, 0.0, 0.3, 0.6, 0.8, 0.9])
def test_multiple_scattering_is_nowhere_negative(g):
    r = np.geomspace(1e-6, 120.0, 400)
    for color in (0.001, 0.01, 0.05, 0.1, 0.2, 0.3, 0.5, 0.7, 0.8, 0.9, 0.95, 0.99, 0.999):
        rn = values(MULTIPLE, r, 1.0, scattering_albedo(color, g), color, g)
        assert (rn >= 0.0).all(), (color, r[rn < 0.0])


def test_multiple_scattering_integrates_to_the_rest():
    alpha = scattering_albedo(0.6)
    total = plane_integral(MULTIPLE, 500.0, sigma_t=1.0, alpha=alpha, albedo=0.6)
    assert total == pytest.approx(0.6 - 0.195771 * alpha, abs=1e-6)


@pytest.mark.parametrize("albedo, alpha, within", [(0.5197, 0.9208, 0.3216), (0.7177, 0.9794, 0.2498)])
def test_energy_inside_half_a_mean_free_path(albedo, alpha, within):
    d = 1.0 / values(SHAPE, albedo)[0]
    assert values(CDF, 0.5, 1.0 / d)[0] == pytest.approx(within, abs=6e-4)


def test_single_scattering_distribution_of_the_model():
    r = np.array([0.1, 0.2, 0.5, 1.0, 2.0])
    np.testing.assert_allclose(values(CDF, r, 4.14), [0.181, 0.322, 0.592, 0.807, 0.953], atol=1e-3)


@kernel
def _cycles_kernels(offsets, count, n, d, out):
    for i in range(count):
        b = cycles_kernel(load3_f64(offsets, i), load3_f64(n, 0), load3_f64(n, 0), load3_f64(d, 0))
        store3_f64(out, i, b)


def test_cycles_kernel_where_the_point_itself_is_hit():
    """A ray's error puts the point that is seen a little off itself, along its normal: it counts as one beside it."""
    n = np.array([0.0490676, 0.00241054, 0.99879255])
    n /= np.linalg.norm(n)
    d = np.array([0.4, 0.1, 0.05])
    beside = np.cross(n, (1.0, 0.0, 0.0))
    largest = []
    for direction in (n, beside / np.linalg.norm(beside)):
        offsets, found = np.outer(np.geomspace(1e-9, 1e-5, 9), direction), np.zeros((9, 3))
        _cycles_kernels(address(offsets), len(offsets), address(n), address(d), address(found))
        assert np.isfinite(found).all() and (found >= 0.0).all()
        largest.append(found.max(0))
    assert (largest[0] <= 2.0 * largest[1]).all()
