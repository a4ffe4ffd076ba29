"""Whole paths are shifted from pixel to pixel and back as themselves, and a picture of them is that of PATH."""

import numpy as np
import pytest

from restir_engine.integrators.techniques.path.sample import AT_LIGHT, LIT_THERE, REPLAYED, WENT_ON
from restir_engine.reuse_settings import ReuseSettings
from testing.kernels.path_shifts import Paths
from testing.scenes.interiors import SCENES, interior
from testing.scenes.rooms import frames, picture_scene
from testing.statistics import Sequential, Verdict, relative_difference

LUMINANCE = np.array([0.2126, 0.7152, 0.0722])


@pytest.fixture(scope="module")
def paths():
    """Samples of rooms with all kinds of light, glossy and glass surfaces, alpha and mirrors."""
    scenes = {"room": picture_scene("all"), "ajar": interior("ajar"), "still life": interior("still life")}
    return {name: Paths(scene) for name, scene in scenes.items()}


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


GROUP, SAMPLES = 16, 4
EARLY = Sequential(bound=0.01, false_alarm=0.0005, miss=0.01, looks=4)
REUSE = {
    "whole": {"paths": "WHOLE", "rounds": 1},
    "indirect": {"paths": "INDIRECT", "rounds": 1},
    "temporal": {"paths": "WHOLE", "temporal": True},
}
KINDS = {
    **{f"{mis}, {pattern}": {"mis": mis, "pattern": pattern} for mis in ("BALANCE", "PAIRWISE", "CONTRIBUTION")
       for pattern in ("DISK", "PAIRS")},
    "one sample": {"vector_weights": False},
    "replayed": {"footprint": 1000.0},
    "reconnected": {"footprint": 0.0, "connect_roughness": 0.0001},
    "two rounds, temporal, cap 1": {"rounds": 2, "temporal": True, "confidence_cap": 1.0},
    "two rounds, temporal": {"rounds": 2, "temporal": True},
}  # fmt: skip


def renders(scene, first: int, samples: int, **settings) -> np.ndarray:
    """Mean luminances of a GROUP of renders."""
    return (frames(scene, samples, range(first, first + GROUP), **settings) @ LUMINANCE).mean((1, 2))


def told(scene, path: np.ndarray, **options) -> Verdict:
    """Whether the mean luminance of renders that reuse paths is told from PATH's."""
    settings = {"integrator": "RESTIR", "reuse": ReuseSettings(**{"light_candidates": 8, "light_samples": 1} | options)}
    means = np.zeros(0)

    def more():
        nonlocal means
        for look in range(EARLY.looks):
            groups = [renders(scene, 1000 + (3 * look + k) * GROUP, SAMPLES, **settings) for k in range(3)]
            means = np.concatenate([means, *groups])
            yield means

    verdict, _ = EARLY.told(more(), lambda ours: relative_difference(ours, path))
    return verdict


@pytest.fixture(scope="module")
def still_life():
    """(scene, mean luminances of renders of PATH)."""
    scene = interior("still life", 32)
    return scene, np.concatenate([renders(scene, k * GROUP, 64, integrator="PATH") for k in range(2)])


@pytest.mark.parametrize("reuse", REUSE)
def test_a_picture_is_that_of_path_as_far_as_told(reuse, still_life):
    assert told(*still_life, **REUSE[reuse]) is Verdict.SAME


@pytest.mark.deep
@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_of_reuse_keeps_the_picture(kind, still_life):
    assert told(*still_life, **REUSE["whole"] | KINDS[kind]) is Verdict.SAME


@pytest.mark.deep
@pytest.mark.parametrize("name", [*SCENES, "area", "point", "spot", "sun", "mesh", "world", "many", "all"])
@pytest.mark.parametrize("reuse", REUSE)
def test_pictures_are_those_of_path(name, reuse):
    scene = interior(name, 32) if name in SCENES else picture_scene(name, 32)
    path = np.concatenate([renders(scene, k * GROUP, 256, integrator="PATH") for k in range(2)])
    assert told(scene, path, **REUSE[reuse]) is not Verdict.DIFFERENT
