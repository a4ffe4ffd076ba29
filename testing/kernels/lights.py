"""Compiled loops over light sampling, for tests."""

import math

import numpy as np

from restir_engine.kernels.core import rng
from restir_engine.kernels.core.jit import device, kernel
from restir_engine.kernels.core.memory import address, load_f64, store_f64
from restir_engine.kernels.core.records import (
    SCRATCH_BYTES,
    SCRATCH_CLOSURES,
    SCRATCH_LIGHT_SAMPLE,
    SCRATCH_POINT,
    closure_at,
    light_sample_at,
    shading_point_at,
)
from restir_engine.kernels.core.vec import cross, dot, load3_f64, madd, put, scale, store3_f64, sub, vec
from restir_engine.kernels.geometry.surface import surface_point
from restir_engine.kernels.lights import (
    light_radiance,
    light_sample,
    lights_intersect,
    note_choice,
    sun_next,
    triangle_pdf,
    world_pdf,
)
from restir_engine.kernels.lights.world import world_radiance
from restir_engine.kernels.lobes.closure import LOBE_TRANSLUCENT


@kernel
def draw_kernel(scene, scratch, x, y, z, kind, seed, n, out):
    """n samples for the point (x, y, z): [drawn, wi, pdf, radiance, light, instance, primitive, distance] each.

    The surface looks up and has one closure of a LOBE_* kind.
    """
    sp = shading_point_at(scratch + SCRATCH_POINT, 0)
    put(sp.p, (x, y, z))
    put(sp.n, (0.0, 0.0, 1.0))
    sp.closures = scratch + SCRATCH_CLOSURES
    sp.n_closures = 1
    closure_at(sp.closures, 0).kind = kind
    ls = light_sample_at(scratch + SCRATCH_LIGHT_SAMPLE, 0)
    for i in range(n):
        u0, u1 = rng.sample2(seed, i, 0)
        u2 = rng.sample1(seed, i, 1)
        row = 12 * i
        if light_sample(scene, sp, scratch, u0, u1, u2):
            store_f64(out, row, 1.0)
            store3_f64(out, row + 1, vec(ls.wi))
            store_f64(out, row + 4, ls.pdf)
            store3_f64(out, row + 5, vec(ls.radiance))
            store_f64(out, row + 8, float(ls.light))
            store_f64(out, row + 9, float(ls.instance))
            store_f64(out, row + 10, float(ls.primitive))
            store_f64(out, row + 11, ls.distance)


@device
def _choose_at(scene, sp, x, y, z, up):
    """Let sp know how light sampling chooses at a point; up: 1 where its surface looks up, 0 where light passes it."""
    put(sp.p, (x, y, z))
    put(sp.n, (0.0, 0.0, up))
    sp.n_closures = 0
    note_choice(scene, sp)


@kernel
def seen_kernel(scene, scratch, x, y, z, up, flags, directions, n, out):
    """What the lamps, suns and the world send along n directions to (x, y, z): [rgb, sum of densities] each."""
    sp = shading_point_at(scratch + SCRATCH_POINT, 0)
    sp.ray_flags = flags
    _choose_at(scene, sp, x, y, z, up)
    o = (x, y, z)
    for i in range(n):
        d = load3_f64(directions, 3 * i)
        r, g, b = world_radiance(scene, scratch, sp, o, d)
        density = world_pdf(scene, scratch, sp, o, d)
        t = 0.0
        light, t = lights_intersect(scene, o, d, t, 1e30, flags)
        while light >= 0:
            lr, lg, lb, pdf = light_radiance(scene, scratch, sp, light, o, d, t)
            r += lr
            g += lg
            b += lb
            density += pdf
            light, t = lights_intersect(scene, o, d, t * (1.0 + 1e-9), 1e30, flags)
        light = sun_next(scene, d, 0, flags)
        while light >= 0:
            lr, lg, lb, pdf = light_radiance(scene, scratch, sp, light, o, d, 1e30)
            r += lr
            g += lg
            b += lb
            density += pdf
            light = sun_next(scene, d, light + 1, flags)
        store3_f64(out, 4 * i, (r, g, b))
        store_f64(out, 4 * i + 3, density)


@kernel
def triangle_kernel(scene, scratch, x, y, z, samples, n, out):
    """triangle_pdf of n samples of `draw_kernel`, found again as points of the triangles."""
    sp = shading_point_at(scratch + SCRATCH_POINT, 0)
    _choose_at(scene, sp, x, y, z, 0.0)
    o = (x, y, z)
    for i in range(n):
        row = 12 * i
        instance, primitive = int(load_f64(samples, row + 9)), int(load_f64(samples, row + 10))
        d = load3_f64(samples, row + 1)
        t = load_f64(samples, row + 11)
        surface_point(scene, sp, instance, primitive, 0.0, 0.0, t, d)
        side = -1.0 if sp.backfacing else 1.0
        ab, ac, q = scale(vec(sp.dpdu), side), scale(vec(sp.dpdv), side), sub(madd(o, d, t), vec(sp.p))
        n = cross(ab, ac)
        square = dot(n, n)
        u, v = dot(cross(q, ac), n) / square, dot(cross(ab, q), n) / square
        surface_point(scene, sp, instance, primitive, u, v, t, d)
        store_f64(out, i, triangle_pdf(scene, sp, o))


def scratch_memory() -> np.ndarray:
    return np.zeros(SCRATCH_BYTES, np.uint8)


def draw(scene, point, n=20_000, seed=1, kind=LOBE_TRANSLUCENT) -> np.ndarray:
    """Samples for a surface that looks up; kind: LOBE_* of its closure."""
    out = np.zeros((n, 12))
    memory = scratch_memory()
    draw_kernel(scene.record, address(memory), *map(float, point), kind, seed, n, address(out))
    return out


def seen(scene, point, directions, flags=8, up=0.0) -> np.ndarray:
    """[rgb, density] along directions (n, 3); flags: RAY_* of the rays; up: 1 from a surface that reflects."""
    directions = np.ascontiguousarray(directions, float)
    out = np.zeros((len(directions), 4))
    memory = scratch_memory()
    start = (scene.record, address(memory), *map(float, point), up, flags)
    seen_kernel(*start, address(directions), len(directions), address(out))
    return out


def triangle_densities(scene, point, samples) -> np.ndarray:
    out = np.zeros(len(samples))
    memory = scratch_memory()
    triangle_kernel(scene.record, address(memory), *map(float, point), address(samples), len(samples), address(out))
    return out


def irradiance(scene, point, normal, n=40_000, seed=3):
    """(mean, standard error) of the irradiance at a point of a plane, red channel."""
    s = draw(scene, point, n, seed)
    cos = np.maximum(s[:, 1:4] @ np.asarray(normal, float), 0.0)
    value = np.where(s[:, 0] > 0.0, s[:, 5] * cos / np.where(s[:, 4] > 0.0, s[:, 4], 1.0), 0.0)
    return value.mean(), value.std() / math.sqrt(n)
