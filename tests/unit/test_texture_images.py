"""Image lookups: extension, interpolation, alpha, colour, projections; and the tables of skies."""

from math import pi

import numpy as np
import pytest

from restir_engine.kernels.core.jit import kernel
from restir_engine.kernels.shading.textures import environment, image
from restir_engine.kernels.shading.textures import opcodes as ops
from restir_engine.kernels.shading.textures.image import _box_weights
from restir_engine.scene import sky, sky_multiple
from restir_engine.scene.images import ImageTable, srgb_decode
from testing.kernels.textures import run

RNG = np.random.default_rng(11)
PIXELS = RNG.random((5, 7, 4)).astype(np.float32)
UV = np.column_stack([RNG.uniform(-2.0, 3.0, (300, 2)), np.zeros(300)])


def table(pixels=PIXELS, decode=None):
    images = ImageTable()
    images.add("image", pixels, decode)
    return images


def lookup(points, flags=0, images=None, index=0):
    return run(ops.IMAGE, points, [index, flags], 4, images or table())


def texel_centres(pixels=PIXELS):
    height, width = pixels.shape[:2]
    u, v = np.meshgrid((np.arange(width) + 0.5) / width, (np.arange(height) + 0.5) / height)
    return np.stack([u, v, np.zeros_like(u)], -1).reshape(-1, 3)


@pytest.mark.parametrize("extension", [image.REPEAT, image.EXTEND, image.CLIP, image.MIRROR])
@pytest.mark.parametrize("interpolation", [image.LINEAR, image.CLOSEST])
def test_texel_centres_are_the_texels(extension, interpolation):
    values = lookup(texel_centres(), extension | interpolation << 4)
    assert np.allclose(values, PIXELS.reshape(-1, 4), atol=1e-6)


@pytest.mark.parametrize("interpolation", [image.LINEAR, image.CLOSEST, image.CUBIC])
def test_extensions(interpolation):
    kind = interpolation << 4
    repeat = lookup(UV, image.REPEAT | kind)
    assert np.allclose(repeat, lookup(np.add(UV, (3.0, -2.0, 0.0)), image.REPEAT | kind), atol=1e-6)
    mirror = lookup(UV, image.MIRROR | kind)
    assert np.allclose(mirror, lookup(UV * (-1.0, 1.0, 1.0), image.MIRROR | kind), atol=1e-6)
    assert np.allclose(mirror, lookup(np.add(UV, (2.0, 4.0, 0.0)), image.MIRROR | kind), atol=1e-6)
    far = np.abs(UV[:, :2] - 0.5).max(1) > 0.95
    assert not lookup(UV[far], image.CLIP | kind).any()
    corner = lookup([(-3.0, -3.0, 0.0)], image.EXTEND | kind)
    assert np.allclose(corner, PIXELS[0, 0], atol=1e-6)


def test_interpolation_weights_sum_to_one():
    flat = np.full((4, 3, 4), 0.25, np.float32)
    for interpolation in (image.LINEAR, image.CLOSEST, image.CUBIC):
        assert np.allclose(lookup(UV, interpolation << 4, table(flat)), 0.25, atol=1e-7)


def test_linear_interpolation_is_continuous_over_the_seam():
    below, above = np.array([[1.0 - 1e-7, 0.3, 0.0]]), np.array([[1.0 + 1e-7, 0.3, 0.0]])
    assert np.allclose(lookup(below), lookup(above), atol=1e-5)


def test_bytes_and_floats_are_the_same():
    coarse = np.rint(PIXELS * 255.0).astype(np.uint8)
    values = lookup(UV, 0, table(coarse))
    assert np.allclose(values, lookup(UV, 0, table((coarse / 255.0).astype(np.float32))), atol=1e-6)


def test_srgb_is_decoded_after_filtering():
    pixels = PIXELS.copy()
    pixels[..., 3] = 1.0
    encoded, decoded = lookup(UV, 0, table(pixels)), lookup(UV, 0, table(pixels, srgb_decode()))
    x = encoded[:, :3]
    expected = np.where(x < 0.04045, x / 12.92, ((x + 0.055) / 1.055) ** 2.4)
    assert np.abs(decoded[:, :3] - expected).max() < 1e-6
    assert np.array_equal(decoded[:, 3], encoded[:, 3])


def test_colours_are_divided_by_alpha_on_demand():
    associated = PIXELS.copy()
    associated[..., :3] *= associated[..., 3:]
    values = lookup(texel_centres(), image.FLAG_UNASSOCIATE, table(associated))
    assert np.allclose(values, PIXELS.reshape(-1, 4), atol=1e-6)


def test_a_missing_image_is_magenta():
    assert lookup([(0.5, 0.5, 0.0)], 0, ImageTable(), -1).tolist() == [[1.0, 0.0, 1.0, 1.0]]


def test_wild_coordinates_give_nothing():
    wild = [(np.nan, 0.0, 0.0), (np.inf, 0.0, 0.0), (1e30, -1e30, 0.0)]
    assert not lookup(wild).any()


def test_tiles():
    images = ImageTable()
    for index, value in enumerate((0.25, 0.75)):
        images.add(index, np.full((2, 2, 4), value, np.float32))
    tiles = [2, 1001, 0, 1012, 1]
    points = [(0.5, 0.5, 0.0), (1.5, 1.5, 0.0), (1.5, 0.5, 0.0), (-0.5, 0.5, 0.0)]
    values = run(ops.IMAGE_TILES, points, [0, image.EXTEND], 4, images, tiles)
    assert values[:, 0].tolist() == [0.25, 0.75, 1.0, 0.25]
    assert values[2].tolist() == [1.0, 0.0, 1.0, 1.0]


@kernel
def _weights(n, blend):
    return _box_weights(n, blend)


def test_box_weights_sum_to_one():
    for blend in (0.0, 0.3, 1.0):
        for n in RNG.normal(size=(200, 3)):
            weights = _weights(tuple(n / np.linalg.norm(n)), blend)
            assert sum(weights) == pytest.approx(1.0, abs=1e-9) and min(weights) >= -1e-9


def test_environment_axes():
    height, width = 16, 32
    u, v = np.meshgrid((np.arange(width) + 0.5) / width, (np.arange(height) + 0.5) / height)
    images = table(np.stack([u, v, u, np.ones_like(u)], -1).astype(np.float32))
    directions = [(1, 0, 0), (0, 1, 0), (0, -2, 0), (0.6, 0, 0.8)]
    expected = [(0.5, 0.5), (0.25, 0.5), (0.75, 0.5), (0.5, 1.0 - np.arccos(0.8) / pi)]
    words = [0, image.REPEAT, environment.EQUIRECTANGULAR]
    values = run(ops.ENVIRONMENT, directions, words, 4, images)
    assert np.allclose(values[:, :2], expected, atol=1e-6)
    ball = run(ops.ENVIRONMENT, [(0, -1, 0), (1, 0, 0)], [0, image.REPEAT, environment.MIRROR_BALL], 4, images)
    assert np.allclose(ball[:, :2], [(0.5, 0.5), (0.5 + 0.25 * 2**0.5, 0.5)], atol=1e-6)


def test_the_image_table_replaces_in_place():
    images = table()
    assert images.add("other", np.zeros((1, 1, 4), np.uint8)) == 1
    assert images.add("image", np.zeros((2, 2, 4), np.float32)) == 0
    assert images.find("image") == 0 and images.find("none") is None and list(images) == ["image", "other"]
    assert images.records()["width"].tolist() == [2, 1] and len(images) == 2
    assert images.nbytes == 2 * 2 * 4 * 4 + 4
    with pytest.raises(ValueError):
        images.add("flat", np.zeros((2, 2, 3), np.float32))


EARTH = sky.Atmosphere(0.2, 0.4, 0.0095, 1.0, True, 100.0, 1.0, 1.0, 1.0)


def test_suns_beyond_the_zenith_come_down_on_the_other_side():
    over = sky.replace(EARTH, elevation=pi - 0.2, rotation=0.4 + pi).normalized()
    assert over.elevation == pytest.approx(0.2)
    assert (over.rotation - EARTH.normalized().rotation) % (2.0 * pi) == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("dome", [sky.half_dome, sky.full_dome, sky_multiple.multiple_dome])
def test_domes(dome):
    pixels = dome(EARTH.normalized())
    assert np.isfinite(pixels).all()
    assert np.array_equal(pixels, pixels[:, ::-1])  # both sides of the sun
    zenith = pixels[-1].mean(0)
    assert zenith[2] > zenith[1] > zenith[0] > 0.0  # a blue sky
    dense = dome(sky.replace(EARTH, aerosols=5.0).normalized())
    assert dense[-1, 0, 2] / dense[-1, 0, 0] < zenith[2] / zenith[0]  # haze is white


def test_a_low_sun_is_red():
    low, high = (sky.single_sun(sky.replace(EARTH, elevation=e).normalized(), True)[1] for e in (0.01, 1.5))
    assert high[2] / high[0] > 4.0 * low[2] / low[0]
    low, high = (sky_multiple.multiple_sun(sky.replace(EARTH, elevation=e).normalized())[1] for e in (0.01, 1.5))
    assert high[2] / high[0] > 4.0 * low[2] / low[0]
