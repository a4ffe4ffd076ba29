"""How PATH chooses light by what it brings to a point: the tree over emissive triangles, the kinds of light.

And how rays find lamps.
"""

import numpy as np
import pytest

from restir_engine.kernels.core.jit import kernel
from restir_engine.kernels.core.memory import address, load_i32, store_f64
from restir_engine.kernels.core.records import (
    RAY_CAMERA,
    SCRATCH_BYTES,
    SCRATCH_POINT,
    emitter_at,
    emitter_group_at,
    light_table_at,
    shading_point_at,
    world_table_at,
)
from restir_engine.kernels.core.vec import load3_f64, put, store3_f64, vec
from restir_engine.kernels.lights import lights_intersect, note_choice
from restir_engine.kernels.lights.choice import world_brings
from restir_engine.kernels.lights.emitter_tree import TOP, choose_triangle, triangle_share, triangles_bring
from restir_engine.scene import emitter_tree, lights
from restir_engine.scene.emitter_tree import is_closed
from restir_engine.scene.lamps import point_lamp
from restir_engine.scene.world import irradiance_polynomial, map_directions
from testing.kernels.lights import draw, irradiance, triangle_densities
from testing.scenes.lights import emission_program, matrix
from testing.scenes.rooms import Builder, checkered, look, scaled
from testing.scenes.shapes import CUBE, QUAD, ball, icosphere

POINTS = [((0.3, -0.2, 0.5), 1.0), ((2.0, 1.0, -0.3), 0.0), ((0.0, 0.0, 6.0), -1.0)]


@kernel
def choose_kernel(scene, x, y, z, up, n, out):
    """[instance, primitive, probability] for n numbers u, the middles of n equal parts of [0, 1)."""
    table = light_table_at(scene.light_table, 0)
    for i in range(n):
        index, k, _, p = choose_triangle(table, (x, y, z), (0.0, 0.0, up), (i + 0.5) / n)
        emitter = emitter_at(table.emitters, index)
        store_f64(out, 3 * i, float(emitter.instance))
        store_f64(out, 3 * i + 1, float(load_i32(emitter_group_at(table.groups, emitter.group).primitives, k)))
        store_f64(out, 3 * i + 2, p)


@kernel
def share_kernel(scene, x, y, z, up, most, out):
    """The probability of each triangle: float64 [emitters, most]."""
    table = light_table_at(scene.light_table, 0)
    for index in range(table.n_emitters):
        emitter = emitter_at(table.emitters, index)
        group = emitter_group_at(table.groups, emitter.group)
        for k in range(group.n):
            primitive = load_i32(group.primitives, k)
            p = triangle_share(table, emitter, group, primitive, (x, y, z), (0.0, 0.0, up))
            store_f64(out, most * emitter.instance + primitive, p)


@kernel
def brought_kernel(scene, scratch, x, y, z, up, out):
    """[shares of the kinds, what triangles bring, what the world brings]."""
    sp = shading_point_at(scratch + SCRATCH_POINT, 0)
    put(sp.p, (x, y, z))
    put(sp.n, (0.0, 0.0, up))
    sp.n_closures = 0
    note_choice(scene, sp)
    store3_f64(out, 0, vec(sp.light_shares))
    store_f64(out, 3, triangles_bring(light_table_at(scene.light_table, 0), (x, y, z), (0.0, 0.0, up)))
    if scene.world_table != 0:
        store_f64(out, 4, world_brings(world_table_at(scene.world_table, 0), (0.0, 0.0, 0.0), (0.0, 0.0, up)))


def lit_scene(lamp: bool = False):
    """Luminous cubes, a tilted quad and a ball of unlike power, some mirrored and stretched."""
    b = Builder()
    random = np.random.default_rng(2)
    for place in random.uniform(-3, 3, (9, 3)):
        b.add(CUBE, emission_program(tuple(random.uniform(0.1, 4, 3))), scaled(matrix(tuple(place)), 0.2, -0.1, 0.3))
    b.add(QUAD, emission_program((1.0, 2.0, 1.0)), scaled(matrix((0.0, 1.0, 2.0), (0.3, 0.2, -1.0)), 0.5, 2.0, 1.0))
    b.add(ball(0.4, 16), emission_program((3.0, 1.0, 1.0)), matrix((-1.0, 2.0, 0.5)))
    if lamp:
        b.lamp(point_lamp(matrix((0.0, 0.0, 1.5)), 20.0 * np.ones(3), 0.1))
    return b.finish(look((0.0, -5.0, 1.0), (0.0, 0.0, 0.0), 8))


@pytest.fixture(params=[1 << 18, 24], ids=["leaves of one", "runs"])
def scene(request, monkeypatch):
    monkeypatch.setattr(emitter_tree, "_MOST_LEAVES", request.param)
    return lit_scene()


@pytest.mark.parametrize("point, up", POINTS)
def test_probabilities_of_all_triangles_sum_to_one_and_are_those_chosen_by(scene, point, up):
    most = max(len(mesh.triangles) for mesh in scene.meshes)
    shares = np.zeros((len(scene.instances), most))
    share_kernel(scene.record, *point, up, most, address(shares))
    assert shares.sum() == pytest.approx(1.0, abs=1e-6)
    n = 200_000
    out = np.zeros((n, 3))
    choose_kernel(scene.record, *point, up, n, address(out))
    instances, primitives = out[:, :2].astype(int).T
    np.testing.assert_allclose(out[:, 2], shares[instances, primitives], rtol=1e-5)
    counts = np.zeros_like(shares)
    np.add.at(counts, (instances, primitives), 1.0)
    # Numbers in even steps meet an interval as often as it is long, give or take one; a leaf has few intervals.
    assert np.abs(counts - n * shares).max() < 2.0 * TOP


def test_every_triangle_that_emits_has_a_chance(scene):
    shares = np.zeros((len(scene.instances), max(len(mesh.triangles) for mesh in scene.meshes)))
    share_kernel(scene.record, 0.0, 0.0, 6.0, 1.0, shares.shape[1], address(shares))
    for instance, row in zip(scene.instances, shares, strict=True):
        assert (row[: len(scene.meshes[instance["mesh"]].triangles)] > 0.0).all()


def pictures():
    """Two quads whose emission is a checkerboard, bright on less than half of it; one is mirrored and stretched."""
    b = Builder()
    board = checkered((30.0, 20.0, 10.0), (0.0, 0.1, 0.2), 1.3)
    b.add(QUAD, board, scaled(matrix((0.3, 0.2, 1.5), (0.2, 0.1, -1.0)), 1.5, 1.0, 1.0))
    b.add(QUAD, board, scaled(matrix((-2.0, 1.0, 0.5), (1.0, -0.4, 0.1)), -0.5, 0.8, 1.0))
    return b.finish(look((0.0, -5.0, 1.0), (0.0, 0.0, 0.0), 8))


@pytest.mark.parametrize("point", [(0.0, 0.0, 0.0), (0.3, 0.2, 1.4), (9.0, -7.0, 5.0)])
def test_points_of_pictures_are_found_again_with_their_density(point):
    """Near the quad, beside it and far away; but for points at the edges of cells, by rounding."""
    scene = pictures()
    samples = draw(scene, point, 5000)
    samples = samples[samples[:, 0] > 0.0]
    found = triangle_densities(scene, point, samples)
    assert len(samples) > 1000
    assert np.isclose(found, samples[:, 4], rtol=1e-3).mean() > 0.99


@pytest.mark.parametrize(("point", "most"), [((0.0, 0.0, -2.0), 0.6), ((0.0, 0.0, 0.0), 1.2), ((0.3, 0.2, 1.2), 2.2)])
def test_what_is_bright_in_a_picture_is_sampled_more(point, most, monkeypatch):
    """The same irradiance as without cells, within four standard errors; farther away than a picture is long, by less
    of the variance; just before it, where every second sample is of all of it, by twice that at most."""
    mean, error = irradiance(pictures(), point, (0.0, 0.0, 1.0))
    monkeypatch.setattr(lights, "_MOST_CELLS", 1)
    plain, plain_error = irradiance(pictures(), point, (0.0, 0.0, 1.0))
    assert mean == pytest.approx(plain, abs=4.0 * np.hypot(error, plain_error))
    assert error**2 < most * plain_error**2


def test_what_is_near_is_chosen_more_often():
    scene = lit_scene()
    shares = np.zeros((len(scene.instances), max(len(mesh.triangles) for mesh in scene.meshes)))
    far = np.zeros_like(shares)
    share_kernel(scene.record, *scene.instances["location"][4] + (0.0, 0.0, 0.6), 0.0, shares.shape[1], address(shares))
    share_kernel(scene.record, 0.0, 0.0, 30.0, 0.0, shares.shape[1], address(far))
    assert shares[4].sum() > 2.0 * far[4].sum()


def test_the_kinds_share_by_what_they_bring():
    """Beside the lamp it is the lamp that is sampled, beside a luminous cube the triangles."""
    scene = lit_scene(lamp=True)
    memory, out = np.zeros(SCRATCH_BYTES, np.uint8), np.zeros(5)

    def shares(point):
        brought_kernel(scene.record, address(memory), *point, 0.0, address(out))
        assert out[:3].sum() == pytest.approx(1.0)
        return out[:3].copy()

    assert shares((0.0, 0.0, 1.2))[0] > 0.8
    assert shares(scene.instances["location"][4] + (0.0, 0.0, 0.5))[1] > 0.5


@kernel
def nearest_kernel(scene, rays, n, out):
    """[index, t] of the lamp that each of n rays, float64 [n, 6], meets first."""
    for i in range(n):
        o, d = load3_f64(rays, 6 * i), load3_f64(rays, 6 * i + 3)
        light, t = lights_intersect(scene, o, d, 0.0, 1e30, RAY_CAMERA)
        store_f64(out, 2 * i, float(light))
        store_f64(out, 2 * i + 1, t)


@pytest.mark.parametrize("count", [1, 5, 300])
def test_rays_find_the_nearest_lamp(count):
    random = np.random.default_rng(count)
    centers, radii = random.uniform(-3, 3, (count, 3)), random.uniform(0.05, 0.4, count)
    b = Builder()
    b.add(QUAD, emission_program((0.0, 0.0, 0.0)), matrix((0.0, 0.0, -9.0)))
    for center, radius in zip(centers, radii, strict=True):
        b.lamp(point_lamp(matrix(tuple(center)), np.ones(3), radius, soft=False))
    scene = b.finish(look((0.0, -5.0, 1.0), (0.0, 0.0, 0.0), 8))
    n = 4000
    rays = random.normal(size=(n, 6))
    rays[:, :3] *= 3.0
    rays[:, 3:] /= np.linalg.norm(rays[:, 3:], axis=1)[:, None]
    out = np.zeros((n, 2))
    nearest_kernel(scene.record, address(rays), n, address(out))
    w = centers - rays[:, None, :3]
    along = np.einsum("nmi,ni->nm", w, rays[:, 3:])
    root = radii**2 - (w**2).sum(2) + along**2
    outside = (w**2).sum(2) > radii**2  # lamps are seen from outside only
    t = np.where((root > 0.0) & outside & (along > 0.0), along - np.sqrt(np.maximum(root, 0.0)), np.inf)
    clear = (np.abs(root) > 1e-6).all(1) & outside.all(1)
    hit = np.isfinite(t.min(1))
    assert hit[clear].any()
    np.testing.assert_array_equal(out[clear, 0] >= 0.0, hit[clear])
    np.testing.assert_allclose(out[clear & hit, 1], t.min(1)[clear & hit], rtol=1e-5)


def test_irradiance_of_the_world_by_the_normal():
    """Within 2 % of the integral of the cosine for a sky of a wide bright spot."""
    height, width = 64, 128
    u, v = np.meshgrid((np.arange(width) + 0.5) / width, (np.arange(height) + 0.5) / height)
    d = map_directions(u.ravel(), v.ravel())
    values = 1.0 + 3.0 * np.maximum(d @ (0.6, 0.0, 0.8), 0.0) ** 4
    bands = np.diff(-np.cos(np.pi * np.arange(height + 1) / height))
    c = irradiance_polynomial(values.reshape(height, width), bands)
    steps = np.repeat(bands * 2.0 * np.pi / width, width)
    for x, y, z in ((0, 0, 1), (1, 0, 0), (0, 0, -1), (0.6, 0, 0.8), (0, 1, 0)):
        truth = (values * steps) @ np.maximum(d @ (x, y, z), 0.0)
        terms = (1.0, y, z, x, x * y, y * z, 3 * z * z - 1, x * z, x * x - y * y)
        assert np.dot(c, terms) == pytest.approx(truth, rel=0.02)


def test_closed_meshes_are_told_from_open_ones():
    _, triangles = icosphere(1.0, 2)
    assert is_closed(np.asarray(triangles, np.uint32))
    assert not is_closed(np.asarray(triangles[1:], np.uint32))
    assert not is_closed(np.asarray(QUAD[1], np.uint32))
