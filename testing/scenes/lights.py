"""Scenes without Blender for tests of lights: programs by hand, lamps, quads."""

import numpy as np

from restir_engine.kernels.core import records as rec
from restir_engine.kernels.shading import opcodes as ops
from restir_engine.scene.description import SceneDescription
from restir_engine.scene.instances import build_instances
from restir_engine.scene.mesh import Mesh
from restir_engine.scene.scene import Scene
from restir_engine.scene.shaders import Program


def emission_program(color, sampling: int = 1) -> Program:
    """A surface, lamp or world that emits a constant radiance."""
    color = tuple(float(c) for c in color)
    code = np.array([ops.EMISSION, 3, 0, 3, 6, ops.END, 0], np.int32)
    constants = np.array([1.0, 1.0, 1.0, *color, 1.0])
    return Program(code, constants, flags=rec.MATERIAL_EMITS, emission_sampling=sampling, emission_estimate=color)


def matrix(location=(0.0, 0.0, 0.0), axis=(0.0, 0.0, 1.0)) -> np.ndarray:
    """A 3x4 placement whose z axis looks along `axis`."""
    z = np.asarray(axis, float) / np.linalg.norm(axis)
    x = np.cross([0.0, 1.0, 0.0] if abs(z[1]) < 0.9 else [1.0, 0.0, 0.0], z)
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(z, x), z, location])


def lamp_description(*lamps) -> SceneDescription:
    """Lamps alone."""
    scene = SceneDescription()
    scene.lights.lamps = np.concatenate(lamps)
    return scene


def lamp_scene(*lamps) -> Scene:
    """A committed scene of lamps alone."""
    return lamp_description(*lamps).commit()


def mesh_description(vertices, triangles, program: Program, matrices=None) -> SceneDescription:
    """Instances of one emissive mesh."""
    scene = SceneDescription()
    scene.shaders.add(program)
    scene.meshes = [Mesh(np.asarray(vertices, np.float32), np.asarray(triangles, np.uint32))]
    matrices = [matrix()] if matrices is None else matrices
    matrices = np.stack([np.asarray(m).reshape(12) for m in matrices])
    scene.material_slots = np.zeros(1, np.int32)
    scene.instances = build_instances(matrices, np.zeros(len(matrices), int), n_materials=1, seen_by=rec.RAY_ALL)
    return scene


def mesh_scene(vertices, triangles, program: Program, matrices=None) -> Scene:
    """A committed scene of instances of one emissive mesh."""
    return mesh_description(vertices, triangles, program, matrices).commit()
