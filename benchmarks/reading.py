"""What reading many materials costs, beside Cycles: `python -m benchmarks.reading [materials] [nodes]`.

Each object has a material of its own. Printed is the processor time of a render of 16 pixels, the least of several in
which the engines take turns, and what it is more than that of the same scene under one material: reading the trees,
compiling them into programs and laying these out, and what Blender does to evaluate them for any engine.
"""

from __future__ import annotations

import sys
import time

import bpy

from testing.blender import kit, render

ENGINES = ("CYCLES", "RESTIR")
TURNS = 9


def material(nodes: int, number: int) -> bpy.types.Material:
    """Principled with a chain of textures, ramps, mixes and maths; no two are alike."""

    def build(node):
        coordinates = node("Mapping", Vector=node("TexCoord").outputs["Object"], Scale=(1.0 + number, 1.0, 1.0))
        color = node("TexNoise", Vector=coordinates, Scale=2.0 + number).outputs["Color"]
        for k in range((nodes - 6) // 4):
            texture = node("TexNoise", Vector=coordinates, Scale=3.0 + k)
            value = node("Math", {0: texture.outputs[0], 1: 0.1 * k}, operation="MULTIPLY")
            ramp = node("ValToRGB", Fac=value)
            color = node("MixRGB", Fac=0.5, Color1=color, Color2=ramp.outputs["Color"]).outputs["Color"]
        return node("BsdfPrincipled", Base_Color=color, Normal=node("Bump", Height=node("Value"), Strength=0.2))

    return kit.material(build)


def build(materials: int, nodes: int, shared: bool) -> None:
    """As many objects as materials, out of the camera's sight."""
    scene = kit.reset()
    render.exact_files(scene)
    scene.restir.is_initialized = True
    scene.render.resolution_x = scene.render.resolution_y = 4
    kit.assign(scene.cycles, render.CYCLES)
    scene.cycles.max_bounces = scene.restir.max_bounces = 0
    scene.restir.integrator = "PATH"
    mesh = kit.mesh("cube")
    mesh.materials.append(None)
    only = material(nodes, 0)
    for k in range(materials):
        thing = kit.add(mesh, (3.0 * k, 50.0, 0.0))
        slot = thing.material_slots[0]
        slot.link = "OBJECT"
        slot.material = only if shared else material(nodes, k)


def seconds(engine: str) -> float:
    """Processor time of a render."""
    with render.quiet():
        start = time.process_time()
        render.render(engine, 1, 0)
        return time.process_time() - start


def main() -> None:
    """Print both engines' times."""
    materials, nodes = (*map(int, sys.argv[1:]), *(300, 25)[len(sys.argv) - 1 :])
    render.register()
    least: dict[tuple[str, bool], float] = {}
    for shared in (True, False):
        build(materials, nodes, shared)
        for engine in ENGINES * (1 + TURNS):
            taken = seconds(engine)
            least[engine, shared] = min(least.get((engine, shared), taken), taken)
    print(f"{materials} materials of {nodes} nodes: seconds of a render, and more than of one material")
    for engine in ENGINES:
        print(f"{engine}: {least[engine, False]:.3f} s, {least[engine, False] - least[engine, True]:.3f} s")


main()
