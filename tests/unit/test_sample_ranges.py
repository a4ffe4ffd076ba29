"""Ranges of samples: together they are what one render of all samples takes."""

import numpy as np
import pytest

from restir_engine.reuse_settings import ReuseSettings
from restir_engine.scene.errors import SceneError
from restir_engine.session import Session
from restir_engine.settings import RenderSettings
from testing.scenes.rooms import picture_scene

METHODS = {"PATH": {"integrator": "PATH"}, "RESTIR": {"integrator": "RESTIR", "reuse": ReuseSettings(pilot=False)}}


@pytest.fixture(scope="module")
def scene():
    return picture_scene("point", 40)


def rendered(scene, **settings) -> Session:
    session = Session(scene, RenderSettings(max_bounces=3, **settings))
    assert session.render()
    return session


def test_ranges_have_no_gap_and_no_overlap_whatever_the_samples_of_a_view_layer():
    for samples in (2, 64, 100, 333):
        parts = [RenderSettings(samples=samples, sample_offset=k, sample_subset=32, scene_samples=100)
                 for k in range(0, 100, 32)]  # fmt: skip
        assert [n for part in parts for n in part.sample_range] == list(range(samples))
        assert all(part.is_part for part in parts)
    assert not RenderSettings(samples=64, sample_subset=64).is_part
    assert RenderSettings(samples=64, sample_offset=48).sample_range == range(48, 64)


def test_a_range_beyond_the_samples_is_a_sentence_that_says_what_to_do():
    RenderSettings(samples=64, sample_offset=63).require_samples()
    with pytest.raises(SceneError, match="begins after 64, but there are 64: lower Offset or raise Samples"):
        RenderSettings(samples=64, sample_offset=64).require_samples()


def added(scene, **settings) -> np.ndarray:
    """What three ranges of 24 samples add up to."""
    parts = [rendered(scene, samples=24, sample_offset=k, sample_subset=8, **settings) for k in (0, 8, 16)]
    assert [part.film.samples for part in parts] == [8, 8, 8]
    return sum(part.film.pixels for part in parts)


def test_ranges_of_path_add_up_to_one_render(scene):
    whole = rendered(scene, samples=24, **METHODS["PATH"]).film.pixels
    np.testing.assert_allclose(added(scene, **METHODS["PATH"]), whole, rtol=1e-4, atol=1e-4)


def test_ranges_of_restir_add_up_to_one_render_but_for_what_it_has_learned(scene):
    """Of the same random numbers; control variates go by the visibility that earlier samples of the range have met."""
    whole, other = (rendered(scene, samples=24, seed=seed, **METHODS["RESTIR"]).film.pixels for seed in (0, 1))
    parts = added(scene, **METHODS["RESTIR"])
    assert parts.mean() == pytest.approx(whole.mean(), rel=0.003)
    assert np.abs(parts - whole).mean() < 0.3 * np.abs(other - whole).mean()


def test_a_view_layer_without_samples_in_a_range_is_an_empty_picture(scene):
    session = rendered(scene, samples=2, sample_offset=0, sample_subset=25, scene_samples=100)
    assert session.is_valid and session.film.samples == 0 and not session.combined()[..., :3].any()


def test_a_range_takes_its_share_of_the_time_and_of_the_noise(scene):
    """Merged, pixels have about the samples and the error of one render with the same threshold."""
    settings = {"samples": 256, "use_adaptive_sampling": True, "adaptive_threshold": 0.05, **METHODS["PATH"]}
    whole = rendered(scene, **settings)
    parts = [rendered(scene, **settings, sample_offset=k, sample_subset=64) for k in range(0, 256, 64)]
    counts = sum(part.film.counts for part in parts)
    assert counts.mean() == pytest.approx(whole.film.counts.mean(), rel=0.15)
    assert Session(scene, RenderSettings(samples=256, sample_subset=64, time_limit=8.0))._time_limit == 2.0
