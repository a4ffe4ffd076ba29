"""Light sampling against densities, solid angles and closed forms, within 4 standard errors unless said."""

import math

import numpy as np
import pytest
from scipy.stats import chi2

from restir_engine.kernels.core import records as rec
from restir_engine.kernels.lobes.closure import LOBE_LAMBERT
from restir_engine.scene.lamps import area_lamp, point_lamp, spot_lamp, sun_lamp
from testing.kernels.lights import draw, irradiance, seen
from testing.measures import close, polygon_irradiance
from testing.scenes.lamps import LAMPS, POINTS, UP, WHITE
from testing.scenes.lights import emission_program, lamp_description, lamp_scene, matrix


@pytest.mark.parametrize("point", POINTS)
@pytest.mark.parametrize("name", LAMPS)
def test_samples_are_found_again_with_their_density(name, point):
    scene = lamp_scene(LAMPS[name])
    samples = draw(scene, point, 2000)
    samples = samples[samples[:, 0] > 0.0]
    assert len(samples) > 0 or "spread" in name or "spot" in name or "distant" in name
    found = seen(scene, point, samples[:, 1:4])
    hit = found[:, 3] > 0.0  # a few at the rim may miss by rounding
    assert hit.mean() > 0.995 if len(samples) else True
    np.testing.assert_allclose(found[hit, 3], samples[hit, 4], rtol=2e-5)
    np.testing.assert_allclose(found[hit, :3], samples[hit, 5:8], rtol=1e-4, atol=1e-9)


@pytest.mark.parametrize("point", POINTS)
@pytest.mark.parametrize("name", [n for n in LAMPS if n not in ("sun small", "area distant")])
def test_chi_squared(name, point):
    """Counts of samples in bins of direction against the integral of the density found by rays."""
    scene = lamp_scene(LAMPS[name])
    n = 20_000
    samples = draw(scene, point, n, seed=7)
    drawn = samples[samples[:, 0] > 0.0]
    if len(drawn) == 0:
        return
    mean = drawn[:, 1:4].mean(axis=0)
    axis = mean / np.linalg.norm(mean)
    frame = matrix((0, 0, 0), axis)[:, :3]
    local = drawn[:, 1:4] @ frame
    top = 1.0 - max((1.0 - local[:, 2]).max() * 1.02, 1e-9)
    rings, sectors, fine = 8, 12, 24
    z = (local[:, 2] - top) / (1.0 - top)
    phi = np.arctan2(local[:, 1], local[:, 0]) / (2 * np.pi) % 1.0
    index = np.minimum((z * rings).astype(int), rings - 1) * sectors + np.minimum(
        (phi * sectors).astype(int), sectors - 1
    )
    observed = np.bincount(index, minlength=rings * sectors)

    grid_z = top + (1.0 - top) * (np.arange(rings * fine) + 0.5) / (rings * fine)
    grid_phi = 2 * np.pi * (np.arange(sectors * fine) + 0.5) / (sectors * fine)
    gz, gp = np.meshgrid(grid_z, grid_phi, indexing="ij")
    r = np.sqrt(1.0 - gz**2)
    directions = np.stack([r * np.cos(gp), r * np.sin(gp), gz], axis=-1).reshape(-1, 3) @ frame.T
    found = seen(scene, point, directions)
    density = np.where(found[:, 0] > 0.0, found[:, 3], 0.0)
    cell = (1.0 - top) * 2 * np.pi / (rings * sectors * fine * fine)
    expected = n * cell * density.reshape(rings, fine, sectors, fine).sum(axis=(1, 3)).ravel()

    keep = expected > 25.0
    # The quadrature of bins that an edge crosses is wrong by up to about 1.5 %, which is allowed for.
    error = np.maximum(np.abs(observed[keep] - expected[keep]) - 0.015 * expected[keep], 0.0)
    statistic = (error**2 / expected[keep]).sum()
    assert statistic < chi2.ppf(1.0 - 1e-4, keep.sum())
    assert abs(expected.sum() - len(drawn)) < 4.0 * math.sqrt(n) * 0.5 + 0.01 * n


ABOVE = matrix((0.0, 0.0, 2.0))


def test_sphere_light():
    lamp = point_lamp(ABOVE, WHITE, 0.8, soft=False)
    radiance = 1.0 / (4.0 * math.pi**2 * 0.8**2)
    assert lamp["strength"][0, 0] == pytest.approx(radiance)
    close(irradiance(lamp_scene(lamp), (0, 0, 0), UP), math.pi * radiance * (0.8 / 2.0) ** 2)
    # Inside the sphere the irradiance of every plane is pi times the radiance.
    close(irradiance(lamp_scene(lamp), (0.1, 0.2, 2.3), UP), math.pi * radiance)


def test_disk_that_turns():
    lamp = point_lamp(ABOVE, WHITE, 0.8)
    radiance = 1.0 / (4.0 * math.pi**2 * 0.8**2)
    close(irradiance(lamp_scene(lamp), (0, 0, 0), UP), math.pi * radiance * 0.64 / (0.64 + 4.0))


def test_delta_lights():
    scene = lamp_scene(point_lamp(ABOVE, WHITE, 0.0))
    close(irradiance(scene, (0, 0, 0), UP, 100), 1.0 / (4.0 * math.pi) / 4.0, 1e-9)
    scene = lamp_scene(spot_lamp(ABOVE, WHITE, 0.0, 1.0, 0.2))
    close(irradiance(scene, (0, 0, 0), UP, 100), 1.0 / (4.0 * math.pi) / 4.0, 1e-9)
    assert not draw(scene, (3.0, 0.0, 0.0), 50)[:, 0].any()
    scene = lamp_scene(sun_lamp(ABOVE, (2.0, 2.0, 2.0), 0.0))
    close(irradiance(scene, (0, 0, 0), UP, 100), 2.0, 1e-9)
    scene = lamp_scene(area_lamp(ABOVE, WHITE, 2.0, 1.0, spread=0.0))
    close(irradiance(scene, (0.9, 0.4, 0), UP, 100), 0.5, 1e-9)
    assert not draw(scene, (1.1, 0.0, 0.0), 50)[:, 0].any()
    assert (draw(scene, (0, 0, 0), 10)[:, 4] == 1.0).all()
    assert not seen(scene, (0, 0, 0), [UP], rec.RAY_CAMERA).any()


@pytest.mark.parametrize("point", [(0, 0, 0), (2.0, 1.0, 0.5), (0.2, 0.1, 1.9)])
def test_rectangle(point):
    lamp = area_lamp(ABOVE, WHITE, 2.0, 1.0)
    corners = [(-1, -0.5, 2), (1, -0.5, 2), (1, 0.5, 2), (-1, 0.5, 2)]
    exact = polygon_irradiance(corners, np.asarray(point, float), np.array(UP)) / (2.0 * math.pi)
    close(irradiance(lamp_scene(lamp), point, UP), exact)


def test_disk():
    lamp = area_lamp(ABOVE, WHITE, 2.0, 2.0, ellipse=True)
    close(irradiance(lamp_scene(lamp), (0, 0, 0), UP), 1.0 / math.pi * 1.0 / (1.0 + 4.0))


def test_area_lights_shine_to_one_side():
    for lamp in (LAMPS["area rectangle"], LAMPS["area disk"]):
        assert not draw(lamp_scene(lamp), (0, 0, 5), 50)[:, 0].any()
        assert not seen(lamp_scene(lamp), (0.2, -0.1, 5), [(0, 0, -1)]).any()


@pytest.mark.parametrize("ellipse", [False, True])
@pytest.mark.parametrize("spread", [0.3, 1.0, 2.5])
def test_spread(spread, ellipse):
    """Irradiance under a grid against a sum over the lamp; the whole power arrives on a large plane."""
    lamp = area_lamp(ABOVE, WHITE, 2.0, 1.2, ellipse=ellipse, spread=spread)
    scene = lamp_scene(lamp)
    half = 0.5 * spread
    n = 1200
    x, y = np.meshgrid((np.arange(n) + 0.5) / n - 0.5, (np.arange(n) + 0.5) / n - 0.5)
    inside = (x * x + y * y < 0.25) if ellipse else np.ones_like(x, bool)
    for point in [(0.0, 0.0, 0.0), (0.7, 0.3, 1.0)]:
        dx, dy, h = 2.0 * x - point[0], 1.2 * y - point[1], 2.0 - point[2]
        d2 = dx * dx + dy * dy + h * h
        tan = np.sqrt(dx * dx + dy * dy) / h
        radiance = np.maximum(math.tan(half) - tan, 0.0) / (math.tan(half) - half) * lamp["strength"][0, 0]
        exact = (radiance * h * h / (d2 * d2) * inside).sum() * 2.4 / n**2
        close(irradiance(scene, point, UP), exact, 1e-3)


def test_sun():
    scene = lamp_scene(sun_lamp(matrix((0, 0, 0), (0.0, 0.6, 0.8)), WHITE, 0.4))
    close(irradiance(scene, (0, 0, 0), UP), 0.8)
    close(irradiance(scene, (0, 0, 0), (0.0, 0.6, 0.8)), 1.0)


def test_selection_probabilities():
    """Densities of many lights add up: each is found as often as chosen, and the sum of choices is 1."""
    lamps = [LAMPS[name] for name in ("point disk", "point sphere", "area rectangle", "sun", "area disk")]
    for count in (1, 20):  # all weighed at the point; in clusters
        scene = lamp_scene(*(lamps * count))
        s = draw(scene, (0.3, 0.2, 0.1), 30_000)
        exact = sum(irradiance(lamp_scene(lamp), (0.3, 0.2, 0.1), UP)[0] for lamp in lamps) * count
        cos = np.maximum(s[:, 3], 0.0)
        value = np.where(s[:, 0] > 0, s[:, 5] * cos / np.where(s[:, 4] > 0, s[:, 4], 1.0), 0.0)
        close((value.mean(), value.std() / math.sqrt(len(s))), exact, 2e-3)
        # 1 / pdf estimates the solid angle of all lights together, each as often as it is there.
        inverse = np.where(s[:, 0] > 0, 1.0 / np.where(s[:, 4] > 0, s[:, 4], 1.0), 0.0)
        angles = 0.0
        for lamp in lamps:
            t = draw(lamp_scene(lamp), (0.3, 0.2, 0.1), 5000)
            angles += np.where(t[:, 0] > 0, 1.0 / np.where(t[:, 4] > 0, t[:, 4], 1.0), 0.0).mean() * count
        close((inverse.mean(), inverse.std() / math.sqrt(len(s))), angles, 5e-3)


def test_choice_on_a_wall_with_a_flush_lamp():
    """Points of a wall and the rays that leave it are on either side of its plane, by rounding: they choose alike."""
    flush = area_lamp(matrix((0.0, 0.0, 2.0)), (50.0, 50.0, 50.0), 1.0, 1.0)  # shines down
    scene = lamp_scene(flush, point_lamp(matrix((1.0, 0.0, 0.5)), WHITE, 0.2))
    samples = draw(scene, (2.0, 0.5, 2.0 - 1e-9), 500)
    samples = samples[samples[:, 8] == 1.0]
    assert len(samples) > 450
    for height in (2.0 - 1e-6, 2.0, 2.0 + 1e-9):
        found = seen(scene, (2.0, 0.5, height), samples[:, 1:4])[:, 3]
        hit = found > 0.0  # the rim is missed from elsewhere
        assert hit.mean() > 0.99
        np.testing.assert_allclose(found[hit], samples[hit, 4], rtol=1e-3)


def test_selection_by_the_normal():
    """A surface that only reflects prefers the lamps before it; densities of hits follow."""
    places = [(1.5, 0.0, 2.0), (-1.0, 1.0, 0.5), (0.0, -1.0, -1.5)]
    lamps = [point_lamp(matrix(place), WHITE, 0.3, soft=False) for place in places] + [LAMPS["sun"]]
    scene = lamp_scene(*lamps)
    s = draw(scene, (0.1, 0.2, 0.0), 20_000, kind=LOBE_LAMBERT)
    assert (s[:, 8] == 2.0).mean() < 0.03
    exact = sum(irradiance(lamp_scene(lamp), (0.1, 0.2, 0.0), UP)[0] for lamp in lamps)
    value = np.where(s[:, 0] > 0, s[:, 5] * np.maximum(s[:, 3], 0.0) / np.where(s[:, 4] > 0, s[:, 4], 1.0), 0.0)
    close((value.mean(), value.std() / math.sqrt(len(s))), exact, 2e-3)
    drawn = s[s[:, 0] > 0.0][:500]
    found = seen(scene, (0.1, 0.2, 0.0), drawn[:, 1:4], up=1.0)
    assert (np.abs(found[:, 3] / drawn[:, 4] - 1.0) < 1e-4).mean() > 0.98


def test_many_lamps():
    """A street of lamps: near ones are preferred, nothing is lost, and densities of hits follow."""
    rng = np.random.default_rng(5)
    places = np.column_stack([rng.uniform(-50, 50, 300), rng.uniform(-3, 3, 300), rng.uniform(1, 2, 300)])
    lamps = [point_lamp(matrix(place), WHITE, 0.2, soft=False) for place in places]
    scene = lamp_scene(*lamps, LAMPS["sun"])
    assert scene.lights.record["n_clusters"] > 10
    point = (3.0, 0.5, 0.0)
    s = draw(scene, point, 30_000, kind=LOBE_LAMBERT)
    offsets = places - point
    d2 = (offsets**2).sum(axis=1)
    exact = (offsets[:, 2] / d2**1.5).sum() / (4.0 * math.pi) + irradiance(lamp_scene(LAMPS["sun"]), point, UP)[0]
    value = np.where(s[:, 0] > 0, s[:, 5] * np.maximum(s[:, 3], 0.0) / np.where(s[:, 4] > 0, s[:, 4], 1.0), 0.0)
    close((value.mean(), value.std() / math.sqrt(len(s))), exact, 2e-3)
    assert value.std() < 1.5 * value.mean()
    local = s[(s[:, 0] > 0.0) & (s[:, 11] < 1e30)][:1000]
    found = seen(scene, point, local[:, 1:4], up=1.0)
    assert (found[:, 3] > 0.999 * local[:, 4]).mean() > 0.99
    assert np.median(found[:, 3] / local[:, 4]) == pytest.approx(1.0, rel=1e-6)


def test_visibility():
    lamp = point_lamp(ABOVE, WHITE, 0.5, seen_by=rec.RAY_ALL & ~rec.RAY_DIFFUSE, max_bounces=0, casts_shadow=False)
    scene = lamp_scene(lamp)
    assert not seen(scene, (0, 0, 0), [UP], rec.RAY_DIFFUSE | rec.RAY_REFLECT).any()
    assert seen(scene, (0, 0, 0), [UP], rec.RAY_GLOSSY | rec.RAY_REFLECT).all()
    assert seen(scene, (0, 0, 0), [UP], rec.RAY_CAMERA).any()
    lamp = point_lamp(ABOVE, WHITE, 0.5, hittable=False)
    scene = lamp_scene(lamp)
    for rays in (rec.RAY_DIFFUSE, rec.RAY_CAMERA):  # as in Cycles, see the scene lamps_without_mis
        assert not seen(scene, (0, 0, 0), [UP], rays).any()


def test_program_of_a_lamp_multiplies_its_strength():
    scene = lamp_description(point_lamp(ABOVE, WHITE, 0.5))
    scene.lights.lamps["material"] = scene.shaders.add(emission_program((2.0, 3.0, 0.0)))
    scene = scene.commit()
    s = draw(scene, (0, 0, 0), 10)
    np.testing.assert_allclose(s[:, 5:8] / scene.lights.lamps["strength"][0, 0], [[2.0, 3.0, 0.0]] * 10)
    np.testing.assert_allclose(seen(scene, (0, 0, 0), [UP])[0, :3], s[0, 5:8])
