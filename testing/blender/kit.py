"""Building blocks of the scenes: meshes, node trees, lights, cameras. Everything lands in the current scene."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import bmesh
import bpy
import numpy as np
from mathutils import Matrix, Vector


def reset() -> bpy.types.Scene:
    """A new file with one empty scene, a black world, and the camera that most scenes keep."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    world(lambda node: node("Background", Strength=0.0))
    camera()
    return scene


# Objects


def add(data, location=(0.0, 0.0, 0.0), target=None, scale=1.0, rotation=(0.0, 0.0, 0.0)) -> bpy.types.Object:
    """An object of `data` in the scene; with a `target`, its -Z axis looks there. Angles in degrees."""
    thing = bpy.data.objects.new(data.name if data else "Empty", data)
    bpy.context.scene.collection.objects.link(thing)
    thing.location = location
    thing.scale = (scale,) * 3 if isinstance(scale, (int, float)) else scale
    thing.rotation_euler = [math.radians(angle) for angle in rotation]
    if target is not None:
        thing.rotation_euler = (Vector(target) - Vector(location)).to_track_quat("-Z", "Y").to_euler()
    return thing


def camera(location=(0.0, -6.0, 2.2), target=(0.0, 0.0, 0.7), **properties) -> bpy.types.Object:
    """The scene's camera."""
    data = bpy.data.cameras.new("Camera")
    assign(data, properties)
    bpy.context.scene.camera = add(data, location, target)
    return bpy.context.scene.camera


SHAPES: dict[str, Callable] = {
    "plane": lambda bm: bmesh.ops.create_grid(bm, size=1.0, calc_uvs=True),
    "cube": lambda bm: bmesh.ops.create_cube(bm, size=2.0, calc_uvs=True),
    "ball": lambda bm: bmesh.ops.create_uvsphere(bm, u_segments=48, v_segments=24, radius=1.0, calc_uvs=True),
    "coarse ball": lambda bm: bmesh.ops.create_uvsphere(bm, u_segments=12, v_segments=7, radius=1.0, calc_uvs=True),
    "cylinder": lambda bm: bmesh.ops.create_cone(
        bm, cap_ends=True, segments=48, radius1=1.0, radius2=1.0, depth=2.0, calc_uvs=True
    ),
    "monkey": lambda bm: bmesh.ops.create_monkey(bm, calc_uvs=True),
}
SMOOTH = {"ball", "coarse ball", "monkey"}


def mesh(shape: str, materials=(), smooth: bool | None = None) -> bpy.types.Mesh:
    """A mesh of the `SHAPES` with UVs, about two units wide."""
    data, bm = bpy.data.meshes.new(shape), bmesh.new()
    bm.loops.layers.uv.new("UVMap")
    SHAPES[shape](bm)
    bm.to_mesh(data)
    bm.free()
    is_smooth = shape in SMOOTH if smooth is None else smooth
    data.polygons.foreach_set("use_smooth", np.full(len(data.polygons), is_smooth))
    for item in materials if isinstance(materials, (list, tuple)) else [materials]:
        data.materials.append(item)
    return data


def put(shape: str, material, location=(0.0, 0.0, 0.0), scale=1.0, smooth=None, **placing) -> bpy.types.Object:
    """An object with a mesh of the `SHAPES`."""
    return add(mesh(shape, material, smooth), location, scale=scale, **placing)


def floor(material=None, size: float = 8.0) -> bpy.types.Object:
    """A floor at height 0, grey unless a material is given."""
    return put("plane", material or diffuse(), scale=size)


def row(materials: list, shape: str = "ball", spread: float = 3.6, size: float = 0.62) -> list[bpy.types.Object]:
    """One object for each material, side by side on the floor."""
    places = np.linspace(-spread / 2, spread / 2, len(materials))
    return [put(shape, item, (x, 0.0, size), size) for item, x in zip(materials, places, strict=True)]


def transform(thing: bpy.types.Object, matrix: np.ndarray) -> None:
    """Give an object a matrix that location, rotation and scale cannot express."""
    thing.matrix_world = Matrix(matrix)


# Lights


def light(kind: str, energy: float, location, target=(0.0, 0.0, 0.0), build=None, **properties) -> bpy.types.Object:
    """A POINT, SPOT, SUN or AREA light in watts (suns: W/m²)."""
    data = bpy.data.lights.new(kind.title(), kind)
    data.energy = energy
    assign(data, properties)
    if build:
        tree(data, "OutputLight", build)
    return add(data, location, target)


def lamp(energy: float = 300.0) -> bpy.types.Object:
    """The area light of scenes that are not about lights."""
    return light("AREA", energy, (2.5, -3.0, 4.5), (0.0, 0.0, 0.5), size=2.0)


def world(build: Callable) -> bpy.types.World:
    """The scene's world from a node tree."""
    result = bpy.data.worlds.new("World")
    tree(result, "OutputWorld", build)
    # Cycles bakes a map of the size of an image to sample from, which takes longer than these renders.
    result.cycles.sampling_method, result.cycles.sample_map_resolution = "MANUAL", 256
    bpy.context.scene.world = result
    return result


def hdri(name: str = "studio", strength: float = 1.0, angle: float = 0.0) -> bpy.types.World:
    """A world lit by one of Blender's own HDRIs, turned by `angle` degrees."""
    folder = Path(bpy.utils.system_resource("DATAFILES")) / "studiolights" / "world"
    image = bpy.data.images.load(str(folder / f"{name}.exr"), check_existing=True)

    def build(node):
        vector = node("Mapping", Vector=node("TexCoord").outputs["Generated"], Rotation=(0.0, 0.0, math.radians(angle)))
        return node("Background", Color=node("TexEnvironment", Vector=vector, image=image), Strength=strength)

    return world(build)


# Node trees


def socket(sockets, name):
    """An input or output by index, identifier or name, the enabled one where several share a name.

    Identifiers are the same in all versions; Blender 5.2 calls some sockets by other names.
    """
    if isinstance(name, int):
        return sockets[name]
    same = [item for item in sockets if name in (item.identifier, item.name)]
    return next((item for item in same if item.enabled), same[0])


def make_nodes(owner_tree: bpy.types.NodeTree) -> Callable:
    """A function that adds nodes: `node("BsdfGlass", Roughness=0.1, distribution="GGX")`.

    Keyword arguments are node properties, else inputs (with _ for a blank); `inputs` takes those that are no
    identifiers. An input gets a value, a socket, or a node, whose first output it takes.
    """

    def node(kind: str, inputs: dict | None = None, **keywords) -> bpy.types.Node:
        result = owner_tree.nodes.new(kind if "NodeGroup" in kind else "ShaderNode" + kind)
        properties = {name: value for name, value in keywords.items() if name in result.bl_rna.properties}
        assign(result, properties)
        values = {name.replace("_", " "): value for name, value in keywords.items() if name not in properties}
        for name, value in (values | (inputs or {})).items():
            target = socket(result.inputs, name)
            if isinstance(value, bpy.types.Node):
                value = next(output for output in value.outputs if output.enabled)
            if isinstance(value, bpy.types.NodeSocket):
                owner_tree.links.new(value, target)
            elif isinstance(value, (tuple, list)) and target.type == "RGBA" and len(value) == 3:
                target.default_value = (*value, 1.0)
            else:
                target.default_value = value
        return result

    return node


def tree(owner, output: str, build: Callable) -> None:
    """Replace the node tree of a material, world or light by what `build` returns for its surface."""
    if bpy.app.version < (5, 0, 0) or isinstance(owner, bpy.types.Light):
        owner.use_nodes = True
    owner.node_tree.nodes.clear()
    node = make_nodes(owner.node_tree)
    built = build(node)
    outputs = built if isinstance(built, dict) else {"Surface": built}
    node(output, outputs)


def material(build: Callable, **properties) -> bpy.types.Material:
    """A material from a node tree; `build` returns its surface, or a dict of the output's inputs."""
    result = bpy.data.materials.new("Material")
    tree(result, "OutputMaterial", build)
    assign(result, properties)
    return result


def diffuse(color=(0.5, 0.5, 0.5), roughness: float = 0.0) -> bpy.types.Material:
    """Diffuse BSDF."""
    return material(lambda node: node("BsdfDiffuse", Color=color, Roughness=roughness))


def emission(color=(1.0, 1.0, 1.0), strength: float = 1.0) -> bpy.types.Material:
    """Emission."""
    return material(lambda node: node("Emission", Color=color, Strength=strength))


def principled(**inputs) -> bpy.types.Material:
    """Principled BSDF with inputs by name, _ for a blank."""
    return material(lambda node: node("BsdfPrincipled", **inputs))


def ramp(node: Callable, factor, stops: list[tuple]) -> bpy.types.Node:
    """A colour ramp through `stops` (position, colour)."""
    result = node("ValToRGB", Fac=factor)
    elements = result.color_ramp.elements
    while len(elements) < len(stops):
        elements.new(0.5)
    for element, (position, color) in zip(elements, stops, strict=True):
        element.position, element.color = position, (*color, 1.0)
    return result


def image(name: str, pixels: np.ndarray, color_space: str = "sRGB", is_float: bool = False) -> bpy.types.Image:
    """An image from values (height, width, 4), rows bottom to top."""
    height, width, _ = pixels.shape
    result = bpy.data.images.new(name, width, height, alpha=True, float_buffer=is_float)
    result.colorspace_settings.name = color_space
    result.pixels.foreach_set(np.ascontiguousarray(pixels, np.float32).ravel())
    result.update()
    result.pack()
    return result


def test_image(color_space: str = "sRGB", size: int = 32) -> bpy.types.Image:
    """Tiles of random colours with a gradient and a round hole in the alpha channel of each."""
    values = np.random.default_rng(5).random((8, 8, 3)).repeat(size // 8, 0).repeat(size // 8, 1)
    v, u = np.mgrid[0:size, 0:size] / size
    hole = np.hypot(8 * u % 1 - 0.5, 8 * v % 1 - 0.5) > 0.36
    return image("Tiles", np.dstack([values * (0.4 + 0.6 * u[:, :, None]), hole]), color_space)


def assign(owner, properties: dict) -> None:
    """Set properties by name; a nested one by a dict."""
    for name, value in properties.items():
        if isinstance(value, dict):
            assign(getattr(owner, name), value)
        else:
            setattr(owner, name, value)
