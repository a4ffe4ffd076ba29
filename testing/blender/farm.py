"""Small files for a farm to render, saved by a Blender of their own.

    python -m testing.blender.farm FILE [--size 32] [--samples 4] [--frames 3] [--handler CODE] [--scene NAME]

The picture is a monkey that turns before a wall, or a scene of `benchmarks`; it is written as PNG to out/frame_ beside
the file. CODE becomes a script that registers itself when the file is opened; in it `frame` is the frame that is
entered and `scene` the scene.
"""

from __future__ import annotations

import argparse
import os
import sys
import textwrap
from pathlib import Path

import bpy

from restir_engine import engine


def stage() -> None:
    """The monkey, the wall, a sun and a camera."""
    scene = bpy.context.scene
    bpy.ops.mesh.primitive_plane_add(size=20.0, location=(0.0, 0.0, -1.0))
    bpy.ops.mesh.primitive_monkey_add()
    monkey = bpy.context.object
    for frame, angle in ((1, 0.0), (11, 3.0)):
        monkey.rotation_euler = (0.0, 0.0, angle)
        monkey.keyframe_insert("rotation_euler", frame=frame)
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location = (0.0, 0.0, 5.0)
    sun = bpy.data.objects.new("Sun", bpy.data.lights.new("Sun", "SUN"))
    sun.rotation_euler, sun.data.energy = (0.5, 0.3, 0.0), 3.0
    for item in (camera, sun):
        scene.collection.objects.link(item)
    scene.camera = camera


def handler(code: str) -> None:
    """Let code run whenever a frame is entered."""
    text = bpy.data.texts.new("handler.py")
    text.use_module = True
    text.write("import bpy\n\n\ndef entered(scene, depsgraph=None):\n    frame = scene.frame_current\n")
    text.write(textwrap.indent(code, "    "))
    text.write("\n\n\nbpy.app.handlers.frame_change_pre.append(entered)\n")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("file", type=Path)
    parser.add_argument("--size", type=int, default=32)
    parser.add_argument("--samples", type=int, default=4)
    parser.add_argument("--frames", type=int, default=3)
    parser.add_argument("--handler", default="")
    parser.add_argument("--set", nargs="*", default=[], help="properties of the scene: render.use_multiview=True")
    options = parser.parse_args()
    bpy.ops.wm.read_factory_settings(use_empty=True)
    engine.register()
    scene = bpy.context.scene
    scene.render.engine = "RESTIR"
    scene.render.resolution_x = scene.render.resolution_y = options.size
    scene.restir.samples, scene.restir.integrator, scene.restir.is_initialized = options.samples, "PATH", True
    scene.frame_start, scene.frame_end = 1, options.frames
    scene.render.filepath = "//out/frame_"
    stage()
    if options.handler:
        handler(options.handler)
    for item in options.set:
        path, _, value = item.partition("=")
        exec(f"scene.{path} = {value}", {"scene": scene, "bpy": bpy})
    bpy.ops.wm.save_as_mainfile(filepath=str(options.file.absolute()))
    engine.unregister()


if __name__ == "__main__":
    main()
    sys.stdout.flush()
    os._exit(0)
