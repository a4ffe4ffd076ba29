"""Textures, coordinates and colour nodes on diffuse surfaces, and closures that only mix and pass light."""

import math

import bpy
import numpy as np

from .. import kit
from ..registry import scene


def painted(build):
    """A diffuse material with the colour that `build` makes."""
    return kit.material(lambda node: node("BsdfDiffuse", Color=build(node)))


def show(builders, shape: str = "cube", size: float = 0.5) -> None:
    """A row of objects under the lamp, one for each colour."""
    kit.floor()
    for thing in kit.row([painted(build) for build in builders], shape, 3.8, size):
        thing.rotation_euler = (0.2, 0.1, 0.6)
    kit.lamp()


def coordinates(node, name: str = "Generated"):
    return node("TexCoord").outputs[name]


@scene(1)
def image_texture():
    """Interpolations, extensions and projections, alpha left out."""
    picture = kit.test_image()

    def flat(**keywords):
        def build(node):
            vector = node("Mapping", Vector=coordinates(node, "UV"), Scale=(2.0, 1.5, 1.0), Location=(-0.4, 0.1, 0))
            return node("TexImage", Vector=vector, image=picture, **keywords)

        return build

    def projected(projection):
        def build(node):
            return node(
                "TexImage", Vector=coordinates(node), image=picture, projection=projection, projection_blend=0.3
            )

        return build

    show(
        [
            flat(interpolation="Linear", extension="REPEAT"),
            flat(interpolation="Closest", extension="MIRROR"),
            flat(interpolation="Cubic", extension="EXTEND"),
            flat(interpolation="Linear", extension="CLIP"),
            projected("BOX"),
            projected("SPHERE"),
            projected("TUBE"),
        ],
        size=0.3,
    )


@scene(1)
def image_spaces():
    """Colour spaces, a float image, and channels that are data."""
    random = np.random.default_rng(3)
    values = np.dstack([random.random((16, 16, 3)), np.ones((16, 16))])
    show(
        [
            lambda node, s=space, f=is_float: node(
                "TexImage", image=kit.image(s, values, s, f), Vector=coordinates(node, "UV")
            )
            for space, is_float in (("sRGB", False), ("Non-Color", False), ("Linear Rec.709", True), ("sRGB", True))
        ]
    )


@scene(1)
def checker_noise():
    def snapped(node):
        return node("VectorMath", {0: coordinates(node), 1: (0.25, 0.25, 0.25)}, operation="SNAP")

    show(
        [
            lambda node: node("TexChecker", Vector=coordinates(node), Scale=4.0),
            lambda node: node("TexNoise", Vector=coordinates(node), Scale=4.0).outputs["Color"],
            lambda node: node("TexNoise", Scale=3.0, Detail=5.5, Distortion=0.6),
            lambda node: node("TexWhiteNoise", Vector=snapped(node)).outputs["Color"],
        ]
    )


@scene(1, alike=True)
def voronoi():
    def cells(**keywords):
        return lambda node: node("TexVoronoi", Vector=coordinates(node), Scale=4.0, **keywords)

    show(
        [
            lambda node: cells()(node).outputs["Color"],
            cells(feature="SMOOTH_F1", Smoothness=0.6),
            cells(feature="DISTANCE_TO_EDGE"),
            cells(feature="F2", distance="MANHATTAN", Detail=2.0),
        ]
    )


@scene(1)
def patterns():
    show(
        [
            lambda node: node("TexBrick", Vector=coordinates(node), Scale=4.0),
            lambda node: node("TexMagic", Vector=coordinates(node), Scale=3.0, turbulence_depth=3),
            lambda node: node("TexWave", Vector=coordinates(node), Scale=2.0, Distortion=3.0),
            lambda node: node("TexWave", Vector=coordinates(node), Scale=2.0, wave_type="RINGS", wave_profile="TRI"),
            lambda node: node("TexGradient", Vector=coordinates(node, "Object"), gradient_type="SPHERICAL"),
            lambda node: node("TexNoise", Vector=coordinates(node), Scale=5.0, noise_type="RIDGED_MULTIFRACTAL"),
        ],
        size=0.35,
    )


@scene(1)
def texture_coordinates():
    def fraction(node, socket):
        return node("VectorMath", {0: socket}, operation="FRACTION")

    show(
        [
            lambda node: coordinates(node),
            lambda node: fraction(node, coordinates(node, "Normal")),
            lambda node: fraction(node, coordinates(node, "Object")),
            lambda node: fraction(node, coordinates(node, "Camera")),
            lambda node: coordinates(node, "Window"),
            lambda node: fraction(node, coordinates(node, "Reflection")),
            lambda node: fraction(node, node("NewGeometry").outputs["Tangent"]),
        ],
        "monkey",
        0.4,
    )


@scene(1)
def color_nodes():
    def base(node):
        return node("TexNoise", Vector=coordinates(node), Scale=2.0).outputs["Color"]

    def mixed(node):
        inputs = {"Factor_Float": 0.8, "A_Color": base(node), "B_Color": (0.9, 0.5, 0.1)}
        return node("Mix", inputs, data_type="RGBA", blend_type="OVERLAY")

    def separated(node):
        hue = node("SeparateColor", Color=base(node), mode="HSV").outputs[0]
        return node("CombineColor", Red=hue, Green=0.6, Blue=0.7, mode="HSV")

    def curved(node):
        result = node("RGBCurve", Color=base(node))
        result.mapping.curves[0].points.new(0.3, 0.7)
        result.mapping.curves[3].points.new(0.6, 0.35)
        result.mapping.update()
        return result

    show(
        [
            lambda node: node("HueSaturation", Color=base(node), Hue=0.7, Saturation=1.4, Value=0.9),
            lambda node: node("BrightContrast", {"Bright": 0.1, "Contrast": 0.6}, Color=base(node)),
            lambda node: node("Gamma", {"Gamma": 2.5}, Color=node("Invert", Color=base(node))),
            curved,
            mixed,
            lambda node: node("RGBToBW", Color=base(node)),
            separated,
        ],
        size=0.35,
    )


@scene(1)
def math_nodes():
    def stripes(node, operation, *values):
        x = node("SeparateXYZ", Vector=coordinates(node)).outputs["X"]
        return node(
            "Math", {0: node("Math", {0: x, 1: 6.0}, operation="MULTIPLY"), 1: 1.7}, operation=operation, use_clamp=True
        )

    def turned(node):
        axis = node("VectorRotate", Vector=coordinates(node, "Object"), Axis=(0.3, 0.5, 1.0), Angle=0.8)
        world = node("VectorTransform", Vector=axis, vector_type="VECTOR", convert_from="OBJECT", convert_to="WORLD")
        return node("VectorMath", {0: world}, operation="ABSOLUTE")

    def curve(node):
        result = node("FloatCurve", Value=node("TexGradient", Vector=coordinates(node)))
        result.mapping.curves[0].points.new(0.3, 0.9)
        result.mapping.update()
        return result

    show(
        [
            *(lambda node, o=operation: stripes(node, o) for operation in ("SINE", "MODULO", "FRACT", "PINGPONG")),
            turned,
            curve,
        ],
        size=0.38,
    )


@scene(1)
def groups():
    """A node group within a group, reroutes, and a muted node."""
    inner = bpy.data.node_groups.new("Inner", "ShaderNodeTree")
    inner.interface.new_socket("Scale", in_out="INPUT", socket_type="NodeSocketFloat")
    inner.interface.new_socket("Color", in_out="OUTPUT", socket_type="NodeSocketColor")
    node = kit.make_nodes(inner)
    scale = inner.nodes.new("NodeGroupInput").outputs["Scale"]
    reroute = inner.nodes.new("NodeReroute")
    inner.links.new(scale, reroute.inputs[0])
    checker = node("TexChecker", Scale=reroute.outputs[0], Color1=(0.9, 0.3, 0.1))
    inner.links.new(checker.outputs["Color"], inner.nodes.new("NodeGroupOutput").inputs["Color"])

    def grouped(scale):
        def build(node):
            group = node("ShaderNodeGroup", node_tree=inner)
            group.inputs["Scale"].default_value = scale
            muted = node("Invert", Color=group.outputs["Color"])
            muted.mute = scale > 5.0
            return muted

        return build

    show([grouped(3.0), grouped(7.0)])


@scene(1)
def bump():
    kit.floor()

    def bumped(height, **keywords):
        def build(node):
            return node("BsdfDiffuse", Color=(0.6, 0.5, 0.4), Normal=node("Bump", Height=height(node), **keywords))

        return kit.material(build)

    def displaced(node):
        height = node("TexNoise", Vector=coordinates(node), Scale=6.0)
        return {"Surface": node("BsdfDiffuse"), "Displacement": node("Displacement", Height=height, Scale=0.2)}

    def tiles(node):
        coordinates = {0: node("TexCoord").outputs["Object"], 1: (0.25, 0.25, 0.25)}  # of a plane: 0 along z
        return node("TexWhiteNoise", Vector=node("VectorMath", coordinates, operation="SNAP").outputs[0])

    if bpy.app.version >= (5, 0, 0):  # before, Cycles' tiles flicker
        kit.put("plane", bumped(tiles, Distance=0.2), (0.0, 1.4, 1.0), 1.5, rotation=(80, 10, 20))
    kit.row(
        [
            bumped(lambda node: node("TexNoise", Vector=coordinates(node), Scale=8.0), Strength=0.8),
            bumped(lambda node: node("TexVoronoi", Scale=6.0), Distance=0.4, Strength=0.6, invert=True),
            bumped(
                lambda node: node("TexImage", image=kit.test_image("Non-Color"), interpolation="Cubic"), Distance=0.1
            ),
            kit.material(displaced),
        ],
        size=0.55,
    )
    kit.lamp()


@scene(1)
def alpha_shadows():
    """Holes from an image's alpha, and coloured veils, in front of lights."""
    kit.floor()
    picture = kit.test_image()

    def holes(node):
        texture = node("TexImage", image=picture, Vector=coordinates(node, "UV"))
        cloth = node("BsdfDiffuse", Color=texture)
        return node("MixShader", {0: texture.outputs["Alpha"], 1: node("BsdfTransparent"), 2: cloth})

    kit.put("plane", kit.material(holes), (0.0, 0.4, 1.1), 1.0, rotation=(60, 0, 20))
    for x, color in ((-1.8, (0.9, 0.3, 0.2)), (1.8, (0.2, 0.5, 0.9))):
        veil = kit.material(lambda node, c=color: node("BsdfTransparent", Color=c))
        kit.put("ball", veil, (x, -0.6, 0.6), 0.5)
    kit.light("SUN", 2.0, (1.0, -1.5, 3.0), angle=math.radians(2))
    kit.light("POINT", 60, (-1, -2.5, 3), shadow_soft_size=0.1)


@scene(1, alike=True)
def oren_nayar():
    kit.floor()
    kit.row([kit.diffuse((0.7, 0.5, 0.4), roughness) for roughness in (0.0, 0.2, 0.5, 1.0)], size=0.55)
    kit.light("POINT", 200, (-1.0, -5.0, 2.5), shadow_soft_size=0.1)
    kit.light("AREA", 60, (3, 2, 2), size=1.0)


@scene(1, alike=True)
def translucent():
    kit.floor()

    def both(node):
        back, front = node("BsdfTranslucent", Color=(0.3, 0.6, 0.1)), node("BsdfDiffuse", Color=(0.2, 0.3, 0.1))
        return node("AddShader", {0: back, 1: front})

    leaf = kit.material(both)
    kit.put("plane", leaf, (-1.0, 0.0, 0.9), 0.8, rotation=(70, 0, 20))
    kit.put("ball", kit.material(lambda node: node("BsdfTranslucent", Color=(0.8, 0.5, 0.4))), (1.1, 0, 0.7), 0.65)
    kit.light("POINT", 150, (-1, 2.5, 2), shadow_soft_size=0.2)
    kit.light("POINT", 60, (2.5, 1.5, 1.5), shadow_soft_size=0.2)


@scene(1, alike=True)
def emission_nodes():
    """Emission that a mix hides in part, and blackbody colours."""
    kit.floor()

    def glowing(node):
        strength = node(
            "MapRange", {"Value": node("TexNoise", Scale=4.0), "From Min": 0.45, "From Max": 0.55, "To Max": 12.0}
        )
        glow = node("Emission", Color=node("Blackbody", Temperature=2200.0), Strength=strength)
        return node("AddShader", {0: node("BsdfDiffuse", Color=(0.05, 0.04, 0.04)), 1: glow})

    kit.row([kit.material(glowing), kit.diffuse(), kit.material(glowing)], size=0.55)
    kit.world(lambda node: node("Background", Strength=0.05))
