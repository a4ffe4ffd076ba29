"""Tests that need Blender as a module: skipped where bpy is not installed."""

import atexit
import importlib.util
import sys
from pathlib import Path

import pytest

bpy = pytest.importorskip("bpy")

from restir_engine import engine  # noqa: E402
from testing.blender import plane  # noqa: E402

ROOT = Path(__file__).resolve().parents[2]

engine.register()  # also for tests that only read a scene: materials have settings of ours
atexit.register(engine.unregister)  # bpy 4.5 can hang at exit while classes are registered


@pytest.fixture
def scene():
    """An empty file whose scene uses the engine at 16 × 16 pixels and one sample of PATH, without a camera."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    engine.register()
    scene = bpy.context.scene
    scene.render.engine = "RESTIR"
    scene.render.resolution_x = scene.render.resolution_y = 16
    scene.render.resolution_percentage = 100
    scene.restir.samples, scene.restir.integrator = 1, "PATH"
    return scene


@pytest.fixture(scope="module")
def ui():
    """The package `ui`, imported as part of the extension."""
    name = "restir_checkout"
    if name not in sys.modules:
        spec = importlib.util.spec_from_file_location(
            name, ROOT / "__init__.py", submodule_search_locations=[str(ROOT)]
        )
        sys.modules[name] = importlib.util.module_from_spec(spec)
    return importlib.import_module(f"{name}.ui")


@pytest.fixture
def stage():
    """A white diffuse plane seen from above by an orthographic camera; direct light only."""
    return plane.stage()
