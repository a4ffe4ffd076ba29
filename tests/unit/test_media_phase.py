"""Phase functions: densities that integrate to 1, and samples that follow them."""

import math

import numpy as np
import pytest

from restir_engine.kernels.core.jit import kernel
from restir_engine.kernels.core.memory import address, load_f64, store_f64
from restir_engine.kernels.volume import phase


@kernel
def _values(kind, a, b, c, cosines, out, count):
    for i in range(count):
        store_f64(out, i, phase.phase_value(kind, a, b, c, load_f64(cosines, i)))


@kernel
def _cosines(kind, a, b, c, out, count):
    for i in range(count):
        store_f64(out, i, phase.phase_cosine(kind, a, b, c, (i + 0.5) / count))


@kernel
def _fournier_forand(backscatter, ior, out):
    values = phase.fournier_forand_parameters(backscatter, ior)
    for k in range(3):
        store_f64(out, k, values[k])


def ocean(backscatter: float, ior: float) -> tuple[float, ...]:
    out = np.empty(3)
    _fournier_forand(backscatter, ior, address(out))
    return tuple(out.tolist())


CASES = {
    "isotropic": (phase.PHASE_HG, 0.0, 0.0, 0.0),
    "forwards": (phase.PHASE_HG, 0.8, 0.0, 0.0),
    "backwards": (phase.PHASE_HG, -0.6, 0.0, 0.0),
    "Rayleigh": (phase.PHASE_RAYLEIGH, 0.0, 0.0, 0.0),
    "Cornette-Shanks": (phase.PHASE_DRAINE, 0.5, 1.0, 0.0),
    "Draine": (phase.PHASE_DRAINE, -0.3, 27.0, 0.0),
    "Draine without g": (phase.PHASE_DRAINE, 0.0, 3.0, 0.0),
    "Fournier-Forand": (phase.PHASE_FOURNIER_FORAND, *ocean(0.1, 1.33)),
    "Fournier-Forand of soft particles": (phase.PHASE_FOURNIER_FORAND, *ocean(0.3, 1.1)),
}


@pytest.mark.parametrize("name", CASES)
def test_samples_follow_the_density(name):
    """Shares of light by cosine, finest forwards; both sides are quadratures of a million points."""
    n = 400000
    edges = 1.0 - 2.0 * np.linspace(0.0, 1.0, 33)[::-1] ** 3
    fine = 1.0 - 2.0 * np.linspace(0.0, 1.0, n + 1)[::-1] ** 5
    middle = 0.5 * (fine[1:] + fine[:-1])
    values, cosines = np.empty(n), np.empty(n)
    _values(*CASES[name], address(middle), address(values), n)
    _cosines(*CASES[name], address(cosines), n)
    mass = 2.0 * math.pi * values * np.diff(fine)
    assert mass.sum() == pytest.approx(1.0, abs=2e-3)
    expected = np.histogram(middle, edges, weights=mass)[0]
    found = np.histogram(cosines, edges)[0] / n
    assert np.abs(found - expected).max() < 2e-3


def test_fournier_forand_scatters_the_share_backwards_that_was_asked_for():
    cosines = np.empty(100000)
    _cosines(phase.PHASE_FOURNIER_FORAND, *ocean(0.2, 1.2), address(cosines), len(cosines))
    assert (cosines < 0.0).mean() == pytest.approx(0.2, abs=1e-3)
