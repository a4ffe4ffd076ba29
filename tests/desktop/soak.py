"""Random edits, undo, orbit, playback, file reloads in a rendered 3D view, from a fixed seed.

    blender --python-exit-code 1 --python tests/desktop/soak.py -- FOLDER [--seconds 600] [--seed 1] [--views 2]
                                                                          [--integrator RESTIR] [--render]

Needs a window. Writes what was done to FOLDER/soak.txt, with the memory of the process every half a minute; ends with
an assertion where a view tells of an error, where threads or views are left over, or where memory has grown by more
than 50 MB since the first two minutes. For this it is read twice while all views show solid shapes: Blender's own
material preview comes and goes in between, with up to a gigabyte where OpenGL is software. --render: half way through
a final render begins, while which the views turn.
"""

import argparse
import random
import runpy
import sys
import threading
import time
from pathlib import Path

import addon_utils
import bpy
from mathutils import Quaternion

scripted = runpy.run_path(str(Path(__file__).resolve().parents[2] / "testing" / "blender" / "scripted.py"))
Log, areas, live_sessions, run, until, window_region = map(
    scripted.get, ("Log", "areas", "live_sessions", "run", "until", "window_region")
)

SETTLED, MOST_GROWTH = 120.0, 50.0  # seconds, MB


def memory() -> float:
    """Resident memory of this process, MB."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * 4096 / 2**20


def override() -> dict:
    """A context of the first 3D view."""
    area = areas("VIEW_3D")[0]
    return {"window": bpy.context.window_manager.windows[0], "area": area, "region": window_region(area)}


def scene() -> bpy.types.Scene:
    return bpy.context.window_manager.windows[0].scene


def meshes() -> list[bpy.types.Object]:
    return [item for item in scene().objects if item.type == "MESH"]


def principled(material: bpy.types.Material):
    return next((node for node in material.node_tree.nodes if node.type == "BSDF_PRINCIPLED"), None)


# What is done: functions of a random number generator -----------------------------------------------------------------


def turn(r) -> None:
    view = r.choice(areas("VIEW_3D")).spaces[0].region_3d
    view.view_rotation.rotate(Quaternion((0.0, 0.0, 1.0), r.uniform(-0.3, 0.3)))


def move(r) -> None:
    r.choice(meshes()).location.z += r.uniform(-0.3, 0.3)


def add(r) -> None:
    if len(meshes()) < 12:
        with bpy.context.temp_override(**override()):
            bpy.ops.mesh.primitive_monkey_add(location=(r.uniform(-3, 3), r.uniform(-3, 3), 0.5))


def remove(r) -> None:
    if len(meshes()) > 3:
        bpy.data.objects.remove(r.choice(meshes()))


def paint(r) -> None:
    materials = [item for item in bpy.data.materials if item.node_tree and principled(item)]
    if materials:
        node = principled(r.choice(materials))
        node.inputs["Base Color"].default_value = (r.random(), r.random(), r.random(), 1.0)
        node.inputs["Subsurface Weight"].default_value = r.choice([0.0, 1.0])


def material(r) -> None:
    item = r.choice(meshes())
    if not item.data.materials:
        item.data.materials.append(bpy.data.materials.new("New"))


def light(r) -> None:
    for item in bpy.data.lights:
        item.energy = r.uniform(100.0, 1500.0)


def world(r) -> None:
    nodes = scene().world.node_tree.nodes
    nodes["Background"].inputs["Strength"].default_value = r.uniform(0.2, 1.5)


def vertex(r) -> None:
    data = r.choice(meshes()).data
    data.vertices[r.randrange(len(data.vertices))].co.z += r.uniform(-0.2, 0.2)
    data.update()


def hide(r) -> None:
    item = r.choice(meshes())
    item.hide_viewport = not item.hide_viewport


def frame(r) -> None:
    scene().frame_set(r.randrange(1, 30))


def play(r) -> None:
    with bpy.context.temp_override(**override()):
        bpy.ops.screen.animation_play()


def edit_mode(r) -> None:
    with bpy.context.temp_override(**override()):
        item = r.choice(meshes())
        item.hide_viewport = False
        bpy.context.view_layer.objects.active = item
        bpy.ops.object.mode_set(mode="EDIT" if item.mode == "OBJECT" else "OBJECT")
        if r.random() < 0.7:
            bpy.ops.object.mode_set(mode="OBJECT")


def push(r) -> None:
    with bpy.context.temp_override(**override()):
        bpy.ops.ed.undo_push(message="Soak")


def undo(r) -> None:
    with bpy.context.temp_override(**override()):
        if bpy.ops.ed.undo.poll():
            bpy.ops.ed.undo()


def redo(r) -> None:
    with bpy.context.temp_override(**override()):
        if bpy.ops.ed.redo.poll():
            bpy.ops.ed.redo()


def shading(r) -> None:
    space = r.choice(areas("VIEW_3D")).spaces[0]
    space.shading.type = r.choice(["SOLID", "MATERIAL", "RENDERED", "RENDERED"])


def border(r) -> None:
    space = r.choice(areas("VIEW_3D")).spaces[0]
    space.use_render_border = not space.use_render_border
    space.render_border_min_x, space.render_border_max_x = 0.2, r.uniform(0.4, 0.9)


def camera(r) -> None:
    view = r.choice(areas("VIEW_3D")).spaces[0].region_3d
    view.view_perspective = r.choice(["CAMERA", "PERSP", "ORTHO"])


OFTEN = [turn, move, paint, light, world, vertex, frame]
SELDOM = [add, remove, material, hide, play, edit_mode, push, undo, redo, shading, border, camera]


def stage(options: argparse.Namespace) -> None:
    """Blender's first scene in as many rendered views as are asked for, with an animated cube."""
    current = scene()
    current.render.engine = "RESTIR"
    current.restir.is_initialized, current.restir.preview_samples = True, 16
    current.restir.integrator = options.integrator
    bpy.ops.mesh.primitive_plane_add(size=14.0, location=(0.0, 0.0, -1.0))
    bpy.ops.mesh.primitive_monkey_add(location=(2.4, 0.6, 0.0))
    cube = bpy.data.objects["Cube"]
    cube.keyframe_insert("location", frame=1)
    cube.location.z = 2.0
    cube.keyframe_insert("location", frame=20)
    bpy.ops.wm.save_as_mainfile(filepath=str(options.folder / "soak.blend"))


def show(kind: str) -> None:
    """Let all 3D views show the scene in a kind of shading."""
    for area in areas("VIEW_3D"):
        area.spaces[0].shading.type = kind


def memory_without_views(found: list[float]):
    """Append the memory of this process while nothing is rendered in views, which are as before afterwards."""
    kinds = [area.spaces[0].shading.type for area in areas("VIEW_3D")]
    show("SOLID")
    yield from until(lambda: not live_sessions(), 60.0)
    yield from until(lambda: not [t for t in threading.enumerate() if t.name.startswith("restir-live")], 60.0)
    yield 2.0
    found.append(memory())
    for area, kind in zip(areas("VIEW_3D"), kinds, strict=True):
        area.spaces[0].shading.type = kind


def final_render(r):
    """A final render beside the views, which turn meanwhile."""
    bpy.context.preferences.view.render_display_type = "NONE"
    render, restir = scene().render, scene().restir
    render.resolution_percentage, restir.samples = 25, 32
    with bpy.context.temp_override(**override()):
        bpy.ops.render.render("INVOKE_DEFAULT")
    yield from until(lambda: bpy.app.is_job_running("RENDER"), 60.0, 0.01)
    while bpy.app.is_job_running("RENDER"):
        turn(r)
        yield 0.1


def split(views: int) -> None:
    """So many rendered 3D views."""
    while len(areas("VIEW_3D")) < views:
        with bpy.context.temp_override(**override()):
            bpy.ops.screen.area_split(direction="VERTICAL", factor=0.5)
    show("RENDERED")


def steps(options: argparse.Namespace, log: Log):
    """The script."""
    addon_utils.enable("bl_ext.user_default.restir_engine", default_set=True)
    yield 1.0
    stage(options)
    split(options.views)
    show("MATERIAL")
    yield 5.0
    show("RENDERED")
    yield from until(lambda: live_sessions() and not any(live.busy for live in live_sessions()), 900.0)
    r, began, told, done = random.Random(options.seed), time.monotonic(), 0.0, 0
    found: list[float] = []
    reload, last_reload = options.seconds / 6.0, time.monotonic()
    while time.monotonic() - began < options.seconds:
        edit = r.choice(OFTEN if r.random() < 0.7 else SELDOM)
        edit(r)
        done += 1
        yield r.choice([0.02, 0.1, 0.3])
        for live in live_sessions():
            assert live.error is None, f"after {done} edits, the last {edit.__name__}: {live.error}"
        passed = time.monotonic() - began
        if time.monotonic() - last_reload > reload:
            bpy.ops.wm.open_mainfile(filepath=str(options.folder / "soak.blend"))
            yield 1.0
            split(options.views)
            last_reload = time.monotonic()
        if not found and passed > SETTLED:
            yield from memory_without_views(found)
        if options.render and passed > 0.5 * options.seconds:
            options.render = False
            yield from final_render(r)
            log(f"{time.monotonic() - began:.0f} s: a final render has ended")
        if passed - told > 30.0:
            told = passed
            log(f"{passed:.0f} s: {done} edits, {memory():.0f} MB, {len(live_sessions())} sessions")
    log.screenshot("soak")
    with bpy.context.temp_override(**override()):
        bpy.ops.screen.animation_cancel()
    yield from memory_without_views(found)
    both = ", ".join(f"{each:.0f} MB" for each in found)
    log(f"{done} edits in {options.seconds:g} s; without views after {SETTLED:g} s and at the end: {both}")
    assert found[-1] - found[0] < MOST_GROWTH, "memory has grown"


def main() -> None:
    """Read the arguments behind `--`, and begin."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--seconds", type=float, default=600.0)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--views", type=int, default=1)
    parser.add_argument("--integrator", default="RESTIR", choices=("PATH", "RESTIR"))
    parser.add_argument("--render", action="store_true")
    options = parser.parse_args(sys.argv[sys.argv.index("--") + 1 :])
    options.folder = options.folder.resolve()
    bpy.context.preferences.view.show_splash = False
    options.folder.mkdir(parents=True, exist_ok=True)
    log = Log(options.folder / "soak.txt")
    run(steps(options, log), log)


main()
