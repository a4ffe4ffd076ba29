"""Compiled loops over points of lights that are kept and placed again, for tests."""

import numpy as np

from restir_engine.context import FrameContext
from restir_engine.kernels.core import rng
from restir_engine.kernels.core.jit import kernel
from restir_engine.kernels.core.memory import address, load_f64, store_f64
from restir_engine.kernels.core.records import SCRATCH_LIGHT_SAMPLE, SCRATCH_POINT, light_sample_at, shading_point_at
from restir_engine.kernels.core.vec import put, store3_f64, vec
from restir_engine.kernels.lights import light_point, light_sample, point_of_sample
from testing.kernels.lights import scratch_memory


@kernel
def keep_kernel(scene, scratch, x, y, z, seed, n, points, out):
    """n samples for (x, y, z), as points [source, primitive, u, v, density] and as light_sample has them.

    out: [wi, distance, radiance, flags]; the density is that of the point's own measure. Without sample the density
    stays 0.
    """
    sp = shading_point_at(scratch + SCRATCH_POINT, 0)
    put(sp.p, (x, y, z))
    ls = light_sample_at(scratch + SCRATCH_LIGHT_SAMPLE, 0)
    for i in range(n):
        u0, u1 = rng.sample2(seed, i, 0)
        u2 = rng.sample1(seed, i, 1)
        if light_sample(scene, sp, scratch, u0, u1, u2):
            source, primitive, u, v = point_of_sample(scene, sp, ls)
            pdf = ls.pdf
            store3_f64(out, 8 * i, vec(ls.wi))
            store_f64(out, 8 * i + 3, ls.distance)
            store3_f64(out, 8 * i + 4, vec(ls.radiance))
            store_f64(out, 8 * i + 7, float(ls.flags))
            store_f64(points, 5 * i, float(source))
            store_f64(points, 5 * i + 1, float(primitive))
            store_f64(points, 5 * i + 2, u)
            store_f64(points, 5 * i + 3, v)
            if light_point(scene, sp, scratch, source, primitive, u, v):
                store_f64(points, 5 * i + 4, pdf / ls.pdf)


@kernel
def place_kernel(scene, scratch, x, y, z, points, n, out):
    """Points as they light (x, y, z): [wi, distance, radiance, flags, pdf, seen_by, placed] each."""
    sp = shading_point_at(scratch + SCRATCH_POINT, 0)
    put(sp.p, (x, y, z))
    ls = light_sample_at(scratch + SCRATCH_LIGHT_SAMPLE, 0)
    for i in range(n):
        source = int(load_f64(points, 5 * i))
        primitive = int(load_f64(points, 5 * i + 1))
        done = light_point(
            scene, sp, scratch, source, primitive, load_f64(points, 5 * i + 2), load_f64(points, 5 * i + 3)
        )
        if done:
            store3_f64(out, 11 * i, vec(ls.wi))
            store_f64(out, 11 * i + 3, ls.distance)
            store3_f64(out, 11 * i + 4, vec(ls.radiance))
            store_f64(out, 11 * i + 7, float(ls.flags))
            store_f64(out, 11 * i + 8, ls.pdf)
            store_f64(out, 11 * i + 9, float(ls.seen_by))
            store_f64(out, 11 * i + 10, 1.0)


def keep(scene, point, n, seed=1) -> tuple[np.ndarray, np.ndarray]:
    """(points (n, 5), samples (n, 8)) of light_sample for a receiver; points in single precision, as they are kept."""
    points, out = np.zeros((n, 5)), np.zeros((n, 8))
    memory = scratch_memory()
    context = FrameContext(scene)
    keep_kernel(context.record, address(memory), *map(float, point), seed, n, address(points), address(out))
    points[:, 2:4] = points[:, 2:4].astype(np.float32)
    return points, out


def place(scene, point, points) -> np.ndarray:
    """What points (n, 5) send to another receiver, (n, 11)."""
    out = np.zeros((len(points), 11))
    memory = scratch_memory()
    points = np.ascontiguousarray(points, float)
    context = FrameContext(scene)
    place_kernel(context.record, address(memory), *map(float, point), address(points), len(points), address(out))
    return out
