"""Seconds until the first picture: of an installed zip, of a checkout with an empty cache and with a warm one.

    python -m benchmarks.first_picture --zip dist/restir_engine-….zip       # fresh install
    python -m benchmarks.first_picture --against ../older/checkout          # empty and warm, both builds in turn

Each line is a Blender of its own (the module `bpy`), which reads a file of 320 × 180 pixels and renders one sample with
the extension's defaults. Seconds of the wall are from the file read to the picture; those of the processor are of that
Blender from its start and of all processes that compiled for it; the memory is what is resident after the picture.
"""

import argparse
import json
import os
import resource
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

import bpy

ROOT = Path(__file__).resolve().parents[1]
SCENES = ("cube", "skin")
NAME = "bl_ext.user_default.restir_engine"


def save_scene(name: str, path: Path) -> None:
    """Blender's default cube as a file; as skin, it scatters light below its surface."""
    bpy.ops.wm.read_factory_settings()
    render = bpy.context.scene.render
    render.resolution_x, render.resolution_y, render.resolution_percentage = 320, 180, 100
    tree = bpy.data.objects["Cube"].data.materials[0].node_tree
    principled = next(node for node in tree.nodes if node.type == "BSDF_PRINCIPLED")
    principled.inputs["Subsurface Weight"].default_value = 1.0 if name == "skin" else 0.0
    bpy.ops.wm.save_as_mainfile(filepath=str(path))


def first_picture(build: Path, scene: str, integrator: str) -> dict[str, float]:
    """What the first picture took in this process; build: a zip or a checkout; integrator: "" for the default."""
    import addon_utils

    with tempfile.TemporaryDirectory() as folder:
        save_scene(scene, Path(folder) / "scene.blend")
        if build.suffix == ".zip":
            bpy.ops.extensions.package_install_files(filepath=str(build), repo="user_default", enable_on_install=False)
        else:
            link = Path(os.environ["XDG_CACHE_HOME"]) / "extensions" / "restir_engine"
            if not link.exists():
                link.parent.mkdir(parents=True, exist_ok=True)
                link.symlink_to(build, target_is_directory=True)
            user = next(r for r in bpy.context.preferences.extensions.repos if r.module == "user_default")
            user.use_custom_directory, user.custom_directory = True, str(link.parent)
            addon_utils.modules_refresh()
        assert addon_utils.enable(NAME, default_set=True)
        bpy.ops.wm.open_mainfile(filepath=str(Path(folder) / "scene.blend"))
        start = time.perf_counter()
        bpy.context.scene.render.engine = "RESTIR"
        own = bpy.context.scene.restir
        own.is_initialized, own.samples, own.use_denoising = True, 1, False
        own.integrator = integrator or own.integrator
        bpy.ops.render.render()
        wall = time.perf_counter() - start
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    for thread in threading.enumerate():  # the time of their processes counts when they have ended
        if thread.name == "restir-compile":
            thread.join()
    used = (resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    processor = sum(usage.ru_utime + usage.ru_stime for usage in used)
    return {"wall": wall, "processor": processor, "memory": pages * os.sysconf("SC_PAGE_SIZE") / 2**20}


def measure(build: Path, scene: str, integrator: str, cache: str) -> dict[str, float]:
    """The same in a process of its own; cache: where kernels are kept, and Blender's folders of a user."""
    environment = os.environ | {"XDG_CACHE_HOME": cache, "BLENDER_USER_RESOURCES": cache, "TMPDIR": cache}
    environment.pop("RESTIR_CACHE", None)
    command = [sys.executable, "-m", "benchmarks.first_picture", "--inside", str(build), scene, integrator]
    lines = subprocess.run(command, env=environment, cwd=ROOT, capture_output=True, text=True, check=True).stdout
    return json.loads(lines.splitlines()[-1])


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--zip", type=Path, help="an installed zip in place of this checkout")
    parser.add_argument("--against", type=Path, help="a checkout to measure beside")
    parser.add_argument("--scenes", nargs="+", default=SCENES, choices=SCENES)
    parser.add_argument("--integrator", default="", choices=("", "PATH", "RESTIR"), help="in place of the default")
    parser.add_argument("--inside", nargs=3, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.inside:
        print("\n" + json.dumps(first_picture(Path(options.inside[0]), *options.inside[1:])), flush=True)
        os._exit(0)  # Blender as a module may hang when it is taken down
    builds = {"zip" if options.zip else "this": options.zip or ROOT}
    if options.against:
        builds["before"] = options.against
    print("| scene | build | cache | wall, s | processor, s | memory, MB |\n|---|---|---|---|---|---|")
    for scene in options.scenes:
        for label, build in builds.items():
            with tempfile.TemporaryDirectory() as cache:
                for state in ("empty",) if label == "zip" else ("empty", "warm"):
                    took = measure(build.resolve(), scene, options.integrator, cache)
                    figures = f"{took['wall']:.1f} | {took['processor']:.1f} | {took['memory']:.0f}"
                    print(f"| {scene} | {label} | {state} | {figures} |", flush=True)


if __name__ == "__main__":
    main()
