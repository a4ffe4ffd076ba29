"""Spheres and strands: what rays hit of them, with closed forms beside it."""

import math

import numpy as np
import pytest

from restir_engine.kernels.core import records as rec
from restir_engine.kernels.core.jit import kernel
from restir_engine.kernels.core.memory import address, store_f64
from restir_engine.kernels.core.records import shading_point_at
from restir_engine.kernels.core.vec import load3_f64, store3_f64, vec
from restir_engine.kernels.geometry.intersect import intersect, occluded
from restir_engine.kernels.geometry.surface import offset_origin, surface_point
from restir_engine.scene.description import SceneDescription
from restir_engine.scene.instances import build_instances
from restir_engine.scene.shaders import Program
from restir_engine.scene.spheres import Spheres
from restir_engine.scene.strands import Strands

FIELDS = 16


@kernel
def hits(scene, scratch, sp, rays, out, n):
    sp = shading_point_at(sp, 0)
    for i in range(n):
        o, d = load3_f64(rays, 6 * i), load3_f64(rays, 6 * i + 3)
        t, instance, primitive, u, v = intersect(scene, scratch, o, d, 0.0, 1.0e30, rec.RAY_ALL)
        at = FIELDS * i
        store_f64(out, at, t)
        store_f64(out, at + 1, float(instance))
        if instance < 0:
            continue
        surface_point(scene, sp, instance, primitive, u, v, t, d)
        store3_f64(out, at + 2, vec(sp.p))
        store3_f64(out, at + 5, vec(sp.n))
        store3_f64(out, at + 8, vec(sp.dpdu))
        store_f64(out, at + 11, float(primitive))
        store_f64(out, at + 12, sp.u)
        store_f64(out, at + 13, sp.v)
        # Whether a ray that leaves by the normal, or goes on, meets the shape itself.
        away = offset_origin(sp, vec(sp.n))
        store_f64(out, at + 14, 1.0 if occluded(scene, scratch, away, vec(sp.n), 1.0e30, rec.RAY_ALL) else 0.0)
        beyond = offset_origin(sp, d)
        store_f64(out, at + 15, 1.0 if occluded(scene, scratch, beyond, d, 1.0e30, rec.RAY_ALL) else 0.0)


class Hits:
    """What rays (n, 6) hit of a shape under a matrix."""

    def __init__(self, shape, rays, matrix=None) -> None:
        description = SceneDescription()
        description.shaders.add(Program())
        description.meshes.append(shape)
        description.material_slots = np.zeros(1, np.int32)
        matrix = np.eye(4)[:3] if matrix is None else matrix
        description.instances = build_instances(
            matrix.reshape(1, 12), np.zeros(1, int), n_materials=1, seen_by=rec.RAY_ALL | rec.RAY_SHADOW
        )
        self.scene = description.commit()
        rays = np.ascontiguousarray(rays, np.float64)
        rays[:, 3:] /= np.linalg.norm(rays[:, 3:], axis=1, keepdims=True)
        scratch = np.zeros(rec.SCRATCH_BYTES + 64, np.uint8)
        scratch = scratch[-address(scratch) % 64 :]
        sp = np.zeros(1, rec.SHADING_POINT)
        out = np.zeros((len(rays), FIELDS))
        hits(self.scene.record, address(scratch), address(sp), address(rays), address(out), len(rays))
        self.rays, self.t, self.hit = rays, out[:, 0], out[:, 1] >= 0
        self.p, self.n, self.dpdu = out[:, 2:5], out[:, 5:8], out[:, 8:11]
        self.primitive, self.u, self.v = out[:, 11].astype(int), out[:, 12], out[:, 13]
        self.away, self.beyond = out[:, 14] > 0, out[:, 15] > 0

    def on_rays(self):
        """Where the rays are at the distances of their hits."""
        return self.rays[:, :3] + self.t[:, None] * self.rays[:, 3:]


def random_rays(n, spread, seed=1):
    """Rays from a sphere of radius 5 to points of a ball of radius `spread`."""
    rng = np.random.default_rng(seed)
    o = rng.normal(size=(n, 3))
    o *= 5.0 / np.linalg.norm(o, axis=1, keepdims=True)
    return np.concatenate([o, spread * rng.uniform(-1, 1, (n, 3)) - o], axis=1)


TURNED = np.array([[0.8, -0.6, 0.0, 0.4], [0.6, 0.8, 0.0, -0.2], [0.0, 0.0, 1.0, 0.3]])


def test_sphere():
    """A unit sphere: hits where the quadratic equation says, normals from the centre, nothing seen from within."""
    found = Hits(Spheres([[0, 0, 0]], [1.0]), random_rays(1000, 1.4))
    o, d = found.rays[:, :3], found.rays[:, 3:]
    b = (o * d).sum(1)
    square = b * b - (o * o).sum(1) + 1.0
    clear = np.abs(square) > 1e-5
    np.testing.assert_array_equal(found.hit[clear], square[clear] > 0.0)
    hit = found.hit
    np.testing.assert_allclose(found.t[hit & clear], (-b - np.sqrt(np.maximum(square, 0.0)))[hit & clear], atol=2e-4)
    np.testing.assert_allclose(np.linalg.norm(found.p[hit], axis=1), 1.0, atol=1e-6)
    np.testing.assert_allclose(found.n[hit], found.p[hit], atol=1e-6)
    assert not found.away[hit].any() and not found.beyond[hit].any()
    inside = Hits(Spheres([[0, 0, 0]], [1.0]), np.concatenate([0.1 * o, d], axis=1))
    assert not inside.hit.any()


@pytest.mark.parametrize("shape", [rec.SHAPE_TUBES, rec.SHAPE_CONES, rec.SHAPE_RIBBONS])
def test_straight_strand(shape):
    """A straight strand of radius 0.2 along z is a cylinder; the ribbon in its place is as wide from everywhere."""
    points = np.array([[0, 0, z] for z in np.linspace(-20, 20, 9)])
    strand = Strands(points, np.full(9, 0.2), [0, 9], shape)
    found = Hits(strand, random_rays(2000, 0.5, 2), np.concatenate([TURNED[:, :3] * 2.0, TURNED[:, 3:]], axis=1))
    axis, foot = TURNED[:, 2], TURNED[:, 3]
    o, d = found.rays[:, :3] - foot, found.rays[:, 3:]
    across = np.cross(d, axis)
    size = np.linalg.norm(across, axis=1)
    distance = (o * across).sum(1) / size  # between the ray and the axis
    clear = (np.abs(np.abs(distance) - 0.4) > 1e-4) & (size > 0.2)
    np.testing.assert_array_equal(found.hit[clear], (np.abs(distance) < 0.4)[clear])
    hit = found.hit & clear
    np.testing.assert_allclose(found.p[hit], found.on_rays()[hit], atol=2e-3)
    np.testing.assert_allclose(np.linalg.norm(found.n[hit], axis=1), 1.0, atol=1e-6)
    np.testing.assert_allclose((found.n @ axis)[hit], 0.0, atol=1e-6)
    np.testing.assert_allclose(found.dpdu[hit] @ axis, 10.0, rtol=1e-5)
    # The normal is that of the cylinder where the ray meets it, of ribbons too.
    near = (-(o * d).sum(1) + (o @ axis) * (d @ axis)) / size**2
    t = near - np.sqrt(np.maximum(0.16 - distance**2, 0.0)) / size
    there = o + t[:, None] * d
    radial = there - (there @ axis)[:, None] * axis
    np.testing.assert_allclose(found.n[hit], (radial / 0.4)[hit], atol=5e-3)
    place = (found.p - foot) @ axis / 2.0 + 20.0
    np.testing.assert_allclose((found.primitive + found.u)[hit], (place / 5.0)[hit], atol=1e-3)
    assert not found.away[hit].any()
    assert hit.sum() > 500 and not found.beyond[hit].any()


@pytest.mark.parametrize("shape", [rec.SHAPE_TUBES, rec.SHAPE_RIBBONS])
def test_catmull_rom(shape):
    """A bent strand passes through its points, along the curve of Catmull and Rom with its ends doubled."""
    rng = np.random.default_rng(3)
    points = np.cumsum(rng.normal(size=(6, 3)) * 0.1 + (0.0, 0.0, 0.3), axis=0)
    radii = np.linspace(0.02, 0.01, 6)
    found = Hits(Strands(points, radii, [0, 6], shape, 16), random_rays(20000, 1.0, 4))
    hit = found.hit
    assert hit.sum() > 100
    k, u = found.primitive[hit], found.u[hit][:, None]
    padded = np.concatenate([points[:1], points, points[-1:]])
    a, b, c, d = (padded[k + i] for i in range(4))
    curve = 0.5 * (2 * b + (c - a) * u + (2 * a - 5 * b + 4 * c - d) * u**2 + (3 * b - a - 3 * c + d) * u**3)
    tangent = 0.5 * ((c - a) + 2 * (2 * a - 5 * b + 4 * c - d) * u + 3 * (3 * b - a - 3 * c + d) * u**2)
    away = found.p[hit] - curve
    inside = ((away * found.rays[hit, 3:]).sum(1) > 0.0) & (shape == rec.SHAPE_TUBES)  # at the open ends
    np.testing.assert_allclose(found.dpdu[hit], np.where(inside, -1.0, 1.0)[:, None] * tangent, atol=1e-5)
    np.testing.assert_allclose((found.n[hit] * tangent).sum(1), 0.0, atol=1e-6)
    np.testing.assert_allclose(found.on_rays()[hit], found.p[hit], atol=4e-3)
    assert (np.linalg.norm(away, axis=1) < 0.0215).all()
    if shape == rec.SHAPE_TUBES:
        normal = np.where(inside, -1.0, 1.0)[:, None] * away / np.linalg.norm(away, axis=1, keepdims=True)
        np.testing.assert_allclose(found.n[hit], normal, atol=1e-5)


def test_round_ends_of_cones():
    """A strand of two points and one radius, as cone between spheres, is a capsule."""
    found = Hits(Strands([[0, 0, -1], [0, 0, 1]], [0.5, 0.5], [0, 2], rec.SHAPE_CONES), random_rays(3000, 2.0, 5))
    p = found.p[found.hit]
    nearest = np.clip(p[:, 2], -1.0, 1.0)[:, None] * (0.0, 0.0, 1.0)
    np.testing.assert_allclose(np.linalg.norm(p - nearest, axis=1), 0.5, atol=1e-5)
    np.testing.assert_allclose((p - nearest) / 0.5, found.n[found.hit], atol=1e-4)
    np.testing.assert_allclose(found.on_rays()[found.hit], p, atol=2e-3)
    assert found.hit.mean() > 0.1 and (np.abs(p[:, 2]) > 1.0).any()
    np.testing.assert_allclose(found.u[found.hit], 0.5 + 0.5 * nearest[:, 2], atol=1e-4)


def test_tapered_cone():
    """A cone from radius 0.5 to 0.1: normals tilt by the angle whose sine is the difference over the length."""
    found = Hits(Strands([[0, 0, 0], [0, 0, 2]], [0.5, 0.1], [0, 2], rec.SHAPE_CONES), random_rays(3000, 1.0, 6))
    sine = 0.2
    inside = found.hit & (found.u > 1e-3) & (found.u < 1.0 - 1e-3)
    np.testing.assert_allclose(found.n[inside, 2], sine, atol=1e-6)
    radius = np.hypot(found.p[inside, 0], found.p[inside, 1])
    centre = 2.0 * found.u[inside]
    np.testing.assert_allclose(radius, (0.5 - 0.2 * centre) * math.sqrt(1 - sine**2), atol=1e-6)
    np.testing.assert_allclose(found.on_rays()[inside], found.p[inside], atol=2e-3)


def test_what_is_not_finite_has_no_segments():
    strands = Strands(
        [[0, 0, 0], [0, 0, 1], [np.nan, 0, 0], [1, 0, 1], [2, 0, 0], [3, 0, 0], [3, 0, 1]],
        np.full(7, 0.1),
        [0, 2, 4, 5, 5, 7],
    )
    record = strands.record()
    assert strands.count == 2 and record["shape"] == rec.SHAPE_RIBBONS
    np.testing.assert_array_equal(strands.arrays["segments"], [0, 13])
    np.testing.assert_array_equal(strands.arrays["strands"], [0, 4])
    points = strands.points
    np.testing.assert_array_equal(points[[0, 3]], points[[1, 2]])
    np.testing.assert_array_equal(points[13:17, :3], [[3, 0, 0], [3, 0, 0], [3, 0, 1], [3, 0, 1]])
    spheres = Spheres([[0, 0, 0], [np.inf, 0, 0]], [1.0, 1.0])
    np.testing.assert_array_equal(spheres.points[1], 0.0)
