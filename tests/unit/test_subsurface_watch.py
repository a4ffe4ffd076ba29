"""Passes that tell what reuse of subsurface light has done: they are what they say, and change nothing."""

import numpy as np
import pytest

from restir_engine.reuse_settings import ReuseSettings
from restir_engine.session import Session
from restir_engine.settings import RenderSettings
from testing.scenes.translucent import translucent

PASSES = frozenset({"Combined", "Subsurface Shift", "Subsurface Reuse"})


@pytest.fixture(scope="module")
def scene():
    return translucent(size=40)


def rendered(scene, shift: str, passes=PASSES) -> Session:
    """A session after two samples."""
    settings = {"sss_method": "DIFFUSION", "sss_shift": shift, "reuse": ReuseSettings(pilot=False), "max_bounces": 0}
    session = Session(scene, RenderSettings("RESTIR", 2, seed=3, threads=1, passes=passes, **settings))
    assert session.render()
    return session


@pytest.mark.parametrize("shift", ["RECONNECTION", "DELAYED", "SEQUENTIAL"])
def test_passes_tell_which_shift_won(shift, scene):
    film = rendered(scene, shift).film
    own, kept, found_again, there = np.moveaxis(film.pass_array("Subsurface Shift"), -1, 0)
    np.testing.assert_allclose(own + kept + found_again, there, atol=1e-6)
    seen = there > 0.0
    assert 0.1 < seen.mean() < 0.9
    assert (0.01 < own[seen].mean() < 0.9) and there.max() == 1.0
    assert (kept.sum() > 0.0) == (shift != "DELAYED")
    assert (found_again.sum() > 0.0) == (shift != "RECONNECTION")
    confidence, succeed, radius = np.moveaxis(film.pass_array("Subsurface Reuse"), -1, 0)
    inside = there == 1.0
    assert confidence[inside].min() >= 1.0 and 3.0 < confidence[inside].mean() < 90.0
    assert succeed.min() >= 0.0 and succeed.max() <= 1.0 and 0.2 < succeed[inside].mean() < 0.99
    assert radius[inside].min() >= 5.0 and radius.max() <= 30.0
    unwatched = rendered(scene, shift, frozenset({"Combined"})).film.pass_array("Combined")
    np.testing.assert_array_equal(unwatched, film.pass_array("Combined"))


def test_without_a_shift_they_are_empty_and_a_warning_says_so(scene):
    session = rendered(scene, "AUTO")
    assert not session.film.pass_array("Subsurface Shift").any()
    assert any("Subsurface Reuse" in line for line in session.scene.warnings.lines())
