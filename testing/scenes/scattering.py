"""Objects that scatter light below their surface, lit and rendered without Blender."""

import numpy as np

from restir_engine.kernels.core import records as rec
from restir_engine.kernels.lobes.nodes import ENTRIES, GLASS, SUBSURFACE
from restir_engine.kernels.shading import opcodes as ops
from restir_engine.kernels.subsurface.parameters import METHODS, POSITIVE
from restir_engine.scene.camera import Camera
from restir_engine.scene.description import SceneDescription
from restir_engine.scene.instances import build_instances
from restir_engine.scene.mesh import Mesh
from restir_engine.scene.scene import Scene
from restir_engine.scene.shaders import Program
from restir_engine.session import Session
from restir_engine.settings import RenderSettings
from testing.scenes.lights import emission_program, matrix
from testing.scenes.shapes import sheets

_X, _W = np.polynomial.legendre.leggauss(24)
COSINES, DIFFUSE = 0.5 * (_X + 1.0), 0.5 * _W * (_X + 1.0)  # weights of diffuse light
PARTS = ("Subsurface Boundary", "Subsurface Single", "Subsurface Multiple")


def subsurface_program(color, radius, g=0.0, roughness=0.5, ior=1.4, method="RANDOM_WALK", entry="METHOD") -> Program:
    """One Subsurface Scattering node of constant inputs; radius: scene units, the mean free path for RANDOM_WALK."""
    color, radius = np.broadcast_to(color, 3), np.broadcast_to(radius, 3)
    constants = np.array([1.0, 1.0, 1.0, *color, 1.0, *radius, ior, roughness, g], float)
    words = [0, 3, 6, 7, 10, 11, 12, -1, METHODS[method], ENTRIES[entry], POSITIVE]
    code = np.array([SUBSURFACE, len(words), *words, ops.END, 0], np.int32)
    burley = rec.MATERIAL_BURLEY if method == "BURLEY" else 0
    return Program(code, constants, flags=rec.MATERIAL_SUBSURFACE | burley)


def singular_program(opcode: int, *inputs) -> Program:
    """A Glass (colour, 0, IOR) or Glossy (colour, 0, 0, 0) node, as smooth as can be."""
    constants, words = [1.0, 1.0, 1.0], [0]
    for value in inputs:
        words.append(len(constants))
        constants += list(np.atleast_1d(value))
    words += [-1, 0] if opcode == GLASS else [-1, -1, 0]
    return Program(np.array([opcode, len(words), *words, ops.END, 0], np.int32), np.array(constants, float))


def scatter_scene(mesh: Mesh, program: Program, lamps=(), sky=0.0, others=()) -> SceneDescription:
    """An object at its own place under lamps and an even sky of radiance `sky`.

    others: (mesh, program) of further objects.
    """
    scene = SceneDescription()
    objects = [(mesh, program), *others]
    scene.meshes = [item for item, _ in objects]
    scene.material_slots = np.array([scene.shaders.add(item) for _, item in objects], np.int32)
    places, index = np.tile(matrix().reshape(1, 12), (len(objects), 1)), np.arange(len(objects))
    scene.instances = build_instances(places, index, materials=index, n_materials=1, seen_by=rec.RAY_ALL)
    if len(lamps):
        scene.lights.lamps = np.concatenate(lamps)
    if np.any(sky):
        scene.world.material = scene.shaders.add(emission_program(np.broadcast_to(sky, 3), sampling=0))
    return scene


def look(scene: SceneDescription, eye, target=(0.0, 0.0, 0.0), width=64, height=64, size=2.0) -> SceneDescription:
    """An orthographic view of `size` scene units across, upright."""
    place = np.eye(4)
    z = np.subtract(eye, target, dtype=float)
    z /= np.linalg.norm(z)
    x = np.cross((0.0, 1.0, 0.0) if abs(z[2]) > 0.99 else (0.0, 0.0, 1.0), z)
    x /= np.linalg.norm(x)
    place[:3, :3] = np.column_stack([x, np.cross(z, x), z])
    place[:3, 3] = eye
    half, ratio = 0.5 * size, height / width
    screen = (-half, half, -half * ratio, half * ratio)
    scene.camera = Camera("ORTHO", place, width, height, screen=screen)
    return scene


def render(
    scene: Scene | SceneDescription, samples: int, passes=("Combined",), threads=1, **settings
) -> dict[str, np.ndarray]:
    """The passes (height, width, channels) after so many samples; no bounces between objects unless asked for."""
    defaults = {"max_bounces": 0, "pixel_filter": "BOX", "samples": samples, "threads": threads}
    session = Session(scene, RenderSettings(passes=frozenset(passes), **defaults | settings))
    session.render()
    return {name: session.film.pass_array(name) for name in passes}


def scene_of(vertices, triangles, placement=None) -> Scene:
    """A committed scene of one object that scatters light."""
    scene = SceneDescription()
    scene.shaders.add(Program(flags=rec.MATERIAL_SUBSURFACE))
    scene.meshes = [Mesh(np.asarray(vertices, np.float32), np.asarray(triangles, np.uint32))]
    scene.material_slots = np.zeros(1, np.int32)
    place = (matrix() if placement is None else np.asarray(placement)).reshape(1, 12)
    scene.instances = build_instances(place, np.zeros(1, int), n_materials=1, seen_by=rec.RAY_ALL)
    return scene.commit()


def slab(b: float) -> Mesh:
    """Two planes b apart, seen from above."""
    vertices, triangles = sheets(0.0, -b)
    triangles[1] = triangles[1][::-1]
    return Mesh(vertices, triangles)
