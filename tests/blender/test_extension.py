"""The checkout enabled as an installed extension: registers, renders, refuses with a sentence, leaves nothing."""

import sys
from pathlib import Path
from types import SimpleNamespace

import addon_utils
import bpy
import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[2]
NAME = "bl_ext.user_default.restir_engine"


@pytest.fixture(scope="module")
def repository(tmp_path_factory):
    """A repository of extensions that holds a link to the checkout."""
    folder = tmp_path_factory.mktemp("extensions")
    (folder / "restir_engine").symlink_to(ROOT, target_is_directory=True)
    return folder


@pytest.fixture
def extension(repository):
    """The extension, enabled in a fresh file; disabled afterwards."""
    engine = sys.modules.get("restir_engine.engine")
    if engine is not None:
        engine.unregister()  # another test's, under the package's own name
    bpy.ops.wm.read_factory_settings()
    user = next(r for r in bpy.context.preferences.extensions.repos if r.module == "user_default")
    user.use_custom_directory, user.custom_directory = True, str(repository)
    addon_utils.modules_refresh()
    assert addon_utils.enable(NAME, default_set=True) is not None
    bpy.context.scene.render.engine = "RESTIR"
    yield sys.modules[NAME]
    addon_utils.disable(NAME, default_set=True)
    if engine is not None:
        engine.register()  # for the tests that come later in this process


def traces() -> list[str]:
    """What the extension has added to Blender, by name."""
    handlers = [
        f"{name}: {handler.__name__}"
        for name in dir(bpy.app.handlers)
        if isinstance(getattr(bpy.app.handlers, name), list)
        for handler in getattr(bpy.app.handlers, name)
        if "restir" in handler.__module__
    ]
    classes = [
        f"class {cls.__name__}"
        for base in (bpy.types.Panel, bpy.types.Operator, bpy.types.PropertyGroup, bpy.types.RenderEngine)
        for cls in base.__subclasses__()
        if "restir" in cls.__module__ and getattr(cls, "is_registered", False)
    ]
    properties = [f"{cls.__name__}.restir" for cls in (bpy.types.Scene, bpy.types.ViewLayer) if hasattr(cls, "restir")]
    panels = [p.__name__ for p in bpy.types.Panel.__subclasses__() if "RESTIR" in getattr(p, "COMPAT_ENGINES", ())]
    registered = [panel for panel in panels if hasattr(bpy.types, panel)]
    return handlers + classes + properties + registered


def test_enable_and_disable_leave_nothing_behind(extension):
    assert len(traces()) > 20
    addon_utils.disable(NAME, default_set=True)
    assert traces() == []
    assert addon_utils.enable(NAME, default_set=True) is not None


def test_register_twice_changes_nothing(extension):
    before = sorted(traces())
    extension.register()
    assert sorted(traces()) == before
    extension.unregister()
    extension.unregister()
    assert traces() == []
    extension.register()
    assert sorted(traces()) == before


def test_enabling_imports_no_numba(extension):
    """In a process of its own, since this one may have imported it."""
    import subprocess

    script = f"""
import os, sys, bpy, addon_utils
user = next(r for r in bpy.context.preferences.extensions.repos if r.module == "user_default")
user.use_custom_directory, user.custom_directory = True, {str(user_folder())!r}
addon_utils.modules_refresh()
addon_utils.enable({NAME!r}, default_set=True)
bpy.context.scene.render.engine = "RESTIR"
print("numba" in sys.modules, "llvmlite" in sys.modules)
sys.stdout.flush()
os._exit(0)
"""
    result = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=120)
    assert result.stdout.split()[-2:] == ["False", "False"], result.stdout + result.stderr


def user_folder() -> str:
    """The folder of the user's repository of extensions."""
    return next(r for r in bpy.context.preferences.extensions.repos if r.module == "user_default").directory


def test_opening_another_file_keeps_the_handlers(extension, tmp_path):
    path = tmp_path / "other.blend"
    bpy.context.scene.restir.samples = 7
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    before = sorted(traces())
    bpy.ops.wm.open_mainfile(filepath=str(path))
    assert sorted(traces()) == before
    assert bpy.context.scene.restir.samples == 7
    assert bpy.context.scene.render.engine == "RESTIR"


def test_settings_come_from_cycles_before_the_first_render(extension):
    scene = bpy.context.scene
    scene.cycles.diffuse_bounces, scene.cycles.sample_clamp_indirect, scene.cycles.filter_width = 3, 5.0, 2.0
    scene.restir.glossy_bounces = 1
    scene.cycles.glossy_bounces = 9
    scene.camera = None
    with pytest.raises(RuntimeError, match="camera"):
        bpy.ops.render.render()
    own = scene.restir
    assert (own.diffuse_bounces, own.clamp_indirect, own.filter_width) == (3, 5.0, 2.0)
    assert own.glossy_bounces == 1  # set by the artist already
    bpy.ops.restir.settings_from_cycles()
    assert own.glossy_bounces == 9


def test_button_lists_what_has_no_counterpart(extension):
    scene = bpy.context.scene
    scene.render.use_freestyle = True
    scene.cycles.samples = 4096
    bpy.context.view_layer.use_pass_shadow = True
    bpy.ops.restir.settings_from_cycles()
    log = sys.modules[NAME + ".restir_engine.warning_log"]
    text = "\n".join(log.lines(scene.name))
    assert "Freestyle" in text and "Shadow" in text
    assert scene.restir.samples == 4096


def test_a_new_scene_has_the_integrator_that_chooses_and_the_noise_threshold_of_cycles(extension):
    scene = bpy.context.scene
    assert scene.restir.integrator == "RESTIR" and not scene.restir.use_adaptive_sampling
    scene.cycles.adaptive_threshold, scene.cycles.adaptive_min_samples = 0.05, 24
    bpy.ops.restir.settings_from_cycles()
    own = scene.restir
    assert (own.use_adaptive_sampling, own.adaptive_min_samples) == (True, 24)
    assert own.adaptive_threshold == pytest.approx(0.05)
    scene.cycles.use_adaptive_sampling = False
    bpy.ops.restir.settings_from_cycles()
    assert not own.use_adaptive_sampling


def test_a_range_of_samples_is_copied_where_cycles_has_it_switched_on(extension):
    cycles, own = bpy.context.scene.cycles, bpy.context.scene.restir
    cycles.use_sample_subset, cycles.sample_offset, cycles.sample_subset_length = True, 64, 32
    bpy.ops.restir.settings_from_cycles()
    assert (own.sample_offset, own.sample_subset) == (64, 32)
    cycles.use_sample_subset = False
    bpy.ops.restir.settings_from_cycles()
    assert (own.sample_offset, own.sample_subset) == (0, 0)


def test_ranges_are_merged_by_the_operator_and_by_the_command(extension, tmp_path):
    scene = bpy.context.scene
    image, own = scene.render.image_settings, scene.restir
    if hasattr(image, "media_type"):
        image.media_type = "MULTI_LAYER_IMAGE"
    image.file_format, image.color_depth, image.exr_codec = "OPEN_EXR_MULTILAYER", "32", "DWAA"
    own.is_initialized, own.integrator, own.samples, own.sample_subset = True, "PATH", 2, 1
    scene.render.resolution_x, scene.render.resolution_y = 16, 12
    names = ("a.exr", "b.exr")
    for own.sample_offset, name in enumerate(names):
        scene.render.filepath = str(tmp_path / name)
        bpy.ops.render.render(write_still=True)
    files = [{"name": name} for name in names]
    assert bpy.ops.restir.merge_ranges(directory=str(tmp_path), files=files, out="c.exr") == {"FINISHED"}
    command = sys.modules[f"{NAME}.operators.merge_ranges"].merge_command
    assert command(["-o", str(tmp_path / "d.exr"), "--finish", *(str(tmp_path / name) for name in names)]) == 0
    files = sys.modules[f"{NAME}.restir_engine.farm.exr"].MultilayerFile
    pictures = [
        files(tmp_path / name).pixels(("ViewLayer", "", "Combined"), "RGBA") for name in (*names, "c.exr", "d.exr")
    ]
    np.testing.assert_allclose(pictures[2], (pictures[0] + pictures[1]) / 2.0, rtol=1e-5, atol=1e-6)
    np.testing.assert_array_equal(pictures[2], pictures[3])
    with pytest.raises(RuntimeError, match="both have samples 0 to 1"):
        bpy.ops.restir.merge_ranges(directory=str(tmp_path), files=[{"name": "a.exr"}, {"name": "d.exr"}], out="e.exr")


def test_compiling_in_the_background_follows_its_preference(extension, monkeypatch, tmp_path):
    """It begins with the integrator of the open scene, ends when it is switched off, and is done once."""
    background = sys.modules[NAME + ".restir_engine.background"]
    monkeypatch.setenv("RESTIR_CACHE", str(tmp_path))
    store = background.cache.Store(tmp_path / "kernels", None, None)
    monkeypatch.setattr(background.cache._Current, "store", store)
    started, ended = [], []
    process = SimpleNamespace(terminate=lambda: ended.append(True), wait=lambda: None)
    monkeypatch.setattr(
        background.workers, "start", lambda arguments, idle, **streams: started.append((arguments, idle)) or process
    )
    preferences = bpy.context.preferences.addons[NAME].preferences
    assert preferences.compile_in_background and background.Background.process is None  # nobody sits before a window
    bpy.context.scene.restir.integrator = "PATH"
    preferences.compile_in_background = True
    arguments, idle = started[0]
    assert idle and {"--all", "--first=integrators.path"} < set(arguments)
    preferences.compile_in_background = False
    assert ended and background.Background.process is None
    store.write(background.note(), b"")
    preferences.compile_in_background = True
    assert len(started) == 1


def test_diagnostics_name_versions(extension):
    text = sys.modules[NAME + ".operators.maintenance"].diagnostics(bpy.context.scene)
    assert bpy.app.version_string in text and "numba" in text


def test_renders_the_default_scene(extension):
    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y, scene.restir.samples = 32, 24, 2
    bpy.ops.render.render()
    pixels = combined()
    assert pixels.shape == (24, 32, 4)
    assert np.isfinite(pixels).all() and pixels[..., :3].mean() > 0.01


def combined() -> np.ndarray:
    """The Combined pass of the last render, (height, width, 4)."""
    import tempfile

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "render.exr"
        settings = bpy.context.scene.render.image_settings
        if hasattr(settings, "media_type"):
            settings.media_type = "IMAGE"
        settings.file_format, settings.color_depth, settings.color_mode = "OPEN_EXR", "32", "RGBA"
        bpy.data.images["Render Result"].save_render(str(path))
        image = bpy.data.images.load(str(path))
        pixels = np.zeros(len(image.pixels), np.float32)
        image.pixels.foreach_get(pixels)
        width, height = image.size
        bpy.data.images.remove(image)
    return pixels.reshape(height, width, 4)
