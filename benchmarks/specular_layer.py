"""A scattering ball under a real dielectric surface, beside models of it: `python -m benchmarks.specular_layer`.

In truth the surface refracts and reflects on both sides. The engine, as Cycles, takes the boundary as matched: what the
layer leaves, 1 - F(wo), enters, refracted or diffuse, and a white Lambert lobe lets light out: *plain*. *Covered* is
the same with the layer at the exit too, whose lobe is weighed by (1 - F(wi)) / (1 - average of F): reciprocal, and in
an even sky the same. The truth's albedo is the one with which it is as bright as *plain* in an even sky. Prints the
means over the truth's, and the block error: relative squares of the differences of blocks of 4 × 4 pixels, as the
product of two independent halves, so that noise is not in it.
"""

from __future__ import annotations

import argparse
import math
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from restir_engine.kernels.core import rng
from restir_engine.kernels.core.jit import device, kernel
from restir_engine.kernels.core.memory import address, load_f64, store_f64
from restir_engine.kernels.core.vec import dot, madd, neg, normalize, scale
from restir_engine.kernels.lobes.diffuse import cosine_direction
from restir_engine.kernels.lobes.fresnel import dielectric
from restir_engine.kernels.subsurface.phase import around

REAL, PLAIN, COVERED = 0, 1, 2
MODELS = {"plain": PLAIN, "covered": COVERED}
IOR = 1.5
SIZE, BLOCK = 32, 4
SHARPNESS = 8.0  # of a lamp: the power of the cosine to its axis
LAMPS = {"front": (0.0, 0.0, 1.0), "side": (0.98, 0.0, 0.2), "back": (0.5, 0.0, -0.87)}
EVEN = (0.0, 0.0, 0.0)
MEAN_FREE_PATHS = (0.015, 0.05, 0.15)  # of the ball's diameter
ALBEDOS = (0.9, 0.985)


@device
def _radiance(d, axis):
    """What comes from the direction d: a soft lamp about an axis, or an even sky where the axis is zero."""
    return 1.0 if dot(axis, axis) == 0.0 else max(dot(axis, d), 0.0) ** SHARPNESS


@device
def _refract(d, n, eta, cos_t):
    """The refracted direction of d, which comes from n's side; eta: the index there by the other one."""
    return normalize(madd(scale(d, eta), n, eta * -dot(d, n) + cos_t))


@device
def _path(p, sigma_t, alpha, model, diffuse, covered, axis, state):
    """Light towards +z from the point p of the unit ball, by one path backwards."""
    fresnel, cos_t = dielectric(p[2], IOR)
    weight = 1.0 - fresnel
    state, u0, u1 = rng.advance(state)
    d = cosine_direction(neg(p), u0, u1) if diffuse else _refract((0.0, 0.0, -1.0), p, 1.0 / IOR, cos_t)
    while True:
        state, u0, u1 = rng.advance(state)
        along = dot(p, d)
        far = -along + math.sqrt(max(along * along - dot(p, p) + 1.0, 0.0))
        t = -math.log(1.0 - u0) / sigma_t
        if t < far:
            p = madd(p, d, t)
            state, u2, u3 = rng.advance(state)
            d = around(d, 2.0 * u2 - 1.0, u3)
            if u1 >= alpha:
                return 0.0
            continue
        p = normalize(madd(p, d, far))
        state, u2, u3 = rng.advance(state)
        if model != REAL:
            d = cosine_direction(p, u2, u3)
            if model == COVERED:
                weight *= (1.0 - dielectric(dot(d, p), IOR)[0]) * covered
            return weight * _radiance(d, axis)
        fresnel, cos_t = dielectric(dot(d, p), 1.0 / IOR)
        if u2 >= fresnel:
            return weight * _radiance(_refract(d, neg(p), IOR, cos_t), axis)
        d = madd(d, p, -2.0 * dot(d, p))


@kernel
def _picture(out, samples, seed, sigma_t, alpha, model, diffuse, covered, x, y, z):
    """SIZE × SIZE pixels of the ball, parallel projection."""
    for i in range(SIZE * SIZE):
        total = 0.0
        for k in range(samples):
            u0, u1 = rng.sample2(rng.key(seed, i, 0, 0), k, 0)
            px, py = 2.0 * (i % SIZE + u0) / SIZE - 1.0, 2.0 * (i // SIZE + u1) / SIZE - 1.0
            square = px * px + py * py
            if square < 0.999:
                p, state = (px, py, math.sqrt(1.0 - square)), rng.stream(rng.key(seed, i, 0, 0), k, 1)
                total += _path(p, sigma_t, alpha, model, diffuse, covered, (x, y, z), state)
        store_f64(out, i, load_f64(out, i) + total / samples)


def layer_average() -> float:
    """2 ∫ F(µ) µ dµ."""
    mu = (np.arange(1000) + 0.5) / 1000
    return float(2.0 * np.mean([dielectric.py_func(m, IOR)[0] * m for m in mu]))


def halves(length: float, alpha: float, model: int, diffuse: bool, axis, samples: int) -> np.ndarray:
    """Two independent pictures [2, SIZE / BLOCK, SIZE / BLOCK] of blocks; length: mean free path / diameter."""
    images, covered = np.zeros((2, SIZE * SIZE)), 1.0 / (1.0 - layer_average())

    def render(k: int) -> None:
        seed = 2 * model + k + 1
        _picture(address(images[k]), samples, seed, 0.5 / length, alpha, model, diffuse, covered, *map(float, axis))

    with ThreadPoolExecutor(2) as pool:
        list(pool.map(render, range(2)))
    n = SIZE // BLOCK
    return images.reshape(2, n, BLOCK, n, BLOCK).mean((2, 4))


def matching_albedo(length: float, alpha: float, diffuse: bool, samples: int) -> float:
    """The albedo with which the real surface is as bright in an even sky as the plain one with `alpha`."""
    target = halves(length, alpha, PLAIN, diffuse, EVEN, samples).mean()
    low, high = 1e-5, 1.0 - alpha
    for _ in range(9):
        middle = math.sqrt(low * high)
        brighter = halves(length, 1.0 - middle, REAL, False, EVEN, samples).mean() > target
        low, high = (middle, high) if brighter else (low, middle)
    return 1.0 - math.sqrt(low * high)


def block_error(one: np.ndarray, truth: np.ndarray) -> float:
    """Two halves each; blocks that see the ball."""
    right = truth.mean(0)
    seen = right > 0.0
    scale = right**2 + 0.01 * right[seen].mean() ** 2
    return float((np.prod(one - truth, axis=0) / scale)[seen].mean())


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--samples", type=int, default=1024)
    samples = parser.parse_args().samples
    print("| entry | mfp / size | albedo | lamp | plain: mean | block error | covered: mean | block error |")
    print("|" + "---|" * 8)
    errors = {name: [] for name in MODELS}
    for entry in ("refractive", "diffuse"):
        for length in MEAN_FREE_PATHS:
            for alpha in ALBEDOS:
                real = matching_albedo(length, alpha, entry == "diffuse", samples)
                for lamp, axis in LAMPS.items():
                    truth = halves(length, real, REAL, False, axis, 2 * samples)
                    cells = [entry, f"{length:g}", f"{alpha:g}", lamp]
                    for name, model in MODELS.items():
                        image = halves(length, alpha, model, entry == "diffuse", axis, samples)
                        errors[name].append(block_error(image, truth))
                        cells += [f"{image.mean() / truth.mean():.3f}", f"{errors[name][-1]:.4f}"]
                    print("| " + " | ".join(cells) + " |", flush=True)
    print({name: round(float(np.mean(values)), 4) for name, values in errors.items()})


if __name__ == "__main__":
    main()
