"""What an artist does in the window, step by step on a timer, with a screenshot of each."""

import runpy
import subprocess
import sys
import time
from pathlib import Path

import addon_utils
import bpy
from mathutils import Quaternion

scripted = runpy.run_path(str(Path(__file__).resolve().parents[2] / "testing" / "blender" / "scripted.py"))
Log, areas, live_sessions, run, until, window_region = map(
    scripted.get, ("Log", "areas", "live_sessions", "run", "until", "window_region")
)

OUT = Path(sys.argv[-1]).resolve()
NAME = "bl_ext.user_default.restir_engine"
note = Log(OUT / "window.txt")
screenshot = note.screenshot


def live_session():
    """The live session of the 3D view; None where there is none."""
    return next(iter(live_sessions()), None)


def move(item: bpy.types.Object) -> None:
    """Lift an object."""
    item.location.z += 0.5


def rendered_view(scene: bpy.types.Scene, integrator: str):
    """Rendered shading: the first picture, a turned view, a selection, and what is moved and hidden."""
    scene.restir.integrator = integrator
    view, name = areas("VIEW_3D")[0], f"viewport_{integrator.lower()}"
    view.spaces[0].shading.type = "RENDERED"
    started = time.monotonic()
    yield from until(lambda: live_session() and live_session().picture is not None, 900.0)  # kernels may compile
    note(f"{integrator} in the 3D view: first picture after {time.monotonic() - started:.1f} s")
    live = live_session()
    region = window_region(view)

    def is_full() -> bool:
        return live.line.endswith(f"{region.width} × {region.height}")

    yield from until(is_full, 120.0)
    screenshot(name)
    for _ in range(12):
        view.spaces[0].region_3d.view_rotation.rotate(Quaternion((0.0, 0.0, 1.0), 0.05))
        yield 0.1
    yield from until(lambda: not is_full(), 60.0)
    screenshot(f"{name}_turning")
    yield from until(is_full, 120.0)
    screenshot(f"{name}_turned")
    asked = live._current
    for item in scene.objects:
        item.select_set(not item.select_get())
    yield 1.0
    assert live._request is None and live._current in (asked, None), "a selection starts the view anew"
    yield from changed_view(live, lambda: move(bpy.data.objects["Suzanne"]))
    yield from changed_view(live, lambda: bpy.data.objects["Cube"].hide_set(True))
    yield from until(is_full, 120.0)
    screenshot(f"{name}_edited")
    bpy.data.objects["Cube"].hide_set(False)
    live = None
    view.spaces[0].shading.type = "SOLID"
    yield from until(lambda: live_session() is None, 30.0)
    note(f"{integrator} in the 3D view: turned, selected, moved, hidden, closed")


def changed_view(live, change):
    """Do something that can be seen, and wait until it is."""
    asked, before = live._current, live.picture
    change()
    yield from until(lambda: live._current is not asked and live.picture is not before, 60.0)


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
    region = window_region(viewport)
    with bpy.context.temp_override(window=window, area=viewport, region=region):
        bpy.ops.wm.call_menu("INVOKE_DEFAULT", name="NODE_MT_category_shader_shader")
    yield 1.0
    screenshot("shader_editor")
    subprocess.run(["xdotool", "mousemove", "640", "20", "key", "Escape"], check=True)
    yield 0.5
    viewport.ui_type = "VIEW_3D"
    yield 0.5

    yield from rendered_view(scene, "PATH")
    yield from rendered_view(scene, "RESTIR")
    for area in areas("VIEW_3D"):
        area.spaces[0].shading.type = "SOLID"
    addon_utils.disable(NAME, default_set=True)
    yield 1.0
    screenshot("disabled")
    addon_utils.enable(NAME, default_set=True)
    bpy.ops.wm.read_homefile()
    yield 1.0


run(steps(), note)
