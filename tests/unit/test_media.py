"""Media against closed forms: extinction, emission, single scattering, furnaces, and which media count where."""

import math
from dataclasses import replace

import numpy as np
import pytest

from restir_engine.kernels.core.records import MAX_MEDIA
from restir_engine.reuse_settings import ReuseSettings
from restir_engine.scene.lamps import point_lamp, sun_lamp
from testing.scenes.lights import matrix
from testing.scenes.media import along_y, cube, medium, picture, stage
from testing.scenes.rooms import WHITE, diffuse, look, render, scaled
from testing.scenes.shapes import QUAD

SIGMA = np.array([0.2, 1.0, 3.0])


def test_absorption_alone_is_beers_law():
    b = stage()
    cube(b, medium(absorption=SIGMA))
    assert picture(b) == pytest.approx(np.broadcast_to(np.exp(-2.0 * SIGMA), (8, 8, 3)), rel=1e-5)


def test_emission_is_gathered_with_its_own_extinction():
    b = stage(world=0.0)
    cube(b, medium(absorption=(0.0, 1.0, 3.0), emission=(0.1, 0.2, 0.3)))
    expected = [0.2, 0.2 * (1.0 - math.exp(-2.0)), 0.1 * (1.0 - math.exp(-6.0))]
    assert picture(b) == pytest.approx(np.broadcast_to(expected, (8, 8, 3)), rel=1e-5)


@pytest.mark.parametrize("g", [0.0, 0.5])
def test_single_scattering_of_a_sun_from_above(g):
    """L(z) = σ_s p(0) E exp(-σ_t (1 - z)) (1 - exp(-2 σ_t)) / σ_t, seen along y; pixels vary by 0.7 %."""
    b = stage(world=0.0)
    b.lamp(sun_lamp(matrix(axis=(0.0, 0.0, 1.0)), 2.0 * WHITE, 0.0))
    scattering = np.array([0.3, 0.8, 2.0])
    absorption = np.array([0.2, 0.0, 1.0])
    cube(b, medium(absorption, scattering, g=g))
    image = picture(b, 1024, max_bounces=0, volume_bounces=0)
    z = np.linspace(-0.8, 0.8, 9)
    sigma = absorption + scattering
    phase = (1.0 - g * g) / (4.0 * math.pi * (1.0 + g * g) ** 1.5)
    # The mean over a pixel of exp(-σ (1 - z)).
    fall = np.diff(np.exp(-sigma * (1.0 - z[:, None])), axis=0) / (sigma * 0.2)
    expected = 2.0 * scattering * phase * fall * (1.0 - np.exp(-2.0 * sigma)) / sigma
    assert image.mean(1) == pytest.approx(expected, rel=0.03)
    assert image.mean((0, 1)) == pytest.approx(expected.mean(0), rel=0.01)


@pytest.mark.parametrize("glass", [None, (0.0, 1.5), (0.1, 1.3)])
def test_what_only_scatters_is_invisible_in_a_furnace(glass):
    b = stage()
    cube(b, medium(scattering=(0.5, 2.0, 4.0), g=0.3, glass=glass))
    image = picture(b, 64)
    error = image.std((0, 1)) / 8.0
    assert np.all(np.abs(image.mean((0, 1)) - 1.0) <= 4.0 * error + 0.005)
    assert np.all(error < 0.02)


def test_light_that_crosses_a_channel_without_scattering_is_not_lost():
    """Red is absorbed only while the others scatter much: the choice of the channel must still let it through."""
    b = stage(world=(1.0, 0.0, 0.0))
    cube(b, medium(absorption=(0.1, 0.0, 0.0), scattering=(0.0, 8.0, 8.0)))
    red = picture(b, 256)[:, :, 0]
    assert red.mean() == pytest.approx(math.exp(-0.2), rel=0.02)


def overlapping(*priorities) -> np.ndarray:
    """Three cubes along y, from -1 to 1, -0.5 to 1.5 and 0 to 0.4, with σ = 1, 2, 4, in the middle of the image."""
    b = stage()
    for sigma, (low, high), priority in zip((1.0, 2.0, 4.0), ((-1, 1), (-0.5, 1.5), (0, 0.4)), priorities, strict=True):
        size = ((1.0), 0.5 * (high - low), 1.0)
        cube(b, medium(absorption=sigma, priority=priority), (0.0, 0.5 * (low + high), 0.01 * sigma), size)
    return -np.log(picture(b).mean((0, 1)))


def test_media_of_the_same_priority_add_up():
    assert overlapping(0, 0, 0) == pytest.approx(np.full(3, 2.0 + 4.0 + 1.6), rel=1e-4)


def test_media_of_the_highest_priority_count_alone():
    assert overlapping(2, 1, 0) == pytest.approx(np.full(3, 2.0 + 0.5 * 2.0), rel=1e-4)
    assert overlapping(0, 1, 2) == pytest.approx(np.full(3, 0.5 + 1.6 * 2.0 + 1.6), rel=1e-4)
    assert overlapping(0, 0, 1) == pytest.approx(np.full(3, 1.6 + 1.6 * 2.0 + 1.6), rel=1e-4)


def test_glass_inside_a_medium_of_higher_priority_is_not_seen_by_paths_nor_by_shadow_rays():
    b = stage(world=0.0)
    b.lamp(sun_lamp(matrix(axis=(0.0, 0.0, 1.0)), 2.0 * WHITE, 0.0))
    cube(b, medium(scattering=0.5, priority=1))
    plain = picture(b, 256, max_bounces=0, volume_bounces=0)
    b = stage(world=0.0)
    b.lamp(sun_lamp(matrix(axis=(0.0, 0.0, 1.0)), 2.0 * WHITE, 0.0))
    cube(b, medium(scattering=0.5, priority=1))
    cube(b, medium(absorption=5.0, glass=(0.0, 1.5)), size=0.5)
    assert picture(b, 256, max_bounces=0, volume_bounces=0).mean() == pytest.approx(plain.mean(), rel=0.02)


def test_a_camera_inside_starts_in_the_medium():
    b = stage()
    cube(b, medium(absorption=SIGMA))
    cube(b, medium(absorption=1.0), (0.0, 0.0, 3.0), 0.5)  # above: the ray upwards enters and leaves it
    camera = replace(along_y(y=0.0), clip_start=0.5)
    assert picture(b, camera=camera) == pytest.approx(np.broadcast_to(np.exp(-0.5 * SIGMA), (8, 8, 3)), rel=1e-4)


def test_as_many_nested_media_count_as_are_kept():
    b = stage()
    for k in range(MAX_MEDIA + 2):
        cube(b, medium(absorption=0.1), size=1.0 - 0.05 * k)
    kept = sum(2.0 * (1.0 - 0.05 * k) for k in range(MAX_MEDIA))
    inner = picture(b, camera=along_y(0.4))
    assert -np.log(inner.mean()) == pytest.approx(0.1 * kept, rel=1e-4)
    assert any("Volume" in line and "overlap" in line for line in b.scene.warnings.lines())


@pytest.mark.parametrize("integrator", ["PATH", "RESTIR"])
def test_as_many_media_as_are_kept_are_no_reason_to_warn(integrator):
    b = stage()
    for k in range(MAX_MEDIA):
        cube(b, medium(absorption=0.1), size=1.0 - 0.05 * k)
    picture(b, camera=along_y(0.4, y=0.0), integrator=integrator)
    assert not b.scene.warnings.lines()


def test_restir_finds_the_media_around_its_vertices():
    """A floor inside of a medium, behind an invisible boundary and lit by resampling; means within three errors."""

    def image(integrator: str, seed: int) -> np.ndarray:
        b = stage(world=0.2)
        b.lamp(point_lamp(matrix((0.5, -0.3, 2.0)), 40.0 * WHITE, 0.2))
        cube(b, medium(absorption=(0.1, 0.3, 0.6), scattering=(0.2, 0.1, 0.1)))
        b.add(QUAD, diffuse((0.8, 0.7, 0.6)), scaled(matrix((0.0, 0.0, -0.5)), 0.9, 0.9, 1.0))
        scene = b.finish(look((0.3, -3.0, 1.6), (0.0, 0.0, -0.4), 16))
        tiles = ReuseSettings(pilot=False)
        return render(scene, 32, integrator=integrator, reuse=tiles, seed=seed, volume_bounces=2).mean((0, 1))

    path, restir = (np.stack([image(name, seed) for seed in range(4)]) for name in ("PATH", "RESTIR"))
    error = np.hypot(*(x.std(0, ddof=1) / 2.0 for x in (path, restir)))
    assert np.all(np.abs(path.mean(0) - restir.mean(0)) < 4.0 * error + 0.002)
    assert np.all(error < 0.02 * path.mean(0))
