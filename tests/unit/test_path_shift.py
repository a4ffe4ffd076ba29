"""Whole paths are shifted from pixel to pixel and back as themselves."""

import numpy as np
import pytest

from restir_engine.integrators.techniques.path.sample import AT_LIGHT, LIT_THERE, REPLAYED, WENT_ON
from testing.kernels.path_shifts import Paths
from testing.scenes.interiors import interior
from testing.scenes.rooms import picture_scene


@pytest.fixture(scope="module")
def paths():
    """Samples of rooms with all kinds of light, glossy and glass surfaces, alpha and mirrors.

    Lights come from tiles in the room, and are sampled as PATH does in the others.
    """
    room = picture_scene("all")
    scenes = {"ajar": interior("ajar"), "still life": interior("still life")}
    found = {name: Paths(scene) for name, scene in scenes.items()}
    return found | {"room": Paths(room), "room without tiles": Paths(room, light_candidates=0)}


def test_every_kind_of_sample_is_kept(paths):
    kinds = np.concatenate([p.kinds.ravel() for p in paths.values()])
    for kind in (REPLAYED, AT_LIGHT, LIT_THERE, WENT_ON):
        assert (kinds == kind).sum() > 50


def test_a_path_shifted_to_its_own_pixel_is_itself(paths):
    for p in paths.values():
        own, _ = p.shifted(0, 0)
        kept = p.kinds >= 0
        target, jacobian = own["target"][kept], own["jacobian"][kept]
        # Single precision decides now and then otherwise whether a vertex is connectable.
        assert (target > 0.0).mean() > 0.999
        found = target > 0.0
        # Directions behind reconnections have 32 bits.
        np.testing.assert_allclose(jacobian[found], 1.0, rtol=4e-3)
        np.testing.assert_allclose(target[found], p.reservoirs["target"][kept][found], rtol=4e-3)
        np.testing.assert_allclose(own["f"][kept][found], p.light[kept][found], rtol=4e-3, atol=1e-6)


@pytest.mark.parametrize("by", [(1, 0), (3, -2)])
def test_a_path_comes_back_as_itself(paths, by):
    for p in paths.values():
        there, back = p.shifted(*by)
        arrived = there["target"] > 0.0
        assert arrived.sum() > 0.3 * (p.kinds >= 0).sum()
        returned = arrived & (back["target"] > 0.0)
        assert returned.sum() > 0.998 * arrived.sum()  # what can be shifted can be shifted back
        np.testing.assert_allclose(there["jacobian"][returned] * back["jacobian"][returned], 1.0, rtol=2e-3)
        np.testing.assert_allclose(back["target"][returned], p.reservoirs["target"][returned], rtol=8e-3)


def corners(scene, samples) -> np.ndarray:
    """Corners in the world of the triangles that samples are reconnected at, (n, 3, 3)."""
    found = np.zeros((len(samples), 3, 3))
    for i, sample in enumerate(samples):
        placed = scene.instances[sample["instance"]]
        mesh = scene.meshes[placed["mesh"]]
        vertices = mesh.vertices[mesh.triangles.reshape(-1, 3)[sample["primitive"]]].astype(float)
        to_world = placed["to_world"].reshape(3, 4)
        found[i] = vertices @ to_world[:, :3].T + to_world[:, 3]
    return found


def frames_of(n: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Two unit tangents for each of some normals."""
    t = np.cross(n, np.where(np.abs(n[:, :1]) < 0.9, [[1.0, 0.0, 0.0]], [[0.0, 1.0, 0.0]]))
    t /= np.linalg.norm(t, axis=1, keepdims=True)
    return t, np.cross(n, t)


def test_the_jacobian_is_that_of_finite_differences():
    """Of paths in a diffuse room that are reconnected at their second vertex.

    A diffuse bounce is uniform over the disk that its direction projects to, which is thus its primary sample space up
    to a constant. A path is moved on the disk of x_1; where it meets the plane of x_2 is seen from y_1.
    """
    scene = interior("doorway")
    p = Paths(scene)
    there, _ = p.shifted(3, -2)
    points = p.integrator.frame.points
    y, x = np.nonzero((there["target"] > 0.0) & (p.kinds >= LIT_THERE) & (p.reservoirs["flags"] & 31 == 2))
    assert len(x) > 200
    samples, start, end = p.reservoirs[y, x], points[y, x], points[y - 2, x + 3]
    triangle = corners(scene, samples)
    ab, ac = triangle[:, 1] - triangle[:, 0], triangle[:, 2] - triangle[:, 0]
    kept = triangle[:, 0] + samples["u"][:, None] * ab + samples["v"][:, None] * ac
    normal = np.cross(ab, ac)
    t, b = frames_of(start["n"])
    towards = (kept - start["p"]) / np.linalg.norm(kept - start["p"], axis=1, keepdims=True)
    disk = np.stack([(towards * t).sum(1), (towards * b).sum(1)], -1)
    t_end, b_end = frames_of(end["n"])

    def carried(move) -> np.ndarray:
        """The disk at y_1 of what is moved on that of x_1."""
        moved = disk + move
        up = np.sqrt(np.maximum(1.0 - (moved**2).sum(1, keepdims=True), 0.0))
        d = moved[:, :1] * t + moved[:, 1:] * b + up * start["n"]
        reach = ((kept - start["p"]) * normal).sum(1) / (d * normal).sum(1)
        between = start["p"] + reach[:, None] * d - end["p"]
        between /= np.linalg.norm(between, axis=1, keepdims=True)
        return np.stack([(between * t_end).sum(1), (between * b_end).sum(1)], -1)

    h = 1e-6
    columns = [(carried(h * e) - carried(-h * e)) / (2.0 * h) for e in np.eye(2)]
    exact = np.abs(columns[0][:, 0] * columns[1][:, 1] - columns[0][:, 1] * columns[1][:, 0])
    ours = there["jacobian"][y, x]
    assert np.ptp(np.log(exact)) > 1.0  # they are not all alike
    np.testing.assert_allclose(ours, exact, rtol=2e-3)
