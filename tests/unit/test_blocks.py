"""Pixels of a block that share exits: S as vector code has it, and the mean that they keep."""

import numpy as np
import pytest

from restir_engine.kernels.subsurface.bssrdf import BSSRDF, CYCLES, MULTIPLE, MULTIPLE_OF_SLAB, WHOLE
from testing.kernels.blocks import shapes


def domains(kinds, random) -> np.ndarray:
    """A domain of each kind near the origin, with random scales of about a tenth."""
    b = np.zeros(len(kinds), BSSRDF)
    b["kind"] = kinds
    b["p"] = 0.05 * random.normal(size=(len(b), 3))
    n = random.normal(size=(len(b), 3)) + (0.0, 0.0, 3.0)
    b["n"] = n / np.linalg.norm(n, axis=1, keepdims=True)
    b["side"] = b["looks"] = 1.0
    b["weight"] = random.random((len(b), 3))
    b["weight"][0, 1] = 0.0
    b["d"] = b["sampled"] = 0.02 + 0.1 * random.random((len(b), 3))
    b["single"] = 0.6 * b["d"]
    b["share"] = 0.5 * random.random((len(b), 3))
    b["near"], b["far"] = random.random((2, len(b), 3)) + 0.2
    b["wide_near"], b["wide_far"] = 0.5 + random.random((2, len(b), 3))
    b["bend"] = random.normal(size=(len(b), 3))
    b["thickness"] = 0.1 + 0.3 * random.random(len(b))
    return b


@pytest.mark.parametrize(
    "kinds",
    [[WHOLE] * 3, [MULTIPLE] * 5, [MULTIPLE_OF_SLAB] * 4, [CYCLES] * 9, [WHOLE, CYCLES, MULTIPLE, MULTIPLE_OF_SLAB] * 4],
    ids=["whole", "multiple", "slab", "Cycles", "all"],
)
def test_a_block_has_the_s_that_paths_have(kinds):
    """In single precision: to 1e-5 of it, and zero where it ends."""
    random = np.random.default_rng(3)
    points = random.normal(size=(200, 3)) * np.geomspace(1e-3, 2.0, 200)[:, None]
    normals = random.normal(size=(200, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    ours, theirs = shapes(domains(kinds, random), points, normals)
    assert (np.abs(theirs) > 0.0).mean() > 0.5
    np.testing.assert_allclose(ours, theirs, rtol=2e-5, atol=1e-7 * np.abs(theirs).max())
