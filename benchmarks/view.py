"""The 3D view beside Cycles', in Blender's window: time to the first new picture after a change, and error after it.

    blender --python-exit-code 1 --python benchmarks/view.py -- FOLDER [--engines PATH RESTIR CYCLES] [--reference 15]
                                                                       [--triangles 1000000 --instances 5000]

Needs an X screen (Xvfb will do) and the extension installed. The scene is Suzanne with skin under an HDRI and an area
light, on a floor, and a ball of 100,000 triangles (or --triangles), with --instances cubes around them. After each
change pictures are read off the screen, with overlays off, in the colours that are displayed. *first*: seconds from the
change to the first picture in which more than 0.3 % of the blocks of 16 × 16 pixels have changed by more than 0.02.
Errors are relative mean squares, mean of (x - r)² / (r² + 0.01) without the worst 0.1 % of the pixels, so many seconds
after the change, against what the same engine shows --reference seconds after it. *orbit*: pictures a second while the
view turns by 16 steps of 0.05 s, and the error right after the last one. Each change ends where it began, so that all
engines see the same scenes.
"""

import argparse
import ctypes
import runpy
import sys
import threading
import time
from pathlib import Path

import bpy
import numpy as np
from mathutils import Quaternion

scripted = runpy.run_path(str(Path(__file__).resolve().parents[1] / "testing" / "blender" / "scripted.py"))
Log, areas, run, window_region = map(scripted.get, ("Log", "areas", "run", "window_region"))

NAME = "bl_ext.user_default.restir_engine"
MOMENTS = (0.3, 1.0, 4.0)
MARGIN, INTERVAL = 90, 0.03  # pixels, seconds
BLOCK, CHANGED, SHARE = 16, 0.02, 0.003
STEPS, STEP = 16, 0.05


class XImage(ctypes.Structure):
    """The beginning of Xlib's structure of this name."""

    _fields_ = (
        *((name, ctypes.c_int) for name in ("width", "height", "xoffset", "format")),
        ("data", ctypes.c_void_p),
        *((name, ctypes.c_int) for name in ("byte_order", "bitmap_unit", "bitmap_bit_order", "bitmap_pad", "depth")),
        ("bytes_per_line", ctypes.c_int),
    )


class Screen:
    """Reads a 3D view off an X screen, every INTERVAL seconds on a thread of its own.

    The window stands in the upper left corner of the screen. What lies in the MARGIN of the view may be covered by
    headers and tools. pictures: (time, float32 (height, width, 3)), each unlike the one before.
    """

    def __init__(self) -> None:
        self.pictures: list[tuple[float, np.ndarray]] = []
        region, window = window_region(areas("VIEW_3D")[0]), bpy.context.window_manager.windows[0]
        top = window.height - region.y - region.height
        self._box = region.x + MARGIN, top + MARGIN, region.width - 2 * MARGIN, region.height - 2 * MARGIN
        self._xlib = ctypes.CDLL("libX11.so.6")
        for name in ("XOpenDisplay", "XDefaultRootWindow", "XGetImage"):
            getattr(self._xlib, name).restype = ctypes.c_void_p
        self._xlib.XOpenDisplay.argtypes = [ctypes.c_char_p]
        self._xlib.XDefaultRootWindow.argtypes = [ctypes.c_void_p]
        self._xlib.XGetImage.argtypes = [
            *[ctypes.c_void_p] * 2, *[ctypes.c_int] * 2, *[ctypes.c_uint] * 2, ctypes.c_ulong, ctypes.c_int,
        ]  # fmt: skip
        self._xlib.XDestroyImage.argtypes = [ctypes.c_void_p]
        self._display = self._xlib.XOpenDisplay(None)
        self._root = self._xlib.XDefaultRootWindow(self._display)
        self._ends = threading.Event()
        self._thread = threading.Thread(target=self._watch, daemon=True)
        self._thread.start()

    def _watch(self) -> None:
        last = b""
        while not self._ends.wait(INTERVAL):
            now, data = time.perf_counter(), self._read()
            if data.tobytes() != last:
                last = data.tobytes()
                self.pictures.append((now, data[..., 2::-1].astype(np.float32) / 255.0))

    def _read(self) -> np.ndarray:
        """What is on the screen, uint8 (height, width, 4), blue first."""
        handle = self._xlib.XGetImage(self._display, self._root, *self._box, 0xFFFFFFFF, 2)
        image = XImage.from_address(handle)
        size = image.height * image.bytes_per_line
        data = np.frombuffer(ctypes.string_at(image.data, size), np.uint8)
        self._xlib.XDestroyImage(handle)
        return data.reshape(image.height, image.bytes_per_line // 4, 4)[:, : image.width]

    def close(self) -> None:
        """Read no more."""
        self._ends.set()
        self._thread.join()


def blocks(picture: np.ndarray) -> np.ndarray:
    """Means of blocks."""
    height, width = (size // BLOCK * BLOCK for size in picture.shape[:2])
    return picture[:height, :width].reshape(height // BLOCK, BLOCK, width // BLOCK, BLOCK, 3).mean((1, 3))


def has_changed(picture: np.ndarray, before: np.ndarray) -> bool:
    """Whether two pictures differ by more than noise."""
    return (np.abs(blocks(picture) - blocks(before)).max(2) > CHANGED).mean() > SHARE


def error(picture: np.ndarray, reference: np.ndarray) -> float:
    """Relative mean square error, without the worst 0.1 % of the pixels."""
    each = np.sort((((picture - reference) ** 2) / (reference**2 + 0.01)).mean(2).ravel())
    return float(each[: each.size - each.size // 1000].mean())


def scatter(count: int) -> None:
    """So many instances of a cube, at the vertices of a mesh."""
    places = np.random.default_rng(1).uniform((-7.0, -7.0, -1.0), (7.0, 7.0, -0.9), (count, 3))
    data = bpy.data.meshes.new("Places")
    data.from_pydata(places.tolist(), [], [])
    field = bpy.data.objects.new("Places", data)
    bpy.context.collection.objects.link(field)
    bpy.ops.mesh.primitive_cube_add(size=0.06)
    bpy.context.object.parent, field.instance_type = field, "VERTS"


def stage(triangles: int = 100_000, instances: int = 0) -> None:
    """The scene."""
    scene = bpy.context.window_manager.windows[0].scene
    for item in [item for item in scene.objects if item.type != "CAMERA"]:
        bpy.data.objects.remove(item)
    scene.view_settings.view_transform = "Standard"
    bpy.ops.mesh.primitive_plane_add(size=14.0, location=(0.0, 0.0, -1.0))
    bpy.ops.mesh.primitive_monkey_add(location=(0.0, 0.0, 0.0))
    monkey = bpy.context.object
    modifier = monkey.modifiers.new("Subdivision", "SUBSURF")
    modifier.levels = modifier.render_levels = 2
    skin = bpy.data.materials.new("Skin")
    node = next(node for node in skin.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    values = {"Base Color": (0.8, 0.5, 0.4, 1.0), "Subsurface Weight": 1.0, "Subsurface Scale": 0.1}
    for name, value in values.items():
        node.inputs[name].default_value = value
    monkey.data.materials.append(skin)
    rings = round((triangles / 4.0) ** 0.5)
    bpy.ops.mesh.primitive_uv_sphere_add(segments=2 * rings, ring_count=rings, radius=0.6, location=(1.8, 0.8, -0.4))
    bpy.context.object.name = "Ball"
    if instances:
        scatter(instances)
    bpy.ops.object.light_add(type="AREA", location=(2.0, -2.0, 3.0), rotation=(0.7, 0.3, 0.0))
    bpy.context.object.name, bpy.context.object.data.energy = "Lamp", 30.0
    tree = scene.world.node_tree
    sky = tree.nodes.new("ShaderNodeTexEnvironment")
    folder = bpy.utils.system_resource("DATAFILES")
    sky.image = bpy.data.images.load(f"{folder}/studiolights/world/forest.exr")
    tree.links.new(sky.outputs["Color"], tree.nodes["Background"].inputs["Color"])
    tree.nodes["Background"].inputs["Strength"].default_value = 0.4
    scene.cycles.use_preview_adaptive_sampling = scene.cycles.use_preview_denoising = False
    scene.cycles.preview_samples = scene.restir.preview_samples = 4096
    scene.restir.is_initialized, scene.restir.preview_sss_method = True, "FROM_MATERIAL"


def turn(sign: int) -> None:
    areas("VIEW_3D")[0].spaces[0].region_3d.view_rotation.rotate(Quaternion((0.0, 0.0, 1.0), sign * 0.2))


def move(sign: int) -> None:
    bpy.data.objects["Suzanne"].location.x += sign * 0.3


def paint(sign: int) -> None:
    node = next(node for node in bpy.data.materials["Skin"].node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    node.inputs["Base Color"].default_value = (0.3, 0.6, 0.4, 1.0) if sign > 0 else (0.8, 0.5, 0.4, 1.0)


def light(sign: int) -> None:
    bpy.data.objects["Lamp"].data.energy = 90.0 if sign > 0 else 30.0


def mesh(sign: int) -> None:
    data = bpy.data.objects["Ball"].data
    places = np.empty(3 * len(data.vertices), np.float32)
    data.vertices.foreach_get("co", places)
    places.reshape(-1, 3)[:, 2] *= 1.5**sign
    data.vertices.foreach_set("co", places)
    data.update()


CHANGES = {"turn": turn, "move": move, "material": paint, "light": light, "mesh": mesh}


def measured(screen: Screen, change, reference: float):
    """Make a change and wait; returns (first, errors)."""
    before = screen.pictures[-1][1]
    screen.pictures.clear()
    began = time.perf_counter()
    change(1)
    yield reference
    pictures = [(when - began, picture) for when, picture in screen.pictures if when > began]
    new = [(when, picture) for when, picture in pictures if has_changed(picture, before)]
    final = pictures[-1][1] if pictures else before
    errors = []
    for moment in MOMENTS:
        shown = [picture for when, picture in pictures if when <= moment]
        errors.append(error(shown[-1] if shown else before, final))
    screen.pictures[:] = screen.pictures[-1:]
    change(-1)
    return (new[0][0] if new else float("nan")), errors


def orbit(screen: Screen, reference: float):
    """Turn the view in steps; returns (pictures a second, error after the last step)."""
    screen.pictures.clear()
    began = time.perf_counter()
    for _ in range(STEPS):
        turn(0.1)
        yield STEP
    ended, last = time.perf_counter(), len(screen.pictures)
    shown = screen.pictures[-1][1] if screen.pictures else None
    yield reference
    final = screen.pictures[-1][1]
    rate = last / (ended - began)
    screen.pictures[:] = screen.pictures[-1:]
    return rate, float("nan") if shown is None else error(shown, final)


def steps(options: argparse.Namespace, log: Log):
    """The script."""
    import addon_utils

    addon_utils.enable(NAME, default_set=True)
    yield 1.0
    stage(options.triangles, options.instances)
    scene = bpy.context.window_manager.windows[0].scene
    view = areas("VIEW_3D")[0]
    space = view.spaces[0]
    space.overlay.show_overlays = space.show_gizmo = False
    space.region_3d.view_distance = 8.0
    screen = Screen()
    log(f"{window_region(view).width} × {window_region(view).height}, Blender {bpy.app.version_string}\n")
    moments = " | ".join(f"{moment:g} s" for moment in MOMENTS)
    log(f"| engine | change | first, s | {moments} |\n|---|---|---|{'---|' * len(MOMENTS)}")
    for engine in options.engines:
        scene.render.engine = "CYCLES" if engine == "CYCLES" else "RESTIR"
        if engine != "CYCLES":
            scene.restir.integrator = engine
        space.shading.type = "RENDERED"
        yield options.warm if engine != "CYCLES" else options.reference
        for name, change in CHANGES.items():
            first, errors = yield from measured(screen, change, options.reference)
            log(f"| {engine} | {name} | {first:.2f} | {' | '.join(f'{value:.4f}' for value in errors)} |")
            yield options.reference
        rate, after = yield from orbit(screen, options.reference)
        log(f"| {engine} | orbit | {rate:.1f} a second | {after:.4f} right after |{' |' * (len(MOMENTS) - 1)}")
        log.screenshot(f"view_{engine.lower()}")
        for _ in range(STEPS):
            turn(-0.1)
        space.shading.type = "SOLID"
        yield 1.0
    screen.close()


def main() -> None:
    """Read the arguments behind `--`, and begin."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--engines", nargs="+", default=["PATH", "RESTIR", "CYCLES"])
    parser.add_argument("--reference", type=float, default=15.0, help="seconds after a change")
    parser.add_argument("--warm", type=float, default=60.0, help="seconds for kernels to load or compile")
    parser.add_argument("--triangles", type=int, default=100_000, help="of the ball, about")
    parser.add_argument("--instances", type=int, default=0)
    options = parser.parse_args(sys.argv[sys.argv.index("--") + 1 :])
    options.folder.mkdir(parents=True, exist_ok=True)
    bpy.context.preferences.view.show_splash = False
    log = Log(options.folder.resolve() / "view.txt")
    run(steps(options, log), log)


main()
