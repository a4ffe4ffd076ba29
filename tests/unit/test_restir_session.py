"""A session of RESTIR: the same image on any number of threads, frames that are cancelled, the picture of V̄."""

import gc
import time
import weakref

import numpy as np
import pytest

from restir_engine import film as films
from restir_engine import session as sessions
from restir_engine.integrators.resampling.reuse import Reuse
from restir_engine.integrators.restir.integrator import RestirIntegrator
from restir_engine.reuse_settings import ReuseSettings
from restir_engine.scene.lamps import area_lamp
from restir_engine.session import Session
from restir_engine.settings import RenderSettings
from testing.scenes.interiors import interior
from testing.scenes.lights import matrix
from testing.scenes.rooms import Builder, diffuse, look, picture_scene, render, scaled
from testing.scenes.shapes import QUAD

SIZE = 72  # pixels: nine tiles, not all of the same size
REUSE = {"integrator": "RESTIR", "reuse": ReuseSettings(temporal=True, rounds=2), "seed": 3}
DISK = REUSE | {"reuse": ReuseSettings(temporal=True, rounds=2, pattern="DISK")}


@pytest.fixture(scope="module")
def scene():
    """So many lamps that there are light tiles."""
    return picture_scene("many", SIZE)


@pytest.fixture(scope="module")
def three_frames(scene):
    return render(scene, 3, threads=1, **REUSE)


@pytest.mark.parametrize(("threads", "tile"), [(2, 32), (5, 32), (3, 12)])
def test_an_image_does_not_depend_on_threads_or_tiles(scene, three_frames, monkeypatch, threads, tile):
    """Reuse in space and time, light tiles. A pass that writes what it reads differs in 1 to 72 %."""
    monkeypatch.setattr(films, "TILE", tile)
    np.testing.assert_array_equal(render(scene, 3, threads=threads, **REUSE), three_frames)


def test_pairs_and_disks_do_not_depend_on_tiles_of_a_size_that_no_block_divides(scene, three_frames, monkeypatch):
    """With tiles of 12 pixels some pairs are of two tiles, and their shifts are computed by either."""
    disk = render(scene, 3, threads=1, **DISK)
    monkeypatch.setattr(films, "TILE", 12)
    np.testing.assert_array_equal(render(scene, 3, threads=1, **DISK), disk)
    assert (disk != three_frames).any()


def test_frames_of_a_tile_are_those_of_the_picture(monkeypatch):
    """Where no sample leaves its block, a tile's steps follow each other, which changes nothing."""
    settings = REUSE | {"reuse": ReuseSettings(paths="WHOLE", rounds=2)}
    scene = interior("doorway", SIZE)
    by_tiles = render(scene, 2, threads=3, **settings)
    monkeypatch.setattr(Reuse, "block", 0)
    np.testing.assert_array_equal(by_tiles, render(scene, 2, threads=1, **settings))


def cancelled(scene, monkeypatch, step: str, frame: int) -> Session:
    """A session that is cancelled in a step of a frame, after its first tile."""
    session = Session(scene, RenderSettings(samples=8, threads=1, **REUSE))
    original = getattr(RestirIntegrator, step)

    def run(self, *args):
        original(self, *args)
        tile = args[-2]
        if self._sample == frame and tile[2]:
            session.cancel()
            time.sleep(3.0 * sessions.POLL)  # which the session notices before the next tile

    monkeypatch.setattr(RestirIntegrator, step, run)
    assert not session.render()
    return session


@pytest.mark.parametrize("step", ["_gbuffer", "_candidates", "_shade", "_film"])
def test_a_cancelled_frame_leaves_no_trace(scene, three_frames, monkeypatch, step):
    session = cancelled(scene, monkeypatch, step, 3)
    assert session.film.samples == 3
    np.testing.assert_array_equal(session.combined()[:, :, :3], three_frames)


def test_what_is_cancelled_before_it_reaches_the_film_is_no_picture(scene, monkeypatch):
    session = cancelled(scene, monkeypatch, "_shade", 0)
    assert session.film.samples == 0 and not session.film.pixels.any()


# The picture of V̄ ---------------------------------------------------------------------------------------------------


@pytest.fixture
def shadows():
    """A floor and a card above it, a reddish lamp on the left and a bluish one on the right."""
    b = Builder()
    b.add(QUAD, diffuse((0.7, 0.7, 0.7)), scaled(matrix(), 3.0, 3.0, 1.0))
    b.add(QUAD, diffuse((0.5, 0.5, 0.5)), scaled(matrix((0.0, 0.2, 0.5)), 0.35, 0.35, 1.0))
    b.lamp(area_lamp(matrix((-0.8, 0.0, 1.5), (-0.5, 0.0, 1.0)), (9.0, 0.5, 0.5), 0.3, 0.3))
    b.lamp(area_lamp(matrix((0.8, 0.0, 1.5), (0.5, 0.0, 1.0)), (0.5, 0.5, 9.0), 0.3, 0.3))
    return b.finish(look((0.0, -2.0, 2.2), (0.0, 0.2, 0.1), 24))


def visibility_pass(scene, **settings) -> tuple[np.ndarray, list[str]]:
    """(the pass, warnings)."""
    passes = frozenset({"Visibility Estimate"})
    session = Session(scene, RenderSettings(max_bounces=0, passes=passes, **settings))
    assert session.render()
    return session.film.pass_array("Visibility Estimate"), session.scene.warnings.lines()


@pytest.mark.parametrize("by_channel", [False, True])
def test_the_pass_is_the_mean_of_the_frames(shadows, monkeypatch, by_channel):
    seen = []
    original = RestirIntegrator._finish

    def finish(self):
        original(self)
        seen.append(self.visibility())

    monkeypatch.setattr(RestirIntegrator, "_finish", finish)
    reuse = ReuseSettings(visibility="ESTIMATED", by_channel=by_channel)
    image, warnings = visibility_pass(shadows, samples=4, integrator="RESTIR", reuse=reuse)
    assert not warnings and len(seen) == 4
    np.testing.assert_allclose(image[..., :3], np.nan_to_num(np.stack(seen)).mean(0), rtol=1e-5, atol=1e-7)
    np.testing.assert_allclose(image[..., 3], np.isfinite(np.stack(seen)).mean((0, 3)), rtol=1e-5)


def test_the_pass_shows_shadows_by_channel(shadows):
    """Under the lamp of one colour, where the card hides the other: V̄ by channel of the same light's places."""
    reuse = ReuseSettings(visibility="ESTIMATED", by_channel=True, light_samples=8)
    image, _ = visibility_pass(shadows, samples=16, integrator="RESTIR", reuse=reuse)
    v = image[..., :3] / np.maximum(image[..., 3:], 1e-6)
    assert image.min() >= 0.0 and image.max() <= 1.0 + 1e-6
    difference = v[..., 0] - v[..., 2]
    assert difference.max() > 0.7 and difference.min() < -0.7  # a shadow of each lamp
    lit = np.median(v, (0, 1))
    assert (lit > 0.9).all()


@pytest.mark.parametrize("settings", [{"integrator": "PATH"}, {"integrator": "RESTIR"}])
def test_where_nothing_is_estimated_the_pass_is_empty_and_says_why(shadows, settings):
    image, warnings = visibility_pass(shadows, samples=1, **settings)
    assert not image.any()
    assert any("Visibility Estimate" in line and "ReSTIR" in line for line in warnings)


# Tiles of their own ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("tile", [32, 12])
def test_a_tile_at_a_time_is_the_frame(scene, monkeypatch, tile):
    """Where no pixel looks at another: the same picture as by whole frames, in the memory of a few tiles."""
    settings = {"integrator": "RESTIR", "reuse": ReuseSettings(pilot=False), "seed": 3, "max_bounces": 2}
    monkeypatch.setattr(films, "TILE", tile)
    own = render(scene, 5, threads=2, **settings)
    original = RestirIntegrator.__init__

    def keep_whole(self, *args, **more):
        original(self, *args, **more)
        assert self.frame is None
        self.frame, self.max_batch = self._new_frame(), 1

    monkeypatch.setattr(RestirIntegrator, "__init__", keep_whole)
    np.testing.assert_array_equal(render(scene, 5, threads=2, **settings), own)


# Memory ---------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "settings",
    [
        {"integrator": "PATH"},
        {"integrator": "RESTIR", "reuse": ReuseSettings(pilot=False)},
        {"integrator": "RESTIR", "reuse": ReuseSettings(temporal=True, rounds=1)},
        {"integrator": "RESTIR", "reuse": ReuseSettings(paths="INDIRECT", temporal=True, rounds=1)},
        {"integrator": "RESTIR", "sss_shift": "RECONNECTION", "sss_method": "DIFFUSION"},
        {"integrator": "RESTIR", "sss_shift": "BLOCKS", "sss_method": "DIFFUSION"},
    ],
    ids=["path", "tiles", "direct", "indirect", "subsurface", "blocks"],
)
def test_what_a_session_has_used_is_given_up_with_it(scene, settings):
    """Nothing in it refers to itself: arrays of a kilobyte a pixel would wait for the garbage collector."""
    gc.collect()
    gc.disable()
    try:
        session = Session(scene, RenderSettings(samples=1, max_bounces=1, threads=1, **settings))
        session.prepare()
        assert session.render()
        gone = weakref.ref(session._integrator)
        del session
        assert gone() is None
    finally:
        gc.enable()
