"""Hair: energy in a white furnace at any angle, samples beside densities, and Chiang's model beside Mitsuba's."""

import numpy as np
import pytest
from scipy.stats import chi2

from testing.kernels.lobes import Surface

ALONG = np.array([0.0, 1.0, 0.0])
HAIR = {"Roughness": 0.3, "Offset": np.radians(2.0), "IOR": 1.55, "parametrization": "ABSORPTION"}
PIGMENT = {"Absorption_Coefficient": (0.1, 0.3, 1.0)}
CHIANG = {
    "hair": HAIR | {"Radial_Roughness": 0.3},
    "rough": HAIR | {"Roughness": 0.7, "Radial_Roughness": 0.8},
    "coated": HAIR | {"Radial_Roughness": 0.5, "Coat": 0.7} | PIGMENT,
}
HUANG = {"huang": HAIR, "huang pigment": HAIR | {"Roughness": 0.5} | PIGMENT}
CLOSURE = {name: {"RoughnessU": 0.25, "RoughnessV": 0.4, "component": name} for name in ("Reflection", "Transmission")}
CASES = [
    *(("CHIANG", inputs) for inputs in CHIANG.values()),
    *(("ShaderNodeBsdfHair", inputs) for inputs in CLOSURE.values()),
    *(pytest.param("HUANG", inputs, marks=pytest.mark.deep) for inputs in HUANG.values()),
]
SEEN_FROM = [(0.0, 0.1, 1.0), (0.3, -0.6, 0.7), (-0.8, 0.5, 0.6), (0.1, -3.0, 0.5)]
THETA, PHI, FINE, SAMPLES = 24, 24, 8, 20_000


def strand(node, wo, **inputs):
    """A strand along y, hit where the normal is z."""
    wo = np.array(wo) / np.linalg.norm(wo)
    return Surface(node, wo, tangent=ALONG, **inputs)


def grid():
    """Midpoints of cells of equal area [THETA · FINE · PHI · FINE, 3] and a cell's solid angle."""
    n, m = THETA * FINE, PHI * FINE
    z, phi = np.meshgrid(1.0 - 2.0 * (np.arange(n) + 0.5) / n, 2.0 * np.pi * (np.arange(m) + 0.5) / m, indexing="ij")
    s = np.sqrt(1.0 - z * z)
    return np.stack([s * np.cos(phi), s * np.sin(phi), z], axis=-1).reshape(-1, 3), 4.0 * np.pi / (n * m)


DIRECTIONS, CELL = grid()


@pytest.mark.parametrize("wo", SEEN_FROM)
@pytest.mark.parametrize("inputs", CHIANG.values(), ids=CHIANG)
def test_hair_without_pigment_keeps_all_light(inputs, wo):
    """A sample's throughput is 1, whatever its direction; the integral of values is too."""
    point = strand("CHIANG", wo, **inputs | {"Absorption_Coefficient": 0.0})
    labels, _, values, pdf = point.sample(256)
    assert (labels > 0).all()
    np.testing.assert_allclose(values.reshape(-1, 3, 3).sum(axis=1) / pdf[:, None], 1.0, rtol=1e-9)
    total = point.evaluate(DIRECTIONS)[0].reshape(-1, 3, 3).sum(axis=(0, 1)) * CELL
    np.testing.assert_allclose(total, 1.0, atol=0.01)


@pytest.mark.deep
@pytest.mark.parametrize("wo", SEEN_FROM)
def test_microfacets_lose_what_scatters_more_than_once(wo):
    """Single scattering at each surface loses light, and makes none; smooth hair keeps almost all.

    At one point the lobe is one of many, by a hash of it: their mean over points counts.
    """
    about = np.array(wo) / np.linalg.norm(wo) + 1e-3 * np.random.default_rng(1).normal(size=(200, 3))
    energies = []
    for roughness in (0.1, 0.3, 0.6):
        inputs = HAIR | {"Roughness": roughness, "Offset": 0.0}
        found = np.array([strand("HUANG", place, **inputs).albedo(500)[0][0] for place in about])
        error = found.std() / np.sqrt(len(found))
        assert found.mean() <= 1.0 + 4.0 * error
        energies.append((found.mean(), error))
    (smooth, _), _, (rough, error) = energies
    assert smooth > 0.99 and 0.9 < rough < smooth + 2.0 * error


@pytest.mark.parametrize("wo", SEEN_FROM)
@pytest.mark.parametrize("node, inputs", CASES)
def test_samples_follow_the_density(node, inputs, wo):
    """Chi-squared over bins with ten expected samples or more at a level of 1e-5; values and pdfs are evaluation's."""
    point = strand(node, wo, **inputs)
    labels, wi, values, pdf = point.sample(SAMPLES, key=5)
    found = labels > 0
    again, pdf_again = point.evaluate(wi[found])
    np.testing.assert_allclose(pdf[found], pdf_again, rtol=1e-9)
    np.testing.assert_allclose(values[found], again, rtol=1e-9, atol=1e-12)
    expected = point.evaluate(DIRECTIONS)[1].reshape(THETA, FINE, PHI, FINE).sum(axis=(1, 3)) * CELL * SAMPLES
    i = np.clip(((1.0 - wi[found, 2]) * 0.5 * THETA).astype(int), 0, THETA - 1)
    j = (np.mod(np.arctan2(wi[found, 1], wi[found, 0]), 2.0 * np.pi) / (2.0 * np.pi) * PHI).astype(int) % PHI
    counts = np.bincount(i * PHI + j, minlength=THETA * PHI).reshape(THETA, PHI)
    # Cells with the edge of a side in them (z = 0) and the pole, where a lobe may begin within the cell.
    big = expected >= 10.0
    if node == "ShaderNodeBsdfHair":
        big[THETA // 2 - 1 : THETA // 2 + 1] = False
    statistic = ((counts - expected)[big] ** 2 / expected[big]).sum()
    assert chi2.sf(statistic, big.sum()) > 1e-5, f"{statistic:.0f} for {big.sum()} bins"


def test_chiang_is_that_of_mitsuba():
    """Values in 60 directions for each of three views; Mitsuba's scales are tilted the other way."""
    mitsuba = pytest.importorskip("mitsuba")
    mitsuba.set_variant("scalar_rgb")
    pigment = {"type": "rgb", "value": list(PIGMENT["Absorption_Coefficient"])}
    theirs = mitsuba.load_dict({
        "type": "hair", "longitudinal_roughness": 0.3, "azimuthal_roughness": 0.4, "scale_tilt": 2.0,
        "int_ior": 1.55, "ext_ior": 1.0, "sigma_a": pigment,
    })  # fmt: skip
    directions = np.random.default_rng(2).normal(size=(60, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    for wo in ((0.0, 0.5, 0.9), (0.3, 0.4, 0.8), (-0.4, -0.3, 0.7)):
        point = strand("CHIANG", wo, **HAIR | PIGMENT | {"Radial_Roughness": 0.4, "Offset": -np.radians(2.0)})
        values, _ = point.evaluate(directions)
        hit = mitsuba.SurfaceInteraction3f()
        hit.wi = mitsuba.Vector3f(*(float(x) for x in point.point["wo"]))
        hit.n, hit.sh_frame = mitsuba.Normal3f(0, 0, 1), mitsuba.Frame3f(mitsuba.Vector3f(0, 0, 1))
        for wi, value in zip(directions, values.reshape(-1, 3, 3).sum(axis=1), strict=True):
            expected = theirs.eval(mitsuba.BSDFContext(), hit, mitsuba.Vector3f(*(float(x) for x in wi)))
            np.testing.assert_allclose(value, [float(x) for x in expected], rtol=3e-3, atol=2e-6)


def test_filter_glossy_widens_hair():
    point = strand("CHIANG", SEEN_FROM[0], **CHIANG["hair"])
    before = point.evaluate(DIRECTIONS)[0].max()
    point.blur(0.5)
    assert point.evaluate(DIRECTIONS)[0].max() < 0.2 * before
