"""The world's importance map, and emissive triangles, against their densities and closed forms."""

import math
import time

import numpy as np
import pytest
from scipy.stats import chi2

from restir_engine.kernels.core import records as rec
from restir_engine.scene.description import SceneDescription
from restir_engine.scene.lamps import area_lamp, point_lamp, portal
from restir_engine.scene.lights import LightTable
from restir_engine.scene.scene import Scene
from testing.kernels.lights import draw, irradiance, seen, triangle_densities
from testing.measures import close, polygon_irradiance
from testing.scenes.lamps import UP, WHITE
from testing.scenes.lights import emission_program, lamp_scene, matrix, mesh_description, mesh_scene

QUAD = np.array([(-1, -0.5, 2), (1, -0.5, 2), (1, 0.5, 2), (-1, 0.5, 2)], float)
TWO = [(0, 1, 2), (0, 2, 3)]


def world_scene(width=64, portals=(), **world) -> Scene:
    scene = SceneDescription()
    scene.lights.portals += portals
    scene.world.material = scene.shaders.add(emission_program((2.0, 2.0, 2.0)))
    scene.world.map_width = width
    for name, value in world.items():
        setattr(scene.world, name, value)
    return scene.commit()


def paint(scene: Scene, values: np.ndarray) -> None:
    """Put another map in the place of the baked one (the program emits the same in all directions)."""
    bands = np.diff(-np.cos(np.pi * np.arange(len(values) + 1) / len(values)))
    scene.world._record.flags.writeable = True
    scene.world._put_map(values.astype(np.float32), bands)


def test_world_is_baked():
    scene = world_scene()
    assert scene.world.sampled
    assert scene.world.mean == pytest.approx(2.0, rel=1e-6)
    directions = np.random.default_rng(1).normal(size=(1000, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    found = seen(scene, (0, 0, 0), directions)
    np.testing.assert_allclose(found[:, :3], 2.0)
    np.testing.assert_allclose(found[:, 3], 1.0 / (4.0 * math.pi), rtol=1e-3)
    close(irradiance(scene, (0, 0, 0), UP), 2.0 * math.pi)


@pytest.mark.parametrize("sun", [False, True])
def test_world_map_chi_squared(sun):
    rng = np.random.default_rng(3)
    height, width = 16, 32
    scene = world_scene(width)
    paint(scene, rng.random((height, width)) ** 8 + 0.01)
    if sun:
        table = scene.world.record
        table["map"], table["sun"] = 0.5, 0.5
        table["sun_direction"], table["sun_one_minus_cos"] = np.array((0.3, -0.5, 0.8)) / np.sqrt(0.98), 0.03
    n = 40_000
    s = draw(scene, (1.0, 2.0, 3.0), n)
    assert s[:, 0].all()
    found = seen(scene, (1.0, 2.0, 3.0), s[:, 1:4])
    assert (np.abs(found[:, 3] / s[:, 4] - 1.0) < 1e-6).mean() > 0.999
    inverse = 1.0 / s[:, 4]
    close((inverse.mean(), inverse.std() / math.sqrt(n)), 4.0 * math.pi)
    u = 0.5 - np.arctan2(s[:, 2], s[:, 1]) / (2 * np.pi)
    v = 1.0 - np.arccos(s[:, 3]) / np.pi
    cells = np.minimum((v * height).astype(int), height - 1) * width + np.minimum((u * width).astype(int), width - 1)
    observed = np.bincount(cells, minlength=height * width)
    fine = 16
    fu, fv = np.meshgrid(
        (np.arange(width * fine) + 0.5) / (width * fine), (np.arange(height * fine) + 0.5) / (height * fine)
    )
    theta, phi = (1.0 - fv) * np.pi, (0.5 - fu) * 2 * np.pi
    directions = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=-1)
    density = seen(scene, (1.0, 2.0, 3.0), directions.reshape(-1, 3))[:, 3].reshape(fu.shape)
    density *= np.sin(theta) * 2 * np.pi**2 / (width * height * fine * fine)
    expected = n * density.reshape(height, fine, width, fine).sum(axis=(1, 3)).ravel()
    assert expected.sum() == pytest.approx(n, rel=5e-3)
    keep = expected > 20.0
    error = np.maximum(np.abs(observed[keep] - expected[keep]) - 0.02 * expected[keep], 0.0)
    assert (error**2 / expected[keep]).sum() < chi2.ppf(1.0 - 1e-4, keep.sum())


PORTALS = [
    portal(matrix((0.3, 0.0, 1.0)), 2.0, 1.0),
    portal(matrix((0.0, 0.5, 2.0), (0.1, 0.3, 1.0)), 2.5, 2.5, ellipse=True),  # some see it behind the first
    portal(matrix((0.0, 0.0, -1.0)), 4.0, 4.0),  # seen from behind
]


@pytest.mark.parametrize("point", [(0.0, 0.0, 0.0), (1.5, 1.0, 0.9), (0.0, 0.0, -30.0), (0.0, 0.0, 5.0)])
@pytest.mark.parametrize("width", [0, 32])
def test_portals(width, point):
    """Directions through portals and by the map: their density, and the same light as without portals."""
    scene = world_scene(width, portals=PORTALS)
    if width:
        paint(scene, np.random.default_rng(3).random((16, 32)) ** 8 + 0.01)
    s = draw(scene, point, 20_000)
    s = s[s[:, 0] > 0.0]
    seen_portals = point[2] < 3.0
    assert len(s) == (20_000 if width or seen_portals else 0)
    found = seen(scene, point, s[:, 1:4])
    assert len(s) == 0 or (np.abs(found[:, 3] / s[:, 4] - 1.0) < 1e-6).mean() > 0.999
    directions = np.random.default_rng(4).normal(size=(20_000, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    density = seen(scene, point, directions)[:, 3] * 4.0 * math.pi
    if len(s):
        close((density.mean(), density.std() / math.sqrt(len(density))), 1.0)
        measure = 1.0 / s[:, 4]
        drawn = 4.0 * math.pi * np.array((np.mean(density > 0.0), np.std(density > 0.0) / math.sqrt(len(density))))
        error = math.hypot(drawn[1], measure.std() / math.sqrt(len(s)))
        assert abs(measure.mean() - drawn[0]) < 4.0 * error + 1e-6
    assert not width or (density > 0.0).all()


def test_world_that_is_not_sampled():
    scene = world_scene(0)
    assert not draw(scene, (0, 0, 0), 20)[:, 0].any()
    np.testing.assert_allclose(seen(scene, (0, 0, 0), [UP])[0], [2.0, 2.0, 2.0, 0.0])
    scene = world_scene(seen_by=rec.RAY_ALL & ~rec.RAY_CAMERA)
    assert not seen(scene, (0, 0, 0), [UP], rec.RAY_CAMERA)[0, :3].any()


@pytest.mark.parametrize("point", [(0, 0, 0), (2.0, 1.0, 0.5), (0.2, 0.1, 1.95), (0.0, 0.0, -60.0), (0.3, 0.2, 3.0)])
def test_emissive_quad(point):
    normal = np.array(UP) if point[2] < 2.0 else -np.array(UP)
    exact = polygon_irradiance(QUAD, np.asarray(point, float), normal)
    scene = mesh_scene(QUAD, TWO, emission_program(WHITE))
    close(irradiance(scene, point, normal), exact)
    s = draw(scene, point, 1000)
    s = np.ascontiguousarray(s[s[:, 0] > 0.0])
    np.testing.assert_allclose(triangle_densities(scene, point, s), s[:, 4], rtol=1e-4)


def test_emissive_instances():
    """Three instances, one mirrored and one stretched, beside a lamp: the sum of their light."""
    stretched = np.diag([2.0, 0.5, 1.0]) @ matrix()[:, :3]
    matrices = [
        matrix(),
        np.column_stack([np.diag([-1.0, 1.0, 1.0]), (3.0, 0.0, 0.0)]),
        np.column_stack([stretched, (0.0, 2.0, -0.5)]),
    ]
    scene = mesh_description(QUAD, TWO, emission_program(WHITE), matrices)
    lamp = area_lamp(matrix((-2.0, 0.0, 1.5)), (5.0, 5.0, 5.0), 1.0, 1.0)
    scene.lights.lamps = lamp
    scene = scene.commit()
    shares = scene.lights.record
    assert shares["lamps"] + shares["triangles"] + shares["world"] == pytest.approx(1.0)
    point = np.array((0.4, 0.6, 0.1))
    exact = irradiance(lamp_scene(lamp), point, UP)[0]
    for m in matrices:
        exact += polygon_irradiance([m[:, :3] @ c + m[:, 3] for c in QUAD], point, np.array(UP))
    close(irradiance(scene, point, UP), exact, 1e-3)
    s = draw(scene, point, 3000)
    s = np.ascontiguousarray(s[(s[:, 0] > 0.0) & (s[:, 8] == -1.0)])
    assert set(s[:, 9]) == {0.0, 1.0, 2.0}
    np.testing.assert_allclose(triangle_densities(scene, point, s), s[:, 4], rtol=1e-4)


def test_sides_of_emission():
    front, back = emission_program(WHITE, 2), emission_program(WHITE, 3)
    below, above = (0, 0, 0), (0, 0, 4)  # the quad's front looks up
    assert not draw(mesh_scene(QUAD, TWO, front), below, 50)[:, 0].any()
    assert draw(mesh_scene(QUAD, TWO, front), above, 50)[:, 0].all()
    assert draw(mesh_scene(QUAD, TWO, back), below, 50)[:, 0].all()
    assert not draw(mesh_scene(QUAD, TWO, emission_program(WHITE, 0)), below, 50)[:, 0].any()


def test_triangle_chi_squared():
    """A near triangle, sampled by solid angle: equal counts in parts of equal solid angle."""
    corners = np.array([(-1.0, -0.7, 0.4), (1.2, -0.5, 0.6), (0.1, 1.0, 0.3)])
    scene = mesh_scene(corners, [(0, 1, 2)], emission_program(WHITE))
    n = 20_000
    s = draw(scene, (0, 0, 0), n)
    assert s[:, 0].all()
    angle = 1.0 / s[0, 4]
    np.testing.assert_allclose(s[:, 4], s[0, 4], rtol=1e-6)
    middle = corners.mean(axis=0)
    frame = matrix((0, 0, 0), middle)[:, :3]

    def bins(directions):
        local = directions @ frame
        x, y = local[:, 0] / local[:, 2], local[:, 1] / local[:, 2]
        return np.clip((x + 4.0) * 2.0, 0, 15).astype(int) * 16 + np.clip((y + 4.0) * 2.0, 0, 15).astype(int)

    observed = np.bincount(bins(s[:, 1:4]), minlength=256)
    rng = np.random.default_rng(1)
    d = rng.normal(size=(1_500_000, 3))
    a, b, c = corners
    inside = (d @ np.cross(a, b) > 0) & (d @ np.cross(b, c) > 0) & (d @ np.cross(c, a) > 0)
    reference = np.bincount(bins(d[inside] / np.linalg.norm(d[inside], axis=1)[:, None]), minlength=256)
    assert angle == pytest.approx(4 * np.pi * inside.mean(), rel=0.01)
    expected = reference * (n / reference.sum())
    keep = expected > 20.0
    variance = expected[keep] * (1.0 + n / reference.sum())
    assert ((observed[keep] - expected[keep]) ** 2 / variance).sum() < chi2.ppf(1.0 - 1e-4, keep.sum())


def test_million_triangles():
    rng = np.random.default_rng(2)
    n = 1000
    x, y = np.meshgrid(np.linspace(-1, 1, n + 1), np.linspace(-1, 1, 501))
    vertices = np.stack([x, y, 2.0 + 0.01 * rng.random(x.shape)], axis=-1).reshape(-1, 3)
    i = (np.arange(500)[:, None] * (n + 1) + np.arange(n)).ravel()
    triangles = np.concatenate([np.stack([i, i + 1, i + n + 2], 1), np.stack([i, i + n + 2, i + n + 1], 1)])
    scene = mesh_scene(vertices, triangles, emission_program(WHITE))
    start = time.process_time()
    LightTable(scene, scene.lights.lamps)
    assert time.process_time() - start < 1.0
    # Each triangle is so small that its middle stands for it; what hides behind others counts too.
    a, b, c = vertices[triangles.T]
    middle, normal = (a + b + c) / 3.0, 0.5 * np.cross(b - a, c - a)
    distance2 = (middle**2).sum(1)
    exact = (np.abs((normal * middle).sum(1)) * middle[:, 2] / distance2**2).sum()
    close(irradiance(scene, (0, 0, 0), UP, 50_000), exact, 1e-3)


def test_no_light_at_all():
    scene = mesh_scene(QUAD, TWO, emission_program((0.0, 0.0, 0.0)))
    assert not draw(scene, (0, 0, 0), 20)[:, 0].any()
    scene = lamp_scene(point_lamp(matrix((0, 0, 2)), (0.0, 0.0, 0.0), 0.1))
    assert not draw(scene, (0, 0, 0), 20)[:, 0].any()
