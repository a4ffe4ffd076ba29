"""What files of strangers have: empty slots, many closures, odd sockets, zones, deep images, rays of shaders, IES."""

import tempfile
from pathlib import Path

import bpy

from .. import kit
from ..image_files import write_png
from ..registry import scene

V5 = bpy.app.version >= (5, 0, 0)

# A luminaire of our own: two planes, brighter to one side.
IES = """IESNA:LM-63-1995
[TEST] none
TILT=NONE
1 1000 1.5 7 3 1 1 0 0 0
1.0 1.0 60
0 10 30 45 60 80 90
0 45 90
900 850 600 300 100 20 0
900 700 650 200 150 30 0
900 600 500 400 50 10 0
"""


def things(materials) -> None:
    """A few shapes near one another on a floor."""
    kit.floor(materials[0])
    places = (("ball", (0.0, 0.0, 0.5), 0.6), ("cube", (1.2, 0.3, 0.3), 0.4), ("monkey", (-1.2, 0.3, 0.5), 0.6))
    for k, (shape, place, size) in enumerate(places):
        kit.put(shape, materials[k % len(materials)], place, size)


@scene(1)
def empty_slots():
    """No slots, an empty one, and a material without an output."""
    kit.floor()
    bare = bpy.data.materials.new("Bare")
    if not V5:
        bare.use_nodes = True
    bare.node_tree.nodes.clear()
    for x, materials in ((-1.4, []), (0.0, [None]), (1.4, [bare])):
        kit.put("monkey", materials, (x, 0.0, 0.6), 0.6)
    kit.lamp()


@scene(1, deep=True)
def many_closures():
    """Forty lobes added up."""

    def build(node):
        total = node("BsdfDiffuse", Color=(0.02, 0.015, 0.01))
        for k in range(39):
            more = node("BsdfDiffuse", Color=(0.01 + 0.0003 * k, 0.015, 0.02), Roughness=0.01 * (k % 5))
            added = node("AddShader")
            added.id_data.links.new(total.outputs[0], added.inputs[0])
            added.id_data.links.new(more.outputs[0], added.inputs[1])
            total = added
        return total

    things([kit.diffuse(), kit.material(build)])
    kit.lamp()


@scene(1, deep=True)
def group_sockets():
    """Numbers, vectors and colours into and out of sockets of other types."""
    group = bpy.data.node_groups.new("Converts", "ShaderNodeTree")
    for name, kind in (("Integer", "Int"), ("Boolean", "Bool"), ("Number", "Float")):
        group.interface.new_socket(name, in_out="INPUT", socket_type=f"NodeSocket{kind}")
        group.interface.new_socket(name, in_out="OUTPUT", socket_type="NodeSocketFloat")
    inside, outside = group.nodes.new("NodeGroupInput"), group.nodes.new("NodeGroupOutput")
    for k in range(3):
        group.links.new(inside.outputs[k], outside.inputs[k])

    def build(node):
        coordinates = node("TexCoord").outputs["Generated"]
        scaled = node("VectorMath", operation="SCALE", inputs={"Vector": coordinates, "Scale": 3.0})
        instance = node("ShaderNodeGroup", node_tree=group)
        separated = node("SeparateXYZ", Vector=scaled)
        for k, source in enumerate((separated.outputs[0], separated.outputs[1], scaled.outputs[0])):
            instance.id_data.links.new(source, instance.inputs[k])
        color = node("CombineXYZ", X=instance.outputs[0], Y=instance.outputs[1], Z=instance.outputs[2])
        return node("BsdfDiffuse", Color=node("VectorMath", operation="SCALE", inputs={"Vector": color, "Scale": 0.3}))

    things([kit.material(build)])
    kit.lamp()


@scene(1, deep=True)
def deep_images():
    """16-bit images with alpha: straight, premultiplied, packed, none; the alpha mixes."""
    materials = []
    with tempfile.TemporaryDirectory() as folder:
        for mode in ("STRAIGHT", "PREMUL", "CHANNEL_PACKED", "NONE"):
            path = Path(folder) / f"{mode}.png"
            write_png(path, (0.4, 0.25, 0.15, 0.5), 16)
            image = bpy.data.images.load(str(path))
            image.alpha_mode = mode
            image.pack()

            def build(node, image=image):
                texture = node("TexImage", image=image)
                inside = node("BsdfDiffuse", Color=texture.outputs["Color"])
                return node("MixShader", {0: texture.outputs["Alpha"], 1: white(node), 2: inside})

            materials.append(kit.material(build))
    kit.floor()
    kit.row(materials, "cube", 4.4)
    kit.lamp()


def white(node):
    """A white diffuse surface."""
    return node("BsdfDiffuse", Color=(0.9, 0.9, 0.9))


@scene(1, deep=True)
def normal_maps_without_uvs():
    """Tangents come from the sphere around the mesh."""

    def build(node):
        normal = node("NormalMap", Color=(0.6, 0.4, 0.9))
        return node("BsdfPrincipled", Normal=normal, Roughness=0.4)

    things([kit.diffuse(), kit.material(build)])
    for thing in bpy.context.scene.objects:
        if thing.type == "MESH":
            while thing.data.uv_layers:
                thing.data.uv_layers.remove(thing.data.uv_layers[0])
    kit.lamp()


@scene(1, deep=True)
def culled():
    """Things beside the frame and far away are left out of a simplified scene."""
    things([kit.diffuse(), kit.diffuse((0.7, 0.3, 0.2))])
    kit.put("ball", kit.emission((1.0, 0.4, 0.2), 20.0), (0.0, -9.0, 2.0), 0.6)
    for thing in bpy.context.scene.objects:
        thing.cycles.use_camera_cull = thing.type == "MESH"
    bpy.context.scene.render.use_simplify = True
    bpy.context.scene.cycles.use_camera_cull = True
    bpy.context.scene.cycles.camera_cull_margin = 0.05
    kit.lamp()


@scene(1, alike=True)
def shader_occlusion():
    """Ambient Occlusion as a colour, near and far, inside, of the object alone."""
    kinds = ({}, {"Distance": 0.4}, {"only_local": True})
    materials = [kit.material(lambda node, k=k: node("Emission", Color=node("AmbientOcclusion", **k))) for k in kinds]
    things(materials)
    inside = kit.material(lambda node: node("Emission", Color=node("AmbientOcclusion", inside=True, Distance=0.5)))
    kit.put("cube", inside, (0.5, -1.2, 0.2), 0.2)


@scene(1, size=(64, 36))
def bevelled():
    """Bevel by radius and number of probes, with smooth shading, and below a bump."""

    def plain(node):
        return node("BsdfDiffuse", Normal=node("Bevel", Radius=0.15, samples=16))

    def few(node):
        return node("BsdfDiffuse", Color=(0.8, 0.5, 0.3, 1), Normal=node("Bevel", Radius=0.08))

    def bumped(node):
        bump = node("Bump", Strength=0.5, Height=node("TexNoise", Scale=4.0))
        return node("BsdfDiffuse", Normal=node("Bevel", Radius=0.2, samples=16, Normal=bump))

    for x, build in ((-1.5, plain), (0.0, few), (1.5, bumped)):
        kit.put("cube", kit.material(build), (x, 0.0, 0.8), 0.55, rotation=(20, 10, 35))
    kit.put("monkey", kit.material(plain), (0.0, -1.4, 0.4), 0.4, smooth=True)
    kit.floor()
    kit.lamp()


@scene(1)
def luminaires():
    """IES of text blocks on lamps of three kinds, turned."""
    text = bpy.data.texts.new("lamp.ies")
    text.from_string(IES)

    def build(node):
        return node("Emission", Strength=node("TexIES", mode="INTERNAL", ies=text, Strength=0.02))

    things([kit.diffuse(), kit.diffuse((0.7, 0.5, 0.3))])
    kit.light("POINT", 60.0, (-1.2, -0.6, 1.8), (-1.0, 0.0, 0.0), build)
    kit.light("SPOT", 120.0, (0.3, -1.0, 2.0), (0.2, 0.1, 0.0), build, shadow_soft_size=0.2, spot_size=2.0)
    kit.light("AREA", 60.0, (1.6, -0.5, 1.8), (1.2, 0.0, 0.0), build, size=0.4)


if V5:

    @scene(1)
    def shader_rays():
        """Raycast downwards and along the normal: whether, how far, what it meets."""

        def build(node, output, down):
            ray = node("Raycast", Length=1.2)
            if down:
                ray.id_data.links.new(node("CombineXYZ", Z=-1.0).outputs[0], ray.inputs["Direction"])
            return node("Emission", Color=ray.outputs[output], Strength=0.8)

        outputs = (("Is Hit", True), ("Hit Distance", False), ("Hit Normal", True))
        things([kit.material(lambda node, o=o: build(node, *o)) for o in outputs])
        kit.put("ball", kit.diffuse(), (0.6, -1.0, 0.3), 0.3)
        kit.lamp(60.0)

    @scene(1, deep=True)
    def working_in_zones():
        """A repeat zone doubles a colour."""

        def build(node):
            start, end = node("ShaderNodeGroup"), None
            tree = start.id_data
            tree.nodes.remove(start)
            start, end = tree.nodes.new("GeometryNodeRepeatInput"), tree.nodes.new("GeometryNodeRepeatOutput")
            start.pair_with_output(end)
            end.repeat_items.clear()
            end.repeat_items.new("RGBA", "Color")
            start.inputs["Iterations"].default_value = 3
            start.inputs["Color"].default_value = (0.1, 0.06, 0.03, 1.0)
            doubled = node("VectorMath", operation="SCALE", inputs={"Vector": start.outputs["Color"], "Scale": 2.0})
            tree.links.new(doubled.outputs[0], end.inputs["Color"])
            return node("BsdfDiffuse", Color=end.outputs["Color"])

        things([kit.diffuse(), kit.material(build)])
        kit.lamp()
