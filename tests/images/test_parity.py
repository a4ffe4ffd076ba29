"""Every scene through Cycles and through this engine: the same picture within the bounds of its group.

The renders stop as soon as they tell (`Comparison.told`), after an eighth, a quarter, half or all of a scene's samples;
--deep compares all scenes with all samples as well. The older Blender leaves slow scenes to --deep in which versions
are alike: the newer one has shown that the engine renders them.
"""

from dataclasses import replace

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from testing.blender import render, scenes  # noqa: E402


@pytest.fixture(scope="module", autouse=True)
def registered():
    render.register()


NEWEST = bpy.app.version >= (5, 0, 0)
QUICK = [name for name, item in scenes.SCENES.items() if not item.deep and (NEWEST or not item.alike)]


@pytest.mark.parametrize("name", QUICK)
def test_picture_matches_cycles_as_far_as_told(name):
    comparison = render.compare_until_told(scenes.SCENES[name])
    failures = comparison.failures()
    assert not failures, "\n".join([name, *failures])


@pytest.mark.deep
@pytest.mark.parametrize("name", scenes.SCENES)
def test_picture_matches_cycles(name):
    failures = render.compare(scenes.SCENES[name]).failures()
    assert not failures, "\n".join([name, *failures])


PLANTS = {"brighter": lambda image: 1.01 * image, "moved": lambda image: np.roll(image, 1, 1)}


@pytest.mark.parametrize("plant", PLANTS)
def test_errors_are_found(plant):
    """One per cent more light, twice the bound; a picture moved by one pixel, which leaves the means alone."""
    for comparison in render.comparisons(scenes.SCENES["area_light"], "RESTIR", render.SHARES):
        planted = replace(comparison, ours=tuple(PLANTS[plant](image) for image in comparison.ours))
        if planted.told():
            break
    assert planted.failures() and not comparison.failures()
