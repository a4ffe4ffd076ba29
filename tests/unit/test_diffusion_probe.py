"""Disk projection against closed forms on planes and spheres, within four standard errors unless said."""

import math

import numpy as np
import pytest

from restir_engine.kernels.core import records as rec
from restir_engine.kernels.core import rng
from restir_engine.kernels.core.jit import kernel
from restir_engine.kernels.core.memory import address, load_f64, store_f64
from restir_engine.kernels.core.vec import dot, load3_f64
from restir_engine.kernels.subsurface import probe as pr
from restir_engine.kernels.subsurface.profile import F_REACH, REACH, profile
from testing.scenes.lights import matrix
from testing.scenes.scattering import scene_of
from testing.scenes.shapes import icosphere, sheets


@kernel
def integrate(scene, scratch, note, x, n, w, d, samples, seed, out):
    """For each sample Σ over the hits of B_c / density, and the number of hits: float64 [samples, 4]."""
    weights, scales = load3_f64(w, 0), load3_f64(d, 0)
    at = load3_f64(x, 0)
    z = dot(weights, scales)
    for i in range(samples):
        u0, u1 = rng.sample2(seed, i, 0)
        u2, u3 = rng.sample2(seed, i, 1)
        kept, found = pr.probe(scene, scratch, note, 0, at, load3_f64(n, 0), 1.0, z, weights, scales, u0, u1, u2, u3)
        store_f64(out, 4 * i + 3, float(found))
        for k in range(kept):
            hit = scratch + pr.HITS + 8 * pr.HIT * k
            pdf = load_f64(hit, pr.H_PDF)
            r = pr.hit_distance(hit, at)
            for c in range(3):
                if pdf > 0.0 and r <= REACH * scales[c]:
                    store_f64(out, 4 * i + c, load_f64(out, 4 * i + c) + profile(r, scales[c]) / pdf)


def means(scene, x, n, scales, samples=20_000, seed=3, weights=(1 / 3, 1 / 3, 1 / 3)):
    """(mean, standard error) of ∫ B_c over the surface, by channel, and the largest number of hits."""
    out = np.zeros((samples, 4))
    scratch = np.zeros(rec.SCRATCH_BYTES + 64, np.uint8)
    aligned = address(scratch) + (-address(scratch) % 64)
    arrays = [np.array(a, float) for a in (x, n, weights, scales)]
    a, b, c, d = map(address, arrays)
    integrate(scene.record, aligned, pr.note_hit.address, a, b, c, d, samples, seed, address(out))
    # Random numbers are stratified, so blocks of one key are not independent samples; this error is an upper bound.
    return out[:, :3].mean(axis=0), out[:, :3].std(axis=0) / math.sqrt(samples), int(out[:, 3].max())


def close(mean, error, expected, lost=1.0 - F_REACH):
    np.testing.assert_array_less(np.abs(mean - expected), 4.0 * error + lost + 2e-4)


SCALES = (0.2, 0.5, 1.0)


@pytest.mark.parametrize("axis", [(0.0, 0.0, 1.0), (0.5, -0.3, 0.8), (1.0, 1.0, 1.0)])
def test_infinite_plane_returns_everything(axis):
    """∫ B = 1 in every channel, and also when the frame is tilted against the plane."""
    scene = scene_of(*sheets(0.0))
    normal = np.asarray(axis) / np.linalg.norm(axis)
    mean, error, hits = means(scene, (0.0, 0.0, 0.0), normal, SCALES, 40_000)
    assert hits == 1
    close(mean, error, 1.0)


def test_two_sheets():
    """The far sheet of a slab of thickness h adds ∫ B(√(r² + h²)) 2πr dr = ¼e^(-h/d) + ¾e^(-h/3d)."""
    h, d = 0.7, np.array(SCALES)
    mean, error, hits = means(scene_of(*sheets(0.0, -h)), (0.0, 0.0, 0.0), (0.0, 0.0, 1.0), SCALES, 40_000)
    assert hits == 2
    close(mean, error, 1.0 + 0.25 * np.exp(-h / d) + 0.75 * np.exp(-h / (3.0 * d)))


@pytest.mark.parametrize("direction", [(0.0, 0.0, 1.0), (0.3, -0.7, 0.2)])
def test_sphere(direction):
    """∫ B over a sphere of radius ρ about a point of it is 1 - ¼e^(-2ρ/d) - ¾e^(-2ρ/3d)."""
    x = np.asarray(direction) / np.linalg.norm(direction)
    scene = scene_of(*icosphere(1.0))
    mean, error, _ = means(scene, x, x, SCALES, 40_000)
    d = np.array(SCALES)
    close(mean, error, 1.0 - 0.25 * np.exp(-2.0 / d) - 0.75 * np.exp(-2.0 / (3.0 * d)), lost=1e-3)


def test_scaled_and_mirrored_instance():
    """Distances and areas are those of the world."""
    placement = matrix((3.0, -1.0, 2.0), (0.3, 0.2, 0.9))
    placement[:, :3] *= [-2.0, 2.0, 2.0]
    scene = scene_of(*icosphere(0.5), placement)
    normal = placement[:, :3] @ [0.0, 0.6, 0.8] / 2.0
    mean, error, _ = means(scene, placement[:, 3] + normal, normal, SCALES, 40_000)
    d = np.array(SCALES)
    close(mean, error, 1.0 - 0.25 * np.exp(-2.0 / d) - 0.75 * np.exp(-2.0 / (3.0 * d)), lost=1e-3)


def test_a_channel_without_profile():
    mean, error, _ = means(scene_of(*sheets(0.0)), (0, 0, 0), (0, 0, 1), (0.2, 0.5, 0.1), 20_000, 3, (0.5, 0.5, 0.0))
    close(mean[:2], error[:2], 1.0)


def test_more_hits_than_there_is_room_for_are_counted():
    heights = -0.001 * np.arange(pr.MAX_HITS + 9)
    _, _, hits = means(scene_of(*sheets(*heights)), (0.0, 0.0, 0.0), (0.0, 0.0, 1.0), SCALES, 50)
    assert hits == pr.MAX_HITS + 9
