"""The irradiance cache: its grid, and pictures with it on."""

import numpy as np
import pytest

from restir_engine.integrators.irradiance_cache import IrradianceCache
from restir_engine.kernels.core.jit import kernel
from restir_engine.kernels.core.memory import address
from restir_engine.kernels.subsurface import irradiance_cache as at
from restir_engine.scene.lamps import area_lamp
from testing.scenes.lights import matrix
from testing.scenes.scattering import look, render, scatter_scene, slab, subsurface_program


@kernel
def key_of(instance, x, y, z, nx, ny, nz, size):
    return at.cell_key(instance, (x, y, z), (nx, ny, nz), size)


@kernel
def note_at(seen, key, value):
    at.note(seen, key, (value, value, value))


def grid(cells: int = 1 << 10, size: int = 64) -> IrradianceCache:
    """A cache for size × 1 pixels."""
    return IrradianceCache(np.zeros((1, size, 4), np.float32), cells)


def observe(cache: IrradianceCache, keys, values) -> None:
    """Note a value (rgb alike) under a key at each of the first pixels, and merge."""
    seen = cache._seen
    seen["key"][: len(keys)] = keys
    seen["value"][: len(keys)] = np.reshape(values, (-1, 1))
    cache.merge()
    assert not seen["key"].any()


def mean_of(cache: IrradianceCache, key: int) -> tuple[int, float]:
    cell = cache.cells[cache.cells["key"] == key][0]
    return int(cell["count"]), float(cell["mean"][1])


def test_keys_tell_objects_places_sides_and_sizes_apart():
    point = (0.3, -0.2, 0.1)
    base = key_of(2, *point, 0.1, 0.2, 0.9, 0.25)
    assert base == key_of(2, 0.31, -0.21, 0.11, 0.3, 0.1, 0.8, 0.4) > 0
    others = [
        key_of(3, *point, 0.1, 0.2, 0.9, 0.25), key_of(2, 0.6, -0.2, 0.1, 0.1, 0.2, 0.9, 0.25),
        key_of(2, 0.3, 0.2, 0.1, 0.1, 0.2, 0.9, 0.25), key_of(2, *point, 0.1, 0.2, -0.9, 0.25),
        key_of(2, *point, 0.1, 0.2, 0.9, 0.5),
    ]  # fmt: skip
    assert len({base, *others}) == 6


def test_a_cell_holds_the_mean_and_forgets_beyond_the_cap():
    cache, values = grid(), np.random.default_rng(1).random(50)
    observe(cache, [7 << 31] * 50, values)
    count, mean = mean_of(cache, 7 << 31)
    assert count == 50 and abs(mean - values.mean()) < 1e-6
    for _ in range(40):
        observe(cache, [7 << 31] * 64, np.zeros(64))
    assert mean_of(cache, 7 << 31)[0] == at.CAP
    before = mean_of(cache, 7 << 31)[1]
    observe(cache, [7 << 31], [1.0])
    np.testing.assert_allclose(mean_of(cache, 7 << 31)[1] - before, (1.0 - before) / at.CAP, rtol=1e-3)


def test_old_cells_give_way_when_there_is_no_room():
    """As many keys as a place holds, all at the same place, and one more."""
    cache = grid()
    keys = [(5 << 31) + k for k in range(at.PLACES + 1)]
    observe(cache, keys, np.ones(len(keys)))
    assert set(cache.cells["key"]) == set(keys[:-1])
    for _ in range(at.AGE):
        observe(cache, keys[1:], np.ones(at.PLACES))
    assert keys[0] in cache.cells["key"]
    observe(cache, keys[1:], np.ones(at.PLACES))
    assert set(cache.cells["key"]) == set(keys[1:])
    assert mean_of(cache, keys[-1]) == (1, 1.0)


def test_keys_that_fall_on_one_place_are_kept_apart():
    cache = grid()
    keys = [(5 << 31) + k for k in range(4)]
    observe(cache, keys * 2, np.tile([1.0, 2.0, 3.0, 4.0], 2))
    assert [mean_of(cache, key) for key in keys] == [(2, 1.0), (2, 2.0), (2, 3.0), (2, 4.0)]


def test_an_old_cell_begins_anew():
    cache, key, other = grid(), 7 << 31, 9 << 31
    observe(cache, [key] * 20, np.ones(20))
    for _ in range(at.AGE - 1):
        observe(cache, [other], [1.0])
    observe(cache, [key], [22.0])
    assert mean_of(cache, key) == (21, 2.0)
    for _ in range(at.AGE):
        observe(cache, [other], [1.0])
    observe(cache, [key], [5.0])
    assert mean_of(cache, key) == (1, 5.0)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_what_is_no_number_is_not_observed(value):
    cache = grid()
    note_at(address(cache._seen), 7 << 31, value)
    cache.merge()
    assert len(cache.cells) == 0
    note_at(address(cache._seen), 7 << 31, 3.0)
    cache.merge()
    assert mean_of(cache, 7 << 31) == (1, 3.0)


def colorful_lamps() -> list[np.ndarray]:
    """Lamps around the back of a slab that is seen from above, near and far, so that each counts somewhere."""
    places = [(0.9, 0.2, -1.2), (-0.8, 0.3, -0.9), (0.1, -1.0, -1.6), (-0.2, 0.8, -2.5), (1.5, -0.4, -0.8)]
    colors = np.random.default_rng(3).uniform(1.0, 20.0, (len(places), 3))
    return [area_lamp(matrix(p, p), tuple(c), 0.8, 0.8) for p, c in zip(places, colors, strict=True)]


def picture(threads: int, cached: bool, samples: int = 24, seed: int = 0) -> np.ndarray:
    """The light below a slab's surface."""
    program = subsurface_program((0.8, 0.5, 0.3), 0.25, entry="DIFFUSE")
    scene = scatter_scene(slab(0.4), program, colorful_lamps())
    look(scene, (0.0, 0.0, 5.0), width=64, height=40, size=2.0)
    options = {"sss_method": "HYBRID", "sss_irradiance_cache": cached, "seed": seed}
    return render(scene, samples, ("Subsurface",), threads, **options)["Subsurface"]


def test_a_picture_is_the_same_on_any_number_of_threads():
    """Equal bits on one thread and on two, and when it is rendered again; others than without the cache."""
    one = picture(1, True)
    np.testing.assert_array_equal(one, picture(2, True))
    np.testing.assert_array_equal(one, picture(1, True))
    assert np.isfinite(one).all() and not np.array_equal(one, picture(2, False))


def test_a_picture_is_as_bright_as_without():
    """The mean within four standard errors and 0.5 %, blocks of 8 × 8 pixels within 3 % (root mean square).

    The errors are those that two pictures of each kind show.
    """
    pictures = np.array([[picture(2, on, 128, 2 * on + k) for k in (0, 1)] for on in (True, False)])
    blocks = pictures.reshape(2, 2, 5, 8, 8, 8, 3).mean(axis=(3, 5))
    mean, reference = blocks.mean(axis=(1, 2, 3))
    error = np.sqrt(((blocks[:, 0] - blocks[:, 1]) ** 2).mean(axis=(1, 2)).sum(axis=0) / 4 / blocks[0, 0, ..., 0].size)
    np.testing.assert_array_less(np.abs(mean - reference), 4.0 * error + 0.005 * reference)
    (a, b), (c, d) = blocks
    squared = ((a - c) * (b - d) / (0.25 * (a + b) * (c + d))).mean()
    assert squared < 0.03**2
