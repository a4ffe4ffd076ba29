"""What is left out is named at every render: in the log, in the report and in the Warnings panel."""

import bpy
import pytest

from restir_engine import warning_log
from restir_engine.scene.warnings import Warnings
from restir_engine.settings import MOST_LIGHT_GROUPS
from restir_engine.sync.left_out import note_object, scene_lines
from testing.blender import kit

V5 = bpy.app.version >= (5, 0, 0)


@pytest.fixture
def shown(scene):
    """A cube before the camera."""
    kit.camera()
    kit.put("cube", kit.diffuse())
    scene.restir.is_initialized = True
    return scene


def set_all(scene, paths):
    """Switch properties on, by path from the scene, its first view layer (LAYER) or the cube (OBJECT)."""
    owners = {"LAYER": scene.view_layers[0], "OBJECT": bpy.data.objects["cube"], "WORLD": scene.world}
    for path in paths:
        *names, last = path.split(".")
        owner = scene
        if names[0] in owners:
            owner, names = owners[names[0]], names[1:]
        for name in names:
            owner = getattr(owner, name)
        setattr(owner, last, True)


@pytest.mark.parametrize(
    ("paths", "word"),
    [
        (["render.use_motion_blur", "restir.sss_irradiance_cache"], "irradiance cache"),
        (["render.use_freestyle"], "Freestyle"),
        (["cycles.use_fast_gi"], "Fast GI"),
        (["cycles.shading_system"], "Open Shading Language"),
        (["LAYER.use_pass_shadow", "LAYER.use_pass_subsurface_color"], "Shadow, Subsurface Color"),
        (["LAYER.cycles.use_pass_shadow_catcher"], "Shadow Catcher"),
        (["LAYER.cycles.denoising_store_passes"], "Denoising Data"),
    ],
)
def test_each_render_names_it(shown, paths, word):
    """However often it is rendered, and no longer once it is off."""
    set_all(shown, paths)
    for _ in range(2):
        bpy.ops.render.render()
        lines = [line for line in warning_log.lines(shown.name) if word in line]
        assert len(lines) == 1
    assert any(word in text for *_, text in scene_lines(shown, shown.view_layers))


def test_a_batch_render_ends_with_their_number(shown, capsys):
    """That of things, not of the renders that name them; nothing is said where there are none."""
    kit.lamp()
    set_all(shown, ["render.use_freestyle", "cycles.use_fast_gi"])
    shown.view_layers.new("Other")
    bpy.ops.render.render()
    # Called from Python, an operator prints what it reports after that.
    assert "ReSTIR: 2 warnings" in capsys.readouterr().out
    shown.render.use_freestyle = shown.cycles.use_fast_gi = False
    bpy.ops.render.render()
    assert "ReSTIR:" not in capsys.readouterr().out


def test_light_groups_have_passes_but_for_those_beyond_the_most(shown):
    """And no irradiance cache, which does not tell them apart."""
    layer = shown.view_layers[0]
    shown.restir.sss_irradiance_cache = True
    assert not list(scene_lines(shown, [layer]))
    for number in range(MOST_LIGHT_GROUPS + 1):
        layer.lightgroups.add(name=f"key {number}")
    cache, passes = (text for *_, text in scene_lines(shown, [layer]))
    assert "irradiance cache" in cache
    assert passes.count("Light Group") == 1 and f"Light Group key {MOST_LIGHT_GROUPS} " in passes


def test_passes_with_a_switch_of_ours_are_not_named_where_it_is_on(shown):
    layer = shown.view_layers[0]
    layer.cycles.denoising_store_passes = layer.restir.use_pass_denoising = True
    assert not list(scene_lines(shown, [layer]))


def test_a_default_scene_leaves_nothing_out(shown):
    kit.lamp()
    bpy.ops.render.render()
    assert not warning_log.lines(shown.name)


def test_data_without_triangles(shown):
    data = getattr(bpy.data, "grease_pencils" if V5 else "grease_pencils_v3").new("Data")
    warnings = Warnings()
    note_object(kit.add(data), warnings)
    assert [line for line in warnings.lines() if "grease pencil" in line]
