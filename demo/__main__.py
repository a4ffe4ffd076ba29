"""Render a demo scene to a PNG: `python -m demo`; with `--beside-cycles SECONDS` as both engines show it by then."""

import argparse
import logging
import os
import sys
import tempfile
import time
from pathlib import Path

import bpy
import numpy as np

from demo import still_life, translucent
from restir_engine import engine

SCENES = {"translucent": translucent.build, "still-life": still_life.build}
ALL_THAT_TIME_ALLOWS = 1 << 20  # samples a pixel


def main() -> None:
    """Build the scene, render it, say where the picture is."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scene", default="translucent", choices=SCENES)
    parser.add_argument("--samples", type=int, default=64, help="paths for each pixel")
    parser.add_argument("--size", default="720x480", help="width and height of the picture in pixels")
    parser.add_argument("--output", type=Path, help="default: the scene's name.png")
    parser.add_argument("--engine", default="RESTIR", choices=("RESTIR", "CYCLES"), help="CYCLES to compare")
    parser.add_argument("--no-denoising", action="store_true", help="show the noise that is left")
    parser.add_argument(
        "--beside-cycles", type=float, metavar="SECONDS", help="Cycles to the left, ReSTIR to the right, not denoised"
    )
    options = parser.parse_args()
    logging.basicConfig(level=logging.INFO, format="%(message)s")

    scene = SCENES[options.scene](*(int(side) for side in options.size.split("x")))
    output = options.output or Path(f"{options.scene.replace('-', '_')}.png")
    engine.register()
    for settings in (scene.restir, scene.cycles):
        settings.samples, settings.use_denoising = options.samples, not options.no_denoising
    scene.restir.clamp_indirect, scene.restir.filter_glossy = 10.0, 1.0  # as in a new Cycles scene
    scene.render.image_settings.file_format = "PNG"
    if options.beside_cycles:
        beside_cycles(scene, options.beside_cycles, output)
    else:
        render(scene, options.engine, output)
    sys.stdout.flush()
    os._exit(0)  # Blender 4.5 can hang at exit while classes are registered


def render(scene: bpy.types.Scene, name: str, output: Path) -> None:
    """Render with the engine of that name, and say how long it took."""
    scene.render.engine = name
    scene.render.filepath = str(output.resolve())
    start = time.perf_counter()
    bpy.ops.render.render(write_still=True)
    print(f"{name}: {output}: {time.perf_counter() - start:.1f} s")


def beside_cycles(scene: bpy.types.Scene, seconds: float, output: Path) -> None:
    """Give each engine so many seconds, without denoising, and put the two pictures side by side."""
    for settings in (scene.restir, scene.cycles):
        settings.samples, settings.time_limit, settings.use_denoising = ALL_THAT_TIME_ALLOWS, seconds, False
        settings.use_adaptive_sampling = False
    pictures = []
    with tempfile.TemporaryDirectory() as folder:
        for name in ("CYCLES", "RESTIR"):
            path = Path(folder, f"{name}.png")
            render(scene, name, path)
            image = bpy.data.images.load(str(path))
            pixels = np.empty(len(image.pixels), np.float32)
            image.pixels.foreach_get(pixels)
            pictures.append(pixels.reshape(image.size[1], image.size[0], 4))
    both = np.concatenate(pictures, axis=1)
    image = bpy.data.images.new("Both", both.shape[1], both.shape[0])
    image.pixels.foreach_set(both.ravel())
    image.filepath_raw, image.file_format = str(output.resolve()), "PNG"
    image.save()


if __name__ == "__main__":
    main()
