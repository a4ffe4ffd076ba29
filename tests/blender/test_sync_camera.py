"""Cameras against Blender's projection and, pixel by pixel, against the points that Cycles' camera rays hit."""

import math
from dataclasses import replace
from types import SimpleNamespace

import bpy
import numpy as np
import pytest
from bpy_extras.object_utils import world_to_camera_view
from mathutils import Matrix, Vector

from restir_engine.kernels.core.jit import kernel
from restir_engine.kernels.core.memory import store_f64
from restir_engine.kernels.geometry.panorama import panorama_direction, panorama_place
from restir_engine.scene.errors import SceneError
from restir_engine.scene.warnings import Warnings
from restir_engine.sync.camera import pixel_size, sync_camera, sync_view, view_camera
from testing.blender import probe

EXTENT = 8.0


@kernel
def _there_and_back(camera, u, v, out):
    u, v = panorama_place(camera, panorama_direction(camera, u, v))
    store_f64(out, 0, u)
    store_f64(out, 1, v)


def position(nodes):
    return nodes.new("ShaderNodeNewGeometry").outputs["Position"]


@pytest.fixture
def room():
    """The inside of a cube around a camera that is turned and scaled."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.mesh.primitive_cube_add(size=2 * EXTENT)
    data = bpy.data.cameras.new("Camera")
    camera = bpy.data.objects.new("Camera", data)
    camera.location = (0.3, -0.4, 0.2)
    camera.rotation_euler = (1.2, 0.1, 0.4)
    camera.scale = (2.0, 2.0, 2.0)
    scene = bpy.context.scene
    scene.collection.objects.link(camera)
    scene.camera = camera
    scene.render.resolution_x, scene.render.resolution_y = 16, 12
    scene.render.resolution_percentage = 100
    return scene


def panorama(data):
    """Where the running Blender keeps the settings of panoramas."""
    return data if hasattr(data, "panorama_type") else data.cycles


def assert_same_rays():
    """Cycles' points lie on our rays, within the pixel filter's 0.005 pixels."""
    expected = probe.probe(position, -10.0, 10.0)
    found = probe.ours(probe.rendered_scene())
    assert found["p"].shape == expected.shape
    away = expected - found["o"]
    along = (away * found["d"]).sum(axis=-1)
    aside = np.linalg.norm(away - along[..., None] * found["d"], axis=-1)
    pixel = np.maximum(along * found["dd"], 0.0) + 1e-3
    assert (along > 0.0).all()
    assert (aside / pixel).max() < 0.02
    # A ray beside an edge of the room may hit the other wall.
    same = np.linalg.norm(found["p"] - expected, axis=-1) < 0.02
    assert same.mean() > 0.98


@pytest.mark.parametrize("fit", ["AUTO", "HORIZONTAL", "VERTICAL"])
@pytest.mark.parametrize("size", [(16, 12), (9, 15)])
def test_perspective(room, fit, size):
    room.render.resolution_x, room.render.resolution_y = size
    data = room.camera.data
    data.sensor_fit, data.shift_x, data.shift_y = fit, 0.15, -0.1
    data.sensor_width, data.sensor_height, data.lens = 32.0, 20.0, 28.0
    assert_same_rays()


@pytest.mark.parametrize("fit", ["AUTO", "HORIZONTAL", "VERTICAL"])
def test_orthographic(room, fit):
    data = room.camera.data
    data.type, data.ortho_scale, data.sensor_fit = "ORTHO", 5.0, fit
    data.shift_x, data.shift_y = -0.2, 0.1
    assert_same_rays()


@pytest.mark.parametrize("limits", [None, (-1.0, 2.0, -0.5, 1.2)])
def test_panorama(room, limits):
    data = room.camera.data
    data.type = "PANO"
    settings = panorama(data)
    settings.panorama_type = "EQUIRECTANGULAR"
    if limits:
        settings.longitude_min, settings.longitude_max, settings.latitude_min, settings.latitude_max = limits
    assert_same_rays()


@pytest.mark.parametrize("kind", ["PERSP", "ORTHO", "PANO"])
def test_pixel_aspect_border_and_percentage(room, kind):
    room.camera.data.type = kind
    if kind == "PANO":
        panorama(room.camera.data).panorama_type = "EQUIRECTANGULAR"
    render = room.render
    render.resolution_x, render.resolution_y, render.resolution_percentage = 43, 31, 50
    render.pixel_aspect_x, render.pixel_aspect_y = 1.0, 1.7
    render.use_border = render.use_crop_to_border = True
    render.border_min_x, render.border_max_x, render.border_min_y, render.border_max_y = 0.3, 0.91, 0.12, 0.7
    assert_same_rays()


@pytest.mark.parametrize("kind", ["PERSP", "ORTHO", "PANO"])
def test_clip_start(room, kind):
    """A wall before the near clipping plane is not seen."""
    bpy.ops.mesh.primitive_cube_add(size=1.0, location=room.camera.location)
    room.camera.data.type = kind
    if kind == "PANO":
        panorama(room.camera.data).panorama_type = "EQUIRECTANGULAR"
    room.camera.data.ortho_scale = 0.5
    room.camera.data.clip_start = 3.0
    assert_same_rays()


@pytest.mark.parametrize("kind", ["PERSP", "ORTHO"])
def test_projection(room, kind):
    """Rays through the places where Blender projects points go through these points."""
    data = room.camera.data
    data.type, data.shift_x, data.shift_y, data.sensor_fit = kind, 0.1, 0.2, "VERTICAL"
    depsgraph = bpy.context.evaluated_depsgraph_get()
    camera = sync_camera(depsgraph, Warnings())
    record = camera.record()
    to_camera = record["to_camera"].reshape(3, 4)
    for point in np.random.default_rng(1).uniform(-5.0, 5.0, (20, 3)):
        u, v, depth = world_to_camera_view(room, room.camera, Vector(point))
        x, y, z = to_camera @ (*point, 1.0)
        left, right, bottom, top = record["screen"]
        distance = 1.0 if kind == "ORTHO" else -z
        assert (x / distance - left) / (right - left) == pytest.approx(u, abs=1e-5)
        assert (y / distance - bottom) / (top - bottom) == pytest.approx(v, abs=1e-5)
        assert -z == pytest.approx(depth, abs=1e-5)


@pytest.mark.parametrize("kind", ["PERSP", "ORTHO", "PANO"])
@pytest.mark.parametrize("blades", [0, 3, 6])
def test_lens(room, kind, blades):
    """The points of the lens that Cycles' rays come from, worked out from what they hit, fill our lens."""
    data = room.camera.data
    data.type, data.ortho_scale = kind, 0.001  # all orthographic rays look at one place
    if kind == "PANO":
        panorama(data).panorama_type = "EQUIRECTANGULAR"
    room.render.resolution_x = room.render.resolution_y = 40
    data.dof.use_dof = True
    data.dof.aperture_fstop = 0.02 if kind != "ORTHO" else 0.7
    data.dof.focus_distance, data.dof.aperture_blades, data.dof.aperture_rotation = 2.0, blades, 0.35
    data.dof.aperture_ratio = 1.5
    expected = probe.probe(position, -10.0, 10.0)
    camera = sync_camera(bpy.context.evaluated_depsgraph_get(), Warnings())
    assert camera.focus_distance == pytest.approx(2.0)
    scene = probe.rendered_scene()
    rays = probe.ours(scene, camera=replace(scene.camera, aperture=0.0))
    matrix = camera.record()["to_world"].reshape(3, 4)
    axes, centre = matrix[:, :3], matrix[:, 3]
    d = rays["d"]
    if kind == "PANO":
        focus = centre + 2.0 * d
        first = -axes[:, 2] - (d @ -axes[:, 2])[..., None] * d
        first /= np.linalg.norm(first, axis=-1, keepdims=True)
        second = np.cross(d, first)
        normal = d
    else:
        start = rays["o"] - camera.clip_start / -(d @ axes[:, 2])[..., None] * d
        focus = start + 2.0 / -(d @ axes[:, 2])[..., None] * d
        first, second, normal = (np.broadcast_to(axis, d.shape) for axis in (axes[:, 0], axes[:, 1], -axes[:, 2]))
        centre = start
    line = focus - expected
    line /= np.linalg.norm(line, axis=-1, keepdims=True)
    back = ((centre - expected) * normal).sum(-1) / (line * normal).sum(-1)
    lens = expected + back[..., None] * line - centre
    x = ((lens * first).sum(-1) / camera.aperture).ravel() * 1.5
    y = ((lens * second).sum(-1) / camera.aperture).ravel()
    assert np.hypot(x, y).max() < 1.02
    half = math.pi / blades if blades else 0.0
    if blades:
        normals = 0.35 + 2.0 * half * np.arange(blades)
        assert (np.outer(x, np.cos(normals)) + np.outer(y, np.sin(normals))).max() < math.cos(half) + 0.02
    moment = (2.0 + math.cos(2.0 * half)) / 6.0
    assert np.mean(x * x + y * y) == pytest.approx(moment, abs=0.03)
    assert abs(np.mean(x)) < 0.05 and abs(np.mean(y)) < 0.05


def test_focus_object(room):
    target = bpy.data.objects.new("Target", None)
    room.collection.objects.link(target)
    target.location = room.camera.location + Vector((0.0, 3.0, 1.0))
    room.camera.data.dof.use_dof = True
    room.camera.data.dof.focus_object = target
    depsgraph = bpy.context.evaluated_depsgraph_get()
    axis = room.camera.matrix_world.to_quaternion() @ Vector((0.0, 0.0, -1.0))
    expected = axis.dot(target.location - room.camera.location)
    assert sync_camera(depsgraph, Warnings()).focus_distance == pytest.approx(expected, rel=1e-5)


ROUND = {
    "MIRRORBALL": {},
    "FISHEYE_EQUIDISTANT": {"fisheye_fov": 3.5},
    "FISHEYE_EQUISOLID": {"fisheye_lens": 9.0, "fisheye_fov": 3.4},
    "FISHEYE_LENS_POLYNOMIAL": {"fisheye_fov": 2.5, "fisheye_polynomial_k0": -0.02, "fisheye_polynomial_k2": -0.001},
}
FILLING = {
    "EQUIANGULAR_CUBEMAP_FACE": {},
    "CENTRAL_CYLINDRICAL": {
        "central_cylindrical_range_u_min": -1.0,
        "central_cylindrical_range_u_max": 2.0,
        "central_cylindrical_range_v_min": -0.5,
        "central_cylindrical_range_v_max": 0.8,
        "central_cylindrical_radius": 1.3,
    },
}


def show(room, kind):
    """Let the camera be one of these panoramas."""
    room.camera.data.type = "PANO"
    settings = panorama(room.camera.data)
    settings.panorama_type = kind
    for name, value in (ROUND | FILLING)[kind].items():
        setattr(settings, name, value)


@pytest.mark.parametrize("fit", ["AUTO", "HORIZONTAL", "VERTICAL"])
@pytest.mark.parametrize("size", [(24, 24), (28, 20), (18, 26)])
@pytest.mark.parametrize("kind", [*ROUND, *FILLING])
def test_projections(room, kind, size, fit):
    """Cycles' points lie on our rays; what lies outside of a round picture is black in both."""
    show(room, kind)
    data = room.camera.data
    data.sensor_fit, data.sensor_width, data.sensor_height = fit, 32.0, 20.0
    room.render.resolution_x, room.render.resolution_y = size
    room.render.pixel_aspect_x = 1.2
    expected = probe.probe(position, -10.0, 10.0)
    found = probe.ours(probe.rendered_scene())
    inside = np.linalg.norm(found["d"], axis=-1) > 0.5
    seen = np.abs(expected - -10.0).max(axis=-1) > 1e-3
    # A pixel at the rim may have its sample on the other side.
    assert (inside != seen).mean() < 0.02
    both = inside & seen
    away = (expected - found["o"])[both]
    along = (away * found["d"][both]).sum(axis=-1)
    aside = np.linalg.norm(away - along[:, None] * found["d"][both], axis=-1)
    assert (along > 0.0).all()
    assert np.quantile(aside / (along * found["dd"][both] + 1e-3), 0.98) < 0.05


@pytest.mark.parametrize("kind", [*ROUND, *FILLING])
def test_place_of_a_direction(room, kind):
    """The place where a direction appears is the one that looks there."""
    show(room, kind)
    record = sync_camera(bpy.context.evaluated_depsgraph_get(), Warnings()).record()
    places = np.random.default_rng(2).uniform(0.25, 0.75, (50, 2))
    out = np.zeros((50, 2))
    for place, found in zip(places, out, strict=True):
        _there_and_back(record, *place, found.ctypes.data)
    np.testing.assert_allclose(out, places, atol=1e-5)


def test_no_camera_and_no_pixels(room):
    depsgraph = bpy.context.evaluated_depsgraph_get()
    room.render.resolution_percentage = 5
    depsgraph.update()
    with pytest.raises(SceneError, match="resolution"):
        sync_camera(depsgraph, Warnings())
    room.render.resolution_percentage = 100
    room.camera = None
    with pytest.raises(SceneError, match="camera"):
        sync_camera(bpy.context.evaluated_depsgraph_get(), Warnings())


@pytest.mark.parametrize("kind", ["PERSP", "ORTHO"])
@pytest.mark.parametrize("fit", ["AUTO", "VERTICAL"])
def test_view_of_two_matrices_is_the_camera_that_they_come_from(room, kind, fit):
    """The 3D view gives matrices in place of a lens."""
    camera = room.camera
    data = camera.data
    data.type, data.sensor_fit, data.shift_x, data.shift_y = kind, fit, 0.1, -0.2
    data.clip_start, data.clip_end, camera.scale = 0.3, 50.0, (1.0, 1.0, 1.0)
    depsgraph = bpy.context.evaluated_depsgraph_get()
    expected = sync_camera(depsgraph, Warnings())
    window = camera.calc_matrix_camera(depsgraph, x=expected.width, y=expected.height)
    found = view_camera(np.array(camera.matrix_world.inverted()), np.array(window), expected.width, expected.height)
    assert found.kind == kind
    assert found.film_size == expected.film_size
    np.testing.assert_allclose(found.screen, expected.screen, rtol=1e-4, atol=1e-5)
    # In parallel projection the camera stands where it begins to see.
    stepped = expected.clip_start if kind == "ORTHO" else 0.0
    place = expected.to_world[:, 3] - stepped * expected.to_world[:, 2]
    np.testing.assert_allclose(found.to_world[:3, 3], place, atol=2e-4)
    np.testing.assert_allclose(found.to_world[:3, :3], expected.to_world[:, :3], atol=1e-5)
    clip = found.clip_start + stepped, found.clip_end + stepped
    np.testing.assert_allclose(clip, (expected.clip_start, expected.clip_end), rtol=1e-2)


def test_pixels_of_the_view_are_as_large_as_the_artist_wants(room):
    for chosen, screen, expected in (("AUTO", 1.0, 1), ("AUTO", 2.0, 2), ("1", 2.0, 1), ("4", 1.0, 4)):
        room.render.preview_pixel_size = chosen
        assert pixel_size(room.render, screen) == expected


def view_through(scene, zoom: float = 1.0, shift=(0.0, 0.0), **of_space):
    """The context of a 3D view through the scene's camera, whose frame has the view's size times `zoom`."""
    depsgraph = bpy.context.evaluated_depsgraph_get()
    render, camera = scene.render, scene.camera.evaluated_get(depsgraph)
    window = np.array(camera.calc_matrix_camera(depsgraph, x=render.resolution_x, y=render.resolution_y))
    window = np.diag([zoom, zoom, 1.0, 1.0]) @ window
    window[0] += shift[0] * window[3]
    window[1] += shift[1] * window[3]
    space = {"use_local_camera": False, "camera": None, "use_render_border": False}
    space |= {f"render_border_{end}_{axis}": float(end == "max") for end in ("min", "max") for axis in "xy"}
    location, rotation, _ = camera.matrix_world.decompose()
    placed = Matrix.Translation(location) @ rotation.to_matrix().to_4x4()
    return SimpleNamespace(
        region=SimpleNamespace(width=render.resolution_x, height=render.resolution_y),
        region_data=SimpleNamespace(
            view_matrix=placed.inverted(), window_matrix=window, view_perspective=of_space.pop("perspective", "CAMERA")
        ),
        space_data=SimpleNamespace(**space | of_space),
        scene=scene,
        preferences=SimpleNamespace(system=SimpleNamespace(pixel_size=1.0)),
    )


@pytest.mark.parametrize("kind", ["PERSP", "ORTHO", "PANO"])
def test_a_view_through_a_camera_is_what_the_camera_sees(room, kind):
    """With lens, shift and sensor fit, where the frame fills the view."""
    data = room.camera.data
    data.type, data.shift_x, data.shift_y, data.sensor_fit = kind, 0.1, -0.2, "VERTICAL"
    data.dof.use_dof, data.dof.focus_distance, data.dof.aperture_fstop = True, 3.0, 0.5
    if kind == "PANO":
        panorama(data).panorama_type = "EQUIRECTANGULAR"
        data.shift_x = data.shift_y = 0.0
    bpy.context.view_layer.update()
    depsgraph = bpy.context.evaluated_depsgraph_get()
    found, expected = sync_view(view_through(room), depsgraph).camera, sync_camera(depsgraph, Warnings())
    assert found.film_size == expected.film_size
    a, b = found.record(), expected.record()
    names = ["kind", "width", "height", "screen", "aperture", "focus_distance", "panorama", "region_x", "region_y"]
    for name in names:
        np.testing.assert_allclose(a[name], b[name], rtol=1e-4, atol=1e-5, err_msg=name)


def test_borders_of_a_view(room):
    """Its own beside the camera's view, in which the camera's counts, within the frame as it is zoomed and moved."""
    depsgraph = bpy.context.evaluated_depsgraph_get()
    own = {"use_render_border": True, "render_border_min_x": 0.25, "render_border_max_y": 0.5}
    view = sync_view(view_through(room, perspective="PERSP", **own), depsgraph)
    assert view.camera.region == (4, 0, 12, 6)
    assert sync_view(view_through(room, **own), depsgraph).camera.region is None
    render = room.render
    render.use_border, render.border_min_x, render.border_max_x = True, 0.5, 1.0
    render.border_min_y, render.border_max_y = 0.0, 0.5
    assert sync_view(view_through(room), depsgraph).camera.region == (8, 0, 8, 6)
    assert sync_view(view_through(room, zoom=0.5), depsgraph).camera.region == (8, 3, 4, 3)
    assert sync_view(view_through(room, zoom=0.5, shift=(0.5, 0.0)), depsgraph).camera.region == (12, 3, 4, 3)
    assert sync_view(view_through(room, zoom=2.0), depsgraph).camera.region == (8, 0, 8, 6)


def test_a_panorama_lies_where_the_cameras_frame_does(room):
    data = room.camera.data
    data.type = "PANO"
    panorama(data).panorama_type = "EQUIRECTANGULAR"
    bpy.context.view_layer.update()
    view = sync_view(view_through(room, zoom=0.5), bpy.context.evaluated_depsgraph_get())
    np.testing.assert_allclose(view.frame, (0.25, 0.25, 0.75, 0.75), atol=1e-6)
    assert (view.camera.width, view.camera.height, view.camera.region) == (8, 6, (-4, -3, 16, 12))
    assert view.camera.rectangle == (-0.5, -0.5, 1.5, 1.5)
