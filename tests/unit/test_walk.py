"""Random walks through boxes and balls against tables: a box far larger than the mean free path is a half space, a flat
one a slab. Errors are standard errors of the mean; bounds are four of these beside the stated share of the value."""

import pytest
from walk_bench import Body, box, closure, mean, normal_entry

TOP = (0, 0.3, 0.4, 0.0, 0.0, 1.0)  # a point of the upper face, seen from above
BOUND = 0.005

# Single-scattering albedo: plane albedo at normal incidence, albedo under diffuse light (Chandrasekhar's H functions).
HALF_SPACE = {
    0.2: (0.035231, 0.046265),
    0.5: (0.115226, 0.146544),
    0.8: (0.285255, 0.341867),
    0.9: (0.414947, 0.478024),
    0.95: (0.535541, 0.596669),
    0.99: (0.752721, 0.794564),
}


def plate(extent: float, thickness: float) -> Body:
    """A box whose upper face is at z = 0, where single precision is finest."""
    vertices, triangles = box(extent, extent, 0.5 * thickness)
    return Body(vertices - (0.0, 0.0, 0.5 * thickness), triangles)


@pytest.fixture(scope="module")
def half_space() -> Body:
    return plate(1000.0, 1000.0)


def check(values, expected, bound=BOUND):
    found, error = mean(values)
    assert abs(found - expected) <= bound * expected + 4.0 * error, f"{found:.5f} ± {error:.5f}, not {expected:.5f}"
    assert error <= bound * expected, f"± {error:.5f} says too little about {expected:.5f}"


@pytest.mark.parametrize("alpha", HALF_SPACE)
def test_half_space(half_space, alpha):
    normal, diffuse = HALF_SPACE[alpha]
    check(half_space.walks(closure(1.0, alpha), TOP, 200_000)[:, 0], diffuse)
    check(half_space.walks(normal_entry(1.0, alpha), TOP, 200_000)[:, 0], normal)
