"""HYBRID against closed forms, and against random walks that end after no scattering and after one."""

import numpy as np
import pytest
from scipy.special import expn

from restir_engine.kernels.subsurface.slabs import albedo_of, ball, single
from restir_engine.presets import surface_albedo
from restir_engine.scene.lamps import area_lamp
from restir_engine.scene.mesh import Mesh
from testing.measures import blocks
from testing.scenes.lights import matrix
from testing.scenes.scattering import COSINES, DIFFUSE, PARTS, look, render, scatter_scene, slab, subsurface_program
from testing.scenes.shapes import icosphere

BALL = Mesh(*icosphere(1.0))
BOUNDARY, SINGLE, MULTIPLE = PARTS


def furnace(mesh, program, samples=64, **settings) -> dict[str, tuple[float, float]]:
    """(mean, error) of the passes' first channel for a patch that sees the same everywhere, under an even sky."""
    scene = look(scatter_scene(mesh, program, sky=1.0), (0.0, 0.0, 5.0), width=24, height=24, size=0.5)
    names = ("Combined", *PARTS)
    passes = render(scene, samples, names, **{"sss_method": "HYBRID"} | settings)
    means = {name: passes[name][..., :3].reshape(-1, 3) for name in names}
    return {name: (x.mean(axis=0), x.std(axis=0) / np.sqrt(len(x))) for name, x in means.items()}


def near(found, expected, slack=1e-3):
    mean, error = found
    np.testing.assert_array_less(np.abs(mean - expected), 4.0 * error + slack)


@pytest.mark.parametrize("analog", [False, True])
def test_slab_in_an_even_sky(analog):
    """Boundary 2 E₃(b), single α (R₁ + T₁), and the sum of adding and doubling, in three channels at once."""
    lengths, alpha = np.array([1.0, 0.5, 0.2]), 0.9
    program = subsurface_program(surface_albedo(alpha), lengths, entry="DIFFUSE")
    found = furnace(slab(1.0), program, sss_analog_escape=analog)
    near(found[BOUNDARY], 2.0 * expn(3, 1.0 / lengths))
    near(found[SINGLE], [alpha * sum(single(0.0, COSINES, 1.0 / x)) @ DIFFUSE for x in lengths])
    near(found["Combined"], [0.82746, 0.70273, 0.52976], 8e-3)


def test_the_papers_form_gains_energy_in_thin_slabs():
    found = furnace(slab(0.5), subsurface_program(surface_albedo(0.9), 1.0, entry="DIFFUSE"), sss_thickness_aware=False)
    near(found["Combined"], 1.269, 0.025)


@pytest.mark.parametrize("tau", [0.5, 2.0, 8.0])
def test_straight_light_through_a_ball(tau):
    """2 (1 - (1 + τ) e^-τ) / τ² for an optical diameter of τ."""
    found = furnace(BALL, subsurface_program(0.5, 2.0 / tau, entry="DIFFUSE"))
    near(found[BOUNDARY], 2.0 * (1.0 - (1.0 + tau) * np.exp(-tau)) / tau**2, 3e-3)


@pytest.mark.parametrize("alpha", [0.7, 0.97])
def test_ball_in_an_even_sky(alpha):
    """What scatters twice and more comes out of balls of 2, 8 and 20 mean free paths' diameter as in random walks."""
    lengths = np.array([1.0, 0.25, 0.1])
    found = furnace(BALL, subsurface_program(surface_albedo(alpha), lengths, entry="DIFFUSE"), 128)
    expected = [ball(2.0 / x, np.sqrt([1.0 - alpha]), 200_000)[0] for x in lengths]
    near(found[MULTIPLE], expected, 0.015 * np.array(expected) + 1e-3)


@pytest.mark.parametrize("g", [0.0, 0.6])
@pytest.mark.parametrize("entry", ["DIFFUSE", "REFRACTIVE", "SKIN"])
def test_methods_agree_on_a_dense_object(entry, g):
    """Within 1 % of what a random walk makes of the same entry, in every channel."""
    program = subsurface_program((0.2, 0.5, 0.8), 0.004, g=g, roughness=0.3, entry=entry)
    walk, error = furnace(BALL, program, 192, sss_method="RANDOM_WALK", max_bounces=0)["Combined"]
    for method in ("HYBRID", "DIFFUSION"):
        mean, own = furnace(BALL, program, sss_method=method)["Combined"]
        np.testing.assert_array_less(np.abs(mean / walk - 1.0), 0.01 + 3.0 * (error + own) / walk, method)


SHAPES = {"ball": BALL, "slab": slab(0.4)}


@pytest.mark.parametrize("g", [0.0, 0.7])
@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("events", [0, 1])
def test_traced_terms_equal_limited_walks(shape, g, events):
    """Per block of 8 × 8 pixels within error bars, in colour, under a lamp from behind and the side."""
    lamp = area_lamp(matrix((2.0, 0.0, -2.5), (0.6, 0.0, -0.8)), (60.0,) * 3, 1.0, 1.0)
    program = subsurface_program((0.8, 0.5, 0.3), (1.0, 0.5, 0.25), g=g, roughness=0.4)
    scene = look(scatter_scene(SHAPES[shape], program, [lamp], 0.3), (0.0, 0.0, 5.0), width=32, height=32, size=2.4)
    name = (BOUNDARY, SINGLE)[events]
    limited = {"sss_method": "RANDOM_WALK", "sss_max_scatters": events or -1}
    walk = blocks(render(scene, 128, (name,), **limited)[name])
    traced = blocks(render(scene, 64, (name,), sss_method="HYBRID", seed=1)[name])
    difference = walk.mean(axis=1) - traced.mean(axis=1)
    error = np.sqrt((walk.var(axis=1) + traced.var(axis=1)) / 64)
    z = difference / np.maximum(error, 1e-9)
    assert (np.abs(z) > 3.0).mean() < 0.05 and np.abs(z).max() < 5.5
    total = np.abs(difference.sum(axis=0)) / np.sqrt((error**2).sum(axis=0))
    assert total.max() < 4.0
    assert traced.mean() > 1e-3


def test_nothing_is_left_over():
    """The passes add up to the picture, and no pixel is not a number, where the object is open."""
    vertices, triangles = icosphere(1.0, 3)
    scene = scatter_scene(Mesh(vertices, triangles[::2]), subsurface_program((0.9, 0.5, 0.0), (2.0, 0.1, 0.3)), sky=1.0)
    passes = render(look(scene, (3.0, 2.0, 5.0)), 4, ("Combined", *PARTS), sss_method="HYBRID", max_bounces=3)
    combined = passes["Combined"][..., :3]
    assert np.isfinite(combined).all()
    below = sum(passes[name] for name in PARTS)
    seen = below.sum(axis=-1) > 0.0
    assert seen.mean() > 0.2
    assert (below <= combined * 1.0001 + 1e-6).all()


def test_white_is_white():
    """α near 1 conserves energy: a dense object of colour 1 is as bright as its surroundings."""
    found = furnace(BALL, subsurface_program(1.0, 0.004, entry="DIFFUSE"))
    near(found["Combined"], 1.0, 0.01)
    assert albedo_of(0.0, 0.5) == 1.0
