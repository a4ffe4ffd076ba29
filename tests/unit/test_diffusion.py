"""DIFFUSION rendered: integrals of the profile over whole objects, lit evenly, and what its passes hold.

The sky is found by the paths' last rays alone, so that a pixel's value is the sum of its exits' weights. Errors are
estimated from the scatter of the pixels, which see the same thing.
"""

import numpy as np
import pytest

from restir_engine.scene.lamps import point_lamp
from restir_engine.scene.mesh import Mesh
from testing.scenes.lights import matrix
from testing.scenes.scattering import PARTS, look, render, scatter_scene, subsurface_program
from testing.scenes.shapes import icosphere

BALL = Mesh(*icosphere(1.0))


def furnace(program, samples=64, **settings):
    """(mean, standard error) rgb of the middle of a ball under an even sky of radiance 1."""
    scene = look(scatter_scene(BALL, program, sky=1.0), (0.0, 0.0, 5.0), width=24, height=24, size=0.5)
    image = render(scene, samples, **settings)["Combined"][..., :3].reshape(-1, 3)
    return image.mean(axis=0), image.std(axis=0) / np.sqrt(len(image))


def burley(color, d):
    return subsurface_program(color, 4.0 * np.pi * np.asarray(d), method="BURLEY")


def test_burley_is_the_integral_over_the_surface():
    """1 - ¼e^(-2/d) - ¾e^(-2/3d) of the colour, in each channel at once."""
    d, color = np.array([0.1, 0.2, 0.5]), np.array([0.8, 0.5, 0.2])
    mean, error = furnace(burley(color, d))
    expected = color * (1.0 - 0.25 * np.exp(-2.0 / d) - 0.75 * np.exp(-2.0 / (3.0 * d)))
    np.testing.assert_array_less(np.abs(mean - expected), 4.0 * error + 2e-3 * color)


@pytest.mark.parametrize("d, factor", [(0.05, 1.0198), (0.1, 1.0551), (0.2, 1.1155), (0.5, 1.0305)])
def test_cycles_kernel_has_cycles_energy(d, factor):
    """What Cycles renders of a sphere in a furnace, over its colour (bpy 4.5)."""
    mean, error = furnace(burley(0.5, d), cycles_burley_kernel=True)
    np.testing.assert_array_less(np.abs(mean / 0.5 - factor), 8.0 * error + 4e-3)


def test_a_large_length_is_black_not_wrong():
    """Nearly all of the profile lies beyond the object."""
    mean, _ = furnace(burley(0.5, 1e4), 16)
    assert (mean >= 0.0).all() and (mean < 0.01).all()


def test_a_short_length_is_the_colour():
    mean, error = furnace(burley((0.8, 0.5, 0.2), 1e-3), 16)
    np.testing.assert_array_less(np.abs(mean - [0.8, 0.5, 0.2]), 4.0 * error + 1e-3)


def test_passes_hold_the_picture():
    """Every way a path goes on belongs to the pass of its first scattering: here all is multiple scattering."""
    lamp = point_lamp(matrix((0.0, 2.0, 3.0)), (50.0,) * 3, 0.2)
    scene = scatter_scene(BALL, burley((0.8, 0.5, 0.2), 0.2), [lamp], 0.2)
    look(scene, (0.0, 0.0, 5.0), width=16, height=16, size=1.0)
    passes = render(scene, 4, ("Combined", "Subsurface", *PARTS), max_bounces=4)
    np.testing.assert_allclose(passes["Subsurface"], passes["Combined"][..., :3], rtol=1e-4)
    np.testing.assert_allclose(passes["Subsurface Multiple"], passes["Subsurface"])
    assert passes["Subsurface"].min() > 0.0


def test_random_walks_fill_the_same_passes():
    scene = scatter_scene(BALL, subsurface_program((0.8, 0.5, 0.2), 0.5), sky=1.0)
    look(scene, (0.0, 0.0, 5.0), width=16, height=16, size=1.0)
    passes = render(scene, 8, ("Combined", "Subsurface", *PARTS), max_bounces=4)
    np.testing.assert_allclose(sum(passes[name] for name in PARTS), passes["Combined"][..., :3], rtol=1e-4)
    assert all(passes[name].mean() > 0.01 for name in PARTS)
