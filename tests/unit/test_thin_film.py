"""Thin films on microfacets beside the exact amplitude of light of single wavelengths."""

import numpy as np
import pytest

from restir_engine.kernels.lobes.thin_film import TABLE_HEAD
from testing.kernels.lobes import Surface, direction

METALLIC, GLASS, PRINCIPLED = "ShaderNodeBsdfMetallic", "ShaderNodeBsdfGlass", "ShaderNodeBsdfPrincipled"
WAVELENGTHS = np.array([460.0, 540.0, 630.0])
COSINES = (1.0, 0.7, 0.3, 0.1)


def table(step: float = 1.0, count: int = 12000) -> np.ndarray:
    """Channels that see one wavelength each (nm): their transform is the wave itself."""
    wave = np.exp(2j * np.pi * step * np.arange(count)[:, None] / WAVELENGTHS)
    return np.concatenate([[1.0, count, step], np.hstack([wave.real, wave.imag]).ravel()])


TABLE = table()
assert TABLE_HEAD == 3


def amplitude(n, cosine, below):
    """Fresnel's amplitudes (s, p) from an index n upon another, complex."""
    q = np.sqrt(below**2 - n**2 * (1.0 - cosine**2) + 0j)
    return (n * cosine - q) / (n * cosine + q), (below**2 * cosine - n * q) / (below**2 * cosine + n * q)


def exact(n, thickness, below, cosine):
    """|r|² of a film between air and `below` for each of WAVELENGTHS, unpolarised."""
    inside = np.sqrt(1.0 - (1.0 - cosine**2) / n**2 + 0j)
    turn = np.exp(2j * np.pi * 2.0 * n * thickness * inside / WAVELENGTHS)
    total = 0.0
    for upper, lower in zip(amplitude(1.0, cosine, n), amplitude(n, inside, below), strict=True):
        total = total + 0.5 * np.abs((upper + lower * turn) / (1.0 + upper * lower * turn)) ** 2
    return total


def reflectance(node, cosine, film, **inputs):
    """What a mirror under a film reflects, rgb."""
    surface = Surface(node, direction(cosine), Thin_Film=(*film, 0.0), film_table=TABLE, Roughness=0.0, **inputs)
    labels, _, values, pdf = surface.sample(4096)
    reflected = (labels & 2) > 0
    rgb = values.reshape(-1, 3, 3).sum(1) / np.maximum(pdf, 1e-300)[:, None]
    chance = reflected.mean()
    return rgb[reflected].mean(0) * chance if chance else np.zeros(3)


@pytest.mark.parametrize("cosine", COSINES)
@pytest.mark.parametrize("film", [(400.0, 1.33), (150.0, 1.9), (900.0, 1.7)])
def test_metals(film, cosine):
    """A physical conductor; the sum ends at the third order, whose rest is below 2 |r₁₂ r₂₃|⁴."""
    eta, k = (0.2, 0.9, 1.4), (3.5, 2.4, 1.9)
    found = reflectance(
        METALLIC, cosine, film, IOR=eta, Extinction=k, distribution="GGX", fresnel_type="PHYSICAL_CONDUCTOR"
    )
    for channel in range(3):
        below = eta[channel] + 1j * k[channel]
        upper, lower = amplitude(1.0, cosine, film[1]), amplitude(film[1], 0.0, below)
        inside = np.sqrt(1.0 - (1.0 - cosine**2) / film[1] ** 2)
        lower = amplitude(film[1], inside, below)
        rest = max(2.0 * abs(u * b) ** 4 / (1.0 - abs(u * b)) for u, b in zip(upper, lower, strict=True))
        expected = exact(film[1], film[0], below, cosine)[channel]
        assert found[channel] == pytest.approx(expected, abs=rest + 2e-4)


@pytest.mark.parametrize("cosine", COSINES)
@pytest.mark.parametrize("film", [(400.0, 1.33), (150.0, 1.9), (900.0, 1.2)])
def test_glass(film, cosine):
    """Whatever the angle, what is not reflected passes."""
    inputs = {"IOR": 1.5, "Color": 1.0, "distribution": "GGX"}
    surface = Surface(GLASS, direction(cosine), Thin_Film=(*film, 0.0), film_table=TABLE, Roughness=0.0, **inputs)
    labels, wi, values, pdf = surface.sample(20_000)
    assert (labels > 0).all()
    rgb = values.reshape(-1, 3, 3).sum(1) / pdf[:, None]
    up = wi[:, 2] > 0.0
    chance = pdf[up][0]
    assert up.mean() == pytest.approx(chance, abs=4.0 * np.sqrt(0.25 / len(up)))
    reflected, passed = rgb[up][0] * chance, rgb[~up][0] * pdf[~up][0]
    assert reflected == pytest.approx(exact(film[1], film[0], 1.5, cosine), abs=1e-3)
    assert reflected + passed == pytest.approx(np.ones(3), abs=1e-6)


def test_a_film_of_the_same_index_is_none():
    """As glass, as air."""
    for index in (1.5, 1.0):
        for cosine in COSINES:
            bare = exact(1.5, 0.0, 1.5, cosine)
            found = reflectance(PRINCIPLED, cosine, (300.0, index), IOR=1.5, Base_Color=0.0)
            assert found == pytest.approx(bare, abs=1e-4)


def test_a_film_alone_mirrors():
    """Under an index of 1 there is nothing but the film's two sides."""
    found = reflectance(PRINCIPLED, 0.8, (300.0, 1.4), IOR=1.0, Base_Color=0.0)
    assert found == pytest.approx(exact(1.4, 300.0, 1.0, 0.8), abs=5e-4)


def test_thinner_than_its_atoms():
    """Below the table's thickness it fades to what it lies on, and ends at a tenth of a nanometre."""
    inputs = {"IOR": 1.5, "Base_Color": 0.0}
    bare = exact(1.5, 0.0, 1.5, 0.7)
    assert reflectance(PRINCIPLED, 0.7, (0.2, 1.9), **inputs) == pytest.approx(bare, rel=0.01)
    assert reflectance(PRINCIPLED, 0.7, (0.0, 1.9), **inputs) == pytest.approx(bare, rel=1e-4)


@pytest.mark.parametrize("film", [(200.0, 1.6), (0.0, 1.6)])
def test_thin_sheets_keep_energy(film):
    """A clear sheet with a film reflects and passes all light."""
    inputs = {"Transmission_Weight": 1.0, "Thin_Wall": 1.0, "Base_Color": 1.0}
    surface = Surface(PRINCIPLED, direction(0.6), Thin_Film=(*film, 0.0), film_table=TABLE, Roughness=0.0, **inputs)
    mean, error = surface.albedo(8192)
    assert (np.abs(mean - 1.0) <= 1e-3 + 4.0 * error).all()
