"""The pass Shadow Catcher beside Cycles: what Blender's own compositor is given by either engine."""

import numpy as np
import pytest

from testing.blender import kit
from testing.blender.compositor import composited
from testing.blender.render import exact_files, register
from testing.blender.scenes.light import caught


def red(nodes):
    """The channel that a red box brightens."""
    split = nodes.new("CompositorNodeSeparateColor")
    split.id_data.links.new(nodes.new("CompositorNodeRLayers").outputs["Shadow Catcher"], split.inputs[0])
    return split.outputs[0]


def test_as_cycles(tmp_path):
    """The mean of a pass whose standard error is 0.1 %, and the shadow's darkest part."""
    register()
    scene = kit.reset()
    caught()
    scene.render.resolution_x, scene.render.resolution_y = 48, 32
    scene.render.film_transparent = True
    exact_files(scene)
    layer = scene.view_layers[0]
    layer.cycles.use_pass_shadow_catcher = layer.restir.use_pass_shadow_catcher = True
    scene.cycles.use_adaptive_sampling, scene.restir.is_initialized = False, True
    for settings in (scene.cycles, scene.restir):
        settings.samples, settings.use_denoising = 128, False
    pictures = []
    for engine in ("CYCLES", "RESTIR"):
        scene.render.engine = engine
        layer.update_render_passes()
        pictures.append(composited(scene, engine, red, tmp_path))
    theirs, ours = pictures
    assert theirs.min() < 0.5 and theirs.max() > 1.2
    assert ours.mean() == pytest.approx(theirs.mean(), rel=0.005)
    assert np.abs(ours - theirs).mean() < 0.02
