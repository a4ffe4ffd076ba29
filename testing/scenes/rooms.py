"""Small scenes without Blender that an integrator renders: a floor, a box, a glossy wall, and one kind of light."""

import numpy as np

from restir_engine.kernels.core import records as rec
from restir_engine.kernels.lobes import nodes
from restir_engine.kernels.shading import opcodes as ops
from restir_engine.kernels.shading.textures.opcodes import CHECKER
from restir_engine.scene.camera import Camera
from restir_engine.scene.description import SceneDescription
from restir_engine.scene.instances import build_instances
from restir_engine.scene.lamps import area_lamp, point_lamp, spot_lamp, sun_lamp
from restir_engine.scene.mesh import Mesh
from restir_engine.scene.scene import Scene
from restir_engine.scene.shaders import Program
from restir_engine.scene.world import World
from restir_engine.session import Session
from restir_engine.settings import RenderSettings
from testing.scenes.lights import emission_program, matrix
from testing.scenes.shapes import CUBE, QUAD


def program(instructions, constants, **fields) -> Program:
    """A program from (opcode, operands…) and the constants that its first registers hold."""
    code = [word for op, *words in instructions for word in (op, len(words), *words)] + [ops.END, 0]
    return Program(np.array(code, np.int32), np.array(constants, np.float64), **fields)


def diffuse(color) -> Program:
    return program([(nodes.DIFFUSE, 0, 3, 6, -1)], [1.0, 1.0, 1.0, *color, 0.0])


def coated(color, roughness: float, share: float = 0.4) -> Program:
    """A diffuse lobe under a rough mirror."""
    lobes = [(nodes.DIFFUSE, 0, 6, 9, -1), (nodes.GLOSSY, 3, 10, 13, 9, 9, -1, -1, nodes.GGX)]
    constants = [*(1.0 - share,) * 3, *(share,) * 3, *color, 0.0, 1.0, 1.0, 1.0, roughness]
    return program(lobes, constants)


def screen(color, opacity: float) -> Program:
    """A diffuse surface that lets a part of the light through."""
    lobes = [(nodes.DIFFUSE, 0, 6, 9, -1), (nodes.TRANSPARENT, 3, 10)]
    constants = [*(opacity,) * 3, *(1.0 - opacity,) * 3, *color, 0.0, 1.0, 0.9, 0.8]
    return program(lobes, constants, flags=rec.MATERIAL_TRANSPARENT)


def checkered(color, other, size: float) -> Program:
    """An emission that changes along the texture coordinates of a lamp or the position on a mesh."""
    code = [(ops.GEOMETRY, 20, ops.POINT_POSITION, 0, 10), (CHECKER, 24, 20, 3, 6, 9), (ops.EMISSION, 0, 24, 11)]
    constants = [1.0, 1.0, 1.0, *color, *other, size, 0.0, 1.0]
    flags = rec.MATERIAL_EMITS | rec.MATERIAL_VARYING_EMISSION
    return program(code, constants, flags=flags, emission_sampling=1, emission_estimate=color)


class Builder:
    """Collects objects and lamps in a description, `scene`, which `finish` commits."""

    def __init__(self) -> None:
        self.scene = SceneDescription()
        self._placed: list[tuple[np.ndarray, int, int, int]] = []
        self._meshes: dict[int, int] = {}

    def add(self, shape, material: Program, place, seen_by: int = rec.RAY_ALL) -> int:
        """Place a `Mesh`, or (vertices, triangles); the index of its instance."""
        index = self._meshes.get(id(shape))
        if index is None:
            index = self._meshes[id(shape)] = len(self.scene.meshes)
            self.scene.meshes.append(shape if isinstance(shape, Mesh) else Mesh(*(np.asarray(a) for a in shape)))
        self._placed.append((np.asarray(place).reshape(12), index, self.scene.shaders.add(material), seen_by))
        return len(self._placed) - 1

    def lamp(self, lamp) -> None:
        self.scene.lights.add(lamp)

    def finish(self, camera: Camera) -> Scene:
        return self.describe(camera).commit()

    def describe(self, camera: Camera) -> SceneDescription:
        matrices, meshes, materials, seen_by = zip(*self._placed, strict=True)
        self.scene.material_slots = np.array(materials, np.int32)
        self.scene.instances = build_instances(
            np.stack(matrices),
            np.array(meshes),
            n_materials=1,
            materials=np.arange(len(meshes)),
            seen_by=np.array(seen_by),
            key=np.arange(len(meshes)) + 1,
        )
        self.scene.camera = camera
        return self.scene


def scaled(place, *factors) -> np.ndarray:
    """A placement with its axes stretched."""
    result = np.array(place, float)
    result[:, :3] *= factors
    return result


def look(location, target, size: int = 64) -> Camera:
    """A camera that sees about two units across at the target."""
    back = np.subtract(location, target).astype(float)
    z = back / np.linalg.norm(back)
    x = np.cross([0.0, 0.0, 1.0], z)
    x /= np.linalg.norm(x)
    pose = np.eye(4)
    pose[:3] = np.column_stack([x, np.cross(z, x), z, location])
    return Camera(to_world=pose, width=size, height=size)


ABOVE = matrix((0.6, -0.8, 2.2), (0.3, -0.4, 1.0))
BESIDE = matrix((-1.2, -0.6, 1.2), (-1.0, -0.4, 0.8))


def room(roughness: float = 0.4) -> Builder:
    """A coated floor, a box, a rough mirror at the back, a half transparent screen."""
    b = Builder()
    b.add(QUAD, coated((0.6, 0.55, 0.5), roughness), scaled(matrix(), 4.0, 4.0, 1.0))
    b.add(CUBE, diffuse((0.7, 0.3, 0.2)), scaled(matrix((-0.5, 0.1, 0.35), (0.0, 0.0, 1.0)), 0.35, 0.25, 0.35))
    b.add(QUAD, coated((0.2, 0.3, 0.6), 0.3, 0.7), scaled(matrix((0.4, 1.2, 0.8), (0.2, -1.0, 0.1)), 1.2, 0.8, 1.0))
    b.add(QUAD, screen((0.3, 0.6, 0.3), 0.5), scaled(matrix((0.6, -0.3, 0.4), (0.5, -0.5, 0.2)), 0.3, 0.3, 1.0))
    return b


# Lights that the camera does not see: the edges of bright ones would be the noisiest in the picture.
UNSEEN = rec.RAY_ALL & ~rec.RAY_CAMERA


def _mesh_light(b: Builder) -> None:
    b.add(QUAD, checkered((30.0, 6.0, 2.0), (1.0, 10.0, 30.0), 7.0), scaled(BESIDE, 0.25, 0.25, 1.0), UNSEEN)
    b.add(CUBE, emission_program((2.0, 3.0, 12.0)), scaled(matrix((0.9, 0.5, 0.3)), 0.1, 0.1, 0.1), UNSEEN)


def _world(b: Builder) -> None:
    b.scene.world = World(material=b.scene.shaders.add(checkered((2.0, 1.0, 0.4), (0.05, 0.1, 0.3), 1.7)), map_width=64)


def _textured_area(b: Builder) -> None:
    material = b.scene.shaders.add(checkered((2.0, 0.2, 0.1), (0.1, 0.5, 2.0), 5.0))
    b.lamp(area_lamp(ABOVE, (40.0, 40.0, 40.0), 1.2, 0.8, material=material, seen_by=UNSEEN))


WHITE = np.ones(3)
LIGHTS = {
    "area": _textured_area,
    "point": lambda b: [
        b.lamp(point_lamp(matrix((-1.2, -0.8, 1.0)), 30.0 * WHITE, 0.25, seen_by=UNSEEN)),
        b.lamp(point_lamp(matrix((1.0, 0.2, 1.6)), (30.0, 5.0, 5.0), 0.2, soft=False, seen_by=UNSEEN)),
        b.lamp(point_lamp(matrix((0.2, -1.0, 1.2)), (5.0, 20.0, 5.0), 0.0)),
    ],
    "spot": lambda b: [
        b.lamp(spot_lamp(ABOVE, 120.0 * WHITE, 0.2, 0.9, 0.4, seen_by=UNSEEN)),
        b.lamp(spot_lamp(BESIDE, (10.0, 30.0, 60.0), 0.0, 0.8, 0.2)),
    ],
    "sun": lambda b: [b.lamp(sun_lamp(ABOVE, 3.0 * WHITE, 0.1)), b.lamp(sun_lamp(BESIDE, (0.2, 0.5, 1.0), 0.0))],
    "mesh": _mesh_light,
    "world": _world,
}


def _many_lights(b: Builder) -> None:
    """Forty coloured points: so many that candidates come from tiles."""
    random = np.random.default_rng(3)
    for color, (x, y, z) in zip(
        random.random((40, 3)), random.random((40, 3)) * [3, 3, 1] + [-1.5, -1.8, 0.9], strict=True
    ):
        b.lamp(point_lamp(matrix((x, y, z)), 3.0 * color, 0.05, seen_by=UNSEEN))


LIGHTS["many"] = _many_lights
LIGHTS["all"] = lambda b: [LIGHTS[name](b) for name in ("area", "point", "sun", "mesh", "world")]


VIEW = (0.4, -3.2, 1.9), (0.0, 0.0, 0.45)  # where the camera of a picture_scene is, and at what it looks


def picture_scene(light: str, size: int = 64) -> Scene:
    """The room under one of the LIGHTS, committed."""
    b = room()
    LIGHTS[light](b)
    return b.finish(look(*VIEW, size))


def render(scene: Scene, samples: int, **settings) -> np.ndarray:
    """The mean of `samples` samples, (height, width, 3)."""
    session = Session(scene, RenderSettings(samples=samples, **settings))
    assert session.render()
    return session.combined()[:, :, :3]


def frames(scene: Scene, samples: int, seeds=range(24), **settings) -> np.ndarray:
    """Means of groups of samples with their own seeds, (groups, height, width, 3), for error bars."""
    return np.stack([render(scene, samples, seed=seed, **settings) for seed in seeds])
