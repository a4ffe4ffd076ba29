"""Random walks through boxes and balls against tables that others made and against closed forms.

A box far larger than the mean free path is a half space, a flat one a slab. Walks are exact ones but where it says
otherwise. `check` allows a share of the value (half a percent) beside four standard errors of the mean, which must not
be larger than that share themselves.
"""

import iadpython
import numpy as np
import pytest
from scipy.special import expn

from restir_engine.kernels.lobes.closure import ENTRY_SKIN
from testing.kernels.walks import Body, closure, mean, normal_entry
from testing.scenes.shapes import ball, box

TOP = (0, 0.5, 0.25, 0.0, 0.0, 1.0)  # a point of the upper face, seen from above
BOUND = 0.005
WIDE = 2000.0  # half the extent of what stands for infinitely wide

# Single-scattering albedo: plane albedo at normal incidence, albedo under diffuse light (Chandrasekhar's H functions).
HALF_SPACE = {
    0.2: (0.035231, 0.046265),
    0.5: (0.115226, 0.146544),
    0.8: (0.285255, 0.341867),
    0.9: (0.414947, 0.478024),
    0.95: (0.535541, 0.596669),
    0.99: (0.752721, 0.794564),
    0.999: (0.912845, 0.929713),
}


def plate(extent: float, thickness: float) -> Body:
    """A box whose upper face is at z = 0, where single precision is finest."""
    vertices, triangles = box(extent, extent, 0.5 * thickness)
    return Body(vertices - (0.0, 0.0, 0.5 * thickness), triangles)


@pytest.fixture(scope="module")
def half_space() -> Body:
    return plate(WIDE, WIDE)


def check(values, expected, bound=BOUND):
    found, error = mean(values)
    assert abs(found - expected) <= bound * expected + 4.0 * error, f"{found:.5f} ± {error:.5f}, not {expected:.5f}"
    assert error <= bound * expected, f"± {error:.5f} says too little about {expected:.5f}"


@pytest.mark.parametrize("alpha", HALF_SPACE)
def test_half_space(half_space, alpha):
    normal, diffuse = HALF_SPACE[alpha]
    n = {0.2: 300_000, 0.999: 40_000}.get(alpha, 100_000)
    check(half_space.walks(closure(1.0, alpha), TOP, n)[:, 0], diffuse)
    check(half_space.walks(normal_entry(1.0, alpha), TOP, n)[:, 0], normal)


def adding_doubling(alpha, g, thickness):
    """(plane albedo and transmittance at normal incidence, under diffuse light) of a slab without a boundary."""
    return iadpython.Sample(a=alpha, g=g, b=thickness, n=1.0, n_above=1.0, n_below=1.0, quad_pts=16).rt()


@pytest.mark.parametrize("g, alpha, n, bound", [
    (0.0, 0.1, 200_000, 0.01),
    (0.5, 0.1, 400_000, 0.01),
    (0.5, 0.9, 150_000, BOUND),
    (0.5, 0.999, 60_000, 0.01),
    (0.8, 0.5, 300_000, 0.01),
    (0.8, 0.99, 100_000, BOUND),
])  # fmt: skip
def test_half_space_of_forward_scattering(half_space, g, alpha, n, bound):
    normal, _, diffuse, _ = adding_doubling(alpha, g, 1e5)
    check(half_space.walks(closure(1.0, alpha, g), TOP, n)[:, 0], diffuse, bound)
    check(half_space.walks(normal_entry(1.0, alpha, g), TOP, n)[:, 0], normal, 2.0 * bound)


@pytest.mark.parametrize("thickness, alpha, g", [
    (0.5, 0.5, 0.0), (1.0, 0.9, 0.0), (2.0, 0.95, 0.0), (5.0, 1.0, 0.0), (1.0, 0.99, 0.8), (2.0, 0.9, 0.75),
])  # fmt: skip
def test_slab(thickness, alpha, g):
    slab = plate(WIDE, thickness)
    expected = adding_doubling(alpha, g, thickness)
    for medium, reflected, transmitted in (
        (normal_entry(1.0, alpha, g), *expected[:2]),
        (closure(1.0, alpha, g), *expected[2:]),
    ):
        walks = slab.walks(medium, TOP, 150_000)
        up = walks[:, 9] < 2
        check(walks[:, 0] * up, reflected, 0.01)
        check(walks[:, 0] * ~up, transmitted, 0.01)


def test_no_light_is_lost_where_none_is_absorbed():
    """α = 1 and even light: what enters a body comes out of it. A cube, a ball and a stretched ball; any g."""
    wide = np.diag([3.0, 1.0, 0.5, 1.0])
    for body in (Body(*box(1.0, 1.0, 1.0)), Body(*ball()), Body(*ball(), wide)):
        for g in (-0.5, 0.0, 0.7):
            walks = body.walks(closure((2.0, 5.0, 0.1), 1.0, g), TOP, 80_000)
            for channel in range(3):
                check(walks[:, channel], 1.0)


def test_light_that_gets_straight_through():
    """No scattering: 2 E₃(b) through a slab, and 2 (1 - (1 + τ) e^-τ) / τ² through a ball of diameter τ."""
    for b in (0.5, 1.0):
        check(plate(WIDE, b).walks(closure(1.0, 0.5), TOP, 60_000, events=0)[:, 0], 2.0 * expn(3, b), 0.01)
    tau = 2.0
    values = Body(*ball(n=256)).walks(closure(0.5 * tau, 0.5), TOP, 40_000, events=0)[:, 0]
    check(values, 2.0 * (1.0 - (1.0 + tau) * np.exp(-tau)) / tau**2, 0.02)


def test_single_scattering(half_space):
    """α (2/3) (1 - ln 2) under diffuse light; at normal incidence by distance, ∫ e^-z ½ ∫ e^(-z/μ) dμ dz."""
    diffuse = half_space.walks(closure(1.0, 0.7), TOP, 150_000, events=1)[:, 0]
    check(diffuse, 0.7 * 2.0 / 3.0 * (1.0 - np.log(2.0)))
    walks = half_space.walks(normal_entry(1.0, 0.7), TOP, 150_000, events=1)
    check(walks[:, 0], 0.7 * 0.153426)
    distance = np.hypot(walks[:, 3] - 0.5 * WIDE, walks[:, 4] + 0.5 * WIDE)
    for radius, share in ((0.1, 0.2453), (0.5, 0.6889), (1.0, 0.8765)):
        check(walks[:, 0] * (distance < radius), 0.7 * 0.153426 * share, 0.015)


def test_light_leaves_by_the_known_distances(half_space):
    """Energy by distance for α = 0.9208, isotropic, diffuse entry: our own older Monte Carlo, to 0.002."""
    walks = half_space.walks(closure(1.0, 0.9208), TOP, 150_000)
    distance = np.hypot(walks[:, 3] - 0.5 * WIDE, walks[:, 4] + 0.5 * WIDE)
    for radius, energy in ((0.1, 0.0819), (0.5, 0.3253), (1.0, 0.5287), (2.0, 0.7594), (4.0, 0.9320)):
        found = walks[distance < radius, 0].sum() / walks[:, 0].sum()
        assert abs(found - energy) < 0.006, f"{found:.4f} inside {radius}, not {energy}"


def test_channels_do_not_disturb_each_other(half_space):
    """Three media walked at once have the albedos that each has alone; one without weight may hold anything."""
    alphas = (0.99, 0.2, 0.8)
    walks = half_space.walks(closure((1.0, 20.0, 5.0), alphas, 0.0), TOP, 150_000)
    for channel, alpha in enumerate(alphas):
        check(walks[:, channel], HALF_SPACE[alpha][1], 0.01)
    for nothing in (0.0, np.inf, np.nan):
        medium = closure((1.0, nothing, 5.0), (0.99, nothing, 0.8), weight=(1.0, 0.0, 1.0), color=(1.0, 0.0, 1.0))
        walks = half_space.walks(medium, TOP, 50_000)
        assert np.isfinite(walks).all() and not walks[:, 1].any()
        check(walks[:, 0], HALF_SPACE[0.99][1])
        check(walks[:, 2], HALF_SPACE[0.8][1], 0.01)


def test_weight_is_divided_by_color(half_space):
    walks = half_space.walks(closure(1.0, 0.8, weight=(0.5, 1.0, 0.25), color=(0.5, 0.5, 0.25)), TOP, 100_000)
    for channel, factor in enumerate((1.0, 2.0, 1.0)):
        check(walks[:, channel], factor * HALF_SPACE[0.8][1])


def test_transforms_are_those_of_the_shape():
    """A stretched and turned instance scatters as the mesh would that has been stretched and turned itself."""
    vertices, triangles = ball()
    matrix = np.eye(4)
    matrix[:3] = [[2.0, 0.3, 0.0, 5.0], [0.0, 0.5, 0.4, -1.0], [0.1, 0.0, -1.0, 2.0]]
    moved = vertices @ matrix[:3, :3].T + matrix[:3, 3]
    view = np.array([0.0, 0.0, -1.0])
    start = (40, 0.4, 0.3, *view)
    a = Body(vertices, triangles, matrix).walks(closure(2.0, 0.9, 0.3), start, 5000)
    b = Body(moved, triangles).walks(closure(2.0, 0.9, 0.3), start, 5000)
    same = np.isclose(a, b, rtol=1e-2, atol=1e-2).all(1)
    assert same.mean() > 0.97, f"{same.mean():.1%} of the walks end in the same place with the same weight"
    assert np.isclose(a[:, 0].mean(), b[:, 0].mean(), rtol=0.01)


def test_entry_fails_below_the_surface(half_space):
    """Refraction needs to see the closure's normal from the front; Skin enters by chance without it."""
    behind = (0, 0.5, 0.25, 1.0, 0.0, 0.0)  # in the plane of the face
    assert not half_space.walks(normal_entry(1.0, 0.9), behind, 100)[:, 0].any()
    share = (half_space.walks(closure(1.0, 0.99, entry=ENTRY_SKIN), behind, 20_000)[:, 0] > 0.0).mean()
    assert 0.4 < share < 0.5


def test_thin_plates_let_light_through():
    """A thousandth of a mean free path; the triangle that a walk starts from does not end it."""
    walks = plate(10.0, 1e-3).walks(closure(1.0, 0.9), TOP, 20_000)
    assert (walks[:, 0] > 0.0).mean() > 0.999
    check(walks[:, 0] * (walks[:, 9] >= 2), adding_doubling(0.9, 0.0, 1e-3)[3])


def test_cycles_approximations_cost_what_is_said(half_space):
    """256 segments at α = 0.999, similarity at g = 0.8, the floor at α = 0.1: what the setting's description says."""
    darker = mean(half_space.walks(closure(1.0, 0.999), TOP, 40_000, exact=False)[:, 0])[0] / HALF_SPACE[0.999][1]
    assert 0.96 < darker < 0.98
    similar = mean(half_space.walks(closure(1.0, 0.95, 0.8), TOP, 60_000, exact=False)[:, 0])[0] / 0.33197
    assert 1.01 < similar < 1.035
    floor = mean(half_space.walks(closure(1.0, 0.1), TOP, 60_000, exact=False)[:, 0])[0] / 0.0217
    assert 1.04 < floor < 1.09
