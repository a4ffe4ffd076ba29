"""What the engine delivers to Blender: passes, view layers, render border, frames; what it says where it cannot."""

import time
from pathlib import Path

import bpy
import numpy as np
import pytest

from restir_engine import engine, properties, session
from restir_engine.settings import DENOISING_ROUGHNESS, PASSES, SPECULAR_ALBEDO
from testing.blender import exr, farm, kit
from testing.blender.render import exact_layers


class FakePass:
    """Takes what would go to Blender's render result."""

    def __init__(self, name: str) -> None:
        self.name, self.pixels = name, None
        self.rect = self

    def foreach_set(self, values: np.ndarray) -> None:
        self.pixels = values.copy()


SHOWN = [item for item in PASSES if item.view_layer or item.own]  # others are what these are made of


@pytest.fixture
def written(monkeypatch):
    """The passes of every final write, in order: name → (height, width, channels)."""
    writes: list[dict[str, np.ndarray]] = []
    original = engine.write_passes

    def write(result, session, shown):
        original(result, session, shown)
        film = session.film
        names = [item.name for item in shown]
        arrays = {name: session.combined() if name == "Combined" else film.pass_array(name) for name in names}
        assert all(array.shape[:2] == (film.height, film.width) for array in arrays.values())
        writes.append(arrays)

    monkeypatch.setattr(engine, "write_passes", write)
    return writes


@pytest.fixture
def lit(scene):
    """A plane that fills the picture's lower half under a grey sky."""
    bpy.ops.mesh.primitive_plane_add(size=40.0)
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location, camera.rotation_euler = (0.0, -3.0, 1.0), (1.5, 0.0, 0.0)
    scene.collection.objects.link(camera)
    scene.camera = camera
    scene.world = bpy.data.worlds.new("Sky")
    if bpy.app.version < (5, 0, 0):
        scene.world.use_nodes = True
    sky(scene).default_value = (0.5, 0.5, 0.5, 1.0)
    scene.restir.use_animated_seed = False
    return scene


def sky(scene: bpy.types.Scene) -> bpy.types.NodeSocketColor:
    """The socket that holds the colour of the sky."""
    nodes = scene.world.node_tree.nodes
    return next(node for node in nodes if node.bl_idname == "ShaderNodeBackground").inputs["Color"]


def picture(scene: bpy.types.Scene, folder: Path) -> np.ndarray:
    """Render; the Combined pass as Blender has it, (height, width, 4), from a file."""
    settings = scene.render.image_settings
    if hasattr(settings, "media_type"):
        settings.media_type = "IMAGE"
    settings.file_format, settings.color_depth, settings.color_mode = "OPEN_EXR", "32", "RGBA"
    scene.render.filepath = str(folder / "render.exr")
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(scene.render.filepath)
    pixels = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(pixels)
    width, height = image.size
    bpy.data.images.remove(image)
    return pixels.reshape(height, width, 4)


def test_picture_is_upright(lit, tmp_path):
    pixels = picture(lit, tmp_path)
    assert pixels.shape == (16, 16, 4)
    assert np.isfinite(pixels).all()
    sky, ground = pixels[-4:, :, 0], pixels[:4, :, 0]
    assert sky.mean() > 1.1 * ground.mean() > 0.1


@pytest.mark.parametrize(("chosen", "method"), [("FINAL", "DIFFUSION"), ("HYBRID", "HYBRID")])
def test_previews_have_their_own_samples_and_method(scene, monkeypatch, chosen, method):
    """A preview of a material that scatters, made by this engine in Blender's own scene."""
    scene.restir.preview_samples, scene.restir.preview_sss_method, scene.restir.sss_method = 2, chosen, "DIFFUSION"
    found = []
    settings = properties.preview_settings
    monkeypatch.setattr(properties, "preview_settings", lambda *scenes: found.append(settings(*scenes)) or found[-1])
    material = bpy.data.materials.new("Skin")
    if bpy.app.version < (5, 0, 0):
        material.use_nodes = True
    material.node_tree.nodes["Principled BSDF"].inputs["Subsurface Weight"].default_value = 1.0
    material.asset_generate_preview()
    end = time.monotonic() + 60.0
    while not (found and np.any(material.preview.image_pixels_float)) and time.monotonic() < end:
        time.sleep(0.05)
    pixels = np.array(material.preview.image_pixels_float).reshape(-1, 4)
    assert np.isfinite(pixels).all() and pixels[:, :3].max() > 0.1
    assert {(item.samples, item.sss_method) for item in found} == {(2, method)}


@pytest.mark.parametrize("crop", (False, True))
def test_render_border(lit, tmp_path, crop):
    full = picture(lit, tmp_path)
    render = lit.render
    render.use_border, render.use_crop_to_border = True, crop
    render.border_min_x, render.border_max_x, render.border_min_y, render.border_max_y = 0.25, 0.75, 0.5, 1.0
    part = picture(lit, tmp_path)
    if crop:
        assert part.shape == (8, 8, 4)
    else:
        assert part.shape == (16, 16, 4)
        assert part[:8].max() == 0.0
        part = part[8:, 4:12]
    np.testing.assert_allclose(part[4:].mean(axis=(0, 1)), full[12:, 4:12].mean(axis=(0, 1)), rtol=0.02)


def regions() -> list[tuple]:
    """Frame sizes and regions (left, right, bottom, top): edges on pixels and anywhere, some at the frame's edge."""
    rng = np.random.default_rng(4)
    found = [
        ((100, 100), (0.35, 0.8, 0.1, 0.9)),
        ((100, 60), (0.0, 0.29, 0.55, 1.0)),
        ((90, 70), (0.7, 1.0, 0.0, 0.07)),
    ]
    for size in ((100, 60), (77, 51), (64, 48)):
        for digits in (1, 2, 8):
            (left, right), (bottom, top) = (np.sort(rng.random(2)) * 0.9 + (0.0, 0.1) for _ in range(2))
            found.append((size, tuple(np.round((left, right, bottom, top), digits).tolist())))
    return found


@pytest.mark.parametrize("crop", (False, True))
@pytest.mark.parametrize(("size", "region"), regions())
def test_region_has_the_pixels_that_cycles_renders(lit, tmp_path, crop, size, region):
    """Every pixel tells by its colour where it stands in the frame."""
    material = kit.material(lambda node: node("Emission", Color=node("TexCoord").outputs["Window"]))
    bpy.data.objects["Plane"].data.materials.append(material)
    lit.camera.rotation_euler = (0.0, 0.0, 0.0)
    render = lit.render
    render.resolution_x, render.resolution_y = size
    render.use_border, render.use_crop_to_border = True, crop
    render.border_min_x, render.border_max_x, render.border_min_y, render.border_max_y = region
    lit.restir.pixel_filter = lit.cycles.pixel_filter_type = "BOX"
    lit.cycles.samples, lit.cycles.use_denoising = 1, False
    ours = picture(lit, tmp_path)
    render.engine = "CYCLES"
    expected = picture(lit, tmp_path)
    assert ours.shape == expected.shape
    np.testing.assert_array_equal(ours[..., 3], expected[..., 3])
    # Both samples lie within the pixel.
    assert (np.abs(ours - expected)[..., :2] * size).max() < 1.0
    shift = (ours - expected)[expected[..., 3] > 0.0].mean(0)[:2] * size
    assert np.abs(shift).max() < 0.3


def test_region_of_a_single_pixel(lit, tmp_path):
    render = lit.render
    render.use_border = render.use_crop_to_border = True
    render.border_min_x, render.border_max_x, render.border_min_y, render.border_max_y = 0.5, 0.5625, 0.0, 0.0625
    assert picture(lit, tmp_path).shape == (1, 1, 4)


@pytest.mark.parametrize("place", ["properties.render_settings", "write_passes", "report_warnings", "Display"])
def test_whatever_fails_is_told_and_ends_the_render(lit, tmp_path, monkeypatch, place):
    """By the operator's error as well: an engine that fails without one can take Blender down."""

    def fail(*_arguments, **_keywords):
        raise ValueError("planted")

    owner, name = (engine.properties, place.partition(".")[2]) if "." in place else (engine, place)
    monkeypatch.setattr(owner, name, fail)
    with pytest.raises(RuntimeError, match=r"planted.*Copy Diagnostics"):
        picture(lit, tmp_path)


def test_shots_of_the_sequencer_have_cameras_of_their_own(lit, tmp_path, written):
    """Two strips of one scene, the second through another camera; a scene without one can be in a strip as well."""
    down = bpy.data.objects.new("Down", bpy.data.cameras.new("Down"))
    down.location = (0.0, 0.0, 5.0)
    lit.collection.objects.link(down)
    edit = bpy.data.scenes.new("Edit")
    edit.render.engine, edit.render.resolution_x, edit.render.resolution_y = "RESTIR", 16, 16
    edit.render.filepath = str(tmp_path / "shot")
    bpy.context.window.scene = edit
    editor = edit.sequence_editor_create()
    strips = editor.strips if hasattr(editor, "strips") else editor.sequences
    for i, camera in enumerate((lit.camera, down)):
        strip = strips.new_scene(camera.name, lit, channel=1 + i, frame_start=1 + 5 * i)
        strip.scene_camera, strip.frame_final_end = camera, 6 + 5 * i
    for frame in (3, 8):
        edit.frame_set(frame)
        bpy.ops.render.render(scene="Edit", write_still=True)
    horizon, ground = (passes["Combined"][-4:, :, 0].mean() for passes in written)
    assert horizon > 1.1 * ground > 0.1
    lit.camera = None
    edit.frame_set(4)
    bpy.ops.render.render(scene="Edit", write_still=True)
    assert written[-1]["Combined"][-4:, :, 0].mean() == pytest.approx(horizon)


def test_all_passes_reach_blender(lit, tmp_path, written):
    layer = bpy.context.view_layer
    layer.pass_cryptomatte_depth = 16
    for item in SHOWN:
        setattr(layer if item.view_layer else layer.restir, item.view_layer or item.own, True)
    settings = lit.render.image_settings
    if hasattr(settings, "media_type"):
        settings.media_type = "MULTI_LAYER_IMAGE"
    settings.file_format = "OPEN_EXR_MULTILAYER"
    lit.restir.use_denoising = True
    lit.render.filepath = str(tmp_path / "passes.exr")
    bpy.ops.render.render(write_still=True)
    newer = set() if bpy.app.version >= (5, 2, 0) else {SPECULAR_ALBEDO, DENOISING_ROUGHNESS}
    shown = [item for item in SHOWN if item.name not in newer]
    assert set(written[-1]) == {item.name for item in shown}
    channels = multilayer_channels(tmp_path / "passes.exr")
    expected = {engine.pass_name(item) for item in shown}
    assert expected <= {name.split(".")[1] for name in channels if name.count(".") >= 2}
    for item in shown:
        got = [name for name in channels if name.split(".")[1:2] == [engine.pass_name(item)]]
        assert len(got) == len(item.channels), item.name


def test_files_have_channels_named_and_stored_as_those_of_cycles(lit, tmp_path):
    """Also with half floats: Blender stores in them what is a colour to it, which the ids of Cryptomatte are not."""
    layer = bpy.context.view_layer
    for item in PASSES:
        if item.view_layer:
            setattr(layer, item.view_layer, True)
    layer.restir.use_pass_volume = layer.cycles.use_pass_volume_direct = layer.cycles.use_pass_volume_indirect = True
    layer.restir.use_pass_denoising = layer.cycles.denoising_store_passes = True
    layer.aovs.add().name, layer.aovs.add().name = "a", "b"
    layer.aovs["b"].type = "VALUE"
    layer.lightgroups.add(name="key")
    exact_layers(lit)
    lit.render.image_settings.color_depth, lit.cycles.samples = "16", 1
    lit.cycles.use_denoising = lit.restir.use_denoising = True
    found = []
    for name in ("CYCLES", "RESTIR"):
        lit.render.engine, lit.render.filepath = name, str(tmp_path / f"{name}.exr")
        bpy.ops.render.render(write_still=True)
        found.append(exr.kinds(lit.render.filepath))
    theirs, ours = found
    assert ours == theirs


def multilayer_channels(path: Path) -> set[str]:
    """Names of the channels of an EXR file, from the headers of its parts: lists of `name, 0, 16 bytes`, ended by 0."""
    data, mark, names = path.read_bytes(), b"channels\0chlist\0", set()
    start = data.find(mark)
    while start >= 0:
        start += len(mark) + 4
        while data[start] != 0:
            end = data.index(b"\0", start)
            names.add(data[start:end].decode())
            start = end + 17
        start = data.find(mark, start)
    return names


def test_both_integrators_render_the_same_passes(lit, written):
    """A floor, a lamp, a sky: the means of every pass of light are the same within the noise of 64 samples."""
    lamp = bpy.data.objects.new("Lamp", bpy.data.lights.new("Lamp", "POINT"))
    lamp.location, lamp.data.energy, lamp.data.shadow_soft_size = (0.5, 0.5, 1.5), 60.0, 0.2
    lit.collection.objects.link(lamp)
    layer = lit.view_layers[0]
    layer.use_pass_diffuse_direct = layer.use_pass_diffuse_indirect = layer.use_pass_environment = True
    lit.restir.samples, lit.restir.reuse.pilot = 64, False
    for integrator in ("PATH", "RESTIR"):
        lit.restir.integrator = integrator
        bpy.ops.render.render()
    path, restir = written
    for name, pixels in path.items():
        np.testing.assert_allclose(restir[name].mean((0, 1)), pixels.mean((0, 1)), rtol=0.01, atol=1e-3, err_msg=name)


@pytest.mark.parametrize(
    "settings",
    [{}, {"integrator": "RESTIR"}, {"integrator": "RESTIR", "reuse": {"rounds": 1, "temporal": True}}],
)
def test_light_passes_add_up_to_the_picture_in_every_pixel(scene, written, settings):
    """With lobes of all classes, some of them without colour in a channel, under more lights than a tile looks at."""
    kit.camera()
    kit.floor()
    glass = kit.principled(Transmission_Weight=1.0, Roughness=0.2)
    hair = kit.material(lambda node: node("BsdfHairPrincipled"))
    kit.row([kit.principled(Base_Color=(0.8, 0.2, 0.0, 1.0)), kit.principled(Metallic=1.0), glass, hair])

    def two_colors(node):
        shines = node("BsdfGlossy", Color=(1.0, 0.1, 0.0, 1.0), Roughness=0.3)
        return node("MixShader", {1: node("BsdfTranslucent", Color=(0.0, 0.3, 1.0, 1.0)), 2: shines})

    kit.put("plane", kit.material(two_colors), (0.0, -1.0, 1.9), 0.8, rotation=(90, 0, 0))
    kit.lamp()
    kit.world(lambda node: node("Background", Color=(0.1, 0.15, 0.2)))
    for x in range(6):
        kit.put("ball", kit.emission((1.0, 0.5, 0.2), 20.0), (x - 2.5, 1.5, 1.5), 0.1)
    layer, classes = bpy.context.view_layer, ("diffuse", "glossy", "transmission")
    for name in [f"{kind}_{part}" for kind in classes for part in ("direct", "indirect", "color")]:
        setattr(layer, f"use_pass_{name}", True)
    layer.use_pass_emit = layer.use_pass_environment = True
    kit.assign(scene.restir, settings | {"samples": 4, "is_initialized": True})
    scene.render.resolution_x, scene.render.resolution_y = 48, 36
    bpy.ops.render.render()
    found = written[-1]
    total = found["Emission"] + found["Environment"]
    for kind in ("Diffuse", "Glossy", "Transmission"):
        total += (found[f"{kind} Direct"] + found[f"{kind} Indirect"]) * found[f"{kind} Color"]
    np.testing.assert_allclose(total, found["Combined"][..., :3], rtol=1e-4, atol=1e-5)


def test_normal_pass_is_the_mean_of_the_samples(scene, written):
    """At edges it is shorter than 1, as in Cycles: what it is where things are covered, times how much of them is."""
    kit.camera((0.0, 0.0, 5.0), (0.0, 0.0, 0.0), type="ORTHO", ortho_scale=4.0)
    kit.put("plane", kit.diffuse())
    bpy.context.view_layer.use_pass_normal = scene.render.film_transparent = True
    scene.restir.samples = 16
    bpy.ops.render.render()
    normal, alpha = written[-1]["Normal"], written[-1]["Combined"][..., 3]
    np.testing.assert_allclose(normal[..., 2], alpha, atol=1e-5)
    assert ((alpha > 0.1) & (alpha < 0.9)).sum() > 10


def test_the_estimate_of_visibility_is_a_pass_of_restir(lit, written):
    """Without an obstacle all light arrives; other settings leave the pass empty and say so."""
    from restir_engine import warning_log

    lamp = bpy.data.objects.new("Lamp", bpy.data.lights.new("Lamp", "POINT"))
    lamp.location = (0.5, 0.5, 1.5)
    lit.collection.objects.link(lamp)
    lit.view_layers[0].restir.use_pass_visibility = True
    lit.restir.integrator, lit.restir.reuse.visibility, lit.restir.samples = "RESTIR", "ESTIMATED", 4
    bpy.ops.render.render()
    ground = written[-1]["Visibility Estimate"][:4]
    assert ground == pytest.approx(1.0)
    assert not warning_log.lines(lit.name)
    lit.restir.reuse.visibility = "TARGET"
    bpy.ops.render.render()
    assert not written[-1]["Visibility Estimate"].any()
    assert any("Visibility Estimate" in line for line in warning_log.lines(lit.name))


def test_each_view_layer_has_its_own_picture(lit, written):
    second = lit.view_layers.new("Empty")
    second.layer_collection.exclude = True
    for item in lit.collection.objects:
        if item.type == "MESH":
            other = bpy.data.collections.new("Ground")
            lit.collection.children.link(other)
            lit.collection.objects.unlink(item)
            other.objects.link(item)
    second.layer_collection.children["Ground"].exclude = True
    second.samples, second.use_pass_z = 2, True
    bpy.ops.render.render()
    first_layer, second_layer = written
    assert "Depth" not in first_layer and "Depth" in second_layer
    assert first_layer["Combined"][:4, :, :3].mean() < 0.9 * second_layer["Combined"][:4, :, :3].mean()


def test_frames_of_an_animation(lit, tmp_path, written):
    lit.frame_start, lit.frame_end = 1, 3
    for frame, grey in ((1, 0.5), (3, 1.0)):
        sky(lit).default_value = (grey, grey, grey, 1.0)
        sky(lit).keyframe_insert("default_value", frame=frame)
    lit.render.filepath = str(tmp_path / "frame_")
    lit.render.image_settings.file_format = "PNG"
    bpy.ops.render.render(animation=True)
    assert sorted(path.name for path in tmp_path.glob("frame_*")) == [f"frame_000{i}.png" for i in (1, 2, 3)]
    brightness = [passes["Combined"][..., :3].mean() for passes in written]
    assert brightness[0] < brightness[1] < brightness[2]


@pytest.mark.parametrize("what", ["no camera", "planted"])
def test_an_animation_goes_on_where_a_frame_fails(scene, tmp_path, monkeypatch, capfd, what):
    farm.save(tmp_path / "shot.blend", size=8, samples=1, frames=4, composited=True)
    scene = bpy.context.scene
    camera, render = scene.camera, session.Session.render

    def without_camera(scene, *_):
        scene.camera = None if what == "no camera" and scene.frame_current in (2, 3) else camera

    def planted(self, *arguments):
        if what == "planted" and scene.frame_current in (2, 3):
            raise ValueError(what)
        render(self, *arguments)

    monkeypatch.setattr(engine.RestirEngine, "ends_at_failures", False)
    monkeypatch.setattr(session.Session, "render", planted)
    bpy.app.handlers.render_pre.append(without_camera)
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "frame_0003.exr").write_bytes(b"of an earlier render")
    try:
        with pytest.raises(RuntimeError, match=f"frames 2-3 not written.*{what}"):
            bpy.ops.render.render(animation=True)
        assert capfd.readouterr().out.splitlines().count("ReSTIR: frames 2-3 failed") == 1
        assert sorted(path.name[-8:] for path in tmp_path.rglob("*.exr")) == [
            *2 * ["0001.exr"],
            "0003.exr",
            *2 * ["0004.exr"],
        ]
        assert (tmp_path / "out" / "frame_0003.exr").read_bytes() == b"of an earlier render"
        assert not scene.render.use_persistent_data and scene.render.filepath == "//out/frame_"
        scene.frame_set(2)
        with pytest.raises(RuntimeError, match=what):
            bpy.ops.render.render()
    finally:
        bpy.app.handlers.render_pre.remove(without_camera)
    scene.frame_set(4)
    scene.camera = camera
    assert bpy.ops.render.render() == {"FINISHED"}


def test_same_seed_same_noise_and_animated_seed_another(lit, written):
    for frame, animated in ((1, False), (2, False), (2, True)):
        lit.frame_set(frame)
        lit.restir.use_animated_seed = animated
        bpy.ops.render.render()
    first, second, third = (passes["Combined"] for passes in written)
    np.testing.assert_array_equal(first, second)
    assert np.abs(third - first).max() > 0.0


def test_animated_settings_are_read_at_each_frame(lit, written):
    lit.restir.film_exposure = 1.0
    lit.restir.keyframe_insert("film_exposure", frame=1)
    lit.restir.film_exposure = 4.0
    lit.restir.keyframe_insert("film_exposure", frame=3)
    means = []
    for frame in (1, 3):
        lit.frame_set(frame)
        bpy.ops.render.render()
        means.append(written[-1]["Combined"][..., :3].mean())
    assert means[1] == pytest.approx(4.0 * means[0], rel=1e-4)


def test_film_transparent_leaves_the_sky_out(lit, tmp_path):
    lit.render.film_transparent = True
    pixels = picture(lit, tmp_path)
    assert pixels[-4:, :, 3].max() == 0.0
    assert pixels[:4, :, 3].min() == 1.0


def test_no_camera_is_an_error(scene):
    with pytest.raises(RuntimeError, match="no camera"):
        bpy.ops.render.render()


def test_missing_package_is_an_error_with_a_way_out(lit, monkeypatch):
    monkeypatch.setattr(engine.requirements, "WHEELS", {"numba-of-another-world": "1.0"})
    with pytest.raises(RuntimeError, match=r"missing\. Install the ReSTIR zip"):
        bpy.ops.render.render()


def test_older_package_is_an_error_with_a_way_out(lit, monkeypatch):
    monkeypatch.setattr(engine.requirements, "WHEELS", {"numpy": "99.0"})
    with pytest.raises(RuntimeError, match=r"needs 99\.0"):
        bpy.ops.render.render()


def test_failed_kernel_keeps_the_picture_and_says_so(lit, monkeypatch, written):
    from restir_engine.integrators.path import PathIntegrator

    bpy.ops.render.render()
    original = PathIntegrator._render

    def fail_later(self, tile, scratch, first_sample, samples):
        original(self, tile, scratch, first_sample, samples)
        if first_sample > 0:
            raise ValueError("planted")

    monkeypatch.setattr(PathIntegrator, "_render", fail_later)
    lit.restir.samples = 4
    with pytest.raises(RuntimeError, match="planted"):
        bpy.ops.render.render()
    np.testing.assert_array_equal(written[1]["Combined"], written[0]["Combined"])


def test_esc_is_answered_within_three_tenths_of_a_second(lit, monkeypatch, written):
    """`test_break` is always False under bpy as a module, so the session is asked through the engine's own call."""
    import time

    from restir_engine.session import Session

    lit.restir.samples, lit.render.resolution_x, lit.render.resolution_y = 1_000_000, 320, 240
    original, ended = Session.render, []

    def render(self, cancelled, on_progress, on_frame):
        begin = []

        def pressed() -> bool:
            if self.film.samples and not begin:
                begin.append(time.perf_counter() + 0.5)
            return bool(begin) and time.perf_counter() > begin[0]

        result = original(self, pressed, on_progress, on_frame)
        ended.append(time.perf_counter() - begin[0])
        return result

    monkeypatch.setattr(Session, "render", render)
    bpy.ops.render.render()
    assert ended[0] < 0.3
    assert written[-1]["Combined"].max() > 0.1


def test_time_limit_ends_the_render(lit, written):
    import time

    bpy.ops.render.render()  # kernels are loaded
    lit.restir.samples, lit.restir.time_limit = 1_000_000, 1.0
    start = time.perf_counter()
    bpy.ops.render.render()
    assert time.perf_counter() - start < 4.0
    assert written[-1]["Combined"].max() > 0.1


def test_warnings_are_kept_for_the_panel(lit):
    from restir_engine import warning_log

    lit.restir.samples = 1
    material = bpy.data.materials.new("Cel")
    if bpy.app.version < (5, 0, 0):
        material.use_nodes = True
    tree = material.node_tree
    output = next(node for node in tree.nodes if node.bl_idname == "ShaderNodeOutputMaterial")
    tree.links.new(tree.nodes.new("ShaderNodeBsdfRayPortal").outputs[0], output.inputs["Surface"])
    bpy.context.view_layer.objects.active.data.materials.append(material)
    bpy.ops.render.render()
    assert any("Cel" in line for line in warning_log.lines(lit.name))


def test_every_pass_has_a_view_layer_switch(scene):
    layer = bpy.context.view_layer
    assert all(hasattr(layer if item.view_layer else layer.restir, item.view_layer or item.own) for item in SHOWN)
    assert properties.enabled_passes(scene, layer) >= {"Combined"}
