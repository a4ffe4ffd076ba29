"""Smoke of 256³ voxels beside Cycles: `python -m benchmarks.smoke [--voxels 256] [--samples 32] [--seeds 4]`.

Error is the standard deviation between seeds over the mean, both of the middle of the picture, which the smoke fills:
it needs no reference, as the means of both engines stand beside it.
Seconds are processor time of `bpy.ops.render.render()`: `reading` that of one sample, and what each further sample
takes. Error at equal time is error · √(seconds a sample): of long renders, in which reading does not count. Prints
Markdown.
"""

from __future__ import annotations

import argparse
import os
import platform
import sys
import tempfile
import time
from pathlib import Path

import bpy
import numpy as np

from testing.blender import kit, render
from testing.blender.registry import Scene

SIZE = (160, 120)


def plume(path: Path, voxels: int) -> None:
    """Write a grid "density" of so many voxels along each side: noise within a ball, half of them empty."""
    kit.reset()
    tree = bpy.data.node_groups.new("Plume", "GeometryNodeTree")
    tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    new, link = tree.nodes.new, tree.links.new
    cube, position, noise = (
        new(kind) for kind in ("GeometryNodeVolumeCube", "GeometryNodeInputPosition", "ShaderNodeTexNoise")
    )
    length, density, output = new("ShaderNodeVectorMath"), new("ShaderNodeMapRange"), new("NodeGroupOutput")
    falls = new("ShaderNodeMath")
    length.operation, falls.operation = "LENGTH", "MULTIPLY_ADD"
    noise.inputs["Scale"].default_value, noise.inputs["Detail"].default_value = 2.5, 4.0
    link(position.outputs[0], noise.inputs["Vector"])
    link(position.outputs[0], length.inputs[0])
    link(length.outputs["Value"], falls.inputs[0])
    falls.inputs[1].default_value = -0.4
    link(noise.outputs[0], falls.inputs[2])
    link(falls.outputs[0], density.inputs["Value"])
    for name, value in (("From Min", 0.2), ("From Max", 0.5), ("To Min", 0.0), ("To Max", 1.0)):
        density.inputs[name].default_value = value
    link(density.outputs[0], cube.inputs["Density"])
    for axis in "XYZ":
        cube.inputs["Resolution " + axis].default_value = voxels
    link(cube.outputs[0], output.inputs[0])
    host = kit.add(bpy.data.volumes.new("Plume"))
    host.modifiers.new("Plume", "NODES").node_group = tree
    data = host.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
    data.grids.load()
    if not data.grids.save(filepath=str(path)):
        raise RuntimeError("the grid cannot be saved")


def stage(path: Path, lamp_inside: bool, bounces: int) -> None:
    """The plume over a floor, under a sun and a sky, or with a lamp in it."""
    item = Scene("smoke", lambda: None, 1, 1, SIZE, {"volume_bounces": bounces, "max_bounces": bounces})
    render.prepare(item)
    data = bpy.data.volumes.new("Plume")
    data.filepath = str(path)
    data.materials.append(
        kit.material(lambda node: {"Volume": node("VolumePrincipled", Density=8.0, Color=(0.9, 0.85, 0.8))})
    )
    kit.add(data, (0.0, 0.0, 1.0), scale=1.2)
    kit.floor(kit.diffuse((0.5, 0.5, 0.5)))
    if lamp_inside:
        lamp = kit.light("POINT", 200.0, (0.2, -0.3, 1.2), shadow_soft_size=0.05)
        lamp.visible_camera = False  # one pixel of it would be all of the error
        kit.world(lambda node: node("Background", Strength=0.05))
    else:
        kit.light("SUN", 3.0, (3.0, -2.0, 4.0), angle=0.05)
        kit.world(lambda node: node("Background", Color=(0.5, 0.7, 1.0), Strength=0.5))


def timed(engine: str, samples: int, seed: int) -> tuple[np.ndarray, float]:
    """A picture (height, width, 3) of the current scene and the processor seconds that it took."""
    with render.quiet():
        start = time.process_time()
        picture = render.render(engine, samples, seed)
        return picture[..., :3], time.process_time() - start


def measure(engine: str, samples: int, seeds: int) -> tuple[np.ndarray, np.ndarray, float, float]:
    """(mean, variance between seeds, seconds of reading, seconds of a sample)."""
    timed(engine, 1, 0)
    reading = min(timed(engine, 1, seed)[1] for seed in range(2))
    pictures, seconds = zip(*(timed(engine, samples, 100 + seed) for seed in range(seeds)), strict=True)
    pictures = np.stack(pictures)
    return pictures.mean(0), pictures.var(0, ddof=1), reading, (np.mean(seconds) - reading) / (samples - 1)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--voxels", type=int, default=256, help="along each side")
    parser.add_argument("--samples", type=int, default=32)
    parser.add_argument("--seeds", type=int, default=4)
    parser.add_argument("--bounces", type=int, default=4)
    options = parser.parse_args()
    render.register()
    load = "/".join(f"{value:.1f}" for value in os.getloadavg())
    print(f"Blender {bpy.app.version_string}, {platform.machine()}, {os.cpu_count()} cores, load before {load}\n")
    print("| light | engine | mean | reading, s | sample, s | error of a sample | error at equal time |")
    print("|---|---|---|---|---|---|---|", flush=True)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "plume.vdb"
        plume(path, options.voxels)
        for light, inside in (("sun and sky", False), ("a lamp inside", True)):
            rows = {}
            for engine in ("CYCLES", "RESTIR"):
                stage(path, inside, options.bounces)
                rows[engine] = measure(engine, options.samples, options.seeds)
            worth = {}
            for engine, (mean, variance, reading, sample) in rows.items():
                box = np.s_[SIZE[1] // 8 : -SIZE[1] // 8, SIZE[0] // 4 : -SIZE[0] // 4]
                error = np.sqrt(options.samples * variance[box].mean()) / mean[box].mean()
                worth[engine] = error * np.sqrt(sample)
                share = worth[engine] / worth["CYCLES"]
                values = f"{mean[box].mean():.4f} | {reading:.2f} | {sample:.4f} | {error:.3f} | {share:.2f}"
                print(f"| {light} | {engine} | {values} |", flush=True)


if __name__ == "__main__":
    main()
    sys.stdout.flush()
    os._exit(0)
