"""The scene's camera object → `Camera`, with the frame that render settings give it."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ..scene.camera import PROJECTIONS, Camera
from ..scene.errors import SceneError
from ..scene.warnings import Warnings

NO_CAMERA = "The scene has no camera: add one, or choose one in the Scene properties under “Camera”."


class Eye(NamedTuple):
    """How one view of a render looks through an evaluated camera object.

    matrix: its place, (4, 4); shift_x: its lens's; side: -1 for the left eye of spherical stereo, 1 for the right one,
    else 0.
    """

    camera: object
    matrix: np.ndarray
    shift_x: float
    side: int


def sync_camera(depsgraph, warnings, camera_object=None, eye: Eye | None = None) -> Camera:
    """The camera of an evaluated depsgraph's scene with the frame of the render settings.

    Or another camera object, or an eye.
    """
    scene = depsgraph.scene
    camera_object = eye.camera if eye else camera_object or scene.camera
    if camera_object is None:
        raise SceneError(NO_CAMERA)
    camera_object = camera_object.evaluated_get(depsgraph)
    if camera_object.type != "CAMERA":
        raise SceneError(f"“{camera_object.name}” is used as the camera but is none: choose a camera object.")
    render = scene.render
    width, height = frame_size(render)
    data = camera_object.data
    camera = read_camera(
        data,
        eye.matrix if eye else np.array(camera_object.matrix_world),
        width,
        height,
        warnings,
        aspect=(render.pixel_aspect_x, render.pixel_aspect_y),
        region=border(render, width, height),
        focus=_focus_location(data),
        shift_x=eye.shift_x if eye else None,
    )
    return replace(camera, **_read_stereo(data.stereo, eye.side)) if eye and eye.side else camera


class View(NamedTuple):
    """What a 3D view shows: its camera, and where the camera's frame lies in the view's region.

    frame: left, bottom, right, top in units of the region, from its lower left corner. A panorama's frame may be
    smaller than the region or reach beyond it; that of any other camera is the region.
    """

    camera: Camera
    frame: tuple[float, float, float, float]

    def same_as(self, other: View | None) -> bool:
        """Whether both show the same."""
        return other is not None and self.frame == other.frame and self.camera.same_as(other.camera)


_ALL = (0.0, 0.0, 1.0, 1.0)


def sync_view(context, depsgraph) -> View:
    """What a 3D view shows: `context` has the region and its view. A camera's view has its lens and its border.

    The view's matrices are those of the eye that it shows of a stereoscopic camera.
    """
    region, view, space = context.region, context.region_data, context.space_data
    step = pixel_size(context.scene.render, context.preferences.system.pixel_size)
    width, height = (max(-(-size // step), 1) for size in (region.width, region.height))
    window = np.array(view.window_matrix)
    camera, frame = view_camera(np.array(view.view_matrix), window, width, height), _ALL
    seen_by = (space.camera if space.use_local_camera else context.scene.camera) if _in_camera(view) else None
    if seen_by is not None and seen_by.type == "CAMERA":
        seen_by = seen_by.evaluated_get(depsgraph)
        data, focus = seen_by.data, _focus_location(seen_by.data)
        around = camera_frame(data.view_frame(scene=context.scene), window)
        if data.type == "PANO":
            camera = _view_of_panorama(data, camera.to_world, around, width, height, focus)
            frame = around
        else:
            camera = replace(camera, **_read_lens(data, camera.kind, camera.to_world, focus))
        return View(_bordered(camera, view_border(context.scene.render, around)), frame)
    own = (space.render_border_min_x, space.render_border_min_y, space.render_border_max_x, space.render_border_max_y)
    return View(_bordered(camera, own if space.use_render_border and not _in_camera(view) else None), frame)


def _in_camera(view) -> bool:
    return view.view_perspective == "CAMERA"


def camera_frame(corners, window: np.ndarray) -> tuple[float, float, float, float]:
    """Where a camera's frame lies in a view through it: left, bottom, right, top in units of the region.

    corners: of the frame in the camera's space, as `Camera.view_frame` gives them. window: view to clip coordinates,
    which tells how far the view is zoomed and shifted.
    """
    points = np.column_stack([np.array(corners, np.float64), np.ones(len(corners))]) @ np.asarray(window, np.float64).T
    places = 0.5 + 0.5 * points[:, :2] / points[:, 3:]
    return (*places.min(0).tolist(), *places.max(0).tolist())


def view_border(render, frame: tuple[float, float, float, float]) -> tuple[float, float, float, float] | None:
    """The render border of a camera's view in units of the region, None where there is none. frame: the camera's."""
    if not render.use_border:
        return None
    left, bottom, right, top = frame
    x, y = (np.array([right, top]) - (left, bottom)).tolist()
    return (
        left + render.border_min_x * x,
        bottom + render.border_min_y * y,
        left + render.border_max_x * x,
        bottom + render.border_max_y * y,
    )


def _bordered(camera: Camera, rectangle: tuple[float, float, float, float] | None) -> Camera:
    """The camera of a view that renders a part of its region only, of a pixel at least; None: all of it."""
    if rectangle is None:
        return camera
    x, y, width, height = camera.region or (0, 0, camera.width, camera.height)
    low = [min(max(round(rectangle[k] * (width, height)[k]), 0), (width, height)[k] - 1) for k in (0, 1)]
    high = [min(max(round(rectangle[k + 2] * (width, height)[k]), low[k] + 1), (width, height)[k]) for k in (0, 1)]
    return replace(camera, region=(x + low[0], y + low[1], high[0] - low[0], high[1] - low[1]))


def _view_of_panorama(data, matrix: np.ndarray, frame, width: int, height: int, focus) -> Camera:
    """The camera of a view of so many pixels through a panoramic camera, whose frame lies there in it."""
    left, bottom, right, top = frame
    whole = max(round((right - left) * width), 1), max(round((top - bottom) * height), 1)
    region = -round(left * width), -round(bottom * height), width, height
    return read_camera(data, matrix, *whole, Warnings(), region=region, focus=focus)


def pixel_size(render, screen: float) -> int:
    """How many of the region's pixels a side of a rendered one has; screen: of the screen's, 2 where they are tiny."""
    return max(int(screen), 1) if render.preview_pixel_size == "AUTO" else int(render.preview_pixel_size)


def view_camera(view: np.ndarray, window: np.ndarray, width: int, height: int) -> Camera:
    """The `Camera` of a view by its two matrices, (4, 4): world to view, and view to clip coordinates."""
    to_world = np.linalg.inv(view.astype(np.float64))
    window = window.astype(np.float64)
    (px, py, pz), (sx, sy) = window.diagonal()[:3], window[:2, 2]
    if window[3, 3] == 0.0:
        screen = ((sx - 1.0) / px, (sx + 1.0) / px, (sy - 1.0) / py, (sy + 1.0) / py)
        near, far = window[2, 3] / (pz - 1.0), window[2, 3] / (pz + 1.0)
        return Camera("PERSP", to_world, width, height, None, screen, near, far)
    sx, sy = window[:2, 3]
    screen = ((-1.0 - sx) / px, (1.0 - sx) / px, (-1.0 - sy) / py, (1.0 - sy) / py)
    near, far = (1.0 + window[2, 3]) / pz, (window[2, 3] - 1.0) / pz
    near, far = sorted((float(near), float(far)))
    # Views in parallel see what lies behind them as well: their camera steps back.
    to_world[:3, 3] -= to_world[:3, 2] / np.linalg.norm(to_world[:3, 2]) * near
    return Camera("ORTHO", to_world, width, height, None, screen, 0.0, far - near)


def frame_size(render) -> tuple[int, int]:
    """Width and height of the whole frame in pixels."""
    percentage = render.resolution_percentage
    width, height = render.resolution_x * percentage // 100, render.resolution_y * percentage // 100
    if width < 1 or height < 1:
        raise SceneError("The image has no pixels: raise the resolution or its percentage in the Output properties.")
    return width, height


def border(render, width: int, height: int) -> tuple[int, int, int, int] | None:
    """The region (x, y, width, height) of the render border, None for the whole frame.

    Blender multiplies in single precision and drops the fraction: 0.7 × 1920 is 1344, in double precision 1343. The
    picture has to have Blender's size to the pixel.
    """
    if not render.use_border:
        return None
    left, right = (int(np.float32(x) * np.float32(width)) for x in (render.border_min_x, render.border_max_x))
    bottom, top = (int(np.float32(y) * np.float32(height)) for y in (render.border_min_y, render.border_max_y))
    if right <= left or top <= bottom:
        raise SceneError("The render region has no pixels: draw it larger, or switch Render Region off.")
    return left, bottom, right - left, top - bottom


def read_camera(
    data, matrix, width: int, height: int, warnings, *, aspect=(1.0, 1.0), region=None, focus=None, shift_x=None
) -> Camera:
    """The `Camera` of a bpy.types.Camera placed by `matrix`.

    focus: where the focus object is, in world space; shift_x: where the lens's is another.
    """
    kind = data.type if data.type in ("PERSP", "ORTHO", "PANO") else "PERSP"
    if kind != data.type:
        warnings.add("Camera", data.name, f"cameras of type {data.type} are rendered as perspective")
    frame = width * aspect[0], height * aspect[1]
    shift = data.shift_x if shift_x is None else shift_x, data.shift_y
    plane = _read_panorama(data, *frame, warnings) if kind == "PANO" else {"screen": _screen(data, kind, *frame, shift)}
    to_world = np.asarray(matrix, np.float64)[:3]
    return Camera(
        kind,
        to_world,
        width,
        height,
        region,
        clip_start=data.clip_start,
        clip_end=data.clip_end,
        **plane,
        **_read_lens(data, kind, to_world, focus),
    )


def _screen(data, kind: str, width: float, height: float, shift) -> tuple[float, float, float, float]:
    """Left, right, bottom, top of the frame; width and height in units of equal size on the sensor."""
    fit = data.sensor_fit
    horizontal = width > height if fit == "AUTO" else fit == "HORIZONTAL"
    if kind == "ORTHO":
        extent = data.ortho_scale
    else:
        extent = (data.sensor_height if fit == "VERTICAL" else data.sensor_width) / data.lens
    unit = extent / (width if horizontal else height)  # of the frame's plane, a pixel
    half_width, half_height = 0.5 * width * unit, 0.5 * height * unit
    x, y = shift[0] * extent, shift[1] * extent
    return x - half_width, x + half_width, y - half_height, y + half_height


def _read_lens(data, kind: str, to_world: np.ndarray, focus) -> dict:
    """Fields of `Camera` that say how it blurs."""
    dof = data.dof
    if not dof.use_dof:
        return {}
    stop = max(dof.aperture_fstop, 1e-5)
    # A lens of so many millimetres, in metres; an orthographic camera counts as a lens of 1 m.
    length = 1.0 if kind == "ORTHO" else data.lens * 1e-3
    distance = dof.focus_distance
    if focus is not None:
        axis = to_world[:, 2]
        axis = axis / max(np.linalg.norm(axis), 1e-30)
        distance = abs(float(axis @ (to_world[:, 3] - focus)))
    return {
        "aperture": length / (2.0 * stop),
        "focus_distance": max(distance, 1e-5),
        "blades": dof.aperture_blades,
        "blade_rotation": dof.aperture_rotation,
        "aperture_ratio": dof.aperture_ratio,
    }


def _read_stereo(stereo, side: int) -> dict:
    """Fields of `Camera` that say where an eye of spherical stereo looks from."""
    merges = stereo.use_pole_merge
    return {
        "eye": 0.5 * side * stereo.interocular_distance,
        "convergence": 0.0 if stereo.convergence_mode == "PARALLEL" else stereo.convergence_distance,
        "pole_merge": (stereo.pole_merge_angle_from, stereo.pole_merge_angle_to) if merges else (0.0, 0.0),
    }


def _focus_location(data):
    """Where the focus object (or its bone) is, None without one. `data` is evaluated."""
    target = data.dof.focus_object
    if target is None:
        return None
    matrix = target.matrix_world
    bone = target.pose.bones.get(data.dof.focus_subtarget) if target.pose and data.dof.focus_subtarget else None
    if bone is not None:
        matrix = matrix @ bone.matrix
    return np.array(matrix.translation)


def _read_panorama(data, width: float, height: float, warnings) -> dict:
    """Fields of `Camera` that say how a panorama shows its surroundings; width, height: of the frame, equal units."""
    # Up to 4.5 these stand in Cycles' own property group, from 5.0 on in the camera.
    source = data if hasattr(data, "panorama_type") else getattr(data, "cycles", None)
    if source is None:
        return {}
    if source.panorama_type not in PROJECTIONS:
        kind = source.panorama_type.replace("_", " ").lower()
        warnings.add("Camera", data.name, f"a {kind} panorama is rendered as an equirectangular one")
        return {}
    longitude = _limits(source.longitude_min, source.longitude_max, math.pi)
    latitude = _limits(source.latitude_min, source.latitude_max, math.pi / 2)
    if source.panorama_type == "CENTRAL_CYLINDRICAL":
        radius = source.central_cylindrical_radius
        longitude = source.central_cylindrical_range_u_min, source.central_cylindrical_range_u_max
        latitude = source.central_cylindrical_range_v_min / radius, source.central_cylindrical_range_v_max / radius
    return {
        "projection": source.panorama_type,
        "longitude": longitude,
        "latitude": latitude,
        "fisheye": (source.fisheye_fov, source.fisheye_lens, *_sensor(data, width, height)),
        "polynomial": tuple(getattr(source, f"fisheye_polynomial_k{i}") for i in range(5)),
    }


def _sensor(data, width: float, height: float) -> tuple[float, float]:
    """Width and height of the sensor that a fisheye lens fills; width, height: of the frame in units of equal size."""
    if data.sensor_fit == "VERTICAL":
        return data.sensor_height * width / height, data.sensor_height
    if data.sensor_fit == "HORIZONTAL" or width > height:
        return data.sensor_width, data.sensor_width * height / width
    return data.sensor_width * width / height, data.sensor_width


def _limits(low: float, high: float, most: float) -> tuple[float, float]:
    return max(low, -most), min(high, most)
