"""Light samples from tiles against those drawn for their receiver; 4 standard errors unless said."""

import math

import numpy as np
import pytest

from restir_engine.context import FrameContext
from restir_engine.kernels.core import records as rec
from restir_engine.kernels.lights import tile_weights
from restir_engine.scene.lamps import point_lamp, sun_lamp
from restir_engine.scene.light_tiles import LightTiles
from restir_engine.scene.world import World
from testing.kernels.light_tiles import from_tiles, resample
from testing.kernels.lights import scratch_memory, seen
from testing.scenes.lamps import DELTAS, LAMPS, PORTALS, SCENES, WHITE, quad, quad_description
from testing.scenes.lights import emission_program, lamp_description, lamp_scene, matrix

PLACE = (0.3, 0.1, 0.2)


def mixed(portals=()):
    """Triangles, two lamps, a sun and a world, which shines in through portals as well."""
    scene = quad_description()
    scene.lights.portals += portals
    scene.lights.lamps = np.concatenate([LAMPS["area disk"], LAMPS["point sphere"], LAMPS["sun"]])
    scene.world = World(material=scene.shaders.add(emission_program((0.1, 0.2, 0.1))), map_width=32)
    return scene.commit()


SCENES = SCENES | {"mixed": mixed, "mixed, portals": lambda: mixed(PORTALS)}
WITHOUT_PORTALS = {"portals": "world", "mixed, portals": "mixed"}


def through(samples, closures=1):
    """Irradiance that samples estimate, from above, from both sides (2) or without a surface (0), rgb."""
    z = samples[..., 3]
    cos = (np.ones_like(z), np.maximum(z, 0.0), np.abs(z))[closures]
    pdf = np.where(samples[..., 4] > 0.0, samples[..., 4], 1.0)
    return samples[..., 5:8] * (samples[..., 0] * cos / pdf)[..., None]


@pytest.mark.parametrize("closures", [0, 1, 2])
@pytest.mark.parametrize("name", SCENES)
def test_mean_is_that_of_light_samples(name, closures):
    scene = SCENES[name]()
    reference = SCENES[WITHOUT_PORTALS.get(name, name)]()
    direct = through(resample(reference, PLACE, 40_000, closures=closures), closures)
    frames = through(from_tiles(scene, PLACE, 400, 50, closures=closures), closures).mean(axis=1)
    error = np.sqrt(direct.var(axis=0) / len(direct) + frames.var(axis=0) / len(frames))
    assert (direct.mean(axis=0) > 0.0).all() or "spread" in name or "narrow" in name
    assert (np.abs(direct.mean(axis=0) - frames.mean(axis=0)) < 4.0 * error + 1e-3 * direct.mean(axis=0)).all()


@pytest.mark.parametrize("name", ["all", "triangles", "world", "mixed"])
def test_entries_have_their_density(name):
    """The mean of 1 / pdf over entries is the measure of all points: 1 a lamp or triangle, 4 pi of the world."""
    scene = SCENES[name]()
    tiles = LightTiles(scene, 64, 256)
    context = FrameContext(scene, tiles=tiles)
    context.fill_tiles(3, scratch_memory())
    pdf = tiles.entries["pdf"].astype(float)
    inverse = np.where(pdf > 0.0, 1.0 / np.where(pdf > 0.0, pdf, 1.0), 0.0).mean(axis=1)
    expected = {"all": len(LAMPS | DELTAS), "triangles": 6, "world": 4.0 * math.pi, "mixed": 9.0 + 4.0 * math.pi}[name]
    assert abs(inverse.mean() - expected) < 4.0 * inverse.std() / 8.0 + 1e-3 * expected


@pytest.mark.parametrize("name", [*LAMPS, "world", "portals"])
def test_rays_that_find_light_know_what_mis_weighs_it_by(name):
    scene = SCENES[name]()
    context = FrameContext(scene, tiles=LightTiles(scene, 4, 64, 8))
    context.fill_tiles(1, scratch_memory())
    samples = resample(context, PLACE, 500)
    samples = samples[samples[:, 0] > 0.0]
    found = seen(context, PLACE, samples[:, 1:4])
    hit = found[:, 3] > 0.0
    assert hit.mean() > 0.99 if len(samples) else True
    # A distant lamp is small beside the rounding of its place.
    np.testing.assert_allclose(found[hit, 3], samples[hit, 8], rtol=1e-4 if name != "area distant" else 1e-2)


NEAR = ["point disk", "point sphere", "area rectangle", "area disk", "sun", "world", "portals"]


@pytest.mark.parametrize("name", NEAR)
def test_mis_with_rays_adds_up_to_all_light(name):
    """Samples of tiles and rays by the cosine, weighed against each other, from a point near the light."""
    scene, place = SCENES[name](), (0.1, 0.1, 1.2)
    exact = through(resample(scene, place, 40_000))[:, 0]
    random = np.random.default_rng(4)
    r, phi = np.sqrt(random.random(40_000)), 2.0 * np.pi * random.random(40_000)
    directions = np.column_stack([r * np.cos(phi), r * np.sin(phi), np.sqrt(1.0 - r * r)])
    samples = from_tiles(scene, place, 400, 50, candidates=4)
    density = np.maximum(samples[..., 3], 0.0) / np.pi
    sampled = through(samples)[..., 0] * mis(samples[..., 8], density)
    context = FrameContext(scene, tiles=LightTiles(scene, 2, 32, 4))
    context.fill_tiles(1, scratch_memory())
    found = seen(context, place, directions)
    rays = found[:, 0] * np.pi * mis(directions[:, 2] / np.pi, found[:, 3])
    sampled = sampled.mean(axis=1)
    error = math.sqrt(exact.var() / 40_000 + rays.var() / 40_000 + sampled.var() / 400)
    assert rays.mean() > 0.0
    assert abs(sampled.mean() + rays.mean() - exact.mean()) < 4.0 * error


def mis(a, b):
    """The power heuristic."""
    return a * a / np.maximum(a * a + b * b, 1e-300)


def test_tiles_do_not_depend_on_who_fills_them():
    scene = SCENES["all"]()
    tiles = LightTiles(scene, 8, 64)
    context = FrameContext(scene, tiles=tiles)
    context.fill_tiles(5, scratch_memory())
    whole = tiles.entries.copy()
    for first in (6, 0, 3):
        context.fill_tiles(5, scratch_memory(), first, min(first + 3, 8))
    np.testing.assert_array_equal(tiles.entries, whole)
    context.fill_tiles(6, scratch_memory())
    assert (tiles.entries["u"] != whole["u"]).mean() > 0.5


def test_tiles_are_seen_in_their_own_context_only():
    scene = quad()
    before = resample(scene, PLACE, 50)
    context = FrameContext(scene, tiles=LightTiles(scene, 2, 32))
    context.fill_tiles(1, scratch_memory())
    np.testing.assert_array_equal(resample(scene, PLACE, 50), before)
    np.testing.assert_array_equal(resample(FrameContext(scene), PLACE, 50), before)
    assert (resample(context, PLACE, 50) != before).any()


def test_more_candidates_less_noise():
    """Lamps of unlike power and distance: candidates find those that matter."""
    rng = np.random.default_rng(2)
    lamps = [point_lamp(matrix(rng.uniform((-4, -4, -2), (4, 4, 4))), WHITE, 0.05) for _ in range(100)]
    scene = lamp_scene(*lamps, sun_lamp(matrix((0, 0, 0), (0.2, 0.1, 1.0)), (0.02, 0.02, 0.02), 0.1))
    noise = [through(from_tiles(scene, PLACE, 60, 50, m))[..., 0].std() for m in (1, 8, 32)]
    assert noise[1] < 0.6 * noise[0]
    assert noise[2] < 0.7 * noise[1]


def test_a_dark_estimate_does_not_hide_a_light():
    """A lamp whose program is estimated as dark is still chosen sometimes."""
    scene = lamp_description(point_lamp(matrix((0, 0, 2)), WHITE, 0.5))
    index = scene.shaders.add(emission_program((0.0, 0.0, 0.0)))
    scene.lights.lamps["material"] = index
    scene = scene.commit()
    tiles = LightTiles(scene, 2, 64)
    FrameContext(scene, tiles=tiles).fill_tiles(1, scratch_memory())
    assert (tiles.emission[:, :, tile_weights.POWER : tile_weights.POWER + 3] > 0.0).all()
    assert (tiles.entries["primitive"] == rec.POINT_ON_LAMP).all()
