"""Media beside Mitsuba 3, a renderer that we did not write: dense and thin, with and without a refractive boundary.

Means may differ by half a percent beside three standard errors; of the blocks of 8 × 8 pixels 99 % have to agree within
three error bars (of 16 images each: one block of 36 may be further off).
"""

import numpy as np
import pytest

from testing.measures import compare
from testing.scenes.shapes import OUTWARD

pytest.importorskip("mitsuba")

from testing.mitsuba.media import ball, mitsuba_frames, our_frames, our_grid_scene, our_scene

# Shape, extinction, single-scattering albedo, g, (roughness, ior) of the glass, samples of each of the 16 images.
CASES = {
    "thin cube": (OUTWARD, 0.5, (0.9, 0.6, 0.3), 0.0, None, 16),
    "coloured ball": (ball(), (1.0, 2.0, 4.0), (0.9, 0.8, 0.99), 0.5, None, 16),
    "dense cube": (OUTWARD, 20.0, (0.95, 0.9, 0.5), 0.3, None, 16),
    "ball in glass": (ball(), (1.0, 2.0, 4.0), (0.9, 0.8, 0.5), 0.3, (0.0, 1.5), 24),
    "dense ball in glass": (ball(), 10.0, (0.98, 0.9, 0.5), 0.0, (0.0, 1.3), 16),
    "ball in rough glass": (ball(), 2.0, (0.9, 0.8, 0.5), 0.0, (0.4, 1.5), 24),
}


@pytest.mark.parametrize("name", CASES)
def test_pictures_agree(name):
    *what, samples = CASES[name]
    ours = our_frames(our_scene(*what, size=48), samples)
    off, error, z = compare(ours, mitsuba_frames(*what, size=48, samples=samples))
    assert np.all(error < 0.004), error
    assert np.all(np.abs(off) <= 0.005 + 3.0 * error), off
    assert (np.abs(z).max(2) > 3.0).sum() <= 1, z


@pytest.mark.deep
def test_a_grid_of_voxels_agrees():
    """Twelve, ten and eight random voxels, with zeros around them."""
    values = np.pad(np.random.default_rng(3).random((12, 10, 8)) ** 2, 1)
    what, samples = ((0.95, 0.8, 0.5), 0.4), 64
    ours = our_frames(our_grid_scene(values, 6.0, *what, size=48), samples)
    theirs = mitsuba_frames(OUTWARD, 6.0, *what, None, size=48, samples=samples, values=values)
    off, error, z = compare(ours, theirs)
    assert np.all(error < 0.004), error
    assert np.all(np.abs(off) <= 0.005 + 3.0 * error), off
    assert (np.abs(z).max(2) > 3.0).sum() <= 1, z
