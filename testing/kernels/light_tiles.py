"""Compiled loops over light samples resampled from tiles, for tests."""

import numpy as np

from restir_engine.context import FrameContext
from restir_engine.kernels.core import rng
from restir_engine.kernels.core.jit import kernel
from restir_engine.kernels.core.memory import address, store_f64
from restir_engine.kernels.core.records import (
    SCRATCH_CLOSURES,
    SCRATCH_LIGHT_SAMPLE,
    SCRATCH_POINT,
    closure_at,
    light_sample_at,
    shading_point_at,
)
from restir_engine.kernels.core.vec import put, store3_f64, vec
from restir_engine.kernels.lights import light_sample
from restir_engine.kernels.lobes.closure import LOBE_LAMBERT, LOBE_TRANSLUCENT
from restir_engine.scene.light_tiles import LightTiles
from testing.kernels.lights import scratch_memory


@kernel
def resample_kernel(scene, scratch, x, y, z, closures, seed, n, out):
    """n light samples for a surface at (x, y, z) that looks up: [drawn, wi, pdf, radiance, mis pdf, light] each.

    closures: 1: a surface that reflects; 2: lets light through as well; 0: a point of a medium.
    """
    sp = shading_point_at(scratch + SCRATCH_POINT, 0)
    put(sp.p, (x, y, z))
    for normal in (sp.n, sp.ng, sp.wo):
        put(normal, (0.0, 0.0, 1.0))
    sp.closures = scratch + SCRATCH_CLOSURES
    sp.n_closures = closures
    for i in range(2):
        c = closure_at(sp.closures, i)
        c.kind = LOBE_LAMBERT if i == 0 else LOBE_TRANSLUCENT
        c.sample_weight = 0.5
        put(c.weight, (0.5, 0.5, 0.5))
        put(c.n, (0.0, 0.0, 1.0))
    ls = light_sample_at(scratch + SCRATCH_LIGHT_SAMPLE, 0)
    for i in range(n):
        u0, u1 = rng.sample2(seed, i, 0)
        u2 = rng.sample1(seed, i, 1)
        if light_sample(scene, sp, scratch, u0, u1, u2):
            row = 10 * i
            store_f64(out, row, 1.0)
            store3_f64(out, row + 1, vec(ls.wi))
            store_f64(out, row + 4, ls.pdf)
            store3_f64(out, row + 5, vec(ls.radiance))
            store_f64(out, row + 8, ls.mis_pdf)
            store_f64(out, row + 9, float(ls.light))


def resample(context, point, n, seed=1, closures=1) -> np.ndarray:
    """Light samples (n, 10) of a scene or of a context, from its tiles when it has some."""
    out = np.zeros((n, 10))
    memory = scratch_memory()
    start = (context.record, address(memory), *map(float, point), closures, seed)
    resample_kernel(*start, n, address(out))
    return out


def from_tiles(scene, point, frames, per_frame, candidates=8, closures=1) -> np.ndarray:
    """Samples (frames, per_frame, 10), each frame from tiles of its own."""
    context = FrameContext(scene, tiles=LightTiles(scene, 4, 64, candidates))
    out = np.zeros((frames, per_frame, 10))
    for frame in range(frames):
        context.fill_tiles(frame, scratch_memory())
        out[frame] = resample(context, point, per_frame, 1000 + frame, closures)
    return out
