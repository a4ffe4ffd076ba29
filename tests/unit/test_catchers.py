"""Light on shadow catchers is what plain renders with and without objects find; see docs/shadow-catchers.md."""

import numpy as np
import pytest

from restir_engine.film import Film
from restir_engine.kernels.core import records as rec
from restir_engine.reuse_settings import ReuseSettings
from restir_engine.session import Session
from restir_engine.settings import RenderSettings
from testing.scenes.lights import emission_program, matrix
from testing.scenes.rooms import ABOVE, Builder, area_lamp, diffuse, look, render, scaled
from testing.scenes.shapes import CUBE, QUAD

FLOOR, BOX, GLOW = 0, 1, 2
NOTHING = {"samples": 8, "seed": 3, "max_bounces": 3}
FINAL = {"passes": frozenset({"Combined", "Shadow Catcher"}), "film_transparent": True}
REUSE = ReuseSettings(pilot=False, temporal=True, rounds=1)
WAYS = {"PATH": {}, "RESTIR": {"integrator": "RESTIR", "reuse": REUSE}, "adaptive": {"use_adaptive_sampling": True}}


def stage(catchers=(), only=(FLOOR, BOX, GLOW)):
    """A floor, a red box and a luminous one above it, under a lamp; some of them catch, some are there."""
    b = Builder()
    b.add(QUAD, diffuse((0.6, 0.6, 0.6)), scaled(matrix(), 3.0, 3.0, 1.0))
    b.add(CUBE, diffuse((0.8, 0.1, 0.1)), scaled(matrix((-0.3, 0.1, 0.25)), 0.2, 0.2, 0.25))
    b.add(CUBE, emission_program((0.5, 2.0, 4.0)), scaled(matrix((0.5, 0.3, 0.3)), 0.1, 0.1, 0.1))
    b.lamp(area_lamp(ABOVE, (9.0, 9.0, 9.0), 0.6, 0.6))
    description = b.describe(look((0.0, -2.0, 1.6), (0.0, 0.0, 0.1), 24))
    description.instances["flags"][list(catchers)] |= rec.INSTANCE_SHADOW_CATCHER
    for index in {FLOOR, BOX, GLOW} - set(only):
        description.instances["n_materials"][index] = description.instances["seen_by"][index] = 0
    return description.commit()


@pytest.fixture(scope="module")
def plain():
    """What PATH finds without any catcher: the whole scene; the floor alone; which pixels are all floor."""
    whole, bare = render(stage(), **NOTHING), render(stage(only=[FLOOR]), **NOTHING)
    session = Session(stage(), RenderSettings(**NOTHING, passes=frozenset({"Normal"})))
    session.render()
    return whole, bare, session.film.pass_array("Normal")[..., 2] > 0.9999


@pytest.mark.parametrize("way", WAYS)
def test_the_pass_is_the_ratio_of_two_plain_renders(plain, way):
    """Their random numbers are the same, so that nothing but rounding tells them apart."""
    whole, bare, floor = plain
    session = Session(stage([FLOOR]), RenderSettings(**NOTHING, **FINAL, **WAYS[way]))
    assert session.render()
    factor, combined = session.film.pass_array("Shadow Catcher"), session.combined()
    tops = floor & (np.abs(combined[..., 3]) < 1e-6)  # the boxes' tops look up as well
    assert tops.sum() > 200 and factor[tops].min() < 0.2 and factor[tops].max() > 1.2
    np.testing.assert_allclose(factor[tops], whole[tops] / bare[tops], rtol=2e-4)
    assert (combined[tops] == 0.0).all()
    assert factor.dtype == combined.dtype == np.float32  # Blender takes nothing else


def test_what_is_no_catcher_looks_as_it_does_without_any(plain):
    session = Session(stage([FLOOR]), RenderSettings(**NOTHING, **FINAL))
    assert session.render()
    covered = session.combined()[..., 3] == 1.0
    np.testing.assert_allclose(session.combined()[covered][:, :3], plain[0][covered], rtol=1e-5)
    assert (session.film.pass_array("Shadow Catcher")[covered] == 1.0).all()


def test_shadows_of_catchers_on_catchers_are_not_caught():
    session = Session(stage([FLOOR, BOX, GLOW]), RenderSettings(**NOTHING, **FINAL))
    assert session.render()
    np.testing.assert_allclose(session.film.pass_array("Shadow Catcher"), 1.0, rtol=1e-5)
    assert not session.combined().any()


def test_a_cancelled_render_shows_finished_tiles_whole():
    """Every pixel has as many samples of the catcher's light as of Combined."""
    scene = stage([FLOOR])
    session = Session(scene, RenderSettings(**NOTHING | {"samples": 1 << 20}, **FINAL, threads=1))
    assert not session.render(on_frame=lambda s: s.film.samples >= 3 and s.cancel())
    again = Session(scene, RenderSettings(**NOTHING | {"samples": session.film.samples}, **FINAL))
    assert again.render()
    np.testing.assert_allclose(
        session.film.pass_array("Shadow Catcher"), again.film.pass_array("Shadow Catcher"), rtol=1e-4
    )


def test_scenes_without_catchers_have_no_sums_of_their_light():
    session = Session(stage(), RenderSettings(**NOTHING))
    assert isinstance(session.film, Film) and not session.film.has_catchers and session.scene.bare is None
