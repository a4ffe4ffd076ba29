"""Media that vary in space against closed forms and quadrature."""

import ctypes
import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import trapezoid

from restir_engine.kernels.core.records import MAJORANTS, SCENE_HAS_PIVOTS
from restir_engine.scene import majorants
from restir_engine.scene.lamps import point_lamp, sun_lamp
from restir_engine.scene.voxels import VoxelAttribute, box_mesh
from testing.scenes.lights import matrix
from testing.scenes.media import along_y, cube, grid_medium, medium, picture, ramp, stage
from testing.scenes.rooms import WHITE, render

SIGMA = np.array([0.2, 0.5, 1.0])


def record_from(dtype: np.dtype, address: int):
    """What stands at an address."""
    return np.frombuffer(ctypes.string_at(int(address), dtype.itemsize), dtype)[0]


def agree(image, expected, most=0.002):
    """The mean over an image agrees within four of its own errors, which are at most a share of it."""
    flat = image.reshape(-1, 3)
    error = flat.std(0) / math.sqrt(len(flat))
    assert np.all(error < most * np.abs(expected)), error
    assert np.all(np.abs(flat.mean(0) - expected) < 4.0 * error + 1e-5), (flat.mean(0), expected, error)


def test_transmittance_of_a_ramp():
    """Seen by paths: exp(-∫ σ (1 + y) dy) over -1 … 1."""
    b = stage()
    cube(b, ramp(absorption=SIGMA))
    agree(picture(b, 64), np.exp(-2.0 * SIGMA))


def test_emission_of_a_ramp():
    b = stage(world=0.0)
    cube(b, ramp(emission=SIGMA))
    agree(picture(b, 512), 2.0 * SIGMA, 0.005)


@pytest.fixture(params=["bounds", "no bounds"])
def bounds(request, monkeypatch):
    """With majorants as they are, and with some that are exceeded nearly everywhere."""
    if request.param == "no bounds":
        monkeypatch.setattr(majorants, "_MARGIN", 0.85)


@pytest.mark.usefixtures("bounds")
def test_single_scattering_of_a_sun_from_above():
    """L(z) = p(0) E ∫ σ_s f(y) exp(-σ_t (f(y) (1 - z) + F(y))) dy with f = 1 + y, F its integral, σ_t = σ_s + σ_a."""
    b = stage(world=0.0)
    b.lamp(sun_lamp(matrix(axis=(0.0, 0.0, 1.0)), 2.0 * WHITE, 0.0))
    scattering, absorption = np.array([0.3, 0.8, 1.5]), np.array([0.2, 0.0, 0.5])
    cube(b, ramp(absorption, scattering))
    y, z = np.linspace(-1.0, 1.0, 2001)[:, None, None], np.linspace(-0.8, 0.8, 401)[None, :, None]
    depth = (scattering + absorption) * ((1.0 + y) * (1.0 - z) + 0.5 * (1.0 + y) ** 2)
    integrand = scattering * (1.0 + y) * np.exp(-depth)
    expected = 2.0 / (4.0 * math.pi) * trapezoid(integrand, y[:, 0, 0], axis=0).mean(0)
    agree(picture(b, 2048, max_bounces=0, volume_bounces=0).mean(0), expected, 0.005)


def test_what_only_scatters_is_invisible_in_a_furnace():
    b = stage()
    cube(b, ramp(scattering=(0.5, 1.0, 2.0)))
    agree(picture(b, 256), np.ones(3), 0.01)


def test_overlapping_media_add_up():
    b = stage()
    cube(b, ramp(absorption=SIGMA))
    cube(b, ramp(absorption=0.5 * SIGMA, slope=-1.0), (0.0, 1.0, 0.0))
    cube(b, medium(absorption=0.3), (0.0, 1.01, 0.02))
    agree(picture(b, 128), np.exp(-2.0 * SIGMA - SIGMA - 0.6))


def test_overlapping_media_scatter_like_their_sum():
    """Two ramps, one rising and one falling, and a medium that does not vary, against one of all their coefficients."""

    def image(build, seed):
        b = stage(world=0.3)
        b.lamp(sun_lamp(matrix(axis=(0.0, 0.0, 1.0)), 2.0 * WHITE, 0.0))
        build(b)
        return picture(b, 64, max_bounces=1, volume_bounces=1, seed=seed).mean((0, 1))

    def parts(b):
        cube(b, ramp((0.2, 0.1, 0.0), (0.1, 0.6, 0.2)))
        cube(b, ramp((0.2, 0.1, 0.0), (0.1, 0.6, 0.2), slope=-1.0), size=1.0001)
        cube(b, medium((0.1, 0.0, 0.2), (0.4, 0.2, 0.1)), size=1.0002)

    def whole(b):
        cube(b, medium((0.5, 0.2, 0.2), (0.6, 1.4, 0.5)))

    apart, together = (np.stack([image(build, seed) for seed in range(6)]) for build in (parts, whole))
    error = np.hypot(apart.std(0, ddof=1), together.std(0, ddof=1)) / math.sqrt(6.0)
    assert np.all(error < 0.01 * together.mean(0)), error / together.mean(0)
    assert np.all(np.abs(apart.mean(0) - together.mean(0)) < 4.0 * error), (apart.mean(0), together.mean(0), error)


def test_instances_of_smoke_share_the_bounds_of_its_grid():
    """Two of other coefficients, with the bounds that their programs give, which are sampled for each."""
    values = np.zeros((12, 12, 12))
    values[1:-1, 1:-1, 1:-1] = np.random.default_rng(3).random((10, 10, 10)) ** 2
    to_index = np.column_stack([5.5 * np.eye(3), np.full(3, 5.5)])

    def scene(proportional: bool):
        b = stage()
        name = b.scene.attribute_name("density")
        mesh = box_mesh("smoke", [VoxelAttribute(name, values, to_index)])
        for absorption, y in ((2.0 * SIGMA, 0.0), (SIGMA[::-1], 2.5)):
            material = replace(grid_medium(name, absorption, 0.0), medium_grid=name if proportional else -1)
            b.add(mesh, material, matrix((0.0, y, 0.0)))
        return b.finish(along_y())

    def records(scene):
        slots = [record_from(np.dtype(np.int64), address) for address in scene.instances["majorants"]]
        return [record_from(MAJORANTS, slot) for slot in slots]

    def bounds(record):
        shape = record["nx"], record["ny"], record["nz"]
        steps = np.frombuffer(ctypes.string_at(int(record["bounds"]), 2 * math.prod(shape)), np.uint16)
        return steps * record["bound_unit"]

    shared, apart = scene(True), scene(False)
    by_grid, by_program = records(shared), records(apart)
    assert by_grid[0]["bounds"] == by_grid[1]["bounds"] and by_program[0]["bounds"] != by_program[1]["bounds"]
    for one, other in zip(by_grid, by_program, strict=True):
        assert bounds(one) == pytest.approx(bounds(other), abs=2.0 * one["bound_unit"])


@pytest.mark.parametrize("inside", [medium((0.1, 0.3, 0.0), (0.2, 0.3, 0.8)), ramp((0.1, 0.3, 0.0), (0.2, 0.3, 0.8))])
def test_points_beside_lamps_change_the_noise_and_not_the_mean(monkeypatch, inside):
    """Two points inside, and a sphere outside that rays find as well."""

    def image(seed):
        b = stage(world=0.0)
        b.lamp(point_lamp(matrix((0.3, 0.0, 0.2)), WHITE, 0.0))
        b.lamp(point_lamp(matrix((-0.4, 0.3, -0.2)), WHITE, 0.0))
        b.lamp(point_lamp(matrix((0.0, 0.0, 3.0)), 4.0 * WHITE, 0.5))
        cube(b, inside)
        scene = b.finish(along_y())
        beside = scene.record["flags"] & SCENE_HAS_PIVOTS
        return render(scene, 512, max_bounces=2, volume_bounces=2, pixel_filter="BOX", seed=seed), beside

    def means_and_noise():
        images = np.stack([image(seed)[0] for seed in range(4)])
        means = images.mean((1, 2))
        return means.mean(0), means.std(0, ddof=1) / 2.0, np.median(images.std(0, ddof=1))

    assert image(0)[1]
    mean, error, noise = means_and_noise()
    monkeypatch.setattr("restir_engine.scene.scene.rec.SCENE_HAS_PIVOTS", 0)
    assert not image(0)[1]
    expected, error_without, noise_without = means_and_noise()
    assert np.all(np.abs(mean - expected) < 4.0 * np.hypot(error, error_without)), (mean, expected)
    assert np.all(error < 0.01 * mean)
    assert noise < 0.7 * noise_without, (noise, noise_without)
