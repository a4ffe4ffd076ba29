"""A body that stands on a floor, their faces in one plane: no light comes in from below the floor."""

import numpy as np
import pytest

from restir_engine.kernels.lobes import nodes
from restir_engine.reuse_settings import ReuseSettings
from restir_engine.scene.lamps import area_lamp
from restir_engine.scene.mesh import Mesh
from testing.scenes.lights import matrix
from testing.scenes.rooms import diffuse, program
from testing.scenes.scattering import look, render, scatter_scene, subsurface_program
from testing.scenes.shapes import box

SQUARE = np.array([(-9.0, -9.0), (9.0, -9.0), (9.0, 9.0), (-9.0, 9.0)])
BELOW = [area_lamp(matrix((0.0, 0.0, -1.5), (0.0, 0.0, -1.0)), (90.0, 90.0, 90.0), 2.0, 2.0)]


def sheet(z: float) -> Mesh:
    vertices = np.column_stack([SQUARE, np.full(4, z)]).astype(np.float32)
    return Mesh(vertices, np.array([(0, 1, 2), (0, 2, 3)], np.uint32))


def body(scale: float, **settings) -> np.ndarray:
    """What is seen from above of a box of wax on a grey floor that is lit from below alone; scale: of the whole."""
    vertices, triangles = box(0.5 * scale, 0.4 * scale, 0.3 * scale)
    mesh = Mesh(vertices.astype(np.float32), triangles.astype(np.uint32))
    wax = subsurface_program((0.8, 0.6, 0.4), 0.2 * scale)
    scene = scatter_scene(mesh, wax, BELOW, others=[(sheet(-0.3 * scale), diffuse((0.5, 0.5, 0.5)))])
    return render(look(scene, (0.0, -2.0, 2.0), size=2.0), 8, max_bounces=4, **settings)["Combined"][..., :3]


@pytest.mark.parametrize("method", ["RANDOM_WALK", "DIFFUSION", "HYBRID"])
@pytest.mark.parametrize("integrator", ["PATH", "RESTIR"])
def test_no_light_from_below_the_floor(integrator, method):
    for scale in (1.0, 0.37):
        assert not body(scale, integrator=integrator, sss_method=method).any()


def test_reuse_brings_no_light_from_below_the_floor():
    """Whole paths of neighbors are not connected through the floor under a translucent sheet that juts out over it."""
    place = 0.7
    above = np.nextafter(np.float32(place), np.float32(1.0))
    floor = sheet(place)
    floor.vertices[:, 0] = np.minimum(floor.vertices[:, 0], 0.12)
    others = [(floor, diffuse((0.0, 0.0, 0.0))), (sheet(-0.8), diffuse((0.8, 0.8, 0.8)))]
    lamps = [area_lamp(matrix((0.5, 0.0, 0.2), (0.0, 0.0, 1.0)), (90.0, 90.0, 90.0), 0.5, 0.5)]
    thin = program([(nodes.TRANSLUCENT, 0, 3, -1)], [1.0, 1.0, 1.0, 0.9, 0.9, 0.9])
    scene = look(scatter_scene(sheet(above), thin, lamps, others=others), (0.0, -0.4, 3.0), size=2.0)
    reuse = ReuseSettings(paths="WHOLE", rounds=1)
    found = render(scene, 8, max_bounces=4, integrator="RESTIR", reuse=reuse)["Combined"][..., :3]
    assert not found[:, :35].any()
    assert found[:, 37:].mean() > 0.1
