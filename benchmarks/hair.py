"""100,000 strands over skin beside Cycles: `python -m benchmarks.hair [--strands 100000] [--points 9] [--samples 16]`.

Seconds are processor time of `bpy.ops.render.render()`: `first` that of one sample, with all reading and building, and
of what each further sample takes. `grows` is by how much the most memory of the process does in that first render: what
an engine asked for before is not asked for again, so that memory is measured with one of `--engines` alone. Then what
reading alone takes: of the strands as hair curves, of as many as particle hair, of a million points. Prints Markdown.
"""

from __future__ import annotations

import argparse
import os
import platform
import resource
import sys
import time
from collections.abc import Callable

import bpy

from restir_engine.scene.description import SceneDescription
from restir_engine.sync.mesh_cache import MeshCache
from restir_engine.sync.points import read_points
from restir_engine.sync.strands import read_curves, read_hair, strand_look
from testing.blender import kit, render
from testing.blender.registry import Scene
from testing.blender.scenes.strands import cloud, curves, fur, points

SIZE = (320, 180)


def stage(strands: int, n_points: int, shape: str, hair: bool = True) -> None:
    """Hair on skin under a lamp and a sky."""
    render.prepare(Scene("hair", lambda: None, 1, 1, SIZE, {"max_bounces": 4}))
    skin = {"Base Color": (0.8, 0.5, 0.4), "Subsurface Weight": 1.0, "Subsurface Scale": 0.05}
    kit.floor(kit.material(lambda node: node("BsdfPrincipled", skin)))
    kit.lamp()
    kit.world(lambda node: node("Background", Strength=0.3))
    bpy.context.scene.cycles_curves.shape = shape
    if hair:
        curves(fur(strands, n_points, 2.0, 0.4), 0.001, kit.diffuse((0.4, 0.25, 0.15)))


def timed(engine: str, samples: int) -> float:
    """Processor seconds of a render."""
    with render.quiet():
        start = time.process_time()
        render.render(engine, samples, 1)
        return time.process_time() - start


def peak() -> float:
    """The most memory that this process has had, in megabytes."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0


def seconds(read: Callable[[], object]) -> float:
    """Processor seconds of reading, the least of three."""
    found = []
    for _ in range(3):
        start = time.process_time()
        read()
        found.append(time.process_time() - start)
    return min(found)


def reading(strands: int, n_points: int) -> None:
    """Print what our readers take."""
    print("\n| reading | elements | processor s |\n|---|---|---|")
    stage(strands, n_points, "RIBBONS")
    look = strand_look(bpy.context.scene)
    data = bpy.data.hair_curves[0]
    took = seconds(lambda: read_curves(SceneDescription(), data, look, MeshCache()))
    print(f"| hair curves | {strands * n_points} points | {took:.2f} |", flush=True)
    stage(strands, n_points, "RIBBONS", hair=False)
    thing = points(*cloud(1_000_000, 0.001, 0.002), kit.diffuse())
    geometry = thing.evaluated_get(bpy.context.evaluated_depsgraph_get()).evaluated_geometry()
    took = seconds(lambda: read_points(SceneDescription(), geometry.pointcloud, MeshCache()))
    print(f"| point cloud | 1000000 points | {took:.2f} |", flush=True)
    stage(strands, n_points, "RIBBONS", hair=False)
    thing = kit.put("ball", kit.diffuse())
    settings = thing.modifiers.new("Hair", "PARTICLE_SYSTEM").particle_system.settings
    kit.assign(settings, {"type": "HAIR", "count": strands, "display_step": 3})
    owner = thing.evaluated_get(bpy.context.evaluated_depsgraph_get())
    cache = MeshCache()
    for name in ("particle hair", "particle hair, kept"):
        start = time.process_time()
        read_hair(SceneDescription(), owner, look, False, cache)
        print(f"| {name} | {strands * 9} points | {time.process_time() - start:.2f} |", flush=True)


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--strands", type=int, default=100_000)
    parser.add_argument("--points", type=int, default=9)
    parser.add_argument("--samples", type=int, default=16)
    parser.add_argument("--engines", nargs="+", default=["CYCLES", "RESTIR"])
    options = parser.parse_args()
    render.register()
    load = "/".join(f"{value:.1f}" for value in os.getloadavg())
    print(f"Blender {bpy.app.version_string}, {platform.machine()}, {os.cpu_count()} cores, load before {load}\n")
    print("| shape | engine | first, s | grows, MB | a sample, s | million samples/s of a core |")
    print("|---|---|---|---|---|---|", flush=True)
    for shape in ("RIBBONS", "THICK"):
        for engine in options.engines:
            stage(100, 4, shape)
            timed(engine, 1)  # what is compiled and loaded once
            stage(options.strands, options.points, shape)
            before = peak()
            first = timed(engine, 1)
            grown = peak() - before
            one = (timed(engine, options.samples) - first) / (options.samples - 1)
            rate = SIZE[0] * SIZE[1] / one / 1e6
            print(f"| {shape} | {engine} | {first:.2f} | {grown:.0f} | {one:.3f} | {rate:.3f} |", flush=True)
    reading(options.strands, options.points)


if __name__ == "__main__":
    main()
    sys.stdout.flush()
    os._exit(0)
