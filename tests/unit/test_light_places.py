"""Points of lights, kept for one receiver and placed for it again and for another; 4 standard errors unless said."""

import math

import numpy as np
import pytest

from restir_engine.kernels.core import records as rec
from restir_engine.scene.lamps import point_lamp
from testing.kernels.light_points import keep, place
from testing.kernels.lights import draw
from testing.scenes.lamps import ABOVE, LAMPS, POINTS, SCENES, WHITE, sky
from testing.scenes.lights import lamp_scene


@pytest.mark.parametrize("point", POINTS)
@pytest.mark.parametrize("name", SCENES)
def test_placed_for_the_same_receiver(name, point):
    """The same direction, distance and radiance; a few points at a rim may be lost or look elsewhere by rounding."""
    scene = SCENES[name]()
    points, samples = keep(scene, point, 1000)
    drawn = samples[:, 4] > 0.0
    assert drawn.any() or "spot" in name or "spread" in name
    placed = place(scene, point, points)[drawn]
    samples = samples[drawn]
    assert (placed[:, 10] > 0.0).mean() > 0.99 if len(placed) else True
    same = placed[:, 10] > 0.0
    angle = np.linalg.norm(placed[same, :3] - samples[same, :3], axis=1)
    assert (angle < 2e-6).all()
    far = np.isinf(samples[same, 3])
    np.testing.assert_array_equal(np.isinf(placed[same, 3]), far)
    np.testing.assert_allclose(placed[same][~far, 3], samples[same][~far, 3], rtol=1e-4)
    np.testing.assert_allclose(placed[same, 4:7], samples[same, 4:7], rtol=2e-3, atol=1e-7)
    np.testing.assert_array_equal(placed[same, 7], samples[same, 7])


def lit(placed, normal):
    """The integrand of irradiance in the measure of points, red."""
    cos = np.maximum(placed[:, :3] @ np.asarray(normal, float), 0.0)
    return np.where(placed[:, 10] > 0.0, placed[:, 4] * cos / np.where(placed[:, 8] > 0.0, placed[:, 8], 1.0), 0.0)


@pytest.mark.parametrize("name", [n for n in SCENES if "spread" not in n and "spot" not in n and n != "all"])
def test_samples_of_one_receiver_light_another(name):
    """Points drawn for one receiver, over their density there, estimate the irradiance at another."""
    scene = SCENES[name]()
    here, there, normal = (0.6, 0.3, 0.9), (0.2, -0.4, -0.3), (0.1, 0.0, 1.0)
    points, _ = keep(scene, here, 40_000)
    density = points[:, 4]
    values = lit(place(scene, there, points), normal) / np.where(density > 0.0, density, 1.0) * (density > 0.0)
    own = draw(scene, there, 40_000, seed=9)
    cos = np.maximum(own[:, 1:4] @ np.asarray(normal), 0.0)
    exact = np.where(own[:, 0] > 0.0, own[:, 5] * cos / np.where(own[:, 4] > 0.0, own[:, 4], 1.0), 0.0)
    error = math.sqrt((values.var() + exact.var()) / len(values))
    assert exact.mean() > 0.0
    assert abs(values.mean() - exact.mean()) < 4.0 * error + 1e-4 * exact.mean()


# Density of the measure of points by (u, v).
SHARES = {"disk": 1.0 / math.pi, "face": 1.0, "ellipse": 4.0 / math.pi, "triangle": 2.0}


def share_of(name, scene, points):
    if name == "triangles":
        return SHARES["triangle"]
    kind, flags = scene.lights.lamps["kind"][0], scene.lights.lamps["flags"][0]
    if kind == rec.LIGHT_AREA:
        return SHARES["ellipse" if flags & rec.LIGHT_ELLIPSE else "face"]
    return SHARES["disk"]


@pytest.mark.parametrize("name", [*LAMPS, "triangles"])
def test_measure_by_finite_differences(name):
    """ls.pdf is the share of the light in a small solid angle, divided by that."""
    scene = SCENES[name]()
    point = (0.3, 0.1, 0.2)
    points, _ = keep(scene, point, 200)
    points = points[points[:, 4] > 0.0]
    step = 1e-5
    moved = [points + np.array([0.0, 0.0, du, dv, 0.0]) for du, dv in ((step, 0), (-step, 0), (0, step), (0, -step))]
    middle = place(scene, point, points)
    right, left, up, down = (place(scene, point, p) for p in moved)
    valid = (middle[:, 10] * right[:, 10] * left[:, 10] * up[:, 10] * down[:, 10]) > 0.0
    du = (right[:, :3] - left[:, :3]) / (2.0 * step)
    dv = (up[:, :3] - down[:, :3]) / (2.0 * step)
    solid_angle = np.linalg.norm(np.cross(du, dv), axis=1)
    ratio = (share_of(name, scene, points) / solid_angle / middle[:, 8])[valid]
    assert valid.mean() > 0.9 or "spread" in name or "spot" in name
    # Differences lose their digits on a distant lamp.
    np.testing.assert_allclose(ratio, 1.0, rtol=1e-2 if name == "area distant" else 1e-4)


def test_directions_keep_their_precision():
    """A point on the world is as exact as single precision in all parts of the sphere."""
    scene = sky()
    points, samples = keep(scene, (0, 0, 0), 5000)
    placed = place(scene, (1, 2, 3), points)
    assert np.abs(placed[:, :3] - samples[:, :3]).max() < 2e-7


def test_limits_hold_for_points():
    lamp = point_lamp(ABOVE, WHITE, 0.5, seen_by=rec.RAY_ALL & ~rec.RAY_GLOSSY, casts_shadow=False)
    scene = lamp_scene(lamp)
    points, _ = keep(scene, (0, 0, 0), 4)
    placed = place(scene, (0, 0, 0), points)
    assert (placed[:, 7] == rec.LIGHT_SAMPLE_NO_SHADOW).all()
    assert not (placed[:, 9].astype(int) & rec.RAY_GLOSSY).any()
    scene = lamp_scene(LAMPS["area rectangle"])
    points, _ = keep(scene, (0, 0, 0), 50)
    assert not place(scene, (0, 0, 5), points)[:, 10].any()  # from behind
