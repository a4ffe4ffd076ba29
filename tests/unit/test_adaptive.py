"""Adaptive sampling: the variance that it goes by, which pixels are done, and what becomes of the film."""

import numpy as np
import pytest

from restir_engine.adaptive import REACH, Convergence, half_size, min_samples
from restir_engine.film import Film
from restir_engine.reuse_settings import ReuseSettings
from restir_engine.session import Session
from restir_engine.settings import RenderSettings, required_passes
from testing.scenes.rooms import picture_scene

METHODS = {"PATH": {"integrator": "PATH"}, "RESTIR": {"integrator": "RESTIR", "reuse": ReuseSettings(pilot=False)}}
SETTINGS = {"use_adaptive_sampling": True, "adaptive_threshold": 0.1, "max_bounces": 2, "samples": 256}


def converge(deviation: np.ndarray, most: int, threshold: float = 0.02, seed: int = 1) -> tuple[Film, Convergence]:
    """Sample a film whose pixels have the mean 1 and a standard deviation (height, width), until all are done."""
    film = Film(deviation.shape[1], deviation.shape[0], required_passes(frozenset(), False))
    settings = RenderSettings(use_adaptive_sampling=True, adaptive_threshold=threshold, adaptive_min_samples=16)
    convergence = Convergence(film, settings)
    random = np.random.default_rng(seed)
    done = False
    while not done and film.samples < most:
        n = min(convergence.left, most - film.samples)
        values = n + np.sqrt(n) * deviation[..., None] * random.normal(size=(*deviation.shape, 3))
        film.sums("Combined")[..., :3] += np.where(film.active[..., None], values, 0.0)
        film.add_samples(n)
        done = convergence.add()
    return film, convergence


def test_variance_is_that_of_the_mean():
    deviation = np.full((40, 40), 0.5)
    film, convergence = converge(deviation, 256, threshold=1e-4)
    assert film.samples == 256
    estimate = convergence.variance()
    # Five pairs, 4,800 values: a relative standard error of √(2 / (5 · 4800)) or a little more, as pairs are unlike.
    assert estimate.mean() == pytest.approx(0.25 / 256, rel=0.04)
    means = film.sums("Combined")[..., :3] / 256
    assert means.var() == pytest.approx(estimate.mean(), rel=0.1)


def test_pixels_get_samples_by_their_variance():
    """Four times the deviation, sixteen times the samples, but for the steps in which they are looked at."""
    deviation = np.full((32, 64), 0.1)
    deviation[:, 32:] = 0.4
    film, _ = converge(deviation, 4096)
    smooth, noisy = film.counts[:, : 32 - 8].mean(), film.counts[:, 32 + 8 :].mean()
    # The error √(2/π) · 3 s / √3 is below 0.02 where n > (69.1 deviation)²: 48 and 764.
    assert 48 * 0.8 < smooth < 48 * 1.6 and 764 * 0.8 < noisy < 764 * 1.6
    assert film.samples == film.counts.max() < 4096


def test_what_is_near_a_noisy_pixel_is_sampled_on():
    deviation = np.zeros((21, 21))
    deviation[10, 10] = 50.0
    film, _ = converge(deviation, 64)
    reach = REACH + 1
    assert (film.counts[10 - reach : 11 + reach, 10 - reach : 11 + reach] == 64).all()
    assert film.counts[0, 0] == 16


def test_halves_grow_with_the_samples():
    assert [half_size(n) for n in (0, 16, 64, 128, 200, 1024)] == [8, 8, 8, 16, 16, 128]
    assert min_samples(0.01, 0) == 64 and min_samples(0.01, 5) == 5 and min_samples(1.0, 0) == 16


@pytest.fixture(scope="module")
def scene():
    return picture_scene("point", 40)


def rendered(scene, threads: int = 2, **settings) -> Session:
    session = Session(scene, RenderSettings(threads=threads, **settings))
    assert session.render()
    return session


@pytest.mark.parametrize("method", METHODS)
def test_smooth_parts_of_a_picture_get_fewer_samples(scene, method):
    session = rendered(scene, **METHODS[method], **SETTINGS, passes=frozenset({"Combined", "Debug Sample Count"}))
    counts = session.film.pass_array("Debug Sample Count")[..., 0]
    assert counts.min() == 32 and counts.mean() < 0.6 * SETTINGS["samples"]  # 32: by the threshold
    whole = rendered(scene, **METHODS[method], **SETTINGS | {"use_adaptive_sampling": False, "seed": 5})
    assert (whole.film.pass_array("Debug Sample Count") == SETTINGS["samples"]).all()
    noise = np.abs(session.combined() - whole.combined())[..., :3].mean(-1)
    assert noise[counts == 32].mean() < noise[counts > 64].mean()
    # Each pixel is divided by its own samples: the means agree, by a standard error of 0.4 % and a bias of less.
    assert session.combined()[..., :3].mean() == pytest.approx(whole.combined()[..., :3].mean(), rel=0.015)


@pytest.mark.parametrize("method", METHODS)
def test_who_is_done_does_not_depend_on_threads_or_time(scene, method, monkeypatch):
    settings = METHODS[method] | SETTINGS | {"samples": 64}
    one = rendered(scene, 1, **settings)
    monkeypatch.setattr("restir_engine.session.BATCH_SECONDS", 0.001)
    other = rendered(scene, 3, **settings)
    np.testing.assert_array_equal(one.film.counts, other.film.counts)
    assert one.film.counts.min() < 64
    np.testing.assert_allclose(one.combined(), other.combined(), rtol=1e-5, atol=1e-6)


def test_a_cancelled_render_is_divided_by_what_was_finished(scene):
    session = Session(scene, RenderSettings(threads=1, **METHODS["PATH"], **SETTINGS | {"adaptive_threshold": 1e-4}))
    session.render(on_frame=lambda s: s.cancel() if s.film.samples >= 24 else None)
    assert (session.film.counts == session.film.samples).all()
    plain = rendered(
        scene, **METHODS["PATH"], **SETTINGS | {"use_adaptive_sampling": False, "samples": session.film.samples}
    )
    np.testing.assert_allclose(session.combined(), plain.combined(), rtol=1e-4, atol=1e-5)


def test_passes_of_a_pixel_are_divided_by_its_own_samples(scene):
    """Light passes that are not divided by a colour add up to Combined, whatever a pixel's number of samples."""
    names = frozenset({"Combined", "Emission", "Environment", "Normal"})
    session = rendered(scene, **METHODS["PATH"], **SETTINGS | {"samples": 96}, passes=names)
    assert session.film.counts.min() < 96
    normals = session.film.pass_array("Normal")
    floor = session.film.counts == 96, session.film.counts < 96
    lengths = np.linalg.norm(normals, axis=2)
    assert all(np.median(lengths[part]) == pytest.approx(1.0, abs=0.02) for part in floor)
