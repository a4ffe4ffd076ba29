"""Rooms with much indirect light: one lit through its doorway, one with a glossy floor and a door ajar, a still life of
glass, one under many lamps. Without Blender; the camera sees no light."""

import numpy as np

from restir_engine.kernels.lobes import nodes
from restir_engine.scene.lamps import area_lamp, point_lamp
from restir_engine.scene.scene import Scene
from restir_engine.scene.shaders import Program
from testing.scenes.lights import matrix
from testing.scenes.rooms import UNSEEN, Builder, coated, diffuse, look, program, scaled
from testing.scenes.shapes import CUBE, ball


def mirror(color, roughness: float) -> Program:
    """A reflection alone."""
    return program([(nodes.GLOSSY, 0, 3, 6, 7, 7, -1, -1, nodes.GGX)], [1.0, 1.0, 1.0, *color, roughness, 0.0])


def glass(roughness: float) -> Program:
    """Clear glass of index 1.45."""
    return program([(nodes.GLASS, 0, 3, 6, 7, -1, nodes.GGX)], [1.0, 1.0, 1.0, 0.95, 1.0, 0.97, roughness, 1.45])


def slab(b: Builder, material: Program, low, high) -> None:
    """A box between two corners."""
    low, high = np.asarray(low, float), np.asarray(high, float)
    b.add(CUBE, material, scaled(matrix(tuple(0.5 * (low + high))), *(0.5 * (high - low))))


def _shell(b: Builder, floor: Program, wall: Program, opening: float) -> None:
    """Two rooms of 4 × 4 × 2.6 m, behind each other along y, and an opening of that width between them at x = 0.6."""
    slab(b, floor, (-2, -2, -0.1), (2, 6.2, 0))
    slab(b, diffuse((0.8, 0.8, 0.8)), (-2, -2, 2.6), (2, 6.2, 2.7))
    slab(b, diffuse((0.7, 0.25, 0.2)), (-2.1, -2, 0), (-2, 6.2, 2.6))
    slab(b, diffuse((0.25, 0.5, 0.3)), (2, -2, 0), (2.1, 6.2, 2.6))
    slab(b, wall, (-2, -2.1, 0), (2, -2, 2.6))
    slab(b, wall, (-2, 6.2, 0), (2, 6.3, 2.6))
    slab(b, wall, (-2, 2, 0), (0.6, 2.1, 2.6))
    slab(b, wall, (0.6 + opening, 2, 0), (2, 2.1, 2.6))
    slab(b, wall, (0.6, 2, 2.1), (0.6 + opening, 2.1, 2.6))


VIEW = (-0.6, -1.9, 1.4), (0.1, 1.0, 0.9)  # where the camera stands and looks to


def _furnished() -> Builder:
    b = Builder()
    _shell(b, diffuse((0.6, 0.5, 0.4)), diffuse((0.75, 0.75, 0.75)), 0.9)
    slab(b, diffuse((0.3, 0.4, 0.7)), (-1.2, 0.6, 0), (-0.5, 1.3, 0.8))
    slab(b, diffuse((0.7, 0.6, 0.3)), (0.2, 0.2, 0), (0.7, 0.7, 0.5))
    return b


def doorway() -> Builder:
    """A diffuse room that is lit by a lamp in the next one, through an open door."""
    b = _furnished()
    b.lamp(area_lamp(matrix((-0.6, 4.4, 2.5), (0.0, 0.0, 1.0)), (300.0, 270.0, 220.0), 0.8, 0.8, seen_by=UNSEEN))
    return b


def ajar() -> Builder:
    """Glossy floor and furniture, a door ajar: light from the next room comes through a gap of 25 cm."""
    b = Builder()
    _shell(b, coated((0.5, 0.4, 0.3), 0.15), diffuse((0.75, 0.75, 0.75)), 0.25)
    slab(b, mirror((0.9, 0.8, 0.6), 0.12), (-1.2, 0.6, 0), (-0.5, 1.3, 0.8))
    b.add(ball(0.35, 32), mirror((0.9, 0.9, 0.9), 0.05), matrix((0.4, 0.4, 0.35)))
    slab(b, coated((0.2, 0.3, 0.6), 0.25), (0.9, 1.0, 0), (1.5, 1.5, 0.6))
    b.lamp(area_lamp(matrix((0.6, 4.4, 2.5), (0.0, 0.0, 1.0)), (900.0, 800.0, 700.0), 0.8, 0.8, seen_by=UNSEEN))
    return b


def still_life() -> Builder:
    """Glass, smooth and rough, before diffuse walls under a broad lamp and its light from the walls."""
    b = Builder()
    _shell(b, diffuse((0.6, 0.5, 0.4)), diffuse((0.75, 0.75, 0.75)), 0.9)
    slab(b, diffuse((0.5, 0.3, 0.2)), (-1.0, 0.0, 0), (1.2, 0.9, 0.7))
    b.add(ball(0.25, 32), glass(0.0), matrix((-0.4, 0.4, 0.96)))
    b.add(ball(0.2, 32), glass(0.25), matrix((0.2, 0.3, 0.91)))
    slab(b, glass(0.1), (0.6, 0.3, 0.71), (0.9, 0.6, 1.2))
    # It shines at the ceiling: what is lit by it is lit indirectly, and glass throws no caustics of it.
    b.lamp(area_lamp(matrix((-1.2, -1.0, 1.6), (0.0, 0.0, -1.0)), (120.0, 110.0, 100.0), 0.5, 0.5, seen_by=UNSEEN))
    return b


def lamps(count: int = 400) -> Builder:
    """The two rooms under small coloured lamps, most of them behind the wall."""
    b = _furnished()
    random = np.random.default_rng(7)
    for place in random.uniform((-1.8, -1.6, 1.8), (1.8, 6.0, 2.5), (count, 3)):
        color = random.uniform(0.1, 1.0, 3) ** 2 * 200.0 / count
        b.lamp(point_lamp(matrix(tuple(place)), color, 0.02, seen_by=UNSEEN))
    return b


SCENES = {"doorway": doorway, "ajar": ajar, "still life": still_life, "400 lamps": lamps}


def interior(name: str, size: int = 64) -> Scene:
    """One of the SCENES, committed."""
    return SCENES[name]().finish(look(*VIEW, size))
