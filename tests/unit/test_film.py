"""The film turns sums into passes."""

import numpy as np
import pytest

from restir_engine.film import FAR, Film
from restir_engine.kernels.core import records as rec
from restir_engine.settings import PASSES, filter_table, required_passes


def film_with(names, samples=4):
    film = Film(3, 2, required_passes(frozenset(names), False), exposure=2.0)
    film.samples = samples
    return film


def test_every_pass_that_kernels_write_has_a_field_in_the_film_record():
    fieldless = [item for item in PASSES if item.field not in rec.FILM.names]
    assert [item.name for item in fieldless if not item.slots] == ["Visibility Estimate", "Debug Sample Count"]
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


def test_depth_of_nothing_is_far():
    film = film_with(["Depth"])
    assert (film.pass_array("Depth") == np.float32(FAR)).all()


@pytest.mark.parametrize(("kind", "limit"), [("BOX", 0.5), ("GAUSSIAN", 2.25), ("BLACKMAN_HARRIS", 1.5)])
def test_filter_table_is_a_symmetric_distribution_as_wide_as_that_of_cycles(kind, limit):
    table = filter_table(kind, 1.5)
    assert table[0] == pytest.approx(-limit) and table[-1] == pytest.approx(limit)
    assert (np.diff(table) >= 0).all()
    assert table == pytest.approx(-table[::-1], abs=1e-4)
