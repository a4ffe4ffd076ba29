"""What a rendered 3D view can show, and what happens to it, step by step, with a screenshot of each.

blender --python-exit-code 1 --python tests/desktop/views.py -- FOLDER
"""

import math
import runpy
import sys
import threading
import time
from pathlib import Path

import addon_utils
import bpy
import numpy as np
from mathutils import Quaternion

scripted = runpy.run_path(str(Path(__file__).resolve().parents[2] / "testing" / "blender" / "scripted.py"))
Log, areas, live_sessions, run, until, window_region = map(
    scripted.get, ("Log", "areas", "live_sessions", "run", "until", "window_region")
)

note = Log(Path(sys.argv[-1]).resolve() / "views.txt")


def stage() -> bpy.types.Scene:
    """Blender's first scene with a coloured floor and a second object."""
    scene = bpy.context.window_manager.windows[0].scene
    scene.render.engine = "RESTIR"
    scene.restir.is_initialized, scene.restir.preview_samples, scene.restir.integrator = True, 8, "PATH"
    bpy.ops.mesh.primitive_plane_add(size=14.0, location=(0.0, 0.0, -1.0))
    bpy.ops.mesh.primitive_monkey_add(location=(2.4, 0.6, 0.0))
    for index, name in enumerate(("Plane", "Suzanne")):
        material = bpy.data.materials.new(name)
        node = next(node for node in material.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
        node.inputs["Base Color"].default_value = ((0.2, 0.5, 0.3, 1.0), (0.8, 0.3, 0.1, 1.0))[index]
        bpy.data.objects[name].data.materials.append(material)
    return scene


def at_rest(seconds: float = 120.0):
    """Wait until all views have all that they will show."""
    yield 0.3
    yield from until(lambda: live_sessions() and not any(live.busy for live in live_sessions()), seconds)
    for live in live_sessions():
        assert live.error is None, live.error
    yield 0.2


def look_through_camera(view: bpy.types.Area) -> None:
    view.spaces[0].region_3d.view_perspective = "CAMERA"


def module(name: str):
    """A module of the extension's package restir_engine."""
    return next(module for key, module in sys.modules.items() if key.endswith(f"restir_engine.{name}"))


def unrest(live) -> float:
    """How much neighbouring pixels of what is shown differ, in the mean."""
    return float(abs(np.diff(live.shown.pixels[..., :3], axis=1)).mean())


def what_views_show(scene: bpy.types.Scene):
    """One picture of each kind of view."""
    view = areas("VIEW_3D")[0]
    space, region = view.spaces[0], window_region(view)
    space.shading.type = "RENDERED"
    yield from until(lambda: live_sessions() and live_sessions()[0].shown is not None, 60.0, 0.02)
    yield 0.2
    note.screenshot("plain")
    yield from at_rest(900.0)
    note.screenshot("region")
    live = live_sessions()[0]

    def expect(size: tuple[int, int] | None = None) -> None:
        found = live.shown.pixels.shape[1::-1]
        expected = size or (region.width, region.height)
        assert all(abs(a - b) <= 1 for a, b in zip(found, expected, strict=True)), (found, expected)

    expect()
    space.use_render_border = True
    space.render_border_min_x, space.render_border_max_x = 0.25, 0.75
    space.render_border_min_y, space.render_border_max_y = 0.5, 0.9
    view.tag_redraw()
    yield from at_rest()
    expect((round(0.5 * region.width), round(0.4 * region.height)))
    note.screenshot("border")
    space.use_render_border = False
    look_through_camera(view)
    yield from at_rest()
    expect()
    note.screenshot("camera")
    render = scene.render
    render.use_border, render.border_min_x, render.border_max_x = True, 0.2, 0.6
    yield from at_rest()
    assert live.shown.pixels.shape[1] < region.width
    note.screenshot("camera_border")
    render.use_border = False
    camera = scene.camera.data
    space.region_3d.view_camera_zoom, camera.passepartout_alpha = 20.0, 0.9
    yield from at_rest()
    note.screenshot("camera_zoomed")
    camera.shift_x, camera.sensor_fit = 0.2, "VERTICAL"
    camera.dof.use_dof, camera.dof.focus_distance, camera.dof.aperture_fstop = True, 8.0, 0.1
    yield from at_rest()
    note.screenshot("camera_lens")
    camera.dof.use_dof, camera.type = False, "PANO"
    camera.panorama_type = "EQUIRECTANGULAR"
    yield from at_rest()
    assert live.shown.frame != (0.0, 0.0, 1.0, 1.0)
    note.screenshot("camera_panorama")
    camera.type, camera.shift_x, camera.sensor_fit = "ORTHO", 0.0, "AUTO"
    yield from at_rest()
    note.screenshot("camera_orthographic")
    camera.type = "PERSP"
    render.film_transparent = True
    yield from at_rest()
    assert live.shown.pixels[..., 3].min() == 0.0
    note.screenshot("transparent")
    render.film_transparent = False
    render.preview_pixel_size = "4"
    yield from at_rest()
    expect((math.ceil(region.width / 4), math.ceil(region.height / 4)))
    note.screenshot("pixel_size")
    render.preview_pixel_size = "AUTO"
    scene.view_settings.exposure = 2.0
    yield from at_rest()
    note.screenshot("exposure")
    scene.view_settings.exposure = 0.0
    noisy = unrest(live)
    scene.restir.use_preview_denoising = True
    yield from at_rest()
    note.screenshot("denoised")
    denoises = module("denoise").find_library() is not None
    assert not denoises or unrest(live) < 0.7 * noisy, (unrest(live), noisy)
    note("denoised" if denoises else "not denoised: this Blender has no Open Image Denoise")
    scene.restir.use_preview_denoising = False
    plane = bpy.data.objects["Plane"]
    plane.is_shadow_catcher = render.film_transparent = True
    yield from at_rest()
    note.screenshot("shadow_catcher")
    alpha = live.shown.pixels[..., 3]
    assert ((alpha > 0.1) & (alpha < 0.9)).mean() > 0.01, "no shadow is caught"
    assert (alpha < 0.05).mean() > 0.1, "what is in no shadow is not transparent"
    plane.is_shadow_catcher = render.film_transparent = False
    space.region_3d.view_perspective = "PERSP"


def local_view(scene: bpy.types.Scene):
    """Only what is selected, and the end of it."""
    view = areas("VIEW_3D")[0]
    yield from at_rest()
    live = live_sessions()[0]
    before = live.picture
    for item in scene.objects:
        item.select_set(item.name == "Suzanne")
    override = {"window": bpy.context.window_manager.windows[0], "area": view, "region": window_region(view)}
    with bpy.context.temp_override(**override):
        bpy.ops.view3d.localview(frame_selected=False)
    yield from at_rest()
    note.screenshot("local_view")
    assert abs(live.picture - before).mean() > 0.01, "local view shows all"
    with bpy.context.temp_override(**override):
        bpy.ops.view3d.localview(frame_selected=False)
    yield from at_rest()
    assert abs(live.picture - before).mean() < 0.01, "local view has not ended"
    view.spaces[0].show_object_viewport_mesh = False
    view.tag_redraw()
    yield from at_rest()
    note.screenshot("no_meshes")
    assert abs(live.picture - before).mean() > 0.01, "kinds of objects are not filtered"
    view.spaces[0].show_object_viewport_mesh = True


def while_it_renders(scene: bpy.types.Scene):
    """Playback, edits, undo, deletion, other shading, two views, a final render: all while the view renders."""
    window, view = bpy.context.window_manager.windows[0], areas("VIEW_3D")[0]
    override = {"window": window, "area": view, "region": window_region(view)}
    cube = bpy.data.objects["Cube"]
    cube.keyframe_insert("location", frame=1)
    cube.location.z = 2.0
    cube.keyframe_insert("location", frame=20)
    with bpy.context.temp_override(**override):
        bpy.ops.screen.animation_play()
    yield 3.0
    note.screenshot("playing")
    with bpy.context.temp_override(**override):
        bpy.ops.screen.animation_cancel()
        bpy.ops.ed.undo_push(message="Before")
    bpy.data.objects["Suzanne"].location.z = 3.0
    with bpy.context.temp_override(**override):
        bpy.ops.ed.undo_push(message="Moved")
    yield 0.5
    with bpy.context.temp_override(**override):
        bpy.ops.ed.undo()
    yield from at_rest()
    scene = window.scene  # the one before is not the one after an undo
    assert abs(bpy.data.objects["Suzanne"].location.z) < 1e-6
    note.screenshot("undone")
    with bpy.context.temp_override(**override):
        bpy.ops.screen.area_split(direction="VERTICAL", factor=0.5)
    yield 0.5
    second = areas("VIEW_3D")[-1]
    second.spaces[0].shading.type = "RENDERED"
    yield from until(lambda: len(live_sessions()) == 2, 20.0)
    second.spaces[0].region_3d.view_rotation.rotate(Quaternion((0.0, 0.0, 1.0), 1.0))
    yield from at_rest()
    note.screenshot("two_views")
    finished = []
    bpy.app.handlers.render_complete.append(lambda *_: finished.append(True))
    scene.render.resolution_x, scene.render.resolution_y, scene.restir.samples = 320, 200, 16
    with bpy.context.temp_override(window=window):
        bpy.ops.render.render("INVOKE_DEFAULT")
    for step in range(20):
        bpy.data.objects["Suzanne"].location.x += 0.02
        view.spaces[0].region_3d.view_rotation.rotate(Quaternion((0.0, 0.0, 1.0), 0.02 * (step % 3)))
        yield 0.1
    yield from until(lambda: finished, 120.0)
    bpy.data.objects.remove(bpy.data.objects["Suzanne"])
    yield from at_rest()
    note.screenshot("deleted")
    for area in areas("VIEW_3D"):
        area.spaces[0].shading.type = "SOLID"
    yield from until(lambda: not live_sessions(), 30.0)
    yield 1.0
    left = [thread.name for thread in threading.enumerate() if thread.name.startswith("restir-live")]
    assert not left, f"threads are left: {left}"


def redraws(scene: bpy.types.Scene):
    """How long the main thread takes to read and to draw while the view is turned and an object moves."""
    viewport = module("viewport").Viewport
    took: dict[str, list[float]] = {"update": [], "draw": []}
    originals = {name: getattr(viewport, name) for name in took}

    def timed(name: str):
        def call(*args) -> None:
            began = time.thread_time()
            originals[name](*args)
            took[name].append(time.thread_time() - began)

        return call

    for name in took:
        setattr(viewport, name, timed(name))
    view = areas("VIEW_3D")[0]
    for _ in range(40):
        view.spaces[0].region_3d.view_rotation.rotate(Quaternion((0.0, 0.0, 1.0), 0.03))
        bpy.data.objects["Cube"].location.x += 0.01
        yield 0.05
    for name, times in took.items():
        setattr(viewport, name, originals[name])
        times.sort()
        note(f"{name}: {len(times)} times, median {1e3 * times[len(times) // 2]:.1f} ms, most {1e3 * times[-1]:.1f} ms")


def steps():
    """The script."""
    addon_utils.enable("bl_ext.user_default.restir_engine", default_set=True)
    yield 1.0
    scene = stage()
    yield from what_views_show(scene)
    note("shown: border, camera, its border, zoom, lens, panorama, orthographic, transparent, pixel size, exposure")
    yield from local_view(scene)
    note("local view and filters")
    yield from redraws(scene)
    yield from while_it_renders(scene)
    note("played, undone, two views, final render meanwhile, deleted, closed")


bpy.context.preferences.view.show_splash = False
run(steps(), note)
