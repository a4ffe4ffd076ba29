"""What is read and built again where little has changed: an object moves among a million triangles that stand still.

`python -m benchmarks.animation [--frames 50]` prints for each frame and view layer, then for edits as the
3D view has them, the seconds that reading and committing take, what structures are built of, and the memory in use.
"""

from __future__ import annotations

import argparse
import time

import bpy
import numpy as np

import restir_engine.engine
from restir_engine import properties
from restir_engine.embree import scenes as embree
from restir_engine.scene.description import SceneDescription
from restir_engine.scene.trees import Trees
from restir_engine.session import Session, memory_in_use
from restir_engine.sync import depsgraph as sync
from restir_engine.sync.mesh_cache import MeshCache

SIDE = 707  # 2 SIDE² triangles


class Clock:
    """Wraps functions and adds up what they take, until it is read."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}
        self.triangles = 0  # that structures were built of

    def watch(self, owner, name: str, label: str) -> None:
        """Let calls of owner.name count as `label`."""
        function = getattr(owner, name)

        def timed(*args, **kwargs):
            start = time.perf_counter()
            try:
                return function(*args, **kwargs)
            finally:
                self.seconds[label] = self.seconds.get(label, 0.0) + time.perf_counter() - start

        setattr(owner, name, timed)

    def count_triangles(self) -> None:
        """Let structures that are built count by their triangles."""
        attach = embree._Scene._attach_triangles

        def counted(scene, vertices, triangles, *rest):
            self.triangles += len(triangles)
            attach(scene, vertices, triangles, *rest)

        embree._Scene._attach_triangles = counted

    def line(self, title: str) -> str:
        """What has been counted since the last line."""
        parts = "  ".join(f"{label} {self.seconds.get(label, 0.0):7.3f} s" for label in ("read", "commit", "render"))
        text = f"{title:34} {parts}  built of {self.triangles:9,d} triangles  {memory_in_use() / 2**20:6.0f} MB"
        self.seconds.clear()
        self.triangles = 0
        return text


def grid(side: int) -> bpy.types.Mesh:
    """A wavy sheet with smooth normals and a UV map."""
    line = np.linspace(-1.0, 1.0, side + 1, dtype=np.float32)
    x, y = (a.ravel() for a in np.meshgrid(line, line))
    corner = (np.arange(side)[:, None] * (side + 1) + np.arange(side)).ravel()
    faces = np.stack([corner, corner + 1, corner + side + 2, corner + side + 1], 1).astype(np.int32)
    mesh = bpy.data.meshes.new("Sheet")
    mesh.vertices.add(len(x))
    mesh.vertices.foreach_set("co", np.column_stack([x, y, 0.05 * np.sin(9.0 * x) * np.cos(7.0 * y)]).ravel())
    mesh.loops.add(faces.size)
    mesh.loops.foreach_set("vertex_index", faces.ravel())
    mesh.polygons.add(len(faces))
    mesh.polygons.foreach_set("loop_start", np.arange(0, faces.size, 4, dtype=np.int32))
    mesh.polygons.foreach_set("use_smooth", np.ones(len(faces), bool))
    mesh.update(calc_edges=True)
    layer = mesh.uv_layers.new(name="UVMap")
    layer.uv.foreach_set("vector", np.column_stack([x, y])[faces.ravel()].ravel())
    return mesh


def stage(frames: int) -> tuple[bpy.types.Object, bpy.types.Object]:
    """A million triangles, and a cube that moves over them: (sheet, cube)."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    sheet = bpy.data.objects.new("Sheet", grid(SIDE))
    bpy.ops.mesh.primitive_cube_add(size=0.3)
    cube = bpy.context.object
    for item, name in ((sheet, "Clay"), (cube, "Paint")):
        item.data.materials.append(bpy.data.materials.new(name))
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    lamp = bpy.data.objects.new("Lamp", bpy.data.lights.new("Lamp", "SUN"))
    for item in (sheet, camera, lamp):
        scene.collection.objects.link(item)
    camera.location, lamp.location = (0.0, 0.0, 4.0), (0.0, 0.0, 4.0)
    scene.camera = camera
    for frame in (1, frames):
        cube.location = (1.5 * frame / frames - 0.75, 0.0, 0.4)
        cube.keyframe_insert("location", frame=frame)
    scene.frame_start, scene.frame_end = 1, frames
    scene.render.engine = "RESTIR"
    scene.render.resolution_x, scene.render.resolution_y = 64, 64
    scene.render.filepath = bpy.app.tempdir + "frame_"
    scene.restir.samples = 1
    return sheet, cube


def animate(clock: Clock, title: str) -> None:
    """Render the animation; a line for each view layer of each frame."""
    render = restir_engine.engine.RestirEngine.render

    def told(engine, depsgraph):
        render(engine, depsgraph)
        frame, layer = depsgraph.scene.frame_current, depsgraph.view_layer.name
        if frame < 4 or frame % 10 == 0:
            print(clock.line(f"{title}, frame {frame}, {layer}"), flush=True)
        clock.line("")

    restir_engine.engine.RestirEngine.render = told
    bpy.ops.render.render(animation=True)
    restir_engine.engine.RestirEngine.render = render


def edit(clock: Clock, sheet: bpy.types.Object, cube: bpy.types.Object) -> None:
    """Edits as a 3D view sees them: read on the main thread, committed by its worker."""
    meshes, trees = MeshCache(), Trees(instanced=True)

    def nothing() -> None:
        pass

    def move() -> None:
        cube.location.x += 0.1

    def move_sheet() -> None:
        sheet.location.z -= 0.01

    def paint() -> None:
        cube.active_material.node_tree.nodes["Principled BSDF"].inputs["Base Color"].default_value = (0.8, 0.1, 0.1, 1)

    def sculpt_cube() -> None:
        cube.data.vertices[0].co.x -= 0.1
        cube.data.update()

    def sculpt_sheet() -> None:
        sheet.data.vertices[0].co.z += 0.1
        sheet.data.update()

    def unwrap() -> None:
        sheet.data.uv_layers[0].uv[0].vector = (0.3, 0.3)
        sheet.data.update()

    steps = [
        ("opened", nothing), ("cube moved", move), ("cube moved again", move), ("material edited", paint),
        ("cube's mesh edited", sculpt_cube), ("sheet's UV map edited", unwrap), ("sheet's mesh edited", sculpt_sheet),
        ("sheet moved", move_sheet), ("sheet moved again", move_sheet), ("cube moved", move),
    ]  # fmt: skip
    for title, change in steps:
        change()
        depsgraph = bpy.context.evaluated_depsgraph_get()
        settings = properties.viewport_settings(depsgraph.scene, depsgraph.view_layer)
        meshes.next_frame()
        description = sync.read_scene(depsgraph, settings, meshes=meshes)
        trees.next_frame()
        description.commit(trees)
        print(clock.line(f"3D view, {title}"), flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--frames", type=int, default=3)
    args = parser.parse_args()
    restir_engine.engine.register()
    clock = Clock()
    clock.watch(sync, "read_scene", "read")
    clock.watch(SceneDescription, "commit", "commit")
    clock.watch(Session, "render", "render")
    clock.count_triangles()
    sheet, cube = stage(args.frames)
    animate(clock, "Animation")
    bpy.context.scene.view_layers.new("Second")
    animate(clock, "Two layers")
    edit(clock, sheet, cube)


if __name__ == "__main__":
    main()
