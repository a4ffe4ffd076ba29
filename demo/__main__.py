"""Render the demo scene with the engine to a PNG: `python -m demo`."""

import argparse
import logging
import os
import sys
import time
from pathlib import Path

import bpy

from demo import still_life
from restir_engine import engine


def main() -> None:
    """Build the scene, render it, say where the picture is."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--samples", type=int, default=64, help="paths for each pixel")
    parser.add_argument("--size", default="720x480", help="width and height of the picture in pixels")
    parser.add_argument("--output", type=Path, default=Path("still_life.png"))
    parser.add_argument("--engine", default="RESTIR", choices=("RESTIR", "CYCLES"), help="CYCLES to compare")
    parser.add_argument("--no-denoising", action="store_true", help="show the noise that is left")
    options = parser.parse_args()
    logging.basicConfig(level=logging.INFO, format="%(message)s")

    scene = still_life.build(*(int(side) for side in options.size.split("x")))
    engine.register()
    scene.render.engine = options.engine
    settings = scene.restir if options.engine == "RESTIR" else scene.cycles
    settings.samples, settings.use_denoising = options.samples, not options.no_denoising
    scene.restir.clamp_indirect, scene.restir.filter_glossy = 10.0, 1.0  # as in a new Cycles scene
    scene.render.image_settings.file_format = "PNG"
    scene.render.filepath = str(options.output.resolve())
    start = time.perf_counter()
    bpy.ops.render.render(write_still=True)
    print(f"{options.output}: {time.perf_counter() - start:.0f} s")
    sys.stdout.flush()
    os._exit(0)  # Blender 4.5 can hang at exit while classes are registered


if __name__ == "__main__":
    main()
