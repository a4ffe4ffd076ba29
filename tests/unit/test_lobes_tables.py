"""The stored albedo tables are those that the integration gives."""

import numpy as np
import pytest

from restir_engine.kernels.lobes import albedo as layout
from restir_engine.kernels.lobes import fibres, lobe_tables, tables


def test_the_array_has_the_layout_that_kernels_read():
    array = lobe_tables()
    assert array.shape == (layout.TABLES_SIZE,)
    assert array.dtype == np.float32 and array.flags.c_contiguous
    assert np.isfinite(array).all()


def test_ggx_entries_are_reproduced():
    array, n = lobe_tables(), layout.GGX_SIZE
    for j, i in ((1, 3), (5, 10), (16, 16), (31, 31)):
        expected = tables.ggx_albedo(tables.axis(n)[i], tables.axis(n)[j])
        assert array[layout.GGX_E + j * n + i] == pytest.approx(expected, abs=1e-6)
    for i in (4, 20, 31):
        rough = tables.axis(n)[i]
        expected = tables.average(lambda mu, r=rough: tables.ggx_albedo(r, mu))
        assert array[layout.GGX_AVERAGE + i] == pytest.approx(expected, abs=1e-6)


def test_glass_and_dielectric_entries_are_reproduced():
    array, n = lobe_tables(), layout.GLASS_SIZE
    a = tables.axis(n)
    for k, j, i in ((1, 1, 3), (6, 8, 4), (12, 15, 15)):
        eta = tables.ior_of(tables.axis(n, 0.99)[k])
        at = (k * n + j) * n + i
        assert array[layout.GLASS_E + at] == pytest.approx(tables.glass_albedo(a[i], a[j], [eta])[0], abs=1e-6)
        assert array[layout.GLASS_OUT_E + at] == pytest.approx(tables.glass_albedo(a[i], a[j], [1 / eta])[0], abs=1e-6)
        assert array[layout.DIELECTRIC_S + at] == pytest.approx(tables.dielectric_position(a[i], a[j], eta), abs=1e-6)


def test_known_values():
    """E and its average from the literature's integrals: Kulla and Conty's E(µ = 1, α = 1) is 1 - ln 2 for GGX."""
    array, n = lobe_tables(), layout.GGX_SIZE
    assert array[layout.GGX_E + n * n - 1] == pytest.approx(1.0 - np.log(2.0), abs=1e-4)
    assert array[layout.GGX_E : layout.GGX_E + n * n].max() <= 1.0


@pytest.mark.parametrize(("j", "i"), [(20, 10), (31, 5), (12, 2)])
def test_sheen_entries_are_reproduced(j, i):
    """A walk of another seed gives the albedo within its error, and the stored lobe lies near the walk's histogram."""
    array, n = lobe_tables(), layout.SHEEN_SIZE
    at = j * n + i
    positions = np.maximum(np.linspace(0.0, 1.0, n), 0.01)
    walks = 100_000
    albedo, density = fibres.walk(positions[i], positions[j], walks, seed=2)
    error = np.sqrt(albedo * (1.0 - albedo) / walks)
    assert array[layout.SHEEN_ALBEDO + at] == pytest.approx(albedo, abs=5.0 * error)
    lobe = albedo * fibres.transformed_cosine(array[layout.SHEEN_A + at], array[layout.SHEEN_B + at])
    assert np.abs(lobe - density).mean() < 0.25 * density.mean()
