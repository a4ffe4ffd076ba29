"""A picture whose shutter is open while all that is in it moves: camera, a caster of shadows, emitters, a sheet."""

from dataclasses import replace

import numpy as np

from restir_engine.scene.description import SceneDescription
from restir_engine.scene.instances import InstanceSteps
from restir_engine.scene.lamps import area_lamp
from restir_engine.scene.mesh import Mesh
from restir_engine.scene.shutter import Shutter
from testing.scenes.lights import emission_program, matrix
from testing.scenes.rooms import UNSEEN, Builder, checkered, coated, diffuse, look, scaled
from testing.scenes.shapes import CUBE, QUAD


def move(scene: SceneDescription, steps: dict[int, np.ndarray]) -> None:
    """Let instances be at these matrices, (steps, 3, 4) each, their number odd; the middle one is where they stand."""
    for index, matrices in steps.items():
        matrices = np.asarray(matrices, float).reshape(1, -1, 12)
        scene.instances["to_world"][index] = matrices[0, matrices.shape[1] // 2]
        scene.instance_steps.append(InstanceSteps(np.array([index]), matrices))


def deforming(steps: np.ndarray, triangles) -> Mesh:
    """A mesh whose vertices are (steps, n, 3), their number odd."""
    steps = np.asarray(steps, np.float32)
    mesh = Mesh(steps[len(steps) // 2], np.asarray(triangles))
    mesh.steps = np.pad(steps, ((0, 0), (0, 2), (0, 0)))
    return mesh


def turned(angle: float, location, *factors) -> np.ndarray:
    """A placement that is turned about the vertical."""
    result = scaled(matrix(location), *factors)
    c, s = np.cos(angle), np.sin(angle)
    result[:, :3] = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]) @ result[:, :3]
    return result


def blurred(size: int, textured: bool = True, camera: bool = True) -> SceneDescription:
    """The scene; textured: whether the emission of one of the emitters varies; camera: whether it moves too."""
    b = Builder()
    b.add(QUAD, coated((0.6, 0.55, 0.5), 0.4), scaled(matrix(), 4.0, 4.0, 1.0))
    caster = b.add(CUBE, diffuse((0.7, 0.3, 0.2)), matrix())
    lift = np.array([[[0, 0, -0.6]] * 4, [[0, 0, 0]] * 4, [[0.3, 0, 0.6], [0, 0, -0.4]] * 2])
    sheet = np.array(QUAD[0]) + lift
    b.add(deforming(sheet, QUAD[1]), coated((0.2, 0.5, 0.6), 0.3), scaled(matrix((0.8, 0.3, 0.5)), 0.3, 0.3, 0.5))
    glow = checkered((9.0, 5.0, 2.0), (1.0, 3.0, 9.0), 3.0) if textured else emission_program((6.0, 4.0, 3.0))
    pane = b.add(QUAD, glow, matrix(), UNSEEN)
    flap = np.array([[[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]] * 3, float)
    flap[0, 2:, 2], flap[2, 2:, 2] = -1.5, 1.5
    b.add(
        deforming(flap, QUAD[1]), emission_program((2.0, 3.0, 8.0)), turned(0.4, (0.2, 0.9, 0.8), 0.2, 0.2, 0.2), UNSEEN
    )
    b.lamp(area_lamp(matrix((0.6, -0.8, 2.2), (0.3, -0.4, 1.0)), 0.5 * np.ones(3), 0.5, 0.4, key=1, seen_by=UNSEEN))
    view = look((0.3, -2.6, 1.9), (0.0, 0.0, 0.35), size)
    result = b.describe(view)
    move(
        result,
        {
            caster: [turned(0.5 * k, (-0.5 + 0.25 * k, 0.1, 0.35), 0.3, 0.12, 0.3) for k in (-1, 0, 1)],
            # It lights less on the mean than in the middle: what is lit at one moment alone is found out.
            pane: [
                scaled(matrix((-0.9 + 0.3 * k, -0.3, 0.5 + 0.8 * k * k), (-1.0, 0.9 * k, -0.4)), 0.3, 0.25, 1.0)
                for k in (-1, -0.5, 0, 0.5, 1)
            ],
        },
    )
    if camera:
        views = [look((0.3 + 0.1 * k, -2.6, 1.9), (0.15 * k, 0.0, 0.35), size) for k in (-1, 0, 1)]
        result.camera = replace(view, steps=tuple(views))
    result.shutter = Shutter(np.array([0.2, 1.0, 0.6]))
    return result
