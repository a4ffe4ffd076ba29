"""Tests that need Blender as a module: skipped where bpy is not installed."""

import atexit

import pytest

bpy = pytest.importorskip("bpy")

from restir_engine import engine  # noqa: E402

engine.register()  # also for tests that only read a scene: materials have settings of ours
atexit.register(engine.unregister)  # bpy 4.5 can hang at exit while classes are registered


@pytest.fixture
def scene():
    """An empty file whose scene uses the engine at 16 × 16 pixels and one sample, without a camera."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    engine.register()
    scene = bpy.context.scene
    scene.render.engine = "RESTIR"
    scene.render.resolution_x = scene.render.resolution_y = 16
    scene.render.resolution_percentage = 100
    scene.restir.samples = 1
    return scene
