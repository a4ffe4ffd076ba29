"""Sampling against density: chi-squared over the sphere, density that integrates to one, values that agree."""

import numpy as np
import pytest
from scipy.stats import chi2

from testing.kernels.lobes import Surface, direction

GLOSSY, GLASS, PRINCIPLED = "ShaderNodeBsdfAnisotropic", "ShaderNodeBsdfGlass", "ShaderNodeBsdfPrincipled"
TANGENT = (0.8, 0.6, 0.0)
CASES = {
    "lambert": ("ShaderNodeBsdfDiffuse", {"Roughness": 0.0}),
    "oren-nayar": ("ShaderNodeBsdfDiffuse", {"Roughness": 0.7}),
    "translucent": ("ShaderNodeBsdfTranslucent", {}),
    "toon": ("ShaderNodeBsdfToon", {"Size": 0.4, "Smooth": 0.3, "component": "DIFFUSE"}),
    "glossy toon": ("ShaderNodeBsdfToon", {"Size": 0.1, "Smooth": 0.2, "component": "GLOSSY"}),
    "velvet": ("ShaderNodeBsdfSheen", {"Roughness": 0.5, "distribution": "ASHIKHMIN"}),
    **{f"sheen {r}": ("ShaderNodeBsdfSheen", {"Roughness": r, "distribution": "MICROFIBER"}) for r in (0.2, 0.5, 1.0)},
    **{
        f"{d} {r} {a}": (
            GLOSSY,
            {"Roughness": r, "Anisotropy": a, "Rotation": 0.1, "Tangent": TANGENT, "distribution": d},
        )
        for d in ("GGX", "BECKMANN", "ASHIKHMIN_SHIRLEY")
        for r, a in ((0.4, 0.0), (0.8, 0.0), (0.6, 0.6), (0.6, -0.5))
    },
    **{
        f"glass {d} {r} {ior}": (GLASS, {"Roughness": r, "IOR": ior, "distribution": d})
        for d in ("GGX", "BECKMANN")
        for r, ior in ((0.4, 1.45), (0.8, 1.45), (0.6, 0.7), (1.0, 1.8))
    },
    "refraction": ("ShaderNodeBsdfRefraction", {"Roughness": 0.5, "IOR": 1.3, "distribution": "GGX"}),
    "principled": (
        PRINCIPLED,
        {"Roughness": 0.4, "Metallic": 0.3, "Transmission_Weight": 0.4, "Coat_Weight": 0.5, "Coat_Roughness": 0.3},
    ),
    "thin": (PRINCIPLED, {"Roughness": 0.5, "Transmission_Weight": 1.0, "Thin_Wall": 1.0}),
    "thin sheet": (
        PRINCIPLED,
        {"Thin_Wall": 1.0, "Subsurface_Weight": 0.8, "Subsurface_Anisotropy": 0.3, "Diffuse_Roughness": 0.6},
    ),
    "fibres": (PRINCIPLED, {"Roughness": 0.4, "Sheen_Weight": 1.0, "Diffuse_Roughness": 0.5}),
}
COSINES = (0.98, 0.5, 0.1)
SAMPLES = 50_000
THETA, PHI, FINE = 32, 32, 8


def grid():
    """Midpoints [theta bin, phi bin, fine, 3] of cells of equal area over the sphere, and a cell's solid angle."""
    n, m = THETA * FINE, PHI * FINE
    z = 1.0 - 2.0 * (np.arange(n) + 0.5) / n
    phi = 2.0 * np.pi * (np.arange(m) + 0.5) / m
    z, phi = np.meshgrid(z, phi, indexing="ij")
    s = np.sqrt(1.0 - z * z)
    return np.stack([s * np.cos(phi), s * np.sin(phi), z], axis=-1).reshape(-1, 3), 4.0 * np.pi / (n * m)


DIRECTIONS, CELL = grid()


def density(point):
    """Probability of each [theta, phi] bin by the lobe's pdf."""
    _, pdf = point.evaluate(DIRECTIONS)
    return pdf.reshape(THETA, FINE, PHI, FINE).sum(axis=(1, 3)) * CELL


def histogram(wi):
    i = np.clip(((1.0 - wi[:, 2]) * 0.5 * THETA).astype(int), 0, THETA - 1)
    j = (np.mod(np.arctan2(wi[:, 1], wi[:, 0]), 2.0 * np.pi) / (2.0 * np.pi) * PHI).astype(int) % PHI
    return np.bincount(i * PHI + j, minlength=THETA * PHI).reshape(THETA, PHI)


@pytest.mark.parametrize("cosine", COSINES)
@pytest.mark.parametrize("case", CASES)
def test_samples_follow_the_density(case, cosine):
    """Chi-squared over bins with 10 expected samples or more, the others pooled, at a level of 1e-5 for each case."""
    node, inputs = CASES[case]
    point = Surface(node, direction(cosine), **inputs)
    labels, wi, values, pdf = point.sample(SAMPLES, key=11)
    found = labels > 0
    assert found.any()
    again, pdf_again = point.evaluate(wi[found])
    np.testing.assert_allclose(pdf[found], pdf_again, rtol=1e-9)
    np.testing.assert_allclose(values[found], again, rtol=1e-9, atol=1e-12)

    expected, counts = density(point) * SAMPLES, histogram(wi[found])
    lost = SAMPLES - found.sum()
    assert expected.sum() <= SAMPLES * 1.02 and expected.sum() + lost >= SAMPLES * 0.98
    # Cells with a step in them (horizon, rim of a cone) are left to their neighbours' sum.
    big = expected >= 10.0
    statistic = ((counts - expected)[big] ** 2 / expected[big]).sum()
    rest, rest_expected = counts[~big].sum(), expected[~big].sum()
    statistic += (rest - rest_expected) ** 2 / max(rest_expected, 10.0)
    assert chi2.sf(statistic, big.sum()) > 1e-5, f"{statistic:.0f} for {big.sum()} bins"


@pytest.mark.parametrize("case", ["lambert", "oren-nayar", "GGX 0.4 0.0", "GGX 0.6 0.6", "BECKMANN 0.8 0.0", "velvet"])
def test_reflection_is_reciprocal(case):
    """f(wo, wi) = f(wi, wo): the value over the cosine is the same both ways."""
    node, inputs = CASES[case]
    rng = np.random.default_rng(3)
    for _ in range(20):
        a, b = (direction(rng.uniform(0.1, 1.0), rng.uniform(0.0, 6.3)) for _ in range(2))
        there = Surface(node, a, **inputs).evaluate(b)[0][0] / b[2]
        back = Surface(node, b, **inputs).evaluate(a)[0][0] / a[2]
        assert there == pytest.approx(back, rel=1e-9, abs=1e-12)


def test_refraction_is_reciprocal_up_to_the_index_squared():
    """f(wo → wi) / η² is the same from both sides (Walter et al. 2007)."""
    eta = 1.4
    inputs = {"Roughness": 0.5, "IOR": eta, "distribution": "GGX"}
    wo, wi = direction(0.8, 0.3), -direction(0.85, 0.4)
    front = Surface(GLASS, wo, **inputs).evaluate(wi)[0][0] / abs(wi[2])
    flip = np.array([1.0, 1.0, -1.0])
    back = Surface(GLASS, wi * flip, backfacing=1, **inputs).evaluate(wo * flip)[0][0] / wo[2]
    assert front[6] > 0.0
    assert front == pytest.approx(back * eta * eta, rel=1e-6)


@pytest.mark.parametrize("node", [GLOSSY, GLASS, "ShaderNodeBsdfRefraction"])
def test_smooth_lobes_are_singular(node):
    point = Surface(node, direction(0.6), Roughness=0.0, Color=(0.9, 0.5, 0.1), distribution="GGX")
    labels, wi, values, pdf = point.sample(512)
    assert (labels & 16 == 16).all()
    assert (point.evaluate(wi)[1] == 0.0).all()
    throughput = values.reshape(-1, 3, 3).sum(axis=1) / pdf[:, None]
    np.testing.assert_allclose(throughput, np.tile([0.9, 0.5, 0.1], (512, 1)), rtol=1e-9)
    for direction_found in wi[labels & 2 == 2]:
        np.testing.assert_allclose(direction_found, direction(0.6, 0.3 + np.pi), atol=1e-9)


def test_singular_parts_of_a_mixture_are_found_in_proportion():
    """A smooth coat over rough metal: the mean of value / pdf holds both."""
    point = Surface(
        PRINCIPLED, direction(0.3), Base_Color=1.0, Metallic=1.0, Coat_Weight=1.0, Coat_Roughness=0.0, Roughness=0.6
    )
    labels, _, values, pdf = point.sample(20000)
    singular = labels & 16 == 16
    assert 0.02 < singular.mean() < 0.5
    share = (values[:, 3] / np.maximum(pdf, 1e-300))[singular].sum() / len(labels)
    assert share == pytest.approx(0.208, abs=0.01)  # Fresnel reflectance of an index of 1.5 at a cosine of 0.3


def test_grazing_and_odd_inputs_give_finite_numbers():
    rng = np.random.default_rng(5)
    for case, (node, inputs) in CASES.items():
        for cosine in (1.0, 1e-3, 1e-6, 0.0, -0.2):
            point = Surface(node, direction(cosine), **inputs)
            _labels, wi, values, pdf = point.sample(256)
            wi = np.concatenate([wi, rng.normal(size=(64, 3)), direction(1e-7)[None], -direction(cosine)[None]])
            wi /= np.maximum(np.linalg.norm(wi, axis=1, keepdims=True), 1e-30)
            seen, density_seen = point.evaluate(wi)
            for name, array in (("values", values), ("pdf", pdf), ("eval", seen), ("eval pdf", density_seen)):
                assert np.isfinite(array).all() and (array >= 0.0).all(), f"{case}, cosine {cosine}: {name}"
            assert np.isfinite(point.color()).all()


def test_bumped_normals_stay_on_the_geometric_side():
    """No reflection goes below the surface and no transmission above it, whatever the shading normal."""
    n = np.array([0.6, 0.0, 0.8])
    for node, inputs in CASES.values():
        point = Surface(node, direction(0.3, np.pi), Normal=n, **inputs)
        labels, wi, _, _ = point.sample(2000)
        found = labels > 0
        assert ((wi[found, 2] > 0.0) == (labels[found] & 2 == 2)).all()
