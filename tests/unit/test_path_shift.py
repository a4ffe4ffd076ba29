"""Whole paths are shifted from pixel to pixel and back as themselves."""

import numpy as np
import pytest

from restir_engine.integrators.techniques.path.sample import AT_LIGHT, LIT_THERE, REPLAYED, WENT_ON
from testing.kernels.path_shifts import Paths
from testing.scenes.interiors import interior
from testing.scenes.rooms import picture_scene


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
