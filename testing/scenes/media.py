"""Scenes of media without Blender: a cube from -1 to 1 seen along y, programs of media by hand."""

import numpy as np

from restir_engine.kernels.core import records as rec
from restir_engine.kernels.lobes import nodes
from restir_engine.kernels.shading import opcodes as ops
from restir_engine.kernels.shading.opcodes import END
from restir_engine.kernels.volume.phase import PHASE_HG
from restir_engine.scene.camera import Camera
from restir_engine.scene.world import World
from testing.scenes.lights import emission_program, matrix
from testing.scenes.rooms import Builder, program, render, scaled
from testing.scenes.shapes import OUTWARD


def medium(absorption=0.0, scattering=0.0, emission=0.0, g=0.0, glass=None, priority=0):
    """A closed mesh's program: coefficients by scene unit, numbers or rgb; `glass` (roughness, ior) of its surface."""
    rgb = [value for x in (absorption, scattering, emission) for value in np.broadcast_to(x, 3)]
    roughness, ior = glass or (0.0, 1.0)
    constants = [1.0, 1.0, 1.0, *rgb, g, 0.0, roughness, ior]
    flags = rec.MATERIAL_MEDIUM
    surface = (nodes.GLASS, 0, 0, 14, 15, -1, nodes.GGX)
    if glass is None:
        surface = (nodes.TRANSPARENT, 0, 0)
        flags |= rec.MATERIAL_TRANSPARENT | rec.MATERIAL_BOUNDARY
    inside = (ops.VOLUME_COEFFICIENTS, 0, 3, 6, 9, PHASE_HG, 12, 13)
    result = program([surface, (END,), inside], constants, flags=flags, medium_priority=priority)
    result.medium = len(surface) + 1 + 2
    return result


def ramp(absorption=0.0, scattering=0.0, emission=0.0, start=1.0, slope=1.0):
    """A boundary's program whose coefficients are those numbers or rgb times start + slope y in object space."""
    rgb = [value for x in (absorption, scattering, emission) for value in np.broadcast_to(x, 3)]
    constants = [1.0, 1.0, 1.0, *rgb, 0.0, 0.0, start, slope]
    inside = (
        (ops.GEOMETRY, 20, ops.POINT_OBJECT, 0, 12),
        (ops.MULTIPLY, 23, 1, 21, 15),
        (ops.ADD, 23, 1, 23, 14),
        *((ops.MULTIPLY, 24 + k, 1, 3 + k, 23) for k in range(9)),
        (ops.VOLUME_COEFFICIENTS, 0, 24, 27, 30, PHASE_HG, 12, 13),
    )
    surface = (nodes.TRANSPARENT, 0, 0)
    flags = rec.MATERIAL_MEDIUM | rec.MATERIAL_TRANSPARENT | rec.MATERIAL_BOUNDARY
    flags |= rec.MATERIAL_MEDIUM_VARIES | rec.MATERIAL_MEDIUM_TEXTURED
    result = program([surface, (END,), *inside], constants, flags=flags)
    result.medium = len(surface) + 1 + 2
    return result


def grid_medium(name: int, absorption, scattering, g=0.0):
    """A boundary's program whose coefficients, numbers or rgb, are multiplied by the grid of an interned name."""
    rgb = [value for x in (absorption, scattering, 0.0) for value in np.broadcast_to(x, 3)]
    inside = (
        (ops.VOLUME_ATTRIBUTE, 14, name),
        *((ops.MULTIPLY, 18 + 3 * k, 3, 3 + 3 * k, 14) for k in range(2)),
        (ops.VOLUME_COEFFICIENTS, 0, 18, 21, 9, PHASE_HG, 12, 13),
    )
    surface = (nodes.TRANSPARENT, 0, 0)
    flags = rec.MATERIAL_MEDIUM | rec.MATERIAL_TRANSPARENT | rec.MATERIAL_BOUNDARY | rec.MATERIAL_MEDIUM_VARIES
    result = program([surface, (END,), *inside], [1.0, 1.0, 1.0, *rgb, g, 0.0], flags=flags)
    result.medium = len(surface) + 1 + 2
    return result


def stage(world=1.0) -> Builder:
    """Nothing but a world of constant radiance."""
    b = Builder()
    b.scene.world = World(material=b.scene.shaders.add(emission_program(np.broadcast_to(world, 3))))
    return b


def cube(b: Builder, material, center=(0.0, 0.0, 0.0), size=1.0) -> None:
    """A cube with edges of twice the size."""
    b.add(OUTWARD, material, scaled(matrix(center), *np.broadcast_to(size, 3)))


def along_y(width: float = 0.8, y: float = -5.0, size: int = 8) -> Camera:
    """Parallel rays along y; image rows go up along z."""
    pose = np.eye(4)
    pose[:3] = np.column_stack([(1, 0, 0), (0, 0, 1), (0, -1, 0), (0, y, 0)])
    return Camera(kind="ORTHO", to_world=pose, width=size, height=size, screen=(-width, width, -width, width))


def picture(b: Builder, samples: int = 4, camera=None, **settings) -> np.ndarray:
    """The image (height, width, 3) of what has been built, with bounces without end unless told otherwise."""
    many = {name: 1000 for name in ("max_bounces", "volume_bounces", "transmission_bounces", "glossy_bounces")}
    return render(b.finish(camera or along_y()), samples, **many | {"pixel_filter": "BOX"} | settings)
