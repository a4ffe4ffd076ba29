"""Every scene through Cycles and through this engine: the same picture within the bounds of its group.

The renders stop as soon as they tell (`Comparison.told`), after an eighth, a quarter, half or all of a scene's samples;
--deep compares all scenes with all samples as well.
"""

from dataclasses import replace

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from testing.blender import render, scenes  # noqa: E402


@pytest.fixture(scope="module", autouse=True)
def registered():
    render.register()


@pytest.mark.parametrize("name", scenes.SCENES)
def test_picture_matches_cycles_as_far_as_told(name):
    comparison = render.compare_until_told(scenes.SCENES[name])
    failures = comparison.failures()
    assert not failures, "\n".join([name, *failures])


@pytest.mark.deep
@pytest.mark.parametrize("name", scenes.SCENES)
def test_picture_matches_cycles(name):
    failures = render.compare(scenes.SCENES[name]).failures()
    assert not failures, "\n".join([name, *failures])


@pytest.mark.parametrize("plant", ["brighter", "moved"])
def test_errors_are_found_with_few_samples(plant):
    """One per cent more light, twice the bound; a picture that is moved by one pixel, which leaves the means alone."""
    item = scenes.SCENES["area_light"]
    for comparison in render.comparisons(item, "RESTIR", render.SHARES):
        assert comparison.told() and not comparison.failures()
        change = (lambda a: 1.01 * a) if plant == "brighter" else (lambda a: np.roll(a, 1, 1))
        planted = replace(comparison, ours=tuple(change(image) for image in comparison.ours))
        assert planted.failures()
        assert planted.told() == (plant == "brighter")
        break
