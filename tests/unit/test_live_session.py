"""A live session renders the latest of its requests, on a thread of its own."""

from dataclasses import replace

import numpy as np
import pytest

from restir_engine.live_session import LiveSession, in_motion
from restir_engine.pace import COARSEST, FIRST, Pace
from restir_engine.scene.lamps import point_lamp
from restir_engine.scene.plain import plain_picture
from restir_engine.scene.trees import Trees
from restir_engine.session import Session
from restir_engine.settings import RenderSettings
from restir_engine.upscale import guide_of, upscaled
from testing.scenes.lights import matrix
from testing.scenes.rooms import Builder, diffuse, look, scaled
from testing.scenes.shapes import QUAD

SIZE = 48
SETTINGS = RenderSettings(samples=4, max_bounces=0, seed=3, threads=1)


def room_description(power: float = 100.0):
    """A floor under a lamp."""
    b = Builder()
    b.add(QUAD, diffuse((0.6, 0.5, 0.4)), scaled(matrix(), 3.0, 3.0, 1.0))
    b.lamp(point_lamp(matrix((0.5, 0.0, 1.5)), (power, power, power), 0.1))
    return b.describe(view(0))


def scene_of(power: float = 100.0):
    return room_description(power).commit()


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
    session = Session(scene_of(), replace(settings, seed=3 + live._sessions - 1))  # coarse ones have had those before
    session.render()
    np.testing.assert_array_equal(live.picture, session.combined())
    assert "4/4" in live.line


def test_what_moves_is_seen_coarsely_first_and_then_in_full(live):
    """The camera's last place is what is seen in the end, in the picture that an own session makes of it."""
    scene = scene_of()
    live.show(scene, SETTINGS, view(0))
    live.wait(300.0)
    sizes = []
    chosen = live._coarse
    live._coarse = lambda *args, **how: (chosen(*args, **how), sizes.append(args[2]))
    for step in range(1, 5):
        live.show(scene, SETTINGS, view(step))
    assert live.wait(300.0)
    assert sizes and all(1 <= step <= COARSEST for step in sizes)
    assert live.picture.shape == (SIZE, SIZE, 4)

    def off(step: int) -> float:
        session = Session(scene, RenderSettings(samples=64, max_bounces=0, threads=1), view(step))
        session.render()
        return float(np.abs(np.minimum(live.picture, 1.0) - np.minimum(session.combined(), 1.0)).mean())

    assert off(4) < 0.3 * off(0)


@pytest.mark.parametrize("shift", ["AUTO", "RECONNECTION"], ids=["indirect", "direct"])
@pytest.mark.parametrize("edited, step", [(False, 0), (False, 1), (True, 0)], ids=["nothing", "camera", "lamp"])
def test_pictures_in_motion_resample_the_one_before(live, edited, step, shift):
    """The second coarse picture's samples stand for more than the candidates of a frame, a pixel's and its neighbors'.

    Unless a lamp has changed, and what is kept of indirect light is what it was before.
    """
    settings = RenderSettings(samples=1, max_bounces=1, threads=1, integrator="RESTIR", sss_shift=shift)
    live._pace.choose = lambda pixels: live._pace.step  # what a pixel costs here is no matter
    scene = scene_of()
    for scene_now, camera in ((scene, view(0)), (scene_of(200.0) if edited else scene, view(step))):
        live.show(scene_now, settings, camera)
        live.wait(300.0)
    history = live._last[2]
    moving = in_motion(settings)
    assert moving.reuse.paths == ("INDIRECT" if shift == "AUTO" else "DIRECT")
    assert history.serves((moving.reuse, moving.sss_shift, moving.sss_method, moving.sss_refraction))
    most, fresh = history.before.frame.reservoirs["confidence"].max(), 1.0 + moving.reuse.neighbours
    assert most <= fresh if edited and shift == "AUTO" else most > fresh


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


def test_a_newer_request_ends_at_once_what_nobody_will_see(live):
    """It does not wait for the next look at the cancel flag."""
    scene, endless = scene_of(), 1 << 20
    live.show(scene, RenderSettings(samples=endless, max_bounces=0, threads=1), view(0))
    while not (passing := live._passing) or passing.settings.samples != endless:
        assert not live.wait(0.01)
    live.show(scene, SETTINGS, view(1))
    assert passing.cancelled


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


def test_pictures_in_motion_are_as_fine_as_their_time_allows():
    pace, pixels = Pace(0.1), 1_000_000
    assert pace.choose(pixels) == FIRST
    pace.took(10_000, 0.1)  # 10 µs each: 10,000 pixels in time, a hundredth of all
    assert pace.choose(pixels) == 10
    for _ in range(20):
        pace.took(10_000, 0.0101)
    assert pace.choose(pixels) == 4
    for _ in range(20):
        pace.took(10_000, 0.0105)  # a little more does not make it coarser and finer in turn
        assert pace.choose(pixels) == 4
    for _ in range(20):
        pace.took(10_000, 1e-5)
    assert pace.choose(pixels) == 1
    for _ in range(20):
        pace.took(100, 100.0)
    assert pace.choose(pixels) == COARSEST


def test_a_region_is_shown_where_it_lies(live):
    camera = replace(view(0), region=(12, 6, 20, 10))
    live.show(scene_of(), SETTINGS, camera, (0.0, 0.0, 1.0, 1.0))
    assert live.wait(300.0)
    assert live.picture.shape == (10, 20, 4)
    assert live.shown.rectangle == (0.25, 0.125, 32 / SIZE, 16 / SIZE)


def test_coarser_pixels_have_the_region_inside():
    for step in range(1, 9):
        camera = replace(view(0), width=101, height=67, region=(13, 7, 31, 23))
        ours, coarse = camera.rectangle, camera.coarser(step).rectangle
        assert coarse[0] <= ours[0] and coarse[1] <= ours[1] and coarse[2] >= ours[2] and coarse[3] >= ours[3]
        assert coarse[2] - coarse[0] < ours[2] - ours[0] + 2.1 * step / 67
    assert camera.coarser(1).same_as(camera)


def test_edges_stay_where_they_are():
    """A floor before black: coarse pixels of two values come out as two values, parted where the finer guide says."""
    scene, fine = scene_of(), replace(view(0), width=96, height=96)
    coarse = fine.coarser(8)
    session = Session(scene, replace(SETTINGS, samples=16, film_transparent=True), fine)
    session.render()
    seen = session.combined()[..., 3]
    small = Session(scene, replace(SETTINGS, samples=64, film_transparent=True), coarse)
    small.render()
    there = small.combined()[..., 3] > 0.5
    picture = np.repeat(there[..., None].astype(np.float32), 4, 2)
    found = upscaled(picture, coarse, fine, guide_of(scene, fine, 1), 1)[..., 3]
    inside = (seen == 0.0) | (seen == 1.0)
    blocks = np.kron(there, np.ones((8, 8)))
    off, off_in_blocks = (np.abs(each - seen)[inside].mean() for each in (found, blocks))
    assert off < 0.2 * off_in_blocks


def test_a_plain_picture_shows_shapes_without_compiled_code():
    """As Embree's kernels see them: what is hit is grey, the rest is dark."""
    description = room_description()
    picture = plain_picture(description, view(0), Trees(instanced=True))
    assert picture.shape == (SIZE, SIZE, 4)
    session = Session(description, replace(SETTINGS, samples=1, film_transparent=True))
    session.render()
    alpha = session.combined()[..., 3]
    assert ((picture[..., 0] > 0.1) == (alpha > 0.5)).mean() > 0.97
