"""Camera rays against geometry worked out by hand."""

import math

import numpy as np
import pytest

from restir_engine.kernels.core.jit import kernel
from restir_engine.kernels.core.memory import address, store_f64
from restir_engine.kernels.core.records import CAMERA
from restir_engine.kernels.core.vec import madd, store3_f64
from restir_engine.kernels.geometry.camera import camera_pixel, camera_ray, camera_reach
from restir_engine.scene.camera import Camera


@kernel
def trace(camera, x, y, lens_u, lens_v, out):
    o, d, dp, dd = camera_ray(camera, x, y, lens_u, lens_v)
    store3_f64(out, 0, o)
    store3_f64(out, 3, d)
    store_f64(out, 6, dp)
    store_f64(out, 7, dd)
    store_f64(out, 8, camera_reach(camera, d))


@kernel
def project_ray(camera, x, y, distance, out):
    """Where the film shows a point on the ray through (x, y)."""
    o, d, _, _ = camera_ray(camera, x, y, 0.5, 0.5)
    seen, px, py = camera_pixel(camera, madd(o, d, distance))
    store_f64(out, 0, 1.0 if seen else 0.0)
    store_f64(out, 1, px)
    store_f64(out, 2, py)


def ray(camera: Camera, x: float, y: float, u: float = 0.5, v: float = 0.5):
    """(o, d, dp, dd, reach) of the camera's ray through film point (x, y)."""
    record = np.zeros(1, CAMERA)
    record[0] = camera.record()
    out = np.zeros(9)
    trace(record[0], float(x), float(y), float(u), float(v), address(out))
    return out[:3], out[3:6], out[6], out[7], out[8]


def test_perspective_corners_and_clipping():
    camera = Camera(width=40, height=20, screen=(-1.0, 1.0, -0.5, 0.5), clip_start=0.5, clip_end=10.0)
    o, d, dp, dd, reach = ray(camera, 40, 20)
    np.testing.assert_allclose(d, np.array([1.0, 0.5, -1.0]) / 1.5, atol=1e-12)
    np.testing.assert_allclose(o, [0.5, 0.25, -0.5], atol=1e-12)  # on the near plane
    np.testing.assert_allclose((o + reach * d)[2], -10.0, atol=1e-9)
    step = 1e-6  # pixels: dd is a derivative
    right = np.array([1.0 + 0.05 * step, 0.5, -1.0])
    up = np.array([1.0, 0.5 + 0.05 * step, -1.0])
    spread = [np.linalg.norm(v / np.linalg.norm(v) - d) / step for v in (right, up)]
    np.testing.assert_allclose(dd, np.mean(spread), rtol=1e-5)
    np.testing.assert_allclose(dp, dd * 0.75, rtol=1e-9)


def test_film_region_is_a_window_of_the_frame():
    whole = Camera(width=40, height=20, screen=(-1.0, 1.0, -0.5, 0.5))
    part = Camera(width=40, height=20, screen=(-1.0, 1.0, -0.5, 0.5), region=(12, 5, 8, 8))
    assert part.film_size == (8, 8)
    for a, b in zip(ray(part, 1.25, 2.5), ray(whole, 13.25, 7.5), strict=True):
        np.testing.assert_allclose(a, b)


def test_scale_of_the_camera_object_is_ignored():
    matrix = np.array([[0.0, -2.0, 0.0, 1.0], [3.0, 0.0, 0.0, 2.0], [0.0, 0.0, 5.0, 3.0]])
    o, d, *_ = ray(Camera(to_world=matrix, clip_start=1e-3), 64, 32)
    np.testing.assert_allclose(d, np.array([0.0, 0.5, -1.0]) / math.sqrt(1.25), atol=1e-12)
    np.testing.assert_allclose(o - 1e-3 * math.sqrt(1.25) * d, [1.0, 2.0, 3.0], atol=1e-12)


def test_orthographic():
    camera = Camera(kind="ORTHO", width=10, height=10, screen=(-2.0, 2.0, -2.0, 2.0), clip_start=1.0, clip_end=5.0)
    o, d, dp, dd, reach = ray(camera, 10, 0)
    np.testing.assert_allclose(d, [0.0, 0.0, -1.0])
    np.testing.assert_allclose(o, [2.0, -2.0, -1.0])
    assert (dp, dd, reach) == pytest.approx((0.4, 0.0, 4.0))


@pytest.mark.parametrize(
    ("x", "y", "expected"),
    [
        (8, 4, (0, 0, -1)),
        (12, 4, (1, 0, 0)),
        (4, 4, (-1, 0, 0)),
        (16, 4, (0, 0, 1)),
        (3, 8, (0, 1, 0)),
        (3, 0, (0, -1, 0)),
    ],
)
def test_panorama_directions(x, y, expected):
    o, d, *_ = ray(Camera(kind="PANO", width=16, height=8, clip_start=0.25), x, y)
    np.testing.assert_allclose(d, expected, atol=1e-12)
    np.testing.assert_allclose(o, 0.25 * np.array(expected), atol=1e-12)


def test_panorama_limits():
    camera = Camera(kind="PANO", width=10, height=10, longitude=(0.0, math.pi / 2), latitude=(0.0, math.pi / 4))
    np.testing.assert_allclose(ray(camera, 0, 0)[1], [0, 0, -1], atol=1e-12)
    np.testing.assert_allclose(ray(camera, 10, 0)[1], [1, 0, 0], atol=1e-12)
    np.testing.assert_allclose(ray(camera, 0, 10)[1], np.array([0, 1, -1]) / math.sqrt(2), atol=1e-12)


@pytest.mark.parametrize("kind", ["PERSP", "ORTHO", "PANO"])
@pytest.mark.parametrize("blades", [0, 5])
def test_rays_through_the_lens_meet_in_the_focus(kind, blades):
    lens = Camera(kind=kind, aperture=0.3, focus_distance=4.0, blades=blades, clip_start=1e-9)
    pinhole = Camera(kind=kind, clip_start=1e-9)
    o, d, *_ = ray(pinhole, 50, 20)
    t = 4.0 if kind == "PANO" else 4.0 / -d[2]
    focus = o + t * d
    random = np.random.default_rng(1)
    points = []
    for u, v in random.random((50, 2)):
        o, d, *_ = ray(lens, 50, 20, u, v)
        np.testing.assert_allclose(np.cross(focus - o, d), 0.0, atol=1e-7)
        points.append(o)
    assert np.ptp(points, axis=0).max() > 0.3


@pytest.mark.parametrize("blades", [0, 3, 6])
def test_lens_shape(blades):
    """Uniform on the disk or polygon: the second moment of a regular polygon is known."""
    rotation, ratio = 0.3, 2.0
    camera = Camera(
        kind="ORTHO",
        aperture=0.5,
        blades=blades,
        blade_rotation=rotation,
        aperture_ratio=ratio,
        clip_start=0.0,
        focus_distance=1.0,
    )
    n = 40
    grid = (np.arange(n) + 0.5) / n
    points = np.array([ray(camera, 32, 32, u, v)[0][:2] for u in grid for v in grid])
    points[:, 0] *= ratio
    radius = np.hypot(*points.T) / 0.5
    assert radius.max() <= 1.0
    if blades == 0:
        expected = 0.5
    else:
        half = math.pi / blades
        expected = (2.0 + math.cos(2.0 * half)) / 6.0
        # No point lies beyond a side; the first one faces the rotation.
        normals = rotation + 2.0 * half * np.arange(blades)
        along = points @ np.array([np.cos(normals), np.sin(normals)])
        assert along.max() / 0.5 <= math.cos(half) + 1e-9
    assert np.mean(radius**2) == pytest.approx(expected, rel=0.01)
    np.testing.assert_allclose(points.mean(axis=0), 0.0, atol=0.01)


TURNED = np.array([[0.0, -1.0, 0.0, 1.0], [0.6, 0.0, 0.8, 2.0], [-0.8, 0.0, 0.6, 3.0]])


@pytest.mark.parametrize("kind", ["PERSP", "ORTHO", "PANO"])
def test_points_appear_where_their_rays_began(kind):
    camera = Camera(
        kind=kind, to_world=TURNED, width=40, height=20, screen=(-1.0, 1.0, -0.6, 0.4), region=(3, 2, 30, 15)
    )
    record = np.zeros(1, CAMERA)
    record[0] = camera.record()
    out = np.zeros(3)
    for x, y, distance in [(0.0, 0.0, 0.0), (3.3, 9.1, 2.0), (29.9, 14.5, 50.0)]:
        project_ray(record[0], x, y, distance, address(out))
        np.testing.assert_allclose(out, [1.0, x, y], atol=1e-9)
    project_ray(record[0], 4.0, 4.0, -5.0, address(out))
    assert out[0] == (1.0 if kind == "PANO" else 0.0)
