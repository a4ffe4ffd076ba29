"""The pass Vector beside Cycles: what Blender's own compositor is given by either engine."""

import numpy as np
import pytest

from restir_engine import properties
from testing.blender import kit
from testing.blender.compositor import composited
from testing.blender.render import exact_files, register
from testing.blender.scenes.motion import keyed, sliding, spinning

SIZE, SAMPLES = 48, 16


@pytest.fixture(scope="module")
def scene():
    """Objects that slide, turn and deform before a wall and a camera that pans and zooms."""
    register()
    scene = kit.reset()
    kit.floor()
    kit.put("plane", kit.diffuse(), (0, 3, 0), 8.0, rotation=(90, 0, 0))
    cube = kit.put("cube", kit.diffuse(), (-1.5, 0, 0.8), 0.5)
    sliding(cube, (0.4, 0.1, 0.2))
    spinning(cube, 40.0)
    ball = kit.put("ball", kit.diffuse(), (1.4, 0, 0.9), 0.6)
    ball.shape_key_add(name="Basis")
    key = ball.shape_key_add(name="Wide")
    points = np.empty(3 * len(key.data), np.float32)
    key.data.foreach_get("co", points)
    key.data.foreach_set("co", (points.reshape(-1, 3) * (1.8, 1.0, 0.5)).astype(np.float32).ravel())
    keyed(key, "value", {0: 0.0, 4: 1.0})
    camera = scene.camera
    keyed(camera, "location", {1: (-0.2, -6.1, 2.2), 3: (0.2, -5.9, 2.2)})
    keyed(camera.data, "lens", {1: 48.0, 3: 52.0})
    scene.frame_set(2)
    scene.view_layers[0].use_pass_vector = True
    scene.render.resolution_x = scene.render.resolution_y = SIZE
    exact_files(scene)
    scene.cycles.use_adaptive_sampling = False
    for settings in (scene.cycles, scene.restir):
        settings.samples, settings.use_denoising = SAMPLES, False
    return scene


def component(index: int):
    """What `composited` shows: one of the first three numbers of the pass."""

    def wire(nodes):
        split = nodes.new("CompositorNodeSeparateColor")
        split.id_data.links.new(nodes.new("CompositorNodeRLayers").outputs["Vector"], split.inputs[0])
        return split.outputs[index]

    return wire


@pytest.mark.parametrize(("integrator", "index"), [("PATH", 0), ("PATH", 1), ("PATH", 2), ("RESTIR", 0)])
def test_as_cycles(scene, tmp_path, integrator, index):
    scene.restir.integrator = integrator
    theirs, ours = (composited(scene, engine, component(index), tmp_path) for engine in ("CYCLES", "RESTIR"))
    assert np.abs(theirs).max() > 1.0
    # Rays through a pixel differ, so what its edges hold of each surface does.
    assert np.median(np.abs(ours - theirs)) < 0.005
    assert np.abs(ours - theirs).mean() < 0.05
    assert np.abs(np.roll(ours, 3, 1) - theirs).mean() > 0.1


def test_the_world_is_as_far_as_can_be(scene, tmp_path):
    """Only how a camera turns and zooms moves it. Cycles' vectors are shorter there, by the cosine to the view axis."""
    scene.restir.integrator = "PATH"
    for thing in scene.objects:
        thing.hide_render = thing.type == "MESH"
    found = [composited(scene, "RESTIR", component(index), tmp_path) for index in range(3)]
    for thing in scene.objects:
        thing.hide_render = False
    x = np.arange(SIZE) + 0.5 - SIZE / 2
    for picture, expected in zip(found, (-0.04 * x, -0.04 * x[:, None], -0.04 * x), strict=True):
        assert np.abs(picture - expected).max() < 0.04
        assert np.abs((picture - expected).mean()) < 0.002


def test_there_is_none_beside_motion_blur(scene):
    layer = scene.view_layers[0]
    assert "Vector" in properties.render_settings(scene, layer).passes
    scene.render.use_motion_blur = True
    assert "Vector" not in properties.render_settings(scene, layer).passes
    scene.render.use_motion_blur = False
