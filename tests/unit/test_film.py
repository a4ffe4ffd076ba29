"""The film turns sums into passes."""

import numpy as np
import pytest

from restir_engine.film import FAR, Film
from restir_engine.kernels.core import records as rec
from restir_engine.session import Session
from restir_engine.settings import PASSES, RenderSettings, filter_table, required_passes
from testing.scenes import rooms
from testing.scenes.lights import matrix
from testing.scenes.shapes import QUAD


def film_with(names, samples=4):
    film = Film(3, 2, required_passes(frozenset(names), False), exposure=2.0)
    film.samples = samples
    return film


def test_every_pass_that_kernels_write_has_a_field_in_the_film_record():
    fieldless = [item for item in PASSES if item.field not in rec.FILM.names]
    catchers = ["Shadow Catcher", "Bare Catcher", "Catcher Backdrop"]  # in records of their own: Film.caught_record
    names = [item.name for item in fieldless if not item.slots]
    own = ["Visibility Estimate", "Subsurface Shift", "Subsurface Reuse", "Debug Sample Count"]  # integrators'
    assert names == [*own, *catchers, "Noisy Image"]
    assert all(item.name[-2:] != "00" for item in fieldless)  # the first pass of a kind stands for all its slots
    assert all(item.kind in ("VALUE", "VECTOR", "COLOR") for item in PASSES)


def test_a_light_pass_needs_the_colour_it_is_divided_by():
    names = [item.name for item in required_passes(frozenset({"Diffuse Direct"}), False)]
    assert names == ["Combined", "Diffuse Direct", "Diffuse Color"]


def test_combined_is_averaged_exposed_and_has_alpha():
    film = film_with(["Combined"])
    film.sums("Combined")[:] = (4.0, 8.0, 12.0, 1.0)
    assert film.pass_array("Combined")[0, 0] == pytest.approx([2.0, 4.0, 6.0, 0.75])


def test_light_passes_are_divided_by_colour_and_black_colour_gives_black():
    film = film_with(["Diffuse Direct"])
    film.sums("Diffuse Direct")[:] = 3.0
    film.sums("Diffuse Color")[0] = 1.5
    result = film.pass_array("Diffuse Direct")
    assert (result[0] == 4.0).all() and (result[1] == 0.0).all()


@pytest.mark.parametrize("transparent", [True, False])
def test_combined_shows_shadows_on_catchers_unless_their_pass_is_asked_for(transparent):
    """A pixel that an object covers by a quarter, before a catcher with half the light, twice the red."""
    for names in ((), ("Shadow Catcher",)):
        passes = required_passes(frozenset(names), False, catchers=True)
        film = Film(1, 1, passes, exposure=2.0, transparent=transparent)
        film.samples = 4
        film.sums("Combined")[:] = (1.0, 2.0, 3.0, 3.0)
        film.sums("Bare Catcher")[:] = (1.0, 1.0, 0.0, 0.0)
        film.sums("Shadow Catcher")[:] = (0.6, 0.2, 0.5)
        if not names:
            film.sums("Catcher Backdrop")[:] = 0.0 if transparent else 2.0
        assert film.pass_array("Shadow Catcher")[0, 0] == pytest.approx([0.6, 0.2, 1.0])
        seen = 0.75 * 0.6
        shown = [0.5, 1.0, 1.5, 1.0 - seen] if transparent else [*(np.array([0.5, 1.0, 1.5]) + seen), 1.0]
        assert film.pass_array("Combined")[0, 0] == pytest.approx([0.5, 1.0, 1.5, 0.25] if names else shown)


def test_what_is_seen_through_a_catcher_is_not_darkened():
    film = Film(1, 1, required_passes(frozenset(), False, catchers=True))
    film.samples = 4
    film.sums("Bare Catcher")[:] = (1.0, 1.0, 1.0, 3.0)
    assert film.pass_array("Shadow Catcher")[0, 0] == pytest.approx([0.75] * 3)


def test_depth_of_nothing_is_far():
    film = film_with(["Depth"])
    assert (film.pass_array("Depth") == np.float32(FAR)).all()


@pytest.mark.parametrize("integrator", ["PATH", "RESTIR"])
def test_the_first_sample_is_of_the_middle_of_the_pixel(integrator):
    """Where a pass holds what it has seen: Position, of a floor, lies below the pixel's middle whatever the seed is."""
    builder = rooms.Builder()
    builder.add(QUAD, rooms.diffuse((0.5, 0.5, 0.5)), rooms.scaled(matrix(), 4.0, 4.0, 1.0))
    camera = rooms.look((0.0, -0.01, 2.0), (0.0, 0.0, 0.0), size=8)
    scene = builder.finish(camera)
    pictures = []
    for seed in (1, 2):
        settings = RenderSettings(
            samples=2, seed=seed, integrator=integrator, passes=frozenset({"Combined", "Position"})
        )
        session = Session(scene, settings)
        session.render()
        pictures.append(session.film.pass_array("Position"))
    assert np.ptp(pictures[0][..., 0]) > 0.5
    assert np.abs(pictures[0] - pictures[1]).max() < 1e-5
    columns = pictures[0][..., 0].mean(0)
    assert columns == pytest.approx(-columns[::-1], abs=1e-3)
    assert np.diff(columns) == pytest.approx(np.diff(columns).mean(), rel=0.01)


@pytest.mark.parametrize(("kind", "limit"), [("BOX", 0.5), ("GAUSSIAN", 2.25), ("BLACKMAN_HARRIS", 1.5)])
def test_filter_table_is_a_symmetric_distribution_as_wide_as_that_of_cycles(kind, limit):
    table = filter_table(kind, 1.5)
    assert table[0] == pytest.approx(-limit) and table[-1] == pytest.approx(limit)
    assert (np.diff(table) >= 0).all()
    assert table == pytest.approx(-table[::-1], abs=1e-4)
