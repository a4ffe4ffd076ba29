"""Every scene through Cycles and through this engine: the same picture within the bounds of its group."""

import pytest

bpy = pytest.importorskip("bpy")

from testing.blender import render, scenes  # noqa: E402


@pytest.fixture(scope="module", autouse=True)
def registered():
    render.register()


@pytest.mark.parametrize("name", scenes.SCENES)
def test_picture_matches_cycles(name):
    failures = render.compare(scenes.SCENES[name]).failures()
    assert not failures, "\n".join([name, *failures])
