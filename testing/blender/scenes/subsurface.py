"""Light below surfaces. Lengths are mean free paths in scene units, whatever a method makes of a radius."""

from __future__ import annotations

import math

import bpy

from .. import kit
from ..registry import scene
from .lobes import show

NEW = bpy.app.version >= (5, 2, 0)
# What a radius is by method: 4π of the lengths that walks are made of, or the mean free path itself.
RADIUS_OF_LENGTH = {
    "RANDOM_WALK": 1.0 if NEW else 4.0 * math.pi,
    "RANDOM_WALK_LEGACY": 4.0 * math.pi,
    "RANDOM_WALK_SKIN": 4.0 * math.pi,
    "BURLEY": 4.0 * math.pi,
}
METHODS = ("RANDOM_WALK", "RANDOM_WALK_SKIN", *(("RANDOM_WALK_LEGACY",) if NEW else ()))
SKIN, JADE, RED = (0.8, 0.5, 0.35), (0.3, 0.7, 0.4), (1.0, 0.35, 0.2)


def subsurface(length: float, color=SKIN, method: str = "RANDOM_WALK", radius=RED, **inputs) -> dict:
    """Inputs of Principled for a length and its ratios by channel."""
    factor = RADIUS_OF_LENGTH[method]
    return {
        "Subsurface_Weight": 1.0,
        "Base_Color": color,
        "Subsurface_Scale": factor * length,
        "Subsurface_Radius": radius,
        "subsurface_method": method,
        "Roughness": 0.4,
    } | inputs


def skin(length: float, *args, **keywords) -> bpy.types.Material:
    """A Principled material that scatters."""
    return kit.principled(**subsurface(length, *args, **keywords))


@scene(3, 128, deep=True)
def subsurface_short():
    show([skin(0.01, method=method) for method in METHODS])


@scene(3, 128)
def subsurface_medium():
    show([skin(0.06, method=method) for method in METHODS], "monkey")


@scene(3, 192, deep=True)
def subsurface_long():
    show([skin(0.5, JADE, method) for method in METHODS])


@scene(3, 192, deep=True)
def subsurface_dark_and_bright():
    show([skin(0.05, color) for color in ((0.02, 0.1, 0.2), (0.99, 0.95, 0.9), (0.0, 0.5, 1.0))])


@scene(3, 192)
def subsurface_anisotropic():
    show([skin(0.05, method=m, Subsurface_Anisotropy=g) for m in METHODS for g in (0.4, 0.8)])


@scene(3, 192, alike=False, deep=True)
def subsurface_backward():
    """Backward scattering, which Blender before 5.2 takes for none."""
    show([skin(0.05, JADE, method, Subsurface_Anisotropy=-0.5) for method in METHODS])


@scene(3, 192, cycles_burley_kernel=True)
def subsurface_burley():
    show([skin(0.02, method="BURLEY"), skin(0.1, JADE, "BURLEY"), skin(0.4, method="BURLEY")])


@scene(3, 128, alike=False)
def subsurface_entry():
    """Rough and smooth entries, and IORs."""
    show(
        [
            skin(0.03, Roughness=0.0, IOR=1.1),
            skin(0.03, Roughness=1.0, IOR=2.0),
            skin(0.03, Specular_IOR_Level=0.1),
            skin(0.03, method="RANDOM_WALK_SKIN", Subsurface_IOR=2.0),
        ]
    )


@scene(3, 128, deep=True)
def subsurface_node():
    def scattering(method, **inputs):
        values = {"Color": SKIN, "Scale": 0.05 * RADIUS_OF_LENGTH[method], "Radius": RED}
        return kit.material(lambda node: node("SubsurfaceScattering", values, falloff=method, **inputs))

    show(
        [
            scattering("RANDOM_WALK", Roughness=0.0, IOR=1.3),
            scattering("RANDOM_WALK", Roughness=1.0, IOR=1.6),
            scattering("RANDOM_WALK_SKIN", IOR=1.6),
        ],
        "monkey",
    )


@scene(3, 128)
def subsurface_textured():
    """Colour, radius and weight of textures."""

    def textured(method, *names):
        def build(node):
            noise = node("TexNoise", Scale=5.0, Detail=1.0)
            values = {
                "Base Color": kit.ramp(node, noise, [(0.35, (0.8, 0.2, 0.1)), (0.65, (0.3, 0.8, 0.6))]),
                "Subsurface Radius": noise.outputs["Color"],
                "Subsurface Weight": kit.ramp(node, noise, [(0.4, (0, 0, 0)), (0.6, (1, 1, 1))]),
            }
            plain = {name.replace("_", " "): value for name, value in subsurface(0.1, method=method).items()}
            inputs = {name: value for name, value in plain.items() if name != "subsurface method"}
            linked = {name: values[name] for name in names}
            return node("BsdfPrincipled", inputs | linked, subsurface_method=method)

        return kit.material(build)

    show(
        [
            textured("RANDOM_WALK", "Base Color"),
            textured("RANDOM_WALK", "Subsurface Radius"),
            textured("RANDOM_WALK_SKIN", "Base Color", "Subsurface Radius", "Subsurface Weight"),
        ]
    )


@scene(3, 128)
def subsurface_bump():
    def bumped(kind, **inputs):
        def build(node):
            bump = node("Bump", Height=node("TexNoise", Scale=9.0), Strength=0.7, Distance=0.3)
            return node(kind, Normal=bump, **inputs)

        return kit.material(build)

    node_inputs = {"Scale": 0.03 * RADIUS_OF_LENGTH["RANDOM_WALK"], "Color": JADE, "Radius": RED}
    show(
        [
            bumped("BsdfPrincipled", **subsurface(0.03)),
            bumped("BsdfPrincipled", **subsurface(0.2, method="RANDOM_WALK_SKIN")),
            bumped("SubsurfaceScattering", falloff="RANDOM_WALK", **node_inputs),
        ]
    )


@scene(3, 128, deep=True)
def subsurface_layers():
    """Between the other layers of Principled, and in a mix with other surfaces."""

    def mixed(node):
        scattering = node("BsdfPrincipled", **subsurface(0.06))
        return node("MixShader", {0: 0.6, 1: scattering, 2: node("BsdfAnisotropic", Roughness=0.2)})

    show(
        [
            skin(0.06, Coat_Weight=1.0, Coat_Tint=(0.8, 0.9, 1.0), Sheen_Weight=0.5),
            skin(0.06, Metallic=0.4, Transmission_Weight=0.3),
            skin(0.06, Subsurface_Weight=0.4, Diffuse_Roughness=0.7),
            kit.material(mixed),
        ]
    )


@scene(3, 128, deep=True)
def subsurface_channel_without_radius():
    show([skin(0.1, radius=radius) for radius in ((1.0, 0.0, 0.3), (0.0, 0.0, 1.0), (0.0, 0.0, 0.0))])


@scene(3, 128)
def subsurface_open_meshes():
    """A plane and a sheet that bends: light that leaves by the border is lost."""
    kit.floor()
    kit.put("plane", skin(0.1), (-0.8, 0.0, 0.8), 0.7, rotation=(60, 0, 20))
    kit.put("plane", skin(0.02, JADE), (0.8, 0.0, 0.8), 0.7, rotation=(-70, 0, -10))
    kit.light("AREA", 150.0, (1.5, 3.0, 3.0), (0, 0, 0.8), size=1.5)
    kit.hdri("courtyard", 0.5)


@scene(3, 192)
def subsurface_instances():
    """One mesh in several places: turned, stretched, mirrored. Lengths are those of the scene, not of the object."""
    kit.floor()
    data = kit.mesh("monkey", skin(0.06))
    for x, size, rotation in (
        (-1.5, (0.6, 0.6, 0.6), (0, 0, 30)),
        (0.0, (0.4, 0.9, 0.7), (20, 0, 0)),
        (1.5, (-0.6, 0.6, 0.3), (0, 10, 0)),
    ):
        kit.add(data, (x, 0.0, 0.75), scale=size, rotation=rotation)
    kit.light("AREA", 150.0, (2.0, 2.5, 3.0), (0, 0, 0.8), size=1.5)
    kit.hdri("courtyard", 0.7)


@scene(3, 256)
def subsurface_behind_glass():
    """Seen through a pane, in a mirror, and through thick glass."""
    kit.floor()
    kit.put("ball", skin(0.06), (-0.9, 0.0, 0.6), 0.6)
    kit.put("monkey", skin(0.1, JADE), (0.9, 0.2, 0.6), 0.5)
    mirror = kit.material(lambda node: node("BsdfAnisotropic", Roughness=0.0))
    kit.put("plane", mirror, (0.0, 1.8, 1.5), 1.6, rotation=(80, 0, 0))
    pane = kit.material(lambda node: node("BsdfGlass", Roughness=0.0, IOR=1.45))
    kit.put("cube", pane, (-0.9, -1.2, 0.7), (0.7, 0.05, 0.6))
    kit.light("AREA", 150.0, (2.5, -2.0, 3.0), (0, 0, 0.5), size=1.5)
    kit.hdri("courtyard", 0.6)


@scene(3, 256)
def subsurface_after_diffuse():
    """A white box whose walls see what scatters: a large part of its light has been below a surface."""
    kit.floor(kit.diffuse((0.8, 0.8, 0.8)))
    wall = kit.diffuse((0.8, 0.8, 0.8))
    kit.put("plane", wall, (0.0, 1.6, 1.0), 2.5, rotation=(90, 0, 0))
    kit.put("plane", wall, (-2.0, 0.0, 1.0), 2.5, rotation=(0, 90, 0))
    kit.put("ball", skin(0.3, (0.9, 0.4, 0.2)), (-0.6, 0.4, 0.8), 0.8)
    kit.put("ball", skin(0.05, JADE), (1.2, 0.6, 0.6), 0.6)
    kit.light("AREA", 60.0, (1.5, 0.2, 3.0), (0, 0.6, 0.5), size=0.8)


if NEW:

    @scene(3, 128)
    def subsurface_thin_wall():
        def thin(g, rough, **more):
            return skin(0.05, Thin_Wall=True, Subsurface_Anisotropy=g, Diffuse_Roughness=rough, **more)

        kit.floor()
        sheets = [thin(0.0, 0.0), thin(0.6, 0.0), thin(-0.4, 0.8), thin(0.3, 0.8, Subsurface_Weight=0.5)]
        for x, sheet in zip((-1.8, -0.6, 0.6, 1.8), sheets, strict=True):
            kit.put("plane", sheet, (x, 0.0, 0.8), 0.5, rotation=(80, 0, 15))
        kit.light("AREA", 150.0, (0.5, 3.0, 2.5), (0, 0, 0.8), size=1.5)
        kit.hdri("courtyard", 0.5)
