"""Media that vary in space: textures inside of meshes, grids of voxels, fire, fog of the world.

Cycles 4.5 marches through them; its steps are short here, as its error falls with them (a gradient is 0.7 % off). 5.2
tracks them without bias.
"""

import bpy

from .. import kit
from ..registry import scene
from .volume import JADE, medium, scattering, stage


def steps(rate: float = 0.1, many: int = 1024) -> None:
    """Let Cycles 4.5 take short steps."""
    settings = bpy.context.scene.cycles
    settings.volume_step_rate, settings.volume_max_steps = rate, many


def cloud(
    material, place=(0.0, 0.0, 0.9), size=0.9, n=24, rotation=(0.0, 0.0, 0.0), space="OBJECT"
) -> bpy.types.Object:
    """A Volume object made by geometry nodes: density 0 at the sides, 1 in a corner of a cube from -1 to 1.

    The density is ((1 + x) (2 + y) (3 + z) / 24)², n, n + 3 and n - 5 voxels along the axes.
    """
    tree = bpy.data.node_groups.new("Cloud", "GeometryNodeTree")
    tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    new, link = tree.nodes.new, tree.links.new
    cube, position, split, output = (
        new(kind)
        for kind in ("GeometryNodeVolumeCube", "GeometryNodeInputPosition", "ShaderNodeSeparateXYZ", "NodeGroupOutput")
    )
    setter = new("GeometryNodeSetMaterial")
    setter.inputs["Material"].default_value = material
    link(position.outputs[0], split.inputs[0])

    def math(operation, a, b):
        node = new("ShaderNodeMath")
        node.operation = operation
        for target, value in ((node.inputs[0], a), (node.inputs[1], b)):
            if isinstance(value, (int, float)):
                target.default_value = value
            else:
                link(value, target)
        return node.outputs[0]

    total = 1.0 / 24.0
    for shift, axis in enumerate(split.outputs):
        total = math("MULTIPLY", math("ADD", axis, 1.0 + shift), total)
    link(math("MULTIPLY", total, total), cube.inputs["Density"])
    for axis, k in (("X", n), ("Y", n + 3), ("Z", n - 5)):
        cube.inputs["Resolution " + axis].default_value = k
    link(cube.outputs[0], setter.inputs[0])
    link(setter.outputs[0], output.inputs[0])
    host = bpy.data.objects.new("Cloud", bpy.data.volumes.new("Cloud"))
    host.data.render.space = space
    bpy.context.scene.collection.objects.link(host)
    host.location, host.scale = place, (size,) * 3 if isinstance(size, float) else size
    host.rotation_euler = [angle * 0.0174533 for angle in rotation]
    host.modifiers.new("Cloud", "NODES").node_group = tree
    return host


def noise(node, scale=2.0, **keywords):
    """A noise texture in object coordinates, from 0 up."""
    texture = node("TexNoise", Scale=scale, Vector=node("TexCoord").outputs["Object"], **keywords)
    return node("MapRange", inputs={"From Min": 0.4, "From Max": 0.7, "To Max": 6.0}, Value=texture.outputs[0])


@scene(4, 64, deep=True, volume_bounces=2)
def smoke_textured():
    stage()
    steps()
    kit.put("cube", medium(lambda node: node("VolumePrincipled", Density=noise(node), Color=JADE)), (0, 0, 1.0), 0.9)


@scene(4, 64, deep=True, volume_bounces=2)
def smoke_gradient():
    """Generated coordinates drive the density of one mesh and the colour and anisotropy of another."""

    def rising(node):
        z = node("SeparateXYZ", Vector=node("TexCoord").outputs["Generated"]).outputs[2]
        return node("VolumeScatter", Density=node("Math", {0: z, 1: 6.0}, operation="MULTIPLY"), Color=(0.9, 0.6, 0.3))

    def turning(node):
        x = node("SeparateXYZ", Vector=node("TexCoord").outputs["Generated"]).outputs[0]
        color = kit.ramp(node, x, [(0.0, (0.9, 0.2, 0.2)), (1.0, (0.2, 0.4, 0.9))])
        return node("VolumeScatter", Density=3.0, Color=color, Anisotropy=x)

    stage()
    steps()
    kit.put("ball", medium(rising), (-0.9, 0.0, 0.9), 0.8)
    kit.put("cube", medium(turning), (0.9, 0.0, 0.8), 0.6, rotation=(0.0, 20.0, 30.0))


@scene(4, 64, deep=True, volume_bounces=2)
def smoke_grid():
    """A Volume object, turned and stretched; its own density counts, in object space and in the world's."""
    stage()
    steps()
    smoke = medium(lambda node: node("VolumePrincipled", Density=20.0, Color=(0.8, 0.7, 0.6)))
    cloud(smoke, (-0.9, 0.0, 0.9), (0.6, 0.8, 0.7), rotation=(10.0, 20.0, 30.0))
    cloud(smoke, (0.9, 0.0, 0.8), 0.7, n=9, space="WORLD")


@scene(4, 64, deep=True)
def smoke_fire():
    """A black body whose temperature a grid gives, and emission by an attribute."""

    def fire(node):
        inputs = {"Blackbody Intensity": 1.0, "Temperature Attribute": "density"}
        return node("VolumePrincipled", inputs, Density=4.0, Temperature=2500.0, Color=(0.3, 0.3, 0.3))

    def glow(node):
        density = node("Attribute", attribute_name="density").outputs["Fac"]
        color = kit.ramp(node, density, [(0.1, (0.0, 0.0, 0.0)), (0.3, (0.0, 0.1, 0.6)), (1.0, (1.0, 0.4, 0.1))])
        return node("Emission", Color=color, Strength=4.0)

    stage()
    steps()
    cloud(medium(fire), (-0.9, 0.0, 0.9), 0.8)
    cloud(medium(glow), (0.9, 0.0, 0.9), 0.8)


@scene(4, 96, deep=True, volume_bounces=1)
def smoke_overlapping():
    """A grid, a texture and a medium that is the same everywhere inside of one another, a ball in all of them."""

    def info(node):
        return node("VolumeScatter", Density=node("Math", {0: node("VolumeInfo").outputs["Density"], 1: 8.0},
                    operation="MULTIPLY"), Color=(0.9, 0.5, 0.4))  # fmt: skip

    stage()
    steps()
    cloud(medium(info), (-0.3, 0.0, 0.9), 0.9)
    kit.put(
        "cube", medium(lambda node: node("VolumePrincipled", Density=noise(node), Color=JADE)), (0.4, 0.1, 0.9), 0.8
    )
    kit.put("ball", scattering((0.4, 0.5, 0.9), 0.7), (0.1, 0.0, 0.9), 0.85)
    kit.put("ball", kit.diffuse((0.8, 0.6, 0.2)), (0.1, 0.0, 0.7), 0.4)


@scene(4, 96, deep=True, volume_bounces=1)
def smoke_world():
    """Fog of the world, the same everywhere, seen with a lamp and a mesh."""
    kit.floor(kit.diffuse((0.6, 0.55, 0.5)))
    kit.lamp(600.0)
    kit.put("ball", kit.diffuse((0.8, 0.3, 0.2)), (0.0, 0.0, 0.8), 0.8)
    kit.world(lambda node: {"Volume": node("VolumeScatter", Density=0.06, Color=(0.8, 0.9, 1.0), Anisotropy=0.3)})


@scene(1, 48, volume_bounces=1)
def smoke_beyond():
    """Fog of the world behind what a ray passes or is scattered by, without a floor."""
    kit.put("ball", scattering((0.8, 0.8, 0.8), 0.4), (-0.3, -0.6, 0.9), 0.7)
    kit.put("ball", kit.diffuse((0.8, 0.3, 0.2)), (1.1, 0.0, 0.8), 0.5)
    kit.light("POINT", 100.0, (0.6, 1.6, 1.4), shadow_soft_size=0.1)
    kit.world(lambda node: {"Volume": node("VolumeScatter", Density=0.06, Color=(0.8, 0.9, 1.0))})
