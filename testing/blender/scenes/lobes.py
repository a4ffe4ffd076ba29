"""Shiny and clear surfaces."""

import math

import bpy
import numpy as np

from .. import kit
from ..registry import scene


def show(materials, shape: str = "ball", samples_light: float = 120.0) -> None:
    """A row of objects on a checkered floor, in the light of an HDRI and of an area light."""
    checker = kit.material(
        lambda node: node("BsdfDiffuse", Color=node("TexChecker", {"Color1": (0.6, 0.6, 0.6)}, Scale=24.0))
    )
    kit.floor(checker)
    size = 2.0 / (len(materials) + 0.4)
    kit.row(materials, shape, 2.0 * size * (len(materials) - 1), min(size, 0.8))
    kit.light("AREA", samples_light, (2.5, -3.0, 3.5), (0, 0, 0.5), size=1.5)
    kit.hdri("courtyard", 0.8, 40.0)


def bsdf(kind: str, **keywords):
    """A material of one BSDF node."""
    return kit.material(lambda node: node(kind, **keywords))


def over(kind: str, key: str, values, **keywords):
    """One material of a BSDF for each value of an input or property."""
    return [bsdf(kind, **keywords | {key: value}) for value in values]


ROUGHNESS = (0.1, 0.3, 0.6, 1.0)
GOLD = (1.0, 0.7, 0.3)


@scene(2, alike=True)
def metal():
    show(over("BsdfPrincipled", "Roughness", ROUGHNESS, Metallic=1.0, Base_Color=GOLD))


@scene(2, alike=True)
def metal_mirror():
    show([*over("BsdfPrincipled", "Roughness", (0.0, 0.03), Metallic=1.0), bsdf("BsdfAnisotropic", Roughness=0.0)])


@scene(2, alike=True)
def metal_anisotropic():
    def brushed(node, axis, turn):
        tangent = node("Tangent", direction_type="RADIAL", axis=axis)
        inputs = {"Anisotropy": 0.8, "Rotation": turn, "Roughness": 0.3}
        return node("BsdfAnisotropic", inputs, Color=GOLD, Tangent=tangent)

    def principled(node):
        tangent = node("Tangent", direction_type="UV_MAP", uv_map="UVMap")
        inputs = {"Anisotropic": 0.7, "Anisotropic Rotation": 0.1}
        return node("BsdfPrincipled", inputs, Metallic=1.0, Roughness=0.35, Tangent=tangent)

    brushes = (("X", 0.0), ("Z", 0.0), ("Z", 0.25))
    show([*(kit.material(lambda node, b=b: brushed(node, *b)) for b in brushes), kit.material(principled)])


@scene(2)
def metal_f82():
    edge = dict(Base_Color=(0.9, 0.6, 0.4), Edge_Tint=(0.3, 0.6, 0.9), Roughness=0.15)
    copper = dict(IOR=(0.2, 0.9, 1.1), Extinction=(3.9, 2.4, 2.2))
    show(
        [
            bsdf("BsdfMetallic", fresnel_type="F82", **edge),
            bsdf("BsdfMetallic", fresnel_type="F82", **edge | {"Roughness": 0.5}, Anisotropy=0.5),
            bsdf("BsdfMetallic", fresnel_type="PHYSICAL_CONDUCTOR", **copper, Roughness=0.2),
            kit.principled(Metallic=1.0, Base_Color=(0.9, 0.6, 0.4), Specular_Tint=(0.4, 0.6, 1.0), Roughness=0.3),
        ]
    )


@scene(2)
def glossy_models():
    show(
        [*over("BsdfAnisotropic", "distribution", ("BECKMANN", "GGX", "ASHIKHMIN_SHIRLEY", "MULTI_GGX"), Roughness=0.4)]
    )


@scene(2)
def glossy_rough():
    show(
        [
            *over(
                "BsdfAnisotropic",
                "distribution",
                ("BECKMANN", "GGX", "ASHIKHMIN_SHIRLEY", "MULTI_GGX"),
                Roughness=0.9,
                Color=GOLD,
            )
        ]
    )


@scene(2)
def dielectric():
    show(over("BsdfPrincipled", "Roughness", ROUGHNESS, Base_Color=(0.6, 0.1, 0.1)))


@scene(2)
def dielectric_specular():
    base = dict(Base_Color=(0.05, 0.1, 0.3), Roughness=0.2)
    show(
        [
            kit.principled(**base, Specular_IOR_Level=1.0),
            kit.principled(**base, IOR=2.4),
            kit.principled(**base, Specular_Tint=(1.0, 0.3, 0.1), Specular_IOR_Level=0.8),
            kit.principled(**base, Metallic=0.5, Diffuse_Roughness=0.5),
        ]
    )


@scene(2, 256)
def rough_glass():
    show(
        [
            bsdf("BsdfGlass", Roughness=0.2, distribution="BECKMANN"),
            bsdf("BsdfGlass", Roughness=0.2, distribution="GGX", Color=(0.7, 0.9, 0.8)),
            bsdf("BsdfGlass", Roughness=0.6, distribution="MULTI_GGX", Color=(0.7, 0.9, 0.8)),
        ]
    )


@scene(2, 512)
def caustic_glass():
    """Smooth glass between a large light and the floor."""
    kit.floor()
    kit.put("ball", bsdf("BsdfGlass", Roughness=0.0, IOR=1.5), (-0.9, 0, 0.8), 0.7)
    kit.put("monkey", bsdf("BsdfGlass", Roughness=0.0, IOR=1.33, Color=(0.6, 0.9, 0.8)), (1.0, 0, 0.8), 0.7)
    kit.light("AREA", 300, (1.5, 1.5, 4.0), (0, 0, 0.5), size=3.0)
    kit.world(lambda node: node("Background", Color=(0.3, 0.4, 0.5)))


@scene(2, 256)
def refraction():
    show(
        [
            bsdf("BsdfRefraction", Roughness=0.0, IOR=1.2),
            bsdf("BsdfRefraction", Roughness=0.3, IOR=1.45),
            bsdf("BsdfRefraction", Roughness=0.3, IOR=1.45, distribution="BECKMANN"),
        ]
    )


@scene(2, 256, alike=True)
def transmission():
    base = dict(Transmission_Weight=1.0, Base_Color=(0.9, 0.7, 0.5))
    show(
        [
            kit.principled(**base, Roughness=0.0),
            kit.principled(**base, Roughness=0.25),
            kit.principled(**base | {"Transmission_Weight": 0.5}, Roughness=0.1),
        ]
    )


@scene(2)
def coat():
    base = dict(Coat_Weight=1.0, Base_Color=(0.5, 0.1, 0.1), Roughness=0.6)
    show(
        [
            kit.principled(**base, Coat_Roughness=0.0),
            kit.principled(**base, Coat_Roughness=0.2, Coat_Tint=(0.9, 0.6, 0.2)),
            kit.principled(**base, Coat_Roughness=0.1, Coat_IOR=2.0, Metallic=1.0, Coat_Tint=(0.3, 0.6, 0.9)),
            kit.principled(**base | {"Coat_Weight": 0.4}, Coat_Roughness=0.5),
        ]
    )


@scene(2)
def sheen():
    show(
        [
            kit.principled(Base_Color=(0.2, 0.1, 0.3), Roughness=1.0, Sheen_Weight=1.0, Sheen_Roughness=0.3),
            kit.principled(Base_Color=(0.2, 0.1, 0.3), Sheen_Weight=0.7, Sheen_Roughness=0.8, Sheen_Tint=(1, 0.4, 0.2)),
            bsdf("BsdfSheen", Roughness=0.4, distribution="MICROFIBER"),
            bsdf("BsdfSheen", Roughness=0.4, distribution="ASHIKHMIN"),
        ]
    )


@scene(2)
def toon():
    size = dict(Size=0.5, Smooth=0.3, Color=(0.8, 0.5, 0.3))
    show(
        [
            bsdf("BsdfToon", component="DIFFUSE", **size),
            bsdf("BsdfToon", component="GLOSSY", **size),
            bsdf("BsdfToon", component="GLOSSY", Size=0.2, Smooth=0.0),
        ]
    )


@scene(2)
def fresnel_mix():
    def mixed(factor):
        def build(node):
            shiny = node("BsdfAnisotropic", Roughness=0.1)
            return node("MixShader", {0: factor(node), 1: node("BsdfDiffuse", Color=(0.1, 0.4, 0.2)), 2: shiny})

        return kit.material(build)

    show(
        [
            mixed(lambda node: node("Fresnel", IOR=1.6)),
            mixed(lambda node: node("LayerWeight", Blend=0.4).outputs["Facing"]),
            mixed(lambda node: node("LayerWeight", Blend=0.7).outputs["Fresnel"]),
        ],
        "monkey",
    )


def normal_image() -> bpy.types.Image:
    """A tangent-space normal map of round bumps."""
    v, u = np.mgrid[0:64, 0:64] / 64
    x, y = np.sin(8 * math.pi * u), np.sin(8 * math.pi * v)
    n = np.dstack([0.5 * x, 0.5 * y, np.ones_like(x)])
    n /= np.linalg.norm(n, axis=2, keepdims=True)
    return kit.image("Normals", np.dstack([0.5 * n + 0.5, np.ones_like(x)]), "Non-Color")


@scene(2)
def normal_map():
    picture = normal_image()

    def mapped(space, **inputs):
        def build(node):
            keywords = {"uv_map": "UVMap"} if space == "TANGENT" else {}
            color = node("TexImage", image=picture, Vector=node("TexCoord").outputs["UV"])
            normal = node("NormalMap", Color=color, space=space, **keywords, Strength=0.8)
            return node("BsdfPrincipled", Normal=normal, **inputs)

        return kit.material(build)

    show(
        [
            mapped("TANGENT", Roughness=0.3, Base_Color=(0.5, 0.2, 0.1)),
            mapped("TANGENT", Roughness=0.2, Metallic=1.0),
            mapped("OBJECT", Roughness=0.5),
            mapped("WORLD", Roughness=0.5),
        ]
    )


@scene(2, alike=True)
def coat_normal():
    """A bump below a smooth coat, and the other way round."""

    def build(node, socket):
        bump = node("Bump", Height=node("TexNoise", Scale=9.0), Strength=0.6)
        inputs = {"Coat Weight": 1.0, "Coat Roughness": 0.05, socket: bump}
        return node("BsdfPrincipled", inputs, Base_Color=(0.3, 0.05, 0.05))

    show([kit.material(lambda node, s=socket: build(node, s)) for socket in ("Normal", "Coat Normal")])


@scene(2)
def principled_alpha():
    show(
        [
            kit.principled(Alpha=0.4, Base_Color=(0.7, 0.2, 0.1)),
            kit.principled(Emission_Color=(1, 0.5, 0.2), Emission_Strength=1.5, Base_Color=(0.1, 0.1, 0.1)),
            kit.principled(Emission_Strength=0.8, Coat_Weight=1.0, Coat_Tint=(0.4, 0.8, 0.4), Sheen_Weight=0.5),
        ]
    )


@scene(2, 192)
def principled_everything():
    everything = dict(Metallic=0.3, Transmission_Weight=0.4, Coat_Weight=0.5, Sheen_Weight=0.5, Alpha=0.9)
    tints = dict(Base_Color=(0.8, 0.5, 0.3), Coat_Tint=(0.8, 0.9, 1.0), Specular_Tint=(1.0, 0.9, 0.7), Anisotropic=0.4)
    show([kit.principled(**everything, **tints, Roughness=roughness) for roughness in (0.15, 0.5)])


@scene(2, 192, filter_glossy=1.0, caustics_refractive=False, caustics_reflective=False, alike=True)
def without_caustics():
    """Filter glossy, and no caustics."""
    show(
        [
            kit.principled(Metallic=1.0, Roughness=0.05),
            bsdf("BsdfGlass", Roughness=0.0),
            bsdf("BsdfGlass", Roughness=0.3),
        ]
    )


def filmed(**inputs):
    """A Principled BSDF under a film."""
    return bsdf("BsdfPrincipled", **{"Thin_Film_Thickness": 400.0, "Thin_Film_IOR": 1.6} | inputs)


@scene(2)
def film_on_plastic():
    show([filmed(Roughness=r, Thin_Film_Thickness=t, IOR=ior) for r, t, ior in ((0.1, 300.0, 1.5), (0.4, 600.0, 1.2))])


@scene(2)
def film_on_metal():
    show(
        [filmed(Metallic=1.0, Roughness=r, Base_Color=c) for r, c in ((0.15, (0.9, 0.6, 0.5)), (0.4, (0.5, 0.5, 0.6)))]
    )


@scene(2)
def film_on_glass():
    show([filmed(Transmission_Weight=1.0, Roughness=r, Thin_Film_IOR=n) for r, n in ((0.0, 1.33), (0.2, 1.8))])


@scene(2)
def film_by_nodes():
    """Thickness by a texture, with a tint and a level; Metallic and Glass BSDFs where they have films."""

    def varying(node):
        noise = node("TexNoise", Scale=2.0)
        thickness = node("MapRange", {"Value": noise.outputs[0], "To Min": 100.0, "To Max": 700.0})
        inputs = {"Thin Film Thickness": thickness, "Thin Film IOR": 1.4, "Specular IOR Level": 0.8}
        return node("BsdfPrincipled", inputs, Roughness=0.2, Specular_Tint=(0.8, 0.9, 1.0))

    materials = [kit.material(varying)]
    if bpy.app.version >= (5, 0, 0):
        film = {"Thin_Film_Thickness": 350.0, "Thin_Film_IOR": 1.4}
        materials.append(bsdf("BsdfMetallic", fresnel_type="PHYSICAL_CONDUCTOR", Roughness=0.2, **film))
        materials.append(bsdf("BsdfGlass", Roughness=0.1, **film))
    show(materials)
