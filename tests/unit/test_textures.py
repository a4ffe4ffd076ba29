"""Procedural textures: known hashes, lattice properties, brute-force comparisons, and no NaN whatever comes in."""

import numpy as np
import pytest

from restir_engine.kernels.core.jit import kernel
from restir_engine.kernels.shading.interpreter import opcodes_in
from restir_engine.kernels.shading.textures import TEXTURE_ENTRIES, noise, voronoi
from restir_engine.kernels.shading.textures import opcodes as ops
from restir_engine.kernels.shading.textures.hashing import cell_point
from restir_engine.kernels.shading.textures.hashing import lookup3 as hash_of
from testing.kernels.textures import run

RNG = np.random.default_rng(7)
POINTS = RNG.uniform(-20.0, 20.0, (200, 3))
WILD = np.array(
    [[1e30, -1e30, 1e15], [np.nan, 0.0, 1.0], [np.inf, -np.inf, 0.0], [123456.7, -999999.9, 2e6], [0, 0, 0]]
)


def lookup3(*keys):
    """Bob Jenkins' hash of one to four 32-bit words, from its description."""
    word = 0xFFFFFFFF

    def rotate(x, k):
        return (x << k | x >> (32 - k)) & word

    a = b = c = (0xDEADBEEF + 4 * len(keys) + 13) & word
    padded = (*keys, 0, 0, 0)
    a, b, c = (a + padded[0]) & word, (b + padded[1]) & word, (c + padded[2]) & word
    if len(keys) == 4:
        for k, turn in ((4, 0), (6, 1), (8, 2), (16, 0), (19, 1), (4, 2)):
            x = [a, b, c]
            target, source, third = turn, (turn + 2) % 3, (turn + 1) % 3
            x[target] = ((x[target] - x[source]) & word) ^ rotate(x[source], k)
            x[source] = (x[source] + x[third]) & word
            a, b, c = x
        a = (a + keys[3]) & word
    for k, target, source in ((14, 2, 1), (11, 0, 2), (25, 1, 0), (16, 2, 1), (4, 0, 2), (14, 1, 0), (24, 2, 1)):
        x = [a, b, c]
        x[target] = ((x[target] ^ x[source]) - rotate(x[source], k)) & word
        a, b, c = x
    return c


@kernel
def _hash(count, i, j, k, m):
    if count == 1:
        return hash_of((i,))
    if count == 2:
        return hash_of((i, j))
    if count == 3:
        return hash_of((i, j, k))
    return hash_of((i, j, k, m))


@kernel
def _cell(dimensions, x, y, z, w):
    return cell_point(dimensions, x, y, z, w)


@pytest.mark.parametrize("count", [1, 2, 3, 4])
def test_hashes_are_lookup3(count):
    for _ in range(20):
        keys = [int(key) for key in RNG.integers(0, 2**32, 4)]
        assert _hash(count, *keys) == lookup3(*keys[:count])


def test_every_opcode_has_an_entry():
    opcodes = {value for name, value in vars(ops).items() if name.isupper()}
    assert opcodes == set(TEXTURE_ENTRIES)


def test_only_used_instructions_are_found():
    code = np.array([3, 2, 104, 105, ops.CHECKER, 5, 0, 0, 0, 0, ops.NOISE, ops.GRADIENT, 3, 1, 2, 3, 0, 0], np.int32)
    assert opcodes_in(code) & TEXTURE_ENTRIES.keys() == {ops.CHECKER, ops.GRADIENT}


def noise_at(
    points, w=0.0, dimensions=3, kind=noise.FBM, flags=0, detail=0.0, roughness=0.5, scale=1.0, distortion=0.0
):
    words = [w, scale, detail, roughness, 2.0, 0.5, 1.0, distortion, dimensions | kind << 4 | flags]
    return run(ops.NOISE, points, words, 4)


@pytest.mark.parametrize("dimensions", [1, 2, 3, 4])
def test_noise_vanishes_on_the_lattice_and_stays_in_range(dimensions):
    lattice = np.floor(POINTS)
    assert np.abs(noise_at(lattice, float(lattice[0, 0]), dimensions)[:, 0]).max() < 1e-6
    values = noise_at(POINTS, 0.37, dimensions, flags=noise.FLAG_NORMALIZE, detail=3.5)[:, 0]
    assert values.min() >= 0.0 and values.max() <= 1.0
    again = noise_at(POINTS, 0.37, dimensions, flags=noise.FLAG_NORMALIZE, detail=3.5)[:, 0]
    assert np.array_equal(values, again)


def test_noise_is_continuous():
    step = 1e-4
    for axis in range(3):
        shifted = POINTS + step * np.eye(3)[axis]
        slope = np.abs(noise_at(shifted)[:, 0] - noise_at(POINTS)[:, 0]) / step
        assert slope.max() < 5.0


def test_noise_has_mean_zero():
    points = np.random.default_rng(3).uniform(0.0, 1000.0, (20000, 3))
    values = noise_at(points)[:, 0]
    assert abs(values.mean()) < 4.0 * values.std() / np.sqrt(len(values))


def test_a_fraction_of_detail_lies_between_whole_octaves():
    low, middle, high = (noise_at(POINTS, detail=detail)[:, 0] for detail in (2.0, 2.5, 3.0))
    assert np.allclose(middle, 0.5 * (low + high), atol=1e-6)


def voronoi_at(points, feature=voronoi.F1, dimensions=3, metric=voronoi.EUCLIDEAN, randomness=1.0, flags=0, detail=0.0):
    word = dimensions | feature << 4 | metric << 8 | flags
    return run(ops.VORONOI, points, [0.3, 1.0, detail, 0.5, 2.0, 1.0, 1.5, randomness, word], voronoi.RESULTS)


def test_voronoi_finds_the_nearest_two_points():
    points = POINTS[:40].astype(np.float32).astype(float)
    first, second = voronoi_at(points), voronoi_at(points, voronoi.F2)
    for point, nearest, further in zip(points, first, second, strict=True):
        cell = np.floor(point)
        offsets = np.array([(i, j, k) for i in (-1, 0, 1) for j in (-1, 0, 1) for k in (-1, 0, 1)])
        seeds = np.array([cell + offset + _cell(3, *(cell + offset), 0.0)[:3] for offset in offsets])
        distances = np.linalg.norm(seeds - point, axis=1)
        order = np.argsort(distances)
        assert nearest[0] == pytest.approx(distances[order[0]], abs=1e-9)
        assert further[0] == pytest.approx(distances[order[1]], abs=1e-9)
        assert np.allclose(nearest[4:7], seeds[order[0]], atol=1e-9)


@pytest.mark.parametrize("flags", [0, voronoi.FLAG_INTEGER_CELLS])
@pytest.mark.parametrize("dimensions", [1, 2, 3, 4])
def test_voronoi_features_agree_with_each_other(dimensions, flags):
    first, second, smooth, edge, sphere = (voronoi_at(POINTS, feature, dimensions, flags=flags) for feature in range(5))
    assert (second[:, 0] >= first[:, 0]).all()
    assert (edge[:, 0] >= -1e-9).all() and (edge[:, 0] <= first[:, 0] + second[:, 0]).all()
    assert (smooth[:, 0] <= first[:, 0] + 1e-9).all()
    assert (sphere[:, 8] > 0.0).all()
    assert ((first[:, 1:4] >= 0.0) & (first[:, 1:4] < 1.0)).all()


def test_without_randomness_cells_are_a_grid():
    values = voronoi_at(POINTS, randomness=0.0)
    assert np.allclose(values[:, 4:7], np.round(POINTS.astype(np.float32)), atol=1e-9)


def test_nothing_makes_a_nan():
    flags = [3 | kind << 4 | noise.FLAG_COLOR for kind in range(5)]
    results = [noise_at(WILD, 1e20, 4, kind, noise.FLAG_COLOR, 15.0, 1.0, 1e3, 1e3) for kind in range(len(flags))]
    for feature in range(5):
        for detail in (0.0, 2.5):
            results.append(voronoi_at(WILD, feature, 4, voronoi.EUCLIDEAN, flags=voronoi.FLAG_NORMALIZE, detail=detail))
    results.append(run(ops.WAVE, WILD, [1.0, 5.0, 30.0, 1.0, 0.5, 0.0, 0], 1))
    zero = np.zeros(3)
    results.append(run(ops.BRICK, WILD[3:], [zero, zero, zero, 0.0, 0.0, 0.1, 0.0, 0.0, 0.0, 0.5, 0.0, 2, 2], 4))
    results.append(run(ops.CHECKER, WILD, [zero, zero, 5.0], 4))
    for kind in range(7):
        results.append(run(ops.GRADIENT, WILD[3:], [kind], 1))
    results.append(run(ops.MAGIC, WILD, [5.0, 0.0, 10, 0], 4))
    results.append(run(ops.WHITE_NOISE, WILD, [np.nan, 4], 4))
    for dimensions in (2, 3):
        results.append(run(ops.GABOR, WILD, [5.0, 2.0, 0.5, 0.0, zero, dimensions], 3))
    for values in results:
        assert np.isfinite(values).all()
