"""What an artist does in the window, step by step on a timer, with a screenshot of each."""

import gc
import shutil
import subprocess
import sys
import time
import traceback
from pathlib import Path

import addon_utils
import bpy
from mathutils import Quaternion

OUT = Path(sys.argv[-1]).resolve()
NAME = "bl_ext.user_default.restir_engine"
LOG = (OUT / "window.txt").open("w")


def note(text: str) -> None:
    """A line of the log."""
    print(text, file=LOG, flush=True)


def screenshot(name: str) -> None:
    """Save what is on the screen."""
    path = str(OUT / f"{name}.png")
    if shutil.which("import"):
        subprocess.run(["import", "-window", "root", path], check=True)
    else:
        bpy.ops.screen.screenshot(filepath=path)


def live_session():
    """The live session of the 3D view; None where there is none."""
    sessions = (item for item in gc.get_objects() if type(item).__name__ == "LiveSession")
    return next((item for item in sessions if not item._closed), None)


def live_picture():
    """What the live session of the 3D view has rendered so far; None where there is no such session."""
    return getattr(live_session(), "picture", None)


def move(item: bpy.types.Object) -> None:
    """Lift an object."""
    item.location.z += 0.5


def areas(kind: str) -> list[bpy.types.Area]:
    """The areas of one kind on the screen."""
    return [area for area in bpy.context.window_manager.windows[0].screen.areas if area.type == kind]


def steps():
    """A generator: yields the seconds to wait before the next step."""
    window = bpy.context.window_manager.windows[0]
    bpy.ops.wm.open_mainfile(filepath=str(OUT / "scene.blend"))
    yield 1.0
    window = bpy.context.window_manager.windows[0]
    scene = window.scene
    scene.render.engine = "RESTIR"
    yield 0.5
    note(f"settings from Cycles: {scene.restir.samples} samples, {scene.restir.diffuse_bounces} diffuse bounces")
    assert (scene.restir.samples, scene.restir.diffuse_bounces) == (16, 3)
    with bpy.context.temp_override(window=window, area=areas("PROPERTIES")[0]):
        areas("PROPERTIES")[0].spaces[0].context = "RENDER"
        bpy.ops.wm.context_menu_enum("INVOKE_DEFAULT", data_path="scene.render.engine")
    yield 1.0
    screenshot("engines")
    subprocess.run(["xdotool", "key", "Escape"], check=True)  # closes the menu
    yield 0.5
    scene.render.resolution_x, scene.render.resolution_y, scene.restir.samples = 480, 320, 32
    started, finished = time.monotonic(), []
    bpy.app.handlers.render_complete.append(lambda *_: finished.append("complete"))
    bpy.app.handlers.render_cancel.append(lambda *_: finished.append("cancelled"))
    with bpy.context.temp_override(window=window):
        bpy.ops.render.render("INVOKE_DEFAULT")
    while not finished and time.monotonic() - started < 240.0:
        yield 3.0
        screenshot("rendering")
    note(f"F12: {finished or 'no end'} after {time.monotonic() - started:.1f} s")
    assert finished == ["complete"]
    yield 3.0
    screenshot("rendered")

    finished.clear()
    scene.restir.samples = 100000
    with bpy.context.temp_override(window=window):
        bpy.ops.render.render("INVOKE_DEFAULT")
    yield 4.0
    note("Esc")
    subprocess.run(["xdotool", "key", "Escape"], check=True)
    escaped = time.monotonic()
    while not finished and time.monotonic() - escaped < 20.0:
        yield 0.02
    note(f"{finished} {time.monotonic() - escaped:.2f} s after Esc")
    yield 0.5
    screenshot("escaped")

    window = bpy.context.window_manager.windows[0]
    properties = areas("PROPERTIES")[0].spaces[0]
    for tab in ("VIEW_LAYER", "WORLD", "OBJECT", "MATERIAL"):
        properties.context = tab
        yield 1.0
        screenshot(f"tab_{tab.lower()}")
    viewport = areas("VIEW_3D")[0]
    viewport.ui_type = "ShaderNodeTree"
    yield 1.0
    region = next(region for region in viewport.regions if region.type == "WINDOW")
    with bpy.context.temp_override(window=window, area=viewport, region=region):
        bpy.ops.wm.call_menu("INVOKE_DEFAULT", name="NODE_MT_category_shader_shader")
    yield 1.0
    screenshot("shader_editor")
    subprocess.run(["xdotool", "mousemove", "640", "20", "key", "Escape"], check=True)
    yield 0.5
    viewport.ui_type = "VIEW_3D"
    yield 0.5

    for integrator in ("PATH", "RESTIR"):
        scene.restir.integrator = integrator
        view = areas("VIEW_3D")[0]
        view.spaces[0].shading.type = "RENDERED"
        yield 3.0
        started = time.monotonic()
        while live_picture() is None and time.monotonic() - started < 900.0:  # kernels may have to be compiled
            yield 0.5
        note(f"{integrator} in the 3D view: first picture {time.monotonic() - started:.1f} s after it was asked for")
        assert live_picture() is not None
        yield 4.0
        screenshot(f"viewport_{integrator.lower()}")
        before = live_picture()
        for _ in range(12):
            view.spaces[0].region_3d.view_rotation.rotate(Quaternion((0.0, 0.0, 1.0), 0.05))
            yield 0.1
        moved = live_picture()
        note(f"turned: {before.shape} -> {moved.shape}")
        assert moved is not before
        yield 4.0
        assert live_picture().shape == before.shape
        screenshot(f"viewport_{integrator.lower()}_turned")
        live = live_session()
        asked = live._current
        for item in scene.objects:
            item.select_set(not item.select_get())
        yield 1.0
        assert live._request is None and live._current in (asked, None), "a selection starts the view anew"
        for change in (lambda: move(bpy.data.objects["Suzanne"]), lambda: bpy.data.objects["Cube"].hide_set(True)):
            before = live.picture
            change()
            yield 4.0
            assert live._current is not asked, "a change is not rendered"
            assert live.picture is not before
            asked = live._current
        screenshot(f"viewport_{integrator.lower()}_edited")
        bpy.data.objects["Cube"].hide_set(False)
        live = None
        view.spaces[0].shading.type = "SOLID"
        yield 3.0
        assert live_picture() is None, "the worker goes on when nobody looks"
    for area in areas("VIEW_3D"):
        area.spaces[0].shading.type = "SOLID"
    addon_utils.disable(NAME, default_set=True)
    yield 1.0
    screenshot("disabled")
    addon_utils.enable(NAME, default_set=True)
    bpy.ops.wm.read_homefile()
    yield 1.0
    note("finished")


def run(generator) -> float | None:
    """One step of the script; quits at its end."""
    try:
        return next(generator)
    except StopIteration:
        pass
    except BaseException:
        note(traceback.format_exc())
    bpy.ops.wm.quit_blender()
    return None


script = steps()
bpy.app.timers.register(lambda: run(script), first_interval=2.0, persistent=True)
