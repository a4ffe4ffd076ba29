"""What shader nodes compute: Cycles' answer beside that of our programs, for many nodes in one render.

A case is a function that adds nodes to a tree and returns the output socket to look at. Each case has a small curved
grid of its own, with two UV maps, colour attributes and a float attribute, seen from above by one orthographic camera.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import bmesh
import bpy
import numpy as np

from restir_engine.kernels.core import records as rec
from restir_engine.kernels.core.jit import kernel
from restir_engine.kernels.core.memory import address
from restir_engine.kernels.core.records import RAY_CAMERA
from restir_engine.kernels.core.vec import store3_f64, vec
from restir_engine.kernels.geometry.camera import camera_ray
from restir_engine.kernels.geometry.intersect import intersect
from restir_engine.kernels.geometry.surface import surface_point
from restir_engine.kernels.shading.interpreter import shader_eval
from restir_engine.settings import RenderSettings
from restir_engine.sync.depsgraph import build_scene
from testing.blender import probe

Build = Callable[[bpy.types.NodeTree], bpy.types.NodeSocket]

PIXELS = 8  # a side of each case
SPACING = 2.0  # between the grids, of which the middle unit is looked at


@dataclass
class Parity:
    """Values (PIXELS, PIXELS, 3) of a case by Cycles and by our program."""

    cycles: np.ndarray
    ours: np.ndarray

    @property
    def error(self) -> float:
        """The largest difference, relative to values above 1."""
        return float(np.max(np.abs(self.ours - self.cycles) / np.maximum(1.0, np.abs(self.cycles))))


def compare(cases: dict[str, Build], scale: float = 1.0, offset: float = 0.0, back: bool = False) -> dict[str, Parity]:
    """Render all cases with Cycles, run their programs at the same points. Emission is value · scale + offset.

    back: the grids are flat shaded and seen from behind.
    """
    bpy.ops.wm.read_factory_settings(use_empty=True)
    columns = int(np.ceil(np.sqrt(len(cases))))
    for index, (name, build) in enumerate(cases.items()):
        _add_grid(name, build, SPACING * (index % columns), SPACING * (index // columns), scale, offset)
        if back:
            _turn_over(bpy.data.objects[name])
    rows = (len(cases) + columns - 1) // columns
    _add_camera(columns, rows)
    theirs = probe.cycles()[..., :3]
    scene = build_scene(bpy.context.evaluated_depsgraph_get(), RenderSettings())
    ours = emission(scene)
    result = {}
    for index, name in enumerate(cases):
        x, y = 2 * PIXELS * (index % columns) + PIXELS // 2, 2 * PIXELS * (index // columns) + PIXELS // 2
        tile = np.s_[y : y + PIXELS, x : x + PIXELS]
        result[name] = Parity((theirs[tile] - offset) / scale, (ours[tile] - offset) / scale)
    return result


def emission(scene) -> np.ndarray:
    """What the programs of a committed scene emit towards its camera: (height, width, 3), bottom row first."""
    width, height = scene.camera.film_size
    camera, sp, closures = (
        np.zeros(1, rec.CAMERA),
        np.zeros(1, rec.SHADING_POINT),
        np.zeros(rec.MAX_CLOSURES, rec.CLOSURE),
    )
    camera[0] = scene.camera.record()
    registers = np.zeros(rec.MAX_REGISTERS + 32)  # with room for rays of the program's own
    sp["closures"], sp["registers"] = address(closures), address(registers)
    scratch = np.zeros(rec.SCRATCH_BYTES + 64, np.uint8)
    start = address(scratch) + -address(scratch) % 64
    out = np.zeros((height, width, 3))
    _shade(scene.record, camera[0], sp[0], start, width, height, address(out))
    return out


@kernel
def _shade(scene, camera, sp, scratch, width, height, out):
    for y in range(height):
        for x in range(width):
            o, d, dp, dd = camera_ray(camera, x + 0.5, y + 0.5, 0.5, 0.5)
            t, instance, primitive, u, v = intersect(scene, scratch, o, d, 0.0, 1e30, RAY_CAMERA)
            if instance >= 0:
                surface_point(scene, sp, instance, primitive, u, v, t, d)
                sp.ray_flags = RAY_CAMERA
                sp.dp = dp + t * dd
                sp.dd = dd
                shader_eval(scene, sp)
                store3_f64(out, 3 * (y * width + x), vec(sp.emission))


def _add_grid(name: str, build: Build, x: float, y: float, scale: float, offset: float) -> None:
    steps = np.linspace(-0.7, 0.7, 6)
    points = [(a, b, 0.2 * np.sin(2.0 * a + 1.0) * np.cos(3.0 * b)) for b in steps for a in steps]
    faces = [(r * 6 + k, r * 6 + k + 1, r * 6 + k + 7, r * 6 + k + 6) for r in range(5) for k in range(5)]
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(points, [], faces)
    mesh.polygons.foreach_set("use_smooth", [True] * len(faces))
    corners = [points[loop.vertex_index] for loop in mesh.loops]
    for uv_name, matrix in (("UVMap", ((0.6, 0.1), (-0.1, 0.5))), ("Second", ((0.0, 1.0), (-1.0, 0.3)))):
        layer = mesh.uv_layers.new(name=uv_name)
        uvs = np.array(corners)[:, :2] @ np.array(matrix).T + 0.5
        layer.uv.foreach_set("vector", uvs.ravel())
    color = mesh.color_attributes.new("Paint", "FLOAT_COLOR", "POINT")
    color.data.foreach_set(
        "color", [c for a, b, z in points for c in (0.5 + 0.4 * a, 0.5 - 0.4 * b, 0.2 + z, 0.7 + 0.2 * b)]
    )
    for domain in ("POINT", "CORNER"):
        stains = mesh.color_attributes.new(f"Bytes of {domain}", "BYTE_COLOR", domain)
        stains.data.foreach_set("color_srgb", [0.8, 0.2, 0.1, 0.6] * len(stains.data))
    heat = mesh.attributes.new("Heat", "FLOAT", "POINT")
    heat.data.foreach_set("value", [a * b + 0.5 for a, b, _ in points])
    mesh.materials.append(emission_material(name, build, scale, offset))
    item = bpy.data.objects.new(name, mesh)
    item.location, item.rotation_euler, item.scale = (x + 0.5, y + 0.5, 0.3), (0.1, -0.2, 0.4), (1.1, 1.3, 0.9)
    item.color = (0.2, 0.4, 0.6, 0.8)
    item.pass_index = 3
    bpy.context.scene.collection.objects.link(item)


def _turn_over(item: bpy.types.Object) -> None:
    item.rotation_euler.x += np.pi
    mesh = bmesh.new()  # a bent quad has two flat normals at the corners of its diagonal, and room for one tangent
    mesh.from_mesh(item.data)
    bmesh.ops.triangulate(mesh, faces=mesh.faces)
    mesh.to_mesh(item.data)
    mesh.free()
    item.data.polygons.foreach_set("use_smooth", [False] * len(item.data.polygons))
    item.data.update()


def emission_material(name: str, build: Build, scale: float = 1.0, offset: float = 0.0) -> bpy.types.Material:
    """A material that emits what `build` returns, times scale plus offset; a shader stands for itself."""
    material = bpy.data.materials.new(name)
    if bpy.app.version < (5, 0, 0):
        material.use_nodes = True
    material.pass_index = 7
    material.cycles.emission_sampling = "NONE"  # it lights nothing: nobody need measure it
    tree = material.node_tree
    tree.nodes.clear()
    emission = tree.nodes.new("ShaderNodeEmission")
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    socket = build(tree)
    if socket.type == "SHADER":
        tree.links.new(socket, output.inputs["Surface"])
        return material
    if (scale, offset) != (1.0, 0.0):
        multiply_add = tree.nodes.new("ShaderNodeVectorMath")
        multiply_add.operation = "MULTIPLY_ADD"
        multiply_add.inputs[1].default_value = (scale,) * 3
        multiply_add.inputs[2].default_value = (offset,) * 3
        tree.links.new(socket, multiply_add.inputs[0])
        socket = multiply_add.outputs[0]
    tree.links.new(socket, emission.inputs["Color"])
    tree.links.new(emission.outputs[0], output.inputs["Surface"])
    return material


def _add_camera(columns: int, rows: int) -> None:
    camera = bpy.data.cameras.new("Camera")
    camera.type = "ORTHO"
    camera.ortho_scale = SPACING * max(columns, rows)
    camera.sensor_fit = "AUTO"
    item = bpy.data.objects.new("Camera", camera)
    # The looked-at unit of a grid is the middle of its tile, which is centred on the grid.
    item.location = (SPACING * columns / 2 - 0.5, SPACING * rows / 2 - 0.5, 5.0)
    scene = bpy.context.scene
    scene.collection.objects.link(item)
    scene.camera = item
    scene.render.resolution_x, scene.render.resolution_y = 2 * PIXELS * columns, 2 * PIXELS * rows
    scene.render.resolution_percentage = 100


def add_node(tree: bpy.types.NodeTree, identifier: str, **settings) -> bpy.types.Node:
    """A new node with attributes set and, for names that are inputs, default values."""
    node = tree.nodes.new(identifier)
    inputs = settings.pop("inputs", {})
    for key, setting in settings.items():
        setattr(node, key, setting)
    for key, setting in inputs.items():
        socket = node.inputs[key] if isinstance(key, int) else next(s for s in node.inputs if s.identifier == key)
        if isinstance(setting, bpy.types.NodeSocket):
            tree.links.new(setting, socket)
        else:
            socket.default_value = setting
    return node
