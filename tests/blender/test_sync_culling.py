"""Culling of simplified scenes: an object that is left out no longer lights the others, in Cycles as in ours."""

import bpy
import numpy as np
import pytest

from testing.blender import kit, render

# Around a camera at (0, -6, 2.2) that looks along y: beside the frame, just within it, behind the camera, far away.
PLACES = [(-4.5, 0.0, 0.5), (-3.2, 0.0, 0.5), (0.0, 0.0, 6.0), (1.0, -9.0, 1.0), (2.4, -3.0, 0.5), (-2.0, 12.0, 0.5)]


@pytest.fixture(scope="module", autouse=True)
def registered():
    render.register()


@pytest.fixture
def stage():
    """A floor that fills a small picture, lit by nothing yet; indirect light alone shows what is there."""
    scene = kit.reset()
    render.exact_files(scene)
    scene.restir.is_initialized = True
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = 16, 12, 100
    kit.assign(scene.cycles, render.CYCLES)
    for ours, theirs, value in render.SHARED:
        setattr(scene.restir, ours, value)
        setattr(scene.cycles, theirs, value)
    scene.render.use_simplify = True
    kit.camera()
    kit.floor(size=20.0)
    return scene


@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("kind", ["PERSP", "ORTHO", "border"])
@pytest.mark.parametrize("tests", [("camera",), ("distance",), ("camera", "distance")])
def test_what_is_culled(stage, place, kind, tests):
    if kind == "border":
        stage.render.use_border = True
        stage.render.border_min_x, stage.render.border_max_x = 0.3, 0.9
    else:
        stage.camera.data.type = kind
    stage.cycles.camera_cull_margin, stage.cycles.distance_cull_margin = 0.1, 8.0
    lamp = kit.put("ball", kit.emission(strength=100.0), place, 0.3)
    for name in tests:
        kit.assign(stage.cycles, {f"use_{name}_cull": True})
        kit.assign(lamp.cycles, {f"use_{name}_cull": True})
    means = [render.render(engine, 4, 0)[..., :3].mean() for engine in ("CYCLES", "RESTIR")]
    assert (np.array(means) > 1e-4).tolist() in ([True, True], [False, False]), means


def test_objects_that_do_not_ask_stay(stage):
    stage.cycles.use_camera_cull = True
    kit.put("ball", kit.emission(strength=100.0), PLACES[0], 0.3)
    assert render.render("RESTIR", 4, 0)[..., :3].mean() > 1e-4
    bpy.data.objects["ball"].cycles.use_camera_cull = True
    assert render.render("RESTIR", 4, 0)[..., :3].mean() == 0.0
