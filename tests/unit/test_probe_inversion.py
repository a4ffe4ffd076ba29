"""The mixture of lines and channels that probes choose from, turned round: the numbers by which one finds a point.

A point x₂ that a probe from x₁ found may have come by several lines and channels. Chosen by their posterior, with the
numbers of radius and angle computed from the point, they are distributed as those that found it: what replaying a path
with random numbers of its own needs (King et al. 2013; sequential shifts of resampled subsurface paths).

Posteriors are accepted within 4 standard errors; without the cosine or with even channels they miss by more than 30.
"""

import math

import numpy as np
import pytest
from scipy.stats import kstest

from restir_engine.kernels.core import records as rec
from restir_engine.kernels.core.jit import kernel
from restir_engine.kernels.core.memory import address, load_f64, store_f64
from restir_engine.kernels.core.vec import load3_f64
from restir_engine.kernels.subsurface import probe as pr
from restir_engine.kernels.subsurface.profile import F_REACH, REACH
from testing.scenes.scattering import scene_of
from testing.scenes.shapes import icosphere, sheets

SCALES, WEIGHTS = np.array([0.1, 0.2, 0.4]), np.array([0.5, 0.3, 0.2])
# Lines through the point below x, towards its plane or of any direction, and lines along the normal and the tangents.
LINES = np.array([pr.TOWARDS_SHARE, pr.ANY_SHARE, pr.NORMAL_SHARE, pr.TANGENT_SHARE, pr.TANGENT_SHARE])
PAIRS = 3 * len(LINES)
DEPTH = 0.4
MOST = 4  # hits of a probe that are looked at
FIELDS = 7  # of each: position, normal, density


@kernel
def probe_kernel(scene, scratch, note, x, n, depth, w, d, numbers, count, out):
    """Probes from x with the given random numbers (float64 [count, 4]): float64 [count, MOST, FIELDS]."""
    for i in range(count):
        kept, _ = pr.probe(
            scene, scratch, note, 0, load3_f64(x, 0), load3_f64(n, 0), 1.0, depth, load3_f64(w, 0), load3_f64(d, 0),
            load_f64(numbers, 4 * i), load_f64(numbers, 4 * i + 1), load_f64(numbers, 4 * i + 2),
            load_f64(numbers, 4 * i + 3),
        )  # fmt: skip
        for k in range(min(kept, MOST)):
            for j in range(FIELDS):
                hit = scratch + pr.HITS + 8 * pr.HIT * k
                store_f64(out, FIELDS * (MOST * i + k) + j, load_f64(hit, pr.H_POINT + j))


class Probes:
    """Probes from a point of a scene's only object."""

    def __init__(self, scene, x, n) -> None:
        self.scene, self.x = scene, np.array(x, float)
        self.n = np.array(n, float) / np.linalg.norm(n)
        t = np.cross([1.0, 1.0, 1.0], self.n)
        t /= np.linalg.norm(t)
        self.axes = np.array([self.n, t, np.cross(self.n, t)])
        block = np.zeros(rec.SCRATCH_BYTES + 64, np.uint8)
        self._scratch = block[-address(block) % 64 :]

    def find(self, numbers) -> np.ndarray:
        """Hits (count, MOST, FIELDS) of probes by random numbers (count, 4); density 0: none."""
        numbers, out = np.ascontiguousarray(numbers), np.zeros((len(numbers), MOST, FIELDS))
        probe_kernel(
            self.scene.record, address(self._scratch), pr.note_hit.address, address(self.x), address(self.n),
            DEPTH, address(WEIGHTS), address(SCALES), address(numbers), len(numbers), address(out),
        )  # fmt: skip
        return out

    def below(self, points) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Distances from the point below x (count,), unit directions from it, upwards (count, 3), and their cosines."""
        q = points - self.x + DEPTH * self.n
        distance = np.linalg.norm(q, axis=1)
        direction = q / distance[:, None] * np.sign(q @ self.n)[:, None]
        return distance, direction, direction @ self.n

    def joint(self, points, normals) -> tuple[np.ndarray, np.ndarray]:
        """Density by area of each line and channel (count, 5, 3), and the distances r of the lines (count, 5)."""
        offset = points - self.x
        along = offset @ self.axes.T
        distance, direction, cosine = self.below(points)
        flat = (DEPTH * np.sqrt(1.0 - cosine**2) / cosine)[:, None]
        r = np.hstack([flat, flat, np.sqrt(np.maximum((offset**2).sum(1)[:, None] - along**2, 0.0))])
        x = np.maximum(r[:, :, None] / SCALES, 1e-12)
        e = np.exp(-x / 3.0)
        density = (e + e**3) / (8.0 * math.pi * SCALES**2 * x * F_REACH)
        density[:, 0] *= (DEPTH**2 / cosine**3)[:, None] * (flat <= REACH * SCALES)
        density[:, 1] = 0.5 / math.pi
        density[:, 2:] *= (np.linalg.norm(offset, axis=1)[:, None] <= REACH * SCALES)[:, None, :]
        seen = np.abs((direction * normals).sum(1) / distance**2)[:, None]
        seen = np.hstack([seen, seen, np.abs(normals @ self.axes.T)])
        return (LINES * seen)[:, :, None] * WEIGHTS * density, r

    def invert(self, points, choice, r, random) -> np.ndarray:
        """Numbers (count, 4) that find the points by the chosen pairs of line and channel."""
        line, channel = choice // 3, choice % 3
        offset, (_, direction, cosine) = points - self.x, self.below(points)
        axis = np.maximum(line - 2, 0)
        right, up = self.axes[(axis + 1) % 3], self.axes[(axis + 2) % 3]
        e = np.exp(-r[np.arange(len(r)), line] / (3.0 * SCALES[channel]))
        towards = np.where(line[:, None] < 2, direction, offset)
        angle = np.arctan2((towards * up).sum(1), (towards * right).sum(1))
        return np.column_stack(
            [
                np.append(0.0, np.cumsum(LINES))[line] + random[0] * LINES[line],
                np.append(0.0, np.cumsum(WEIGHTS))[channel] + random[1] * WEIGHTS[channel],
                np.where(line == 1, 1.0 - cosine, (1.0 - 0.25 * e**3 - 0.75 * e) / F_REACH),
                angle / (2.0 * math.pi) % 1.0,
            ]
        )


def choices(numbers) -> np.ndarray:
    """Which pair of line and channel random numbers choose: 3 · line + channel."""
    return 3 * np.digitize(numbers[:, 0], np.cumsum(LINES)[:-1]) + np.digitize(numbers[:, 1], np.cumsum(WEIGHTS)[:2])


CASES = {
    "plane": lambda: Probes(scene_of(*sheets(0.0, size=60.0)), (0, 0, 0), (0, 0, 1)),
    "tilted frame": lambda: Probes(scene_of(*sheets(0.0, size=60.0)), (0, 0, 0), (0.5, -0.3, 0.8)),
    "sphere": lambda: Probes(scene_of(*icosphere(1.0)), np.array((0.6, 0.0, 0.8)) * 1.001, (0.6, 0.0, 0.8)),
    "sheets": lambda: Probes(scene_of(*sheets(0.0, -0.2, size=60.0)), (0, 0, 0), (0, 1, 1)),
}


@pytest.fixture(scope="module", params=CASES)
def found(request):
    """(name, probes, which of the probes, how it chose, points, joint densities, distances) of all hits."""
    random = np.random.default_rng(5)
    probes, numbers = CASES[request.param](), random.random((40_000, 4))
    hits = probes.find(numbers)
    which, k = np.nonzero(hits[:, :, 6] > 0.0)
    hits = hits[which, k]
    joint, r = probes.joint(hits[:, :3], hits[:, 3:6])
    np.testing.assert_allclose(joint.sum((1, 2)), hits[:, 6], rtol=1e-6)
    return request.param, probes, which, choices(numbers)[which], hits[:, :3], joint.reshape(-1, PAIRS), r


def test_how_a_point_was_found_is_distributed_as_its_posterior(found):
    _, _, which, choice, _, joint, _ = found
    posterior = joint / joint.sum(1, keepdims=True)
    surprise = (choice[:, None] == np.arange(PAIRS)) - posterior
    by_probe = np.zeros((which.max() + 1, PAIRS))
    np.add.at(by_probe, which, surprise)  # hits of a probe have its choice in common
    # In all, and apart where the posterior is below and above one half: a wrong one may have the right mean.
    for likely in (posterior >= 0.0, posterior < 0.5, posterior >= 0.5):
        by_probe[:] = 0.0
        np.add.at(by_probe, which, surprise * likely)
        error = np.sqrt((by_probe**2).sum(0))
        assert (np.abs(by_probe.sum(0)) <= 4.0 * error + 1e-9).all()


def test_inverted_numbers_find_the_same_point(found):
    name, probes, _, _, points, joint, r = found
    random = np.random.default_rng(6)
    cumulative = np.cumsum(joint, 1) / joint.sum(1, keepdims=True)
    choice = (random.random((len(joint), 1)) > cumulative).sum(1)
    numbers = probes.invert(points, choice, r, random.random((2, len(joint))))
    np.testing.assert_array_equal(choices(numbers), choice)
    again = probes.find(numbers)
    off = np.linalg.norm(again[:, :, :3] - points[:, None], axis=2) + 9.0 * (again[:, :, 6] == 0.0)
    # Embree's single precision moves what a probe grazes.
    assert (off.min(1) < 1e-3).mean() > 0.999
    assert np.median(off.min(1)) < 1e-5
    if name == "plane":  # where each probe from below finds one point, numbers stay uniform
        assert kstest(numbers[:, 2], "uniform").pvalue > 0.001
        assert kstest(numbers[:, 3], "uniform").pvalue > 0.001
        assert kstest(numbers[:, 1], "uniform").pvalue > 0.001
