"""Materials that move the vertices of meshes."""

import bpy

from .. import kit
from ..registry import scene


def displaced(method: str, make):
    """A grey material with a displacement that `make` makes from `node`."""
    return kit.material(
        lambda node: {"Surface": node("BsdfDiffuse", Color=(0.7, 0.7, 0.7)), "Displacement": make(node)},
        displacement_method=method,
    )


def noise(node):
    """Bumps."""
    return node("Displacement", Height=node("TexNoise", Scale=3.0), Midlevel=0.5, Scale=0.6)


def tiles(node):
    """Steps along a UV map."""
    checker = node("TexChecker", Vector=node("TexCoord").outputs["UV"], Scale=6.0)
    return node("Displacement", Height=checker.outputs["Fac"], Midlevel=0.0, Scale=0.15)


def vectors(space: str):
    """Noise in all directions."""
    return lambda node: node(
        "VectorDisplacement", Vector=node("TexNoise", Scale=2.0).outputs["Color"], Midlevel=0.5, Scale=0.8, space=space
    )


def show(materials):
    """A row of turned and stretched balls, subdivided."""
    kit.floor()
    kit.light("AREA", 200.0, (2.5, -3.0, 3.5), (0.0, 0.0, 0.5), size=1.5)
    kit.world(lambda node: node("Background", Strength=0.3))
    for thing in kit.row(materials, "ball", 4.2, 0.55):
        thing.rotation_euler, thing.scale = (0.3, 0.2, 0.5), (0.5, 0.5, 0.6)
        modifier = thing.modifiers.new("Subdivision", "SUBSURF")
        modifier.levels = modifier.render_levels = 2


@scene(1, 128, deep=True)
def displacement():
    show([displaced("DISPLACEMENT", noise), displaced("BOTH", noise), displaced("DISPLACEMENT", tiles)])


@scene(1, 128, deep=True)
def vector_displacement():
    show([displaced("DISPLACEMENT", vectors(space)) for space in ("OBJECT", "TANGENT", "WORLD")])


@scene(1, 128, deep=True)
def flat_displacement():
    """Flat bodies, whose faces stay together, two of them subdivided: evenly, and by their size."""
    show([])
    grown = displaced("DISPLACEMENT", lambda node: node("Displacement", Height=0.2, Midlevel=0.0, Scale=1.0))
    _, even, by_size = kit.row([grown, grown, displaced("DISPLACEMENT", noise)], "cube", 4.2, 0.45)
    modifier = even.modifiers.new("Subdivision", "SUBSURF")
    modifier.levels = modifier.render_levels = 2
    adaptive(by_size)


def adaptive(thing) -> None:
    """Let an object be subdivided by its size."""
    modifier = thing.modifiers.new("Subdivision", "SUBSURF")
    modifier.levels = modifier.render_levels = 0
    if bpy.app.version >= (5, 0, 0):
        modifier.use_adaptive_subdivision = True
    else:
        bpy.context.scene.cycles.feature_set = "EXPERIMENTAL"
        thing.cycles.use_adaptive_subdivision = True
