"""Rays through Embree: hits agree with a brute-force NumPy intersection; masks, instances and occlusion work."""

import numpy as np
import pytest

from restir_engine.embree.scenes import MeshScene, Placed, WorldScene
from restir_engine.kernels.core import records as rec
from restir_engine.kernels.core.jit import kernel
from restir_engine.kernels.core.memory import address, load_f64, store_f64
from restir_engine.kernels.geometry.intersect import intersect, occluded

SHIFT = 5.0


@kernel
def trace(scene, scratch, rays, out, n, mask):
    for i in range(n):
        o = (load_f64(rays, 6 * i), load_f64(rays, 6 * i + 1), load_f64(rays, 6 * i + 2))
        d = (load_f64(rays, 6 * i + 3), load_f64(rays, 6 * i + 4), load_f64(rays, 6 * i + 5))
        t, instance, primitive, u, v = intersect(scene, scratch, o, d, 0.0, 1.0e30, mask)
        store_f64(out, 6 * i, t)
        store_f64(out, 6 * i + 1, float(instance))
        store_f64(out, 6 * i + 2, float(primitive))
        store_f64(out, 6 * i + 3, u)
        store_f64(out, 6 * i + 4, v)
        store_f64(out, 6 * i + 5, 1.0 if occluded(scene, scratch, o, d, 0.5 * t, mask) else 0.0)


class Soup:
    """Random triangles, twice: at the origin for camera rays, and shifted, as an instance, for all rays."""

    def __init__(self) -> None:
        rng = np.random.default_rng(1)
        self.buffer = np.zeros((302, 3), np.float32)
        self.buffer[:300] = (rng.random((100, 1, 3)) + 0.2 * rng.random((100, 3, 3))).reshape(300, 3)
        self.triangles = np.arange(300, dtype=np.uint32).reshape(100, 3)
        vertices = self.buffer[:300]
        transforms = np.tile(np.eye(4)[:3].ravel(), (2, 1)).astype(np.float32)
        transforms[1, 3] = SHIFT
        content = [
            Placed(rec.RAY_CAMERA, transforms[0], vertices=vertices, triangles=self.triangles),
            Placed(rec.RAY_ALL, transforms[1], scene=MeshScene(vertices, self.triangles)),
        ]
        self.top = WorldScene(content)
        self.scene = np.zeros(1, rec.SCENE)
        self.scene[0]["embree"] = self.top.handle
        block = np.zeros(rec.SCRATCH_BYTES + 64, np.uint8)
        self.scratch = block[-address(block) % 64 :]

    def trace(self, rays: np.ndarray, mask: int) -> np.ndarray:
        out = np.zeros((len(rays), 6))
        trace(self.scene[0], address(self.scratch), address(rays), address(out), len(rays), mask)
        return out

    def brute_force(self, rays: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Nearest t and primitive against the triangles at the origin (Möller–Trumbore); t = inf: none."""
        a, b, c = self.buffer[:300].astype(float).reshape(100, 3, 3).transpose(1, 0, 2)
        o, d = rays[:, None, :3], rays[:, None, 3:]
        h = np.cross(d, c - a)
        det = ((b - a) * h).sum(-1)
        s = o - a
        u = (s * h).sum(-1) / det
        q = np.cross(s, b - a)
        v = (d * q).sum(-1) / det
        t = ((c - a) * q).sum(-1) / det
        t = np.where((u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0), t, np.inf)
        return t.min(1), t.argmin(1)


@pytest.fixture(scope="module")
def soup() -> Soup:
    return Soup()


@pytest.fixture(scope="module")
def rays() -> np.ndarray:
    rng = np.random.default_rng(2)
    origin = rng.random((500, 3)) + np.array((0.0, 0.0, 3.0))
    direction = rng.random((500, 3)) - origin
    return np.concatenate([origin, direction / np.linalg.norm(direction, axis=1, keepdims=True)], axis=1)


def test_hits_agree_with_brute_force(soup, rays):
    found = soup.trace(rays, rec.RAY_CAMERA)
    t, primitive = soup.brute_force(rays)
    hit = np.isfinite(t)
    assert hit.any() and not hit.all()
    assert (found[hit, 1] == 0).all() and (found[~hit, 1] == -1).all()
    assert found[hit, 0] == pytest.approx(t[hit], rel=1e-5)
    assert (found[hit, 2] == primitive[hit]).mean() > 0.99  # ties on shared depth


def test_an_instance_is_hit_where_it_stands_and_reports_its_row(soup, rays):
    shifted = rays.copy()
    shifted[:, 0] += SHIFT
    found = soup.trace(shifted, rec.RAY_DIFFUSE)
    t, _ = soup.brute_force(rays)
    hit = np.isfinite(t)
    assert (found[hit, 1] == 1).all()
    assert found[hit, 0] == pytest.approx(t[hit], rel=1e-4)


def test_a_mask_hides_instances(soup, rays):
    assert (soup.trace(rays, rec.RAY_DIFFUSE)[:, 1] == -1).all()


def test_nothing_lies_before_the_nearest_hit(soup, rays):
    assert (soup.trace(rays, rec.RAY_CAMERA)[:, 5] == 0.0).all()
