"""RESTIR takes light tiles where they pay: what is chosen, and that no clock or thread has a say in it."""

from dataclasses import replace

import numpy as np
import pytest

from restir_engine.context import FrameContext
from restir_engine.film import Film
from restir_engine.integrators.path import PathIntegrator
from restir_engine.integrators.restir import choice
from restir_engine.integrators.restir.integrator import RestirIntegrator
from restir_engine.reuse_settings import ReuseSettings
from restir_engine.scene.camera import Camera
from restir_engine.settings import RenderSettings, required_passes
from testing.scenes.interiors import interior
from testing.scenes.rooms import picture_scene, render

SETTINGS = RenderSettings(integrator="RESTIR", samples=256, max_bounces=2)


def integrator(light: str, settings: RenderSettings = SETTINGS):
    context = FrameContext(picture_scene(light))
    width, height = context.camera.film_size
    return choice.integrator_of(context, settings, Film(width, height, required_passes(settings.passes, False)))


@pytest.mark.parametrize(
    ("light", "kind"),
    [("area", PathIntegrator), ("sun", PathIntegrator), ("many", RestirIntegrator)],
)
def test_what_is_best_for_a_scene(light, kind):
    """One lamp needs no trial; of two suns light samples of PATH are better, of 40 lamps those of tiles."""
    assert type(integrator(light)) is kind


@pytest.mark.parametrize(("scene", "paths"), [("doorway", "WHOLE"), ("area", "DIRECT")])
def test_whole_paths_are_reused_where_it_pays(scene, paths):
    """Light through a doorway is found by few: reuse has a fifth of PATH's error in the same time; not where a lamp is
    seen from everywhere, nor in short renders or in pictures that are denoised."""
    context = FrameContext(interior(scene, 128) if scene == "doorway" else picture_scene(scene, 128))
    film = Film(128, 128, required_passes(SETTINGS.passes, False))
    found = choice.integrator_of(context, replace(SETTINGS, max_bounces=12), film)
    assert type(found) is (RestirIntegrator if paths == "WHOLE" else PathIntegrator)
    assert found.settings.reuse.paths == paths
    for changes in ({"samples": 128}, {"use_denoising": True}):
        assert type(choice.integrator_of(context, replace(SETTINGS, **changes), film)) is PathIntegrator


def test_paths_are_tried_in_blocks_all_over_the_picture():
    tiles = np.array(choice.blocks(Camera(width=1920, height=1080)))
    assert len(tiles) == pytest.approx(choice.BLOCKS, abs=4)
    assert (tiles % choice.BLOCK == 0).all() and (tiles[:, 2:] - tiles[:, :2] == choice.BLOCK).all()
    assert tiles[:, 2].max() <= 1920 and tiles[:, 3].max() <= 1080
    counts, _, _ = np.histogram2d(tiles[:, 0], tiles[:, 1], bins=2, range=[(0, 1920), (0, 1080)])
    assert counts.min() >= 4


def test_one_lamp_has_no_trial_in_a_short_render(monkeypatch):
    monkeypatch.setattr(choice, "compare", None)
    assert type(integrator("area")) is PathIntegrator


@pytest.mark.parametrize(
    "changes",
    [
        {"reuse": ReuseSettings(pilot=False)},
        {"reuse": ReuseSettings(rounds=1)},
        {"reuse": ReuseSettings(temporal=True)},
        {"samples": 8},
        {"time_limit": 0.01},
        {"passes": frozenset({"Combined", "Visibility Estimate"})},
    ],
)
def test_where_samples_are_reused_or_few_nothing_is_tried(changes, monkeypatch):
    monkeypatch.setattr(choice, "compare", None)
    assert type(integrator("many", replace(SETTINGS, **changes))) is RestirIntegrator


def test_a_trial_finds_what_is_noisier_in_the_same_time():
    """Of 40 lamps, tiles leave less than a third of PATH's variance, which is more than they cost."""
    context = FrameContext(picture_scene("many", 40))
    path, tiles, fewer = choice.compare(context, SETTINGS)
    assert tiles < path / 3.0 and tiles < fewer < path


def test_a_picture_does_not_depend_on_threads():
    scene = picture_scene("many", 48)
    one, other = (render(scene, 128, threads=threads, integrator="RESTIR", max_bounces=1) for threads in (1, 3))
    np.testing.assert_array_equal(one, other)


def test_the_small_picture_shows_what_the_large_one_does():
    camera = Camera(width=1920, height=1080, region=(480, 270, 960, 540))
    small = choice.smaller(camera, 1250)
    x, y, width, height = small.region
    assert width * height == pytest.approx(1250, rel=0.05) and width / height == pytest.approx(16 / 9, rel=0.05)
    assert (x / small.width, y / small.height) == pytest.approx((0.25, 0.25), abs=0.02)
    assert choice.smaller(Camera(width=20, height=10), 1250).film_size == (20, 10)
