"""What a HYBRID sample costs beside a random walk's, as a Markdown table: `python -m benchmarks.hybrid_cost`.

By mean free path / size, body and light: rays of a HYBRID sample, time of a HYBRID and of a DIFFUSION sample against a
RANDOM_WALK's, and relMSE of HYBRID and RANDOM_WALK after equal time. A sample is a path that meets the body.

Rays are counted where kernels call Embree, in a process of their own whose symbols lead to a counter first; the
camera's are left out, the ray by which the path goes on is counted. Times are processor time of one thread, in turns,
so that what else runs matters little, and contain the camera's ray. The errors are those of as many samples as two such
threads take in a second: bias² + variance / samples, from two pictures of each method and two of the truth, which is
RANDOM_WALK's, so that no noise is taken for bias. "noise × time" is variance × time of a sample over a random walk's.
"""

from __future__ import annotations

import argparse
import itertools
import multiprocessing
import time

import llvmlite.binding
import numpy as np
from numba import cfunc, types

from restir_engine.context import FrameContext
from restir_engine.embree import library
from restir_engine.film import Film
from restir_engine.integrators.path import PathIntegrator
from restir_engine.kernels.core.memory import address, load_i64, store_i64
from restir_engine.scene.description import SceneDescription
from restir_engine.settings import RenderSettings, required_passes

from .hybrid_sweep import LIGHTS, scene_of

MEAN_FREE_PATHS = (0.02, 0.05, 0.1, 0.2)
METHODS = ("RANDOM_WALK", "HYBRID", "DIFFUSION")
SIZE, WIDTH = (320, 180), 0.8  # pixels; scene units, which the bodies fill
CORES, SECONDS = 2, 1.0
ROUNDS = 3

_counts = np.zeros(2, np.int64)
_COUNTS = address(_counts)
_QUERY = types.void(types.int64, types.int64, types.int64)
_intersect = types.ExternalFunction("uncounted_rtcIntersect1", _QUERY)
_occluded = types.ExternalFunction("uncounted_rtcOccluded1", _QUERY)


def _count_intersect(structure, ray, arguments):
    store_i64(_COUNTS, 0, load_i64(_COUNTS, 0) + 1)
    _intersect(structure, ray, arguments)


def _count_occluded(structure, ray, arguments):
    store_i64(_COUNTS, 1, load_i64(_COUNTS, 1) + 1)
    _occluded(structure, ray, arguments)


_COUNTERS = {"rtcIntersect1": _count_intersect, "rtcOccluded1": _count_occluded}


class Renderer:
    """One method in a scene on one thread; every call of `sample` adds samples that it did not have before."""

    def __init__(self, scene, method: str, seed: int = 0, **more) -> None:
        options = {"passes": frozenset(("Combined", "Subsurface")), "max_bounces": 0, "pixel_filter": "BOX"} | more
        settings = RenderSettings(**options, sss_method=method, seed=seed, film_transparent=True)
        if isinstance(scene, SceneDescription):
            scene = scene.commit()
        self.film = Film(*scene.camera.film_size, required_passes(settings.passes, False))
        self._integrator = PathIntegrator(FrameContext(scene), settings, self.film)
        self._scratch = self._integrator.scratch()

    def sample(self, samples: int) -> float:
        """Add samples to every pixel; processor seconds."""
        began = time.process_time()
        end = self.film.samples + samples
        while self.film.samples < end:
            batch = min(end - self.film.samples, self._integrator.max_batch)
            for stage in self._integrator.stages(self.film.samples, batch):
                stage.run((0, 0, self.film.width, self.film.height), self._scratch)
                stage.finish()
            self.film.samples += batch
        return time.process_time() - began

    def picture(self) -> np.ndarray:
        """The light below the surface, rgb."""
        return self.film.pass_array("Subsurface").astype(float)

    def hits(self) -> float:
        """Camera rays that have met the body."""
        return float(self.film.pass_array("Combined")[..., 3].sum()) * self.film.samples


def rays(case: tuple) -> tuple[float, float]:
    """(rays that look for the nearest hit, shadow rays) of a HYBRID sample, in a process that has run no kernel yet."""
    library.load()
    keep = []
    for name, function in _COUNTERS.items():
        real = llvmlite.binding.address_of_symbol("restir_" + name)
        llvmlite.binding.add_symbol("uncounted_" + name, real)
        keep.append(cfunc(_QUERY)(function))
        llvmlite.binding.add_symbol("restir_" + name, keep[-1].address)
    renderer = Renderer(scene_of(*case, "DIFFUSE", SIZE, WIDTH), "HYBRID")
    _counts[:] = 0
    renderer.sample(2)
    nearest, shadow = _counts
    return (nearest - 2 * SIZE[0] * SIZE[1]) / renderer.hits(), shadow / renderer.hits()


def noise_and_bias(pair: list[np.ndarray], truth: list[np.ndarray]) -> tuple[float, float]:
    """(variance of one of the pair, bias²), weighted as relMSE does."""
    weight = 1.0 / ((0.5 * (truth[0] + truth[1])) ** 2 + 0.01)
    variance = 0.5 * float((weight * (pair[0] - pair[1]) ** 2).mean())
    (a, b), (c, d) = pair, truth
    bias = 0.5 * float((weight * ((a - c) * (b - d) + (a - d) * (b - c))).mean())
    return variance, bias


def measure(case: tuple, samples: int) -> dict[str, float]:
    """The figures of one body, mean free path / size and light."""
    scene = scene_of(*case, "DIFFUSE", SIZE, WIDTH)
    renderers = [[Renderer(scene, m, seed) for seed in (1, 2)] for m in METHODS]
    truth = [Renderer(scene, "RANDOM_WALK", seed) for seed in (3, 4)]
    seconds = np.full(len(METHODS), np.inf)
    part = -(-samples // ROUNDS)
    for pair in renderers:
        pair[0].sample(1)
        pair[1].sample(1)
    for _, k in itertools.product(range(ROUNDS), range(len(METHODS))):
        for renderer in renderers[k]:
            seconds[k] = min(seconds[k], renderer.sample(part) / part)
    for renderer in truth:
        renderer.sample(4 * samples)
    found = {}
    for k, method in enumerate(METHODS):
        film = renderers[k][0].film
        pair, n = [r.picture() for r in renderers[k]], film.samples
        variance, bias = noise_and_bias(pair, [r.picture() for r in truth])
        affordable = CORES * SECONDS / seconds[k]
        found[method] = {
            "time": seconds[k] / seconds[0], "microseconds": 1e6 * seconds[k] * n / renderers[k][0].hits(),
            "samples": affordable, "noise": variance * n, "bias": bias, "error": bias + variance * n / affordable,
        }  # fmt: skip
    return found


COLUMNS = {
    "rays": "rays", "of them shadow rays": "shadow", "HYBRID µs": "microseconds", "HYBRID time": "time",
    "noise × time": "efficiency", "bias²": "bias", "HYBRID relMSE": "error", "RANDOM_WALK relMSE": "walk",
    "DIFFUSION time": "diffusion",
}  # fmt: skip


def line(name: list[str], row: dict[str, float]) -> str:
    """A line of the table."""
    return "| " + " | ".join(name + [f"{row[key]:.3g}" for key in COLUMNS.values()]) + " |"


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--bodies", nargs="+", default=["bunny", "head"])
    parser.add_argument("--lengths", nargs="+", type=float, default=list(MEAN_FREE_PATHS))
    parser.add_argument("--lights", nargs="+", default=list(LIGHTS))
    parser.add_argument("--samples", type=int, default=9)
    asked = parser.parse_args()
    print("| mfp / size | body | light | " + " | ".join(COLUMNS) + " |\n|" + "---|" * (3 + len(COLUMNS)))
    for length in asked.lengths:
        rows = []
        for body, light in itertools.product(asked.bodies, asked.lights):
            case = (body, length, light)
            with multiprocessing.get_context("spawn").Pool(1) as pool:
                nearest, shadow = pool.apply(rays, (case,))
            found = measure(case, asked.samples)
            walk, hybrid, diffusion = (found[m] for m in METHODS)
            hybrid |= {
                "rays": nearest + shadow,
                "shadow": shadow,
                "walk": walk["error"],
                "diffusion": diffusion["time"],
            }
            hybrid["efficiency"] = hybrid["noise"] * hybrid["time"] / walk["noise"]
            rows.append(hybrid)
            print(line([f"{length:g}", body, light], hybrid), flush=True)
        means = {key: float(np.mean([row[key] for row in rows])) for key in COLUMNS.values()}
        print(line([f"**{length:g}**", "mean", ""], means), flush=True)


if __name__ == "__main__":
    main()
