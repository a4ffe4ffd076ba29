"""A small world to resample in: points on the ground under a luminous ceiling, a disk between them.

Pixel i stands at (PLACES[i], 0) and sees the ceiling z = 1 up to the angle REACH[i] from the zenith. A sample is that
angle and an azimuth (θ, φ), in the measure dθ dφ; the shift from one pixel to another keeps the point of the ceiling
(a reconnection), and fails beyond the other's reach. The integrand is radiance · cos θ sin θ · visibility.
"""

import math

import numpy as np

from restir_engine.integrators.resampling import resample as r
from restir_engine.integrators.resampling.reservoir import accept
from restir_engine.kernels.core import rng
from restir_engine.kernels.core.jit import device, kernel
from restir_engine.kernels.core.memory import address, load_f64, store_f64

PIXELS = 4
PLACES = np.array([[0.0, 0.0], [0.35, -0.1], [-0.2, 0.5], [0.6, 0.4]])
REACH = np.array([1.1, 0.8, 1.25, 0.95])
WORLD = np.ascontiguousarray(np.column_stack([PLACES, REACH]))
CONFIDENCES = np.array([1.0, 3.0, 0.5, 7.0])
# What a test plants: errors that must be found.
NO_ERROR, NO_JACOBIAN, NULL_UNCOUNTED, WEIGHT_UNSCALED = range(4)


@device
def ceiling(world, i, theta, phi):
    """The point of the ceiling that pixel i sees."""
    r = math.tan(theta)
    return load_f64(world, 3 * i) + r * math.cos(phi), load_f64(world, 3 * i + 1) + r * math.sin(phi)


@device
def direction(world, i, x, y):
    """(θ, φ) under which pixel i sees a point of the ceiling, and |d(x, y)/d(θ, φ)| there."""
    dx = x - load_f64(world, 3 * i)
    dy = y - load_f64(world, 3 * i + 1)
    theta = math.atan(math.sqrt(dx * dx + dy * dy))
    return theta, math.atan2(dy, dx), math.tan(theta) * (1.0 + math.tan(theta) ** 2)


@device
def shift(world, i, j, theta, phi):
    """(valid, θ', φ', |T'|): from pixel i to pixel j."""
    x, y = ceiling(world, i, theta, phi)
    theta_j, phi_j, area_j = direction(world, j, x, y)
    if theta_j > load_f64(world, 3 * j + 2):
        return False, theta_j, phi_j, 0.0
    area_i = math.tan(theta) * (1.0 + math.tan(theta) ** 2)
    return True, theta_j, phi_j, area_i / area_j


@device
def radiance(x, y):
    return max(0.0, 1.0 + math.sin(3.0 * x) * math.cos(2.0 * y) + 4.0 * math.exp(-8.0 * ((x - 0.5) ** 2 + y * y)))


@device
def integrand(world, i, theta, phi):
    """f_i; an opaque disk of radius 0.3 stands halfway up over (0.3, 0.2)."""
    x, y = ceiling(world, i, theta, phi)
    mx = 0.5 * (x + load_f64(world, 3 * i)) - 0.3
    my = 0.5 * (y + load_f64(world, 3 * i + 1)) - 0.2
    if mx * mx + my * my < 0.09 or theta > load_f64(world, 3 * i + 2):
        return 0.0
    return radiance(x, y) * math.cos(theta) * math.sin(theta)


@device
def target(world, i, theta, phi, exact):
    """p̂_i: the integrand, or something unlike it with the same support."""
    f = integrand(world, i, theta, phi)
    return f if exact != 0 else f * (0.3 + math.cos(2.0 * phi) ** 2)


@kernel
def shift_kernel(world, i, j, theta, phi, out):
    valid, a, b, jacobian = shift(world, i, j, theta, phi)
    store_f64(out, 0, 1.0 if valid else 0.0)
    store_f64(out, 1, a)
    store_f64(out, 2, b)
    store_f64(out, 3, jacobian)


@kernel
def integrand_kernel(world, i, thetas, phis, n, out):
    for k in range(n):
        store_f64(out, k, integrand(world, i, load_f64(thetas, k), load_f64(phis, k)))


@device
def initial(world, i, key, exact, trial, fail):
    """RIS of two uniform candidates in pixel i, failing with probability `fail`: (θ, φ, W)."""
    reach = load_f64(world, 3 * i + 2)
    total = 0.0
    theta = 0.0
    phi = 0.0
    u = rng.sample1(key, trial, 10 * i)
    for k in range(2):
        a, b = rng.sample2(key, trial, 10 * i + 1 + k)
        a *= reach
        b *= 2.0 * math.pi
        weight = 0.5 * target(world, i, a, b, exact) * reach * 2.0 * math.pi
        total += weight
        taken, u = accept(weight, total, u)
        if taken:
            theta, phi = a, b
    p = target(world, i, theta, phi, exact)
    if p <= 0.0 or rng.sample1(key, trial, 10 * i + 5) < fail:
        return theta, phi, 0.0
    return theta, phi, total / p / (1.0 - fail)


@kernel
def resample_kernel(world, confidences, table, samples, kind, n, trials, seed, exact, fail, planted, out):
    """`trials` rounds of reuse by pixel 0 among n pixels; each [f W, Σ w f/p̂, W, θ, φ, Σ m of the candidates].

    `samples`: float64 [PIXELS, 3] to work in, (θ, φ, W) shifted to pixel 0. A sample that is NULL has no weight.
    """
    for trial in range(trials):
        key = rng.hash_combine(seed, trial)
        sum_m = 0.0
        for i in range(n):
            theta, phi, w = initial(world, i, key, exact, 0, fail)
            confidence = load_f64(confidences, i)
            valid, a, b, jacobian = shift(world, i, 0, theta, phi)
            p = 0.0
            if valid and w > 0.0:
                p = target(world, 0, a, b, exact)
            if planted == NO_JACOBIAN:
                jacobian = 1.0
            if planted == NULL_UNCOUNTED and p == 0.0:
                confidence = 0.0
            r.put_candidate(table, i, confidence, w * jacobian, p)
            store_f64(samples, 3 * i, a)
            store_f64(samples, 3 * i + 1, b)
        for i in range(n):
            for j in range(1, n):
                if kind == r.CONTRIBUTION or r.needs_from(kind, i, j):
                    fill_from(world, table, samples, i, j, exact)
        total = r.weigh(table, n, kind)
        vector = 0.0
        for i in range(n):
            if r.target_of(table, i) > 0.0:
                f = integrand(world, 0, load_f64(samples, 3 * i), load_f64(samples, 3 * i + 1))
                vector += r.weight_of(table, i) * f / r.target_of(table, i)
        for i in range(n):
            sum_m += r.mis_weight(table, n, kind, i)
        chosen = r.choose(table, n, total, rng.sample1(key, 0, 99))
        row = 6 * trial
        store_f64(out, row + 1, vector)
        if chosen >= 0:
            a = load_f64(samples, 3 * chosen)
            b = load_f64(samples, 3 * chosen + 1)
            w = r.selected_weight(table, n, kind, total, chosen)
            if planted == WEIGHT_UNSCALED:
                w = total
            store_f64(out, row, integrand(world, 0, a, b) * w)
            store_f64(out, row + 2, w)
            store_f64(out, row + 3, a)
            store_f64(out, row + 4, b)


@device
def fill_from(world, table, samples, i, j, exact):
    """p̂_{←j} of candidate i, carried back from pixel 0 to pixel j."""
    valid, a, b, jacobian = shift(world, 0, j, load_f64(samples, 3 * i), load_f64(samples, 3 * i + 1))
    value = 0.0
    if valid:
        value = target(world, j, a, b, exact) * jacobian
    r.put_from(table, i, j, value)


@kernel
def sum_kernel(world, confidences, table, samples, kind, n, theta, phi, out):
    """Σ_i m_i(y) at one y of pixel 0, as if each candidate had arrived there, and p̂(y)."""
    for i in range(n):
        r.put_candidate(table, i, load_f64(confidences, i), 1.0, target(world, 0, theta, phi, 0))
        store_f64(samples, 3 * i, theta)
        store_f64(samples, 3 * i + 1, phi)
    for i in range(n):
        for j in range(1, n):
            fill_from(world, table, samples, i, j, 0)
    total = 0.0
    for i in range(n):
        total += r.mis_weight(table, n, kind, i)
    store_f64(out, 0, total)
    store_f64(out, 1, target(world, 0, theta, phi, 0))


def shifted(i: int, j: int, theta: float, phi: float) -> tuple[bool, float, float, float]:
    """The shift from pixel i to pixel j, called from Python."""
    out = np.zeros(4)
    shift_kernel(address(WORLD), i, j, theta, phi, address(out))
    return bool(out[0]), *out[1:]


def integral(i: int = 0, where=None, n: int = 1500) -> float:
    """∫ f_i dθ dφ by the midpoint rule over the pixel's domain; with `where`, the area of f_i > 0 inside it."""
    theta = (np.arange(n) + 0.5) / n * REACH[i]
    phi = (np.arange(n) + 0.5) / n * 2.0 * np.pi
    grid = [np.ascontiguousarray(a).ravel() for a in np.meshgrid(theta, phi, indexing="ij")]
    out = np.zeros(n * n)
    integrand_kernel(address(WORLD), i, address(grid[0]), address(grid[1]), n * n, address(out))
    cell = REACH[i] * 2.0 * np.pi / n**2
    return out.sum() * cell if where is None else ((out > 0.0) & where(*grid)).sum() * cell


def run(kind: int, n=PIXELS, trials=30_000, seed=1, exact=0, fail=0.0, planted=NO_ERROR, confidences=CONFIDENCES):
    """Columns of `resample_kernel`, one row a trial."""
    table = np.zeros(r.TABLE_BYTES // 8)
    samples = np.zeros((PIXELS, 3))
    out = np.zeros((trials, 6))
    resample_kernel(
        address(WORLD), address(confidences), address(table), address(samples), kind, n, trials, seed, exact, fail,
        planted, address(out),
    )  # fmt: skip
    return out


def sum_of_weights(kind: int, theta: float, phi: float) -> np.ndarray:
    """Σ m_i at a point of pixel 0's domain, and the target there."""
    table, samples, out = np.zeros(r.TABLE_BYTES // 8), np.zeros((PIXELS, 3)), np.zeros(2)
    sum_kernel(
        address(WORLD), address(CONFIDENCES), address(table), address(samples), kind, PIXELS, theta, phi, address(out)
    )
    return out
