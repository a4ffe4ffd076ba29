"""Stereoscopy beside Cycles: what each view's camera sees, in files that Blender writes of all views."""

from itertools import pairwise

import bpy
import numpy as np
import pytest

from restir_engine.scene.description import SceneDescription
from restir_engine.session import Session
from restir_engine.sync import depsgraph
from testing.blender import exr, kit
from testing.blender.render import exact_files, exact_layers, register

WIDTH, HEIGHT = 20, 14
POLES = {"use_pole_merge": True, "pole_merge_angle_from": 0.1, "pole_merge_angle_to": 0.7}
MODES = {  # the camera, its stereo settings
    "off axis": ({"shift_x": 0.1}, {"convergence_mode": "OFFAXIS", "pivot": "LEFT"}),
    "parallel": ({"type": "ORTHO"}, {"convergence_mode": "PARALLEL", "pivot": "CENTER"}),
    "toe in": ({"sensor_fit": "VERTICAL"}, {"convergence_mode": "TOE", "pivot": "RIGHT"}),
    "spherical perspective": ({}, {"convergence_mode": "TOE", "use_spherical_stereo": True} | POLES),
    "panorama": ({"type": "PANO"}, {"convergence_mode": "OFFAXIS"}),
    "spherical panorama": ({"type": "PANO"}, {"convergence_mode": "PARALLEL", "use_spherical_stereo": True}),
    "EQUIRECTANGULAR": ({"type": "PANO"}, {"convergence_mode": "OFFAXIS", "use_spherical_stereo": True} | POLES),
    "MIRRORBALL": ({"type": "PANO"}, {"convergence_mode": "TOE", "use_spherical_stereo": True}),
    "CENTRAL_CYLINDRICAL": ({"type": "PANO"}, {"convergence_mode": "OFFAXIS", "use_spherical_stereo": True} | POLES),
}


@pytest.fixture
def room(scene):
    """The inside of a cube around a camera that is turned and scaled; two views of it."""
    register()
    kit.put("cube", kit.diffuse(), scale=8.0)
    kit.camera((0.3, -0.4, 0.2), (3.0, 1.0, 0.5)).scale = (2.0, 2.0, 2.0)
    render, cycles = scene.render, scene.cycles
    render.resolution_x, render.resolution_y, render.use_multiview = WIDTH, HEIGHT, True
    cycles.samples, cycles.max_bounces, cycles.use_adaptive_sampling, cycles.use_denoising = 1, 0, False, False
    scene.restir.max_bounces, scene.restir.is_initialized = 0, True
    for settings in (cycles, scene.restir):
        settings.filter_width = 0.01
    cycles.pixel_filter_type = scene.restir.pixel_filter = "BLACKMAN_HARRIS"
    bpy.context.view_layer.use_pass_z = True
    return scene


def channels(scene, engine: str, folder) -> dict[str, np.ndarray]:
    """All channels of the one file that Blender writes of a render: Layer.Pass.view.X by name."""
    exact_layers(scene)
    scene.render.engine, scene.render.filepath = engine, str(folder / f"{engine}.exr")
    bpy.ops.render.render(write_still=True)
    return exr.channels(scene.render.filepath)


def assert_same_depths(scene, folder, views=("left", "right")) -> None:
    """Of what each view sees, and no two views see the same."""
    theirs, ours = (channels(scene, engine, folder) for engine in ("CYCLES", "RESTIR"))
    assert set(theirs) == set(ours)
    depths = [theirs[f"ViewLayer.Depth.{view}.Z"] for view in views]
    for view, depth in zip(views, depths, strict=True):
        # Outside of a round picture nothing is as far as can be. A pixel at its rim may lie on either side.
        away = np.abs(ours[f"ViewLayer.Depth.{view}.Z"] - depth) / depth
        assert np.quantile(away, 0.95) < 4e-3, view
    assert min(np.abs(a - b).max() for a, b in pairwise(depths)) > 0.1


@pytest.mark.parametrize("mode", MODES)
def test_each_eye_sees_what_it_does_in_cycles(room, tmp_path, mode):
    camera, stereo = MODES[mode]
    data = room.camera.data
    kit.assign(data, camera)
    if data.type == "PANO":
        kind = mode if mode.isupper() else "EQUIRECTANGULAR"
        (data if hasattr(data, "panorama_type") else data.cycles).panorama_type = kind
    kit.assign(data.stereo, {"interocular_distance": 0.6, "convergence_distance": 3.0} | stereo)
    assert_same_depths(room, tmp_path)


def test_cameras_by_suffix_are_read_of_one_scene(room, tmp_path, monkeypatch):
    """Three of them, one of which moves; what moves it is seen in its own vectors and in no other's."""
    room.camera.name, room.render.views_format = "Eye_L", "MULTIVIEW"
    for name, place in (("Eye_R", (-2.0, 0.5, 1.0)), ("Eye_M", (1.0, 2.0, -1.0))):
        data = room.camera.data.copy()
        data.lens = 30.0 - place[2]
        kit.add(data, place, (4.0, 0.0, 0.0)).name = name
    room.render.views.new("middle").camera_suffix = "_M"
    for frame in (0, 2):
        bpy.data.objects["Eye_R"].location.y = 0.5 + 0.2 * frame
        bpy.data.objects["Eye_R"].keyframe_insert("location", frame=frame)
    room.frame_set(1)
    assert_same_depths(room, tmp_path, ("left", "right", "middle"))

    bpy.context.view_layer.use_pass_vector = True
    done = {"read": 0, "commit": 0, "render": 0}

    def counted(owner, function, what):
        original = getattr(owner, function)

        def call(*arguments, **keywords):
            done[what] += 1
            return original(*arguments, **keywords)

        monkeypatch.setattr(owner, function, call)

    counted(depsgraph, "read_scene", "read")
    counted(SceneDescription, "commit", "commit")
    counted(Session, "render", "render")
    ours, theirs = (channels(room, engine, tmp_path) for engine in ("RESTIR", "CYCLES"))
    assert done == {"read": 1, "commit": 1, "render": 3}
    for view in ("left", "right", "middle"):
        found, expected = ([of[f"ViewLayer.Vector.{view}.{axis}"] for axis in "XYZW"] for of in (ours, theirs))
        np.testing.assert_allclose(np.median(np.abs(np.subtract(found, expected)), (1, 2)), 0.0, atol=5e-3)
        assert (np.abs(found).max() > 0.2) == (view == "right")


def test_files_and_pictures_of_two_eyes_are_blenders(room, tmp_path):
    """One file for each, or one with red of the one and the rest of the other, of every frame."""
    kit.put("coarse ball", kit.emission((0.8, 0.6, 0.4)), (3.0, 1.0, 0.5))
    room.camera.data.stereo.interocular_distance = 0.6
    room.render.engine, room.frame_end = "RESTIR", 2
    settings = room.render.image_settings
    exact_files(room)
    room.view_settings.view_transform = "Raw"
    settings.file_format, settings.color_mode, settings.color_depth = "PNG", "RGB", "8"
    found = {}
    for views, kind in (("INDIVIDUAL", "eye"), ("STEREO_3D", "both")):
        settings.views_format, room.render.filepath = views, str(tmp_path / f"{kind}_")
        settings.stereo_3d_format.display_mode = "ANAGLYPH"
        bpy.ops.render.render(animation=True)
        found |= {path.stem: pixels(path) for path in tmp_path.glob(f"{kind}_*.png")}
    assert set(found) == {"eye_0001_L", "eye_0001_R", "eye_0002_L", "eye_0002_R", "both_0001", "both_0002"}
    for frame in ("0001", "0002"):
        left, right = found[f"eye_{frame}_L"], found[f"eye_{frame}_R"]
        assert np.abs(left - right).max() > 0.02
        np.testing.assert_array_equal(found[f"both_{frame}"][..., 0], left[..., 0])
        np.testing.assert_array_equal(found[f"both_{frame}"][..., 1:3], right[..., 1:3])


def pixels(path) -> np.ndarray:
    """(height, width, 4) of an image file."""
    image = bpy.data.images.load(str(path))
    values = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(values)
    return values.reshape(image.size[1], image.size[0], 4)
