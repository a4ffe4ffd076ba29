"""Albedos of slabs and half spaces against tables that others have made, and what the lookups make of them."""

import math

import numpy as np
import pytest
from scipy.special import expn

from restir_engine.kernels.core.jit import kernel
from restir_engine.kernels.core.memory import address, store_f64
from restir_engine.kernels.subsurface import albedo
from restir_engine.kernels.subsurface.slabs import MU, albedo_of, half_space, single, slab_tables, slabs
from testing.scenes.scattering import COSINES, DIFFUSE


@kernel
def look_up(table, alpha, g, mu, b, out):
    s = albedo.similar(alpha, g)
    store_f64(out, 0, albedo.total_albedo(table, s, g, mu))
    store_f64(out, 1, albedo.single_albedo(table, g, mu))
    reflected, transmitted = albedo.slab_albedos(table, s, g, mu, b)
    store_f64(out, 2, reflected)
    store_f64(out, 3, transmitted)


def looked_up(alpha, g, mu, b=1.0) -> np.ndarray:
    out = np.zeros(4)
    look_up(address(slab_tables()), alpha, g, mu, b, address(out))
    return out


@pytest.mark.parametrize("alpha, g, normal, diffuse", [
    (0.5, 0.0, 0.115226, 0.146544), (0.9, 0.0, 0.414947, 0.478024), (0.999, 0.0, 0.912845, 0.929713),
    (0.5, 0.5, 0.04754, 0.08244), (0.9, 0.8, 0.13622, 0.21672), (0.99, 0.8, 0.52192, 0.60265),
])  # fmt: skip
def test_half_spaces(alpha, g, normal, diffuse):
    """Chandrasekhar's H functions for g = 0, iadpython for the others."""
    assert half_space(alpha, g, np.ones(1))[0] == pytest.approx(normal, abs=5e-5)
    assert half_space(alpha, g, COSINES) @ DIFFUSE == pytest.approx(diffuse, abs=5e-5)


@pytest.mark.parametrize("alpha, b, expected", [
    (0.5, 1.0, (0.09912, 0.44606, 0.13417, 0.30671)),
    (0.9, 0.5, (0.16904, 0.76538, 0.24749, 0.65992)),
    (0.9, 5.0, (0.41254, 0.07665, 0.47634, 0.05342)),
    (1.0, 2.0, (0.51751, 0.48248, 0.60994, 0.39006)),
])  # fmt: skip
def test_slabs(alpha, b, expected):
    """iadpython's UR1, UT1, URU, UTU."""
    r, t = slabs(alpha, 0.0, np.array([b]), np.concatenate([[1.0], COSINES]))
    found = (r[0, 0], t[0, 0], r[0, 1:] @ DIFFUSE, t[0, 1:] @ DIFFUSE)
    assert found == pytest.approx(expected, abs=6e-5)


def test_single_scattering():
    assert single(0.0, COSINES)[0] @ DIFFUSE == pytest.approx(2.0 / 3.0 * (1.0 - math.log(2.0)), abs=1e-5)
    for b, reflected, transmitted in ((0.5, 0.17021, 0.14109), (1.0, 0.19668, 0.11633), (2.0, 0.20423, 0.05058)):
        r, t = single(0.0, COSINES, b)
        assert (r @ DIFFUSE, t @ DIFFUSE) == pytest.approx((reflected, transmitted), abs=3e-4)


@pytest.mark.parametrize("g", [-0.5, 0.0, 0.33, 0.8])
@pytest.mark.parametrize("alpha", [0.35, 0.8, 0.97, 0.9995])
def test_lookups_of_half_spaces(alpha, g):
    for mu in (0.3, 0.75, 1.0):
        total, once, _, _ = looked_up(alpha, g, mu)
        assert total == pytest.approx(half_space(alpha, g, np.array([mu]))[0], rel=8e-3, abs=3e-3)
        assert once == pytest.approx(single(g, np.array([mu]))[0][0], rel=0.02, abs=4e-3)


@pytest.mark.parametrize("g", [0.0, 0.5])
@pytest.mark.parametrize("alpha", [0.8, 0.97])
@pytest.mark.parametrize("b", [0.05, 0.3, 1.5, 6.0])
def test_lookups_of_slabs(alpha, g, b):
    """b: σ_t (1 - g α) thickness, between the table's own."""
    mu, thickness = np.array([0.7]), b / (1.0 - g * alpha)
    (r,), (t,) = slabs(alpha, g, np.array([thickness]), mu)
    r1, t1 = single(g, mu, thickness)
    _, _, reflected, transmitted = looked_up(alpha, g, mu[0], b)
    assert reflected == pytest.approx((r - alpha * r1)[0], rel=0.05, abs=2e-3)
    assert transmitted == pytest.approx((t - alpha * t1 - np.exp(-thickness / mu))[0], rel=0.05, abs=2e-3)


def test_straight_light_through_a_slab():
    """2 E₃(b) is what the tables leave out of diffuse light."""
    (_,), (t,) = slabs(1e-6, 0.0, np.array([1.0]), COSINES)
    assert t @ DIFFUSE == pytest.approx(2.0 * expn(3, 1.0), rel=1e-3)


def test_anisotropy_and_similarity_name_the_same_medium():
    for g in (-0.5, 0.0, 0.7):
        assert albedo_of(0.3, g) == pytest.approx((1 - 0.09) / (1 - g * 0.09))
    assert len(MU) > 2
