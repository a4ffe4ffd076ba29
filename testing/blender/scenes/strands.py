"""Strands and points: hair curves, particle hair, point clouds."""

from __future__ import annotations

import bpy
import numpy as np

from .. import kit
from ..registry import scene


def fur(count: int, points: int, size: float = 1.5, length: float = 1.2, seed: int = 0) -> np.ndarray:
    """Bent strands on a square of the floor, (count, points, 3)."""
    rng = np.random.default_rng(seed)
    places = np.zeros((count, points, 3))
    places[:, 0, :2] = rng.uniform(-size, size, (count, 2))
    way = rng.normal(0.0, 0.5, (count, 3)) * (1.0, 1.0, 0.0) + (0.0, 0.0, 1.0)
    for k in range(1, points):
        way = way / np.linalg.norm(way, axis=1, keepdims=True) + rng.normal(0.0, 0.25, (count, 3))
        way[:, 2] -= 0.1
        step = way / np.linalg.norm(way, axis=1, keepdims=True) * length / (points - 1)
        places[:, k] = places[:, k - 1] + step
    return places


def curves(places: np.ndarray, radius, material, **placing) -> bpy.types.Object:
    """Hair curves through places (curves, points, 3); radius: a number, or one for each point."""
    data = bpy.data.hair_curves.new("Hair")
    data.add_curves([places.shape[1]] * len(places))
    data.position_data.foreach_set("vector", places.astype(np.float32).ravel())
    radii = np.broadcast_to(np.float32(radius), places.shape[:2]).ravel().copy()
    layer(data, "radius", "FLOAT", "POINT", radii)
    data.materials.append(material)
    return kit.add(data, **placing)


def layer(data, name: str, kind: str, domain: str, values: np.ndarray) -> None:
    """An attribute of curves or a mesh."""
    attribute = data.attributes.get(name) or data.attributes.new(name, kind, domain)
    attribute.data.foreach_set("value" if kind == "FLOAT" else "vector", values.astype(np.float32).ravel())


def points(places: np.ndarray, radii: np.ndarray, material, **placing) -> bpy.types.Object:
    """A point cloud, made of a mesh by geometry nodes, with an attribute "tint" of its own."""
    data = bpy.data.meshes.new("Points")
    data.from_pydata(places.tolist(), [], [])
    layer(data, "size", "FLOAT", "POINT", radii)
    layer(data, "tint", "FLOAT_VECTOR", "POINT", np.random.default_rng(3).random((len(places), 3)))
    thing = kit.add(data, **placing)
    tree = bpy.data.node_groups.new("Points", "GeometryNodeTree")
    tree.interface.new_socket("Geometry", in_out="INPUT", socket_type="NodeSocketGeometry")
    tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    nodes, links = tree.nodes, tree.links
    source, sink = nodes.new("NodeGroupInput"), nodes.new("NodeGroupOutput")
    size, spread = nodes.new("GeometryNodeInputNamedAttribute"), nodes.new("GeometryNodeMeshToPoints")
    size.data_type, size.inputs["Name"].default_value = "FLOAT", "size"
    paint = nodes.new("GeometryNodeSetMaterial")
    paint.inputs["Material"].default_value = material
    links.new(source.outputs[0], spread.inputs["Mesh"])
    links.new(next(output for output in size.outputs if output.enabled), spread.inputs["Radius"])
    links.new(spread.outputs[0], paint.inputs["Geometry"])
    links.new(paint.outputs[0], sink.inputs[0])
    thing.modifiers.new("Points", "NODES").node_group = tree
    return thing


def groom(thing: bpy.types.Object, count: int = 150, **settings) -> bpy.types.Object:
    """Particle hair with the object's second material."""
    particles = thing.modifiers.new("Hair", "PARTICLE_SYSTEM").particle_system.settings
    kit.assign(particles, {"type": "HAIR", "count": count, "hair_length": 0.6, "render_type": "PATH", "material": 2})
    kit.assign(particles, {"radius_scale": 0.05, "brownian_factor": 0.1, **settings})
    return thing


def ground() -> None:
    kit.floor()
    kit.lamp()
    kit.world(lambda node: node("Background", Strength=0.3))


def shape(kind: str) -> None:
    bpy.context.scene.cycles_curves.shape = kind


def half(color) -> bpy.types.Material:
    """Diffuse, half of it transparent."""

    def build(node):
        return node("MixShader", {0: 0.5, 1: node("BsdfTransparent"), 2: node("BsdfDiffuse", Color=color)})

    return kit.material(build)


def cloud(count: int, smallest: float, largest: float) -> tuple[np.ndarray, np.ndarray]:
    """Places and radii of points above the floor."""
    rng = np.random.default_rng(1)
    places = rng.uniform(-1.5, 1.5, (count, 3)) * (1.0, 1.0, 0.4) + (0.0, 0.0, 0.8)
    return places, rng.uniform(smallest, largest, count)


@scene(1)
def ribbons():
    """Hair curves, flat across the ray, that shade like round ones."""
    ground()
    curves(fur(300, 6), 0.02, kit.diffuse((0.7, 0.4, 0.2)))


@scene(1, deep=True)
def tubes():
    """Thick hair curves of few points: open ends, shadows between them."""
    ground()
    shape("THICK")
    curves(fur(40, 4), np.linspace(0.08, 0.03, 4), kit.diffuse((0.7, 0.4, 0.2)))


@scene(1, deep=True, alike=False)
def poly_curves():
    """Curves of type POLY: straight cones with round ends from Blender 5.2 on, ribbons before."""
    ground()
    curves(fur(12, 4), 0.1, kit.diffuse((0.7, 0.4, 0.2))).data.set_types(type="POLY")


@scene(1, deep=True)
def transparent_strands():
    """Alpha in what the camera sees and in shadows."""
    ground()
    curves(fur(60, 4), 0.06, half((0.3, 0.5, 0.7)))


@scene(1, deep=True)
def transparent_tubes():
    """The same of tubes, of which shadow rays count both walls."""
    ground()
    shape("THICK")
    curves(fur(60, 4), 0.06, half((0.3, 0.5, 0.7)))


@scene(1, deep=True)
def translucent_strands():
    """Light goes through in one event."""
    ground()
    shape("THICK")
    curves(fur(100, 6), 0.03, kit.material(lambda node: node("BsdfTranslucent", Color=(0.8, 0.5, 0.3))))


@scene(1, deep=True)
def glowing_strands():
    """Emission of strands is found by rays alone."""
    kit.floor()
    curves(fur(60, 4), 0.04, kit.emission((1.0, 0.6, 0.3), 3.0))


@scene(1, deep=True)
def strand_instances():
    """Hair turned, scaled and placed several times."""
    ground()
    hair = curves(fur(30, 4, 0.4, 0.6), 0.04, kit.diffuse((0.7, 0.4, 0.2)), location=(-1.6, -0.5, 0.0))
    for i in range(4):
        kit.add(hair.data, (-0.7 + 0.8 * i, 0.4 * i - 0.5, 0.1), rotation=(0, 20 * i, 30), scale=0.7 + 0.3 * i)


@scene(1, deep=True)
def stretched_strands():
    """Hair under a matrix that stretches it: its radius grows with the volume."""
    ground()
    hair = curves(fur(60, 4, 0.7), 0.06, kit.diffuse((0.7, 0.4, 0.2)), location=(0.0, 0.0, 0.1))
    hair.scale, hair.rotation_euler = (2.0, 1.0, 0.7), (0.0, 0.35, 0.52)


@scene(1, deep=True)
def strand_data():
    """Curves Info, UV and attributes of hair curves."""
    ground()

    def build(node):
        info = node("HairInfo")
        mixed = node("CombineColor", Red=info.outputs["Intercept"], Green=info.outputs["Random"])
        tint = node("Attribute", attribute_name="tint")
        return node("BsdfDiffuse", Color=node("Mix", {"A_Color": mixed, "B_Color": tint}, data_type="RGBA"))

    hair = curves(fur(60, 5), np.random.default_rng(5).uniform(0.02, 0.08, (60, 5)), kit.material(build))
    layer(hair.data, "tint", "FLOAT_VECTOR", "POINT", np.random.default_rng(9).random((300, 3)))


@scene(1)
def point_cloud():
    """Spheres of many sizes, coloured by Point Info and an attribute."""
    ground()

    def build(node):
        info = node("PointInfo")
        tint = node("Attribute", attribute_name="tint")
        mixed = node("CombineColor", Red=info.outputs["Random"], Green=info.outputs["Radius"], Blue=tint.outputs["Fac"])
        return node("BsdfDiffuse", Color=mixed)

    points(*cloud(200, 0.03, 0.2), kit.material(build))


@scene(1, deep=True)
def transparent_points():
    """Spheres are seen from outside alone: alpha counts once."""
    ground()
    points(*cloud(60, 0.1, 0.25), half((0.3, 0.5, 0.7)))


def furry(**settings) -> bpy.types.Object:
    """A ball with hair."""
    materials = [kit.diffuse((0.8, 0.6, 0.5)), kit.diffuse((0.5, 0.25, 0.1))]
    return groom(kit.put("ball", materials, (0, 0, 0.9), 0.6), **settings)


@scene(1)
def particle_hair():
    """Interpolated children that taper, on skin."""
    ground()
    furry(child_type="INTERPOLATED", rendered_child_count=5, root_radius=0.6, tip_radius=0.1, shape=0.5)


@scene(1, deep=True)
def parents_only():
    """Hair of a hidden emitter, with closed tips, under a scale."""
    ground()
    thing = furry(shape=-0.6, tip_radius=0.3, use_close_tip=True, radius_scale=0.15)
    thing.show_instancer_for_render = False
    thing.scale, thing.rotation_euler = (0.8, 0.6, 0.5), (0.3, 0.5, 0.2)


@scene(1, deep=True)
def hair_on_uv():
    """Simple, spiralling children with the emitter's UV map and colours."""
    ground()

    def build(node):
        checks = node("TexChecker", Vector=node("TexCoord").outputs["UV"], Scale=12.0)
        paint = node("Attribute", attribute_name="Paint")
        return node("BsdfDiffuse", Color=node("Mix", {"A_Color": checks, "B_Color": paint}, data_type="RGBA"))

    thing = kit.put("ball", [kit.diffuse((0.8, 0.6, 0.5)), kit.material(build)], (0, 0, 0.9), 0.6)
    paint = thing.data.color_attributes.new("Paint", "BYTE_COLOR", "CORNER")
    paint.data.foreach_set("color", np.random.default_rng(2).random(4 * len(paint.data)).astype(np.float32))
    groom(thing, 60, child_type="SIMPLE", rendered_child_count=5, kink="SPIRAL")


@scene(1, deep=True)
def hair_of_collections():
    """An emitter that stands in an instanced collection."""
    ground()
    thing = furry(count=60)
    group = bpy.data.collections.new("Group")
    bpy.context.scene.collection.objects.unlink(thing)
    group.objects.link(thing)
    thing.location, thing.scale = (0, 0, 0.5), (0.4, 0.4, 0.4)
    for i in range(4):
        empty = kit.add(None, (-1.5 + i, 0.2 * i, 0), rotation=(0, 0, 30 * i))
        empty.instance_type, empty.instance_collection = "COLLECTION", group
