"""Many lights, as Markdown tables: `python -m benchmarks.many_lights [triangles] [lamps]`.

triangles: seconds of a RESTIR frame of one million-triangle mesh of which 10 to 1,000,000 triangles emit and else are
like the others, against that of 10; five dragons when RESTIR_ASSETS is set (a folder with `stanford`), else a wavy
grid. Seconds are of processor time, all counts by turns, so that other load on the machine matters less.
lamps: relMSE of Cycles (with its light tree), PATH and RESTIR after equal seconds, against converged PATH, in a scene
of 400 coloured lamps on diffuse and subsurface scattering objects.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import bpy
import numpy as np

from testing.blender import kit, render
from testing.measures import relmse

from . import scenes
from .against_cycles import timed

SIZE, SMALL = (480, 270), (128, 72)
SAMPLES, REFERENCE_SAMPLES, TRIAL_SAMPLES, ROUNDS = 8, 4096, 9, 3
COUNTS = (10, 1_000, 100_000, 1_000_000)
WAYS = ("CYCLES", "PATH", "RESTIR")


def _million() -> bpy.types.Mesh:
    """The mesh, in a scene of its own; with assets five copies of a dragon of 202,520 triangles on a floor."""
    scenes.prepare("million_triangles", SIZE)
    for thing in [o for o in bpy.data.objects if o.type == "LIGHT"]:
        bpy.data.objects.remove(thing)
    assets = os.environ.get("RESTIR_ASSETS", "")
    grid = next(o for o in bpy.data.objects if o.type == "MESH")
    if not assets:
        return grid.data
    bpy.data.objects.remove(grid)
    bpy.ops.wm.ply_import(filepath=str(Path(assets) / "stanford" / "dragon_vrip_res2.ply"))
    dragon = bpy.context.object
    dragon.data.materials.clear()
    dragon.data.materials.append(kit.diffuse())
    copies = [dragon] + [kit.add(dragon.data.copy()) for _ in range(4)]
    for i, copy in enumerate(copies):
        copy.rotation_euler = (np.pi / 2, 0.0, 0.4 * i)
        copy.location = (1.3 * (i - 2), 0.5 * (i % 2), -0.35)
        copy.scale = (7.0,) * 3
        copy.select_set(True)
    bpy.context.view_layer.objects.active = dragon
    bpy.ops.object.join()
    kit.floor()
    return dragon.data


def triangles() -> Iterator[str]:
    """Rows: how many emit, seconds of some frames, against those of the fewest."""
    mesh = _million()
    mesh.materials[0] = kit.principled(Emission_Strength=0.0)
    mesh.materials.append(kit.principled(Emission_Color=(1.0, 0.8, 0.5, 1.0), Emission_Strength=3.0))
    bpy.context.scene.restir.integrator = "RESTIR"
    faces = len(mesh.polygons)
    order = np.random.default_rng(1).permutation(faces)
    per_face = len(mesh.loop_triangles) / faces if mesh.loop_triangles else len(mesh.polygons[0].vertices) - 2
    of = f"{round(faces * per_face):,}"
    yield f"| of {of} triangles emit | processor seconds of {SAMPLES} frames | ratio |\n|---|---|---|"
    seconds = dict.fromkeys(COUNTS, np.inf)
    for _ in range(ROUNDS):
        for count in COUNTS:
            emits = np.zeros(faces, np.int32)
            emits[order[: round(count / per_face)]] = 1
            mesh.polygons.foreach_set("material_index", emits)
            mesh.update()
            timed("RESTIR", 1)
            seconds[count] = min(seconds[count], _processor_seconds())
    for count in COUNTS:
        yield f"| {count:,} | {seconds[count]:.2f} | {seconds[count] / seconds[COUNTS[0]]:.2f} |"


def _processor_seconds() -> float:
    """Of SAMPLES frames, without what comes before and after them."""
    times = []
    for samples in (SAMPLES, 2 * SAMPLES):
        start = time.process_time()
        timed("RESTIR", samples)
        times.append(time.process_time() - start)
    return times[1] - times[0]


def _picture(way: str, samples: int, seed: int = 0):
    bpy.context.scene.restir.integrator = way if way != "CYCLES" else "PATH"
    return timed("CYCLES" if way == "CYCLES" else "RESTIR", samples, seed)


def lamps() -> Iterator[str]:
    """Rows: after how many seconds, relMSE of each way, RESTIR's against the others'."""
    scenes.prepare("lanterns", SMALL)
    bpy.context.scene.cycles.use_light_tree = True
    reference, _ = _picture("PATH", REFERENCE_SAMPLES, 99)  # Cycles would take an hour: its rays meet every lamp
    rates = {}
    for way in WAYS:
        start = _picture(way, 1)[1]
        start = min(start, _picture(way, 1)[1])
        rates[way] = (start, max(_picture(way, TRIAL_SAMPLES)[1] - start, 1e-3) / (TRIAL_SAMPLES - 1))
    yield "| seconds | Cycles | PATH | RESTIR | RESTIR / Cycles | RESTIR / PATH |\n|---|---|---|---|---|---|"
    for seconds in (1.0, 10.0):
        errors = []
        for way in WAYS:
            start, each = rates[way]
            picture, _ = _picture(way, max(1, round((seconds - start) / each)), 1)
            errors.append(relmse(picture, reference))
        cycles, path, restir = errors
        columns = (*(f"{e:.4g}" for e in errors), f"{restir / cycles:.2f}", f"{restir / path:.2f}")
        yield f"| {seconds:g} | {' | '.join(columns)} |"


PARTS = {"triangles": triangles, "lamps": lamps}


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("parts", nargs="*", help=f"{', '.join(PARTS)}; all if none is named")
    render.register()
    load = "/".join(f"{value:.1f}" for value in os.getloadavg())
    print(f"Blender {bpy.app.version_string}, {os.cpu_count()} cores, load before {load}\n")
    for name in parser.parse_args().parts or PARTS:
        for row in PARTS[name]():
            print(row, flush=True)
        print()


if __name__ == "__main__":
    main()
    sys.stdout.flush()
    os._exit(0)  # bpy 4.5 can hang at a normal exit
