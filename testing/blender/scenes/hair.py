"""Hair: strands under the hair BSDFs."""

import bpy
import numpy as np

from .. import kit
from ..registry import scene


def tuft(material, location, seed: int, count: int = 900, points: int = 8):
    """Strands that grow out of half a ball, thinner at their tips."""
    random = np.random.default_rng(seed)
    z, phi = random.uniform(0.0, 1.0, count), random.uniform(0.0, 2.0 * np.pi, count)
    normal = np.stack([np.sqrt(1.0 - z * z) * np.cos(phi), np.sqrt(1.0 - z * z) * np.sin(phi), z], 1)
    t = np.linspace(0.0, 1.0, points)[None, :, None]
    places = normal[:, None] * (0.4 + 0.4 * t) + (0.1 * random.normal(size=(count, 1, 3)) - (0.0, 0.0, 0.2)) * t * t
    data = bpy.data.hair_curves.new("Tuft")
    data.add_curves([points] * count)
    data.position_data.foreach_set("vector", places.astype(np.float32).ravel())
    radius = data.attributes.get("radius") or data.attributes.new("radius", "FLOAT", "POINT")
    radius.data.foreach_set("value", np.tile(0.016 * (1.0 - 0.7 * t.ravel()), count).astype(np.float32))
    data.materials.append(material)
    return kit.add(data, location)


def show(materials) -> None:
    """A row of tufts in the light of a sky and a lamp."""
    kit.floor()
    kit.world(lambda node: node("Background", Strength=0.6))
    kit.light("AREA", 150.0, (2.5, -3.0, 4.5), (0.0, 0.0, 0.5), size=2.0)
    for place, material in enumerate(materials):
        tuft(material, (1.7 * (place - 0.5 * (len(materials) - 1)), 0.0, 0.1), place)


def principled(**keywords):
    """A Principled Hair BSDF; random numbers by strand are switched off by a constant one."""
    return kit.material(lambda node: node("BsdfHairPrincipled", keywords.pop("inputs", None), **keywords))


@scene(2, 48)
def hair_closure():
    """Cycles' own sampling goes beyond the surface's horizon, where its light sampling has nothing: docs/lobes.md."""

    def closure(component: str):
        inputs = {"Color": (0.6, 0.35, 0.15), "Offset": -0.05, "RoughnessU": 0.2, "RoughnessV": 0.5}
        return kit.material(lambda node: node("BsdfHair", inputs, component=component))

    show([closure("Reflection"), closure("Transmission")])


ABSORPTION = {"Absorption Coefficient": (0.1, 0.3, 1.0)}


@scene(3, 192, deep=True)
def hair_chiang():
    show([
        principled(model="CHIANG", parametrization="ABSORPTION", inputs=ABSORPTION, Roughness=0.4, Coat=0.5),
        principled(model="CHIANG", parametrization="COLOR", Color=(0.6, 0.3, 0.1), Radial_Roughness=0.6),
        principled(model="CHIANG", parametrization="MELANIN", Melanin=0.4, Melanin_Redness=0.7, Tint=(0.9, 0.6, 0.8)),
    ])  # fmt: skip
