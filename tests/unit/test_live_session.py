"""A live session renders the latest of its requests, on a thread of its own."""

from dataclasses import replace

import numpy as np
import pytest

from restir_engine.live_session import SMALL, LiveSession, in_motion
from restir_engine.scene.lamps import point_lamp
from restir_engine.session import Session
from restir_engine.settings import RenderSettings
from testing.scenes.lights import matrix
from testing.scenes.rooms import Builder, diffuse, look, scaled
from testing.scenes.shapes import QUAD

SIZE = 48
SETTINGS = RenderSettings(samples=4, max_bounces=0, seed=3, threads=1)


def scene_of(power: float = 100.0):
    """A floor under a lamp."""
    b = Builder()
    b.add(QUAD, diffuse((0.6, 0.5, 0.4)), scaled(matrix(), 3.0, 3.0, 1.0))
    b.lamp(point_lamp(matrix((0.5, 0.0, 1.5)), (power, power, power), 0.1))
    return b.finish(view(0))


def view(step: int):
    return look((0.3 * step, -3.0, 2.0), (0.0, 0.0, 0.0), SIZE)


@pytest.fixture
def live():
    session = LiveSession()
    yield session
    session.close()


@pytest.mark.parametrize("integrator", ["PATH", "RESTIR"])
def test_renders_what_a_session_does(live, integrator):
    settings = RenderSettings(samples=4, max_bounces=0, seed=3, threads=1, integrator=integrator)
    live.show(scene_of(), settings, view(0))
    assert live.wait(300.0)
    assert live.error is None
    session = Session(scene_of(), replace(settings, seed=4))  # the small frame has had the first seed
    session.render()
    np.testing.assert_array_equal(live.picture, session.combined())
    assert "4/4" in live.line


def test_what_moves_is_seen_in_small_first_and_then_in_full(live):
    """The camera's last place is what is seen in the end, in the picture that an own session makes of it."""
    scene = scene_of()
    live.show(scene, SETTINGS, view(0))
    live.wait(300.0)
    sizes = []
    keep = live._keep
    live._keep = lambda session: (keep(session), sizes.append(session.film.width))
    for step in range(1, 5):
        live.show(scene, SETTINGS, view(step))
    assert live.wait(300.0)
    assert sizes[0] == SIZE // SMALL
    assert sizes[-1] == SIZE

    def off(step: int) -> float:
        session = Session(scene, RenderSettings(samples=64, max_bounces=0, threads=1), view(step))
        session.render()
        return float(np.abs(np.minimum(live.picture, 1.0) - np.minimum(session.combined(), 1.0)).mean())

    assert off(4) < 0.3 * off(0)


def test_frames_in_motion_resample_the_one_before(live):
    """The second small frame's samples stand for more than one frame of candidates."""
    scene = scene_of()
    settings = RenderSettings(samples=1, max_bounces=0, threads=1, integrator="RESTIR")
    for _ in range(2):
        live.show(scene, settings, view(0))
        live.wait(300.0)
    history = live._history[True]
    moving = in_motion(settings)
    assert history.serves((moving.reuse, moving.sss_shift, moving.sss_method))
    assert history.before.frame.reservoirs["confidence"].max() > 1.0


def test_another_scene_takes_the_place_of_the_first(live):
    settings = RenderSettings(samples=8, max_bounces=0, threads=1, integrator="RESTIR")
    live.show(scene_of(), settings, view(0))
    live.wait(300.0)
    before = live.picture.mean()
    live.show(scene_of(200.0), settings, view(0))
    live.wait(300.0)
    assert live.error is None
    assert live.picture[..., :3].mean() > 1.3 * before


def test_a_newer_request_ends_the_one_before(live):
    """Nobody waits for a million samples."""
    scene = scene_of()
    live.show(scene, RenderSettings(samples=1 << 20, max_bounces=0, threads=1), view(0))
    while live.picture is None:
        assert not live.wait(0.05)
    live.show(scene, SETTINGS, view(1))
    assert live.wait(60.0)
    assert "4/4" in live.line


def test_an_error_is_kept_and_the_next_request_is_rendered(live, monkeypatch):
    def fail(self):
        raise RuntimeError("no light")

    with monkeypatch.context() as patch:
        patch.setattr(Session, "prepare", fail)
        live.show(scene_of(), SETTINGS, view(0))
        live.wait(60.0)
        assert "no light" in str(live.error)
    live.show(scene_of(), SETTINGS, view(0))
    live.wait(300.0)
    assert live.error is None
    assert live.picture.any()


def test_closing_ends_the_thread():
    live = LiveSession()
    live.show(scene_of(), RenderSettings(samples=1 << 20, max_bounces=0, threads=1), view(0))
    while live.picture is None:
        live.wait(0.05)
    live.close()
    live.close()
    live._thread.join(10.0)
    assert not live._thread.is_alive()
