"""What a block of pixels makes of S, called from Python."""

from __future__ import annotations

import numpy as np

from restir_engine.integrators.blocks.block import (
    BLOCK,
    LANES,
    SHAPE,
    begin_block,
    block_at,
    block_bytes,
    put_domain,
    rows_of,
    sample_of,
)
from restir_engine.integrators.blocks.gather import gather
from restir_engine.kernels.core.jit import kernel
from restir_engine.kernels.core.memory import address, load_f32
from restir_engine.kernels.core.records import PATH, path_at
from restir_engine.kernels.core.vec import load3_f64, put, store3_f64, sub, vec
from restir_engine.kernels.subsurface.bssrdf import bssrdf_at, diffused


@kernel
def shapes_kernel(block, path, domains, count, points, normals, samples, ours, theirs):
    """S of `samples` points (float64 [samples, 3]) for `count` domains, BSSRDF: float64 [samples, count, 3] each.

    ours: as the rows of a block have it; theirs: as `diffused` does.
    """
    for k in range(samples):
        begin_block(block)
        for j in range(count):
            put_domain(block, path_at(path, 0), bssrdf_at(domains, j), 1.0)
        p, n = load3_f64(points, 3 * k), load3_f64(normals, 3 * k)
        s = sample_of(block, 0)
        put(s.p, sub(p, vec(bssrdf_at(domains, 0).p)))
        put(s.n, n)
        put(s.irradiance, (1.0, 1.0, 1.0))
        s.lane = 0
        s.group = -1
        block_at(block, 0).samples = 1
        gather(block)
        for j in range(count):
            rows = rows_of(block)
            at = LANES * SHAPE + j
            found = (load_f32(rows, at), load_f32(rows, at + LANES), load_f32(rows, at + 2 * LANES))
            store3_f64(ours, 3 * (k * count + j), found)
            b = bssrdf_at(domains, j)
            store3_f64(theirs, 3 * (k * count + j), diffused(b, sub(p, vec(b.p)), n))


def shapes(domains: np.ndarray, points: np.ndarray, normals: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """S of points (n, 3) with normals for domains (m,) of BSSRDF, (n, m, 3): as blocks have it, as `diffused` does."""
    block = np.zeros(block_bytes(0) + 64, np.uint8)
    block = block[-address(block) % 64 :]
    assert not block[: BLOCK.itemsize].any()
    path = np.zeros(1, PATH)
    points, normals = (np.ascontiguousarray(a, float) for a in (points, normals))
    ours, theirs = np.zeros((2, len(points), len(domains), 3))
    shapes_kernel(
        address(block), address(path), address(domains), len(domains), address(points), address(normals), len(points),
        address(ours), address(theirs),
    )  # fmt: skip
    return ours, theirs
