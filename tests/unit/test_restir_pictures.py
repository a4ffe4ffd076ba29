"""RESTIR's mean is PATH's: 3 standard errors and 0.5 % by channel, and by blocks of 8 × 8 pixels (algorithms, §5.2)."""

import numpy as np
import pytest
from pictures import LIGHTS, compare, frames, picture_scene

SIZE = 32


@pytest.fixture(scope="module")
def references():
    """PATH's direct light by name of the light, rendered once."""
    kept = {}

    def reference(name, scene):
        if name not in kept:
            kept[name] = frames(scene, 128, integrator="PATH", max_bounces=0)
        return kept[name]

    return reference


def check(ours: np.ndarray, reference: np.ndarray) -> None:
    off, error, z = compare(ours, reference)
    assert np.isfinite(ours).all()
    assert (error < 0.004).all(), f"standard errors {error} are too large to tell"
    # Errors come from 8 groups each, so that 4 of them are as rare as 3 exact ones.
    assert (np.abs(off) < np.minimum(4.0 * error, 0.005)).all(), f"off by {off}, standard errors {error}"
    assert np.abs(z).mean() < 1.2, np.abs(z).mean()


@pytest.mark.parametrize("name", LIGHTS)
def test_without_reuse_direct_light_is_that_of_path(name, references):
    scene = picture_scene(name, SIZE)
    check(frames(scene, 64, integrator="RESTIR", restir_rounds=0, max_bounces=0), references(name, scene))


def test_the_light_of_all_bounces_is_that_of_path():
    scene = picture_scene("world", SIZE)
    check(frames(scene, 64, integrator="RESTIR"), frames(scene, 128, integrator="PATH"))
