"""HYBRID behind glass and in mirrors: what is seen directly, times what the glass or the mirror leaves of it."""

import numpy as np
import pytest

from restir_engine.kernels.lobes.nodes import GLASS, GLOSSY
from restir_engine.scene.lamps import area_lamp
from restir_engine.scene.mesh import Mesh
from testing.measures import blocks
from testing.scenes.lights import matrix
from testing.scenes.scattering import PARTS, look, render, scatter_scene, singular_program, subsurface_program
from testing.scenes.shapes import icosphere

BOUNDARY, SINGLE, _ = PARTS
COLOR, IOR = (0.9, 0.7, 0.5), 1.5
REFLECTANCE = ((IOR - 1.0) / (IOR + 1.0)) ** 2
# Of a pane that is looked through at a right angle: T² (1 + R² + R⁴ + …).
THROUGH = (1.0 - REFLECTANCE) / (1.0 + REFLECTANCE)
LAMPS = (
    area_lamp(matrix((2.0, 0.0, -2.5), (0.6, 0.0, -0.8)), (60.0,) * 3, 1.0, 1.0),
    area_lamp(matrix((-1.0, 3.0, 0.3), (-0.3, 1.0, 0.1)), (40.0, 60.0, 20.0), 1.0, 1.0),
)
# Paths may bounce between faces of glass, and no light comes from one part of the scene to another.
BOUNCES = {"max_bounces": 8, "diffuse_bounces": 0, "caustics_reflective": False, "caustics_refractive": False}


def quad(corner, x, y) -> np.ndarray:
    """Corners of a parallelogram."""
    corner, x, y = (np.asarray(v, float) for v in (corner, x, y))
    return np.array([corner, corner + x, corner + x + y, corner + y])


def pane() -> Mesh:
    """A sheet of glass above the ball, a tenth thick, wider than the view; its rim is open."""
    top, bottom = quad((-2, -2, 2.1), (4, 0, 0), (0, 4, 0)), quad((-2, -2, 2.0), (4, 0, 0), (0, 4, 0))
    faces = [(0, 1, 2), (0, 2, 3), (4, 6, 5), (4, 7, 6)]
    return Mesh(np.concatenate([top, bottom]), np.array(faces))


def mirror() -> Mesh:
    """A plane at 45° above the ball, in which a view along -x sees it as a view along -z would."""
    return Mesh(quad((-1.5, -2, 1.5), (3, 0, 3), (0, 4, 0)), np.array([(0, 1, 2), (0, 2, 3)]))


def program(entry: str):
    return subsurface_program((0.8, 0.5, 0.3), (1.0, 0.5, 0.25), roughness=0.4, entry=entry)


def picture(behind: str, entry: str, samples: int, name="Subsurface", **settings) -> np.ndarray:
    """A pass of the ball seen along -z: plainly, through glass, or in a mirror."""
    others = {
        "nothing": (),
        "glass": [(pane(), singular_program(GLASS, COLOR, 0.0, IOR))],
        "mirror": [(mirror(), singular_program(GLOSSY, COLOR, 0.0, 0.0, 0.0))],
    }[behind]
    scene = scatter_scene(Mesh(*icosphere(1.0)), program(entry), LAMPS, others=others)
    eye, target = ((5.0, 0.0, 3.0), (0.0, 0.0, 3.0)) if behind == "mirror" else ((0.0, 0.0, 5.0), (0.0, 0.0, 0.0))
    look(scene, eye, target, width=32, height=32, size=2.4)
    image = render(scene, samples, (name,), **BOUNCES | settings)[name]
    return image.swapaxes(0, 1) if behind == "mirror" else image


def same(one: np.ndarray, other: np.ndarray) -> None:
    """Means of blocks of 8 × 8 pixels agree within error bars, from the scatter of the pixels' differences; the whole
    does."""
    difference = blocks(one) - blocks(other)
    error = difference.std(axis=1) / 8.0
    difference = difference.mean(axis=1)
    z = difference / np.maximum(error, 1e-9)
    assert (np.abs(z) > 3.0).mean() < 0.05 and np.abs(z).max() < 5.5
    total, bar = np.abs(difference.sum(axis=0)), np.sqrt((error**2).sum(axis=0))
    assert (total < 4.0 * bar).all()
    assert (blocks(other).mean(axis=(0, 1)) > 0.0).all()


@pytest.mark.parametrize("entry", ["DIFFUSE", "REFRACTIVE"])
@pytest.mark.parametrize(
    ("behind", "factor"), [("glass", np.square(COLOR) * THROUGH), ("mirror", np.array(COLOR))], ids=["glass", "mirror"]
)
def test_hybrid_is_what_is_seen_directly_times_a_factor(behind, factor, entry):
    direct = picture("nothing", entry, 96, sss_method="HYBRID")
    same(picture(behind, entry, 96, sss_method="HYBRID", seed=1), factor * direct)


@pytest.mark.parametrize("events", [0, 1])
def test_traced_terms_behind_glass_equal_limited_walks(events):
    name = (BOUNDARY, SINGLE)[events]
    limited = {"sss_method": "RANDOM_WALK", "sss_max_scatters": events or -1}
    walk = picture("glass", "REFRACTIVE", 128, name, **limited)
    same(walk, picture("glass", "REFRACTIVE", 64, name, sss_method="HYBRID", seed=1))
