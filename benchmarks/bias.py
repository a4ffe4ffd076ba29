"""How far RESTIR's mean is from PATH's, by kind of reuse: `python -m benchmarks.bias [LIGHT] [--seeds N] [--moving]`.

Direct light alone (no bounces) of the room of testing/scenes/rooms.py at 32 × 32 pixels. Prints a table in Markdown:
the relative difference of the mean luminance and its standard error over independent renders, relMSE of 8 samples, the
time of all on the CPU.

With --moving the last of four frames at 96 × 96 pixels, by what moves (testing/scenes/moving.py): bias of the mean,
with the frame's own candidates as control variate; and how the biases of 36 blocks of the picture spread, in their
standard errors. With --visibility what visibility that is reused or averaged does to V̄ and the picture, in the scene of
testing/scenes/card.py. With --subsurface every shift of subsurface light, beside the same without reuse, in 8 samples
at 64 × 64 pixels and in the last of three frames in which all moves (testing/scenes/translucent.py).
"""

from __future__ import annotations

import argparse
import math
import time

import numpy as np

from restir_engine.reuse_settings import ReuseSettings
from testing.scenes import card
from testing.scenes.moving import MOVES, animation, bias, histories, reuse_of
from testing.scenes.rooms import LIGHTS, picture_scene, render
from testing.scenes.translucent import STEPS, subsurface_light, translucent

LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
UNBIASED_MIS = ("BALANCE", "PAIRWISE", "DEFENSIVE", "CONTRIBUTION")
SAMPLES = 8  # of one render: the longest history

NONE = {"rounds": 0}
SPATIAL = {"rounds": 1}
TEMPORAL = {"rounds": 0, "temporal": True}
BOTH = {"rounds": 1, "temporal": True}


def combinations() -> dict[str, dict]:
    """Settings by name: those without bias first."""
    found: dict[str, dict] = {}
    for target in ("TARGET", "SHADED"):
        v = {"visibility": target}
        found[f"no reuse, {target}"] = NONE | v
        for mis in UNBIASED_MIS:
            found[f"spatial, {mis}, {target}"] = SPATIAL | v | {"mis": mis}
        for cap in (1.0, 20.0):
            for mis in ("BALANCE", "DEFENSIVE"):
                for name, reuse in (("temporal", TEMPORAL), ("both", BOTH)):
                    c = {"confidence_cap": cap, "mis": mis}
                    found[f"{name}, {mis}, cap {cap:g}, {target}"] = reuse | v | c
    return found


def shortcuts() -> dict[str, dict]:
    """Settings that trade bias for time or noise."""
    reused, estimated = {"visibility": "REUSED"}, {"visibility": "ESTIMATED"}
    return {
        "spatial, CONFIDENCE (1/M)": SPATIAL | {"mis": "CONFIDENCE"},
        "both, CONFIDENCE (1/M)": BOTH | {"mis": "CONFIDENCE"},
        "both, REUSED": BOTH | reused,
        "both, ESTIMATED": BOTH | estimated,
        "both, ESTIMATED by channel": BOTH | estimated | {"by_channel": True},
        "both, ESTIMATED, near 8": BOTH | estimated | {"near": 8.0},
        "both, REUSED, discard": BOTH | reused | {"discard": True},
        "both, ESTIMATED, discard": BOTH | estimated | {"discard": True},
    }


def relmse(x: np.ndarray, reference: np.ndarray) -> float:
    """Mean of (x - r)² / (r² + 0.01), the worst 0.1 % of pixels left out."""
    error = ((x - reference) ** 2 / (reference**2 + 0.01)).mean(-1).ravel()
    return float(np.sort(error)[: math.ceil(0.999 * len(error))].mean())


MOVING = {  # plans by name, and what moves
    **{f"{moves}, temporal": (moves, reuse_of(temporal=True)) for moves in MOVES},
    **{
        f"all, {'both' if rounds else 'temporal'}, {mis}, {target}": (
            "all",
            reuse_of(temporal=True, rounds=rounds, mis=mis, visibility=target),
        )
        for rounds in (0, 1)
        for mis in ("BALANCE", "DEFENSIVE")
        for target in ("TARGET", "SHADED")
    },
    "all, temporal, NOW": ("all", reuse_of(temporal=True, history_target="NOW")),
}


def blocks(pictures: np.ndarray, count: int = 6) -> np.ndarray:
    """Means of (n, size, size) over count × count blocks."""
    n, size = pictures.shape[:2]
    return pictures.reshape(n, count, size // count, count, size // count).mean((2, 4)).reshape(n, -1)


def spread(pictures: np.ndarray, truths: np.ndarray) -> np.ndarray:
    """z-scores of the blocks that are lit."""
    a, b = blocks(pictures), blocks(truths)
    error = np.hypot(a.std(0, ddof=1) / math.sqrt(len(a)), b.std(0, ddof=1) / math.sqrt(len(b)))
    lit = b.mean(0) > 0.0
    return ((a.mean(0) - b.mean(0)) / np.maximum(error, 1e-12))[lit]


def moving(seeds: int, only: str) -> None:
    """Print the table of --moving; each row has seeds of its own."""
    scene = animation("all", 96)[-1]
    truths = np.stack([render(scene, 256, seed=seed, integrator="PATH", max_bounces=0) for seed in range(8)])
    truths = truths @ LUMINANCE
    print("| what moves, settings | bias % | standard error % | z of blocks: RMS | largest |\n|---|---|---|---|---|")
    for row, (name, (moves, plan)) in enumerate(MOVING.items()):
        if only not in name:
            continue
        first = 10000 * (row + 1)
        pictures, candidates = histories(animation(moves, 96), plan, range(first, first + seeds))
        found, error = bias(pictures, candidates, truths)
        z = spread(pictures, truths)
        rms, largest = np.sqrt((z**2).mean()), np.abs(z).max()
        print(f"| {name} | {100 * found:+.3f} | {100 * error:.3f} | {rms:.2f} | {largest:.1f} |", flush=True)


def averaged_visibility(seeds: int) -> None:
    """Print the table of --visibility."""
    scene = card.card()
    truth = card.converged(scene)
    known = None
    print("| | variance of V̄ | bias % | standard error % | RMS of the pixels' biases % |\n|---|---|---|---|---|")
    for name, reuse in card.REUSES.items():
        images, v = card.pictures(scene, *reuse, seeds)
        known = card.always_known(v) if known is None else known
        variance = np.nanvar(v[:, known], 0, ddof=1).mean()
        off, error = card.bias(images, truth)
        rms = card.structure(images, truth)
        print(f"| {name} | {variance:.4f} | {100 * off:+.2f} | {100 * error:.2f} | {100 * rms:.1f} |", flush=True)


SHIFTS = ("RECONNECTION", "DELAYED", "HYBRID", "SEQUENTIAL", "SEQUENTIAL_FAST")


def subsurface(seeds: int, only: str) -> None:
    """Print the table of --subsurface: differences of the mean from renders of the same seeds without reuse."""
    still, steps = translucent(), [translucent(step, "all") for step in range(STEPS)]

    def last(seed: int, **settings) -> float:
        history = None
        first = 0 if "sss_shift" in settings else STEPS - 1
        for step, scene in enumerate(steps[first:], first):
            light = subsurface_light(scene, 1, history=history, seed=STEPS * seed + step, **settings)
            history = light.history
        return float((light.rgb @ LUMINANCE).mean())

    def mean(seed: int, **settings) -> float:
        return float((subsurface_light(still, SAMPLES, seed=seed, **settings).rgb @ LUMINANCE).mean())

    print("| method, shift | bias % | standard error % |\n|---|---|---|")
    kinds = {
        "space": (mean, {}),
        "space and time": (mean, {"sss_temporal": True}),
        "moving": (last, {"sss_temporal": True}),
    }
    for method in ("DIFFUSION", "HYBRID"):
        for kind, (render_mean, more) in kinds.items():
            alone = np.array([render_mean(seed, sss_method=method) for seed in range(seeds)])
            for shift in SHIFTS:
                name = f"{method}, {shift}, {kind}"
                if only not in name:
                    continue
                settings = {"sss_method": method, "sss_shift": shift, **more}
                off = np.array([render_mean(seed, **settings) for seed in range(seeds)]) - alone
                error = off.std(ddof=1) / math.sqrt(seeds)
                print(
                    f"| {name} | {100 * off.mean() / alone.mean():+.2f} | {100 * error / alone.mean():.2f} |",
                    flush=True,
                )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("light", nargs="?", default="all", choices=LIGHTS)
    parser.add_argument("--seeds", type=int, default=64)
    parser.add_argument("--only", default="", help="names that contain this")
    parser.add_argument("--moving", action="store_true", help="histories of scenes in which something moves")
    parser.add_argument("--subsurface", action="store_true", help="shifts of subsurface light")
    parser.add_argument("--visibility", action="store_true", help="visibility that is reused or averaged")
    args = parser.parse_args()
    if args.visibility:
        averaged_visibility(args.seeds)
        return
    if args.subsurface:
        subsurface(args.seeds, args.only)
        return
    if args.moving:
        moving(args.seeds, args.only)
        return
    scene = picture_scene(args.light, 32)
    references = np.stack([render(scene, 2048, seed=seed, integrator="PATH", max_bounces=0) for seed in range(8)])
    reference = references.mean(0)
    means = references.mean((1, 2)) @ LUMINANCE
    truth, truth_error = means.mean(), means.std(ddof=1) / math.sqrt(len(means))
    print(f"PATH: standard error {100 * truth_error / truth:.3f} %\n")
    print("| settings | bias % | standard error % | relMSE | CPU seconds |\n|---|---|---|---|---|")
    for name, options in (combinations() | shortcuts()).items():
        if args.only not in name:
            continue
        settings = ReuseSettings(pilot=False, **options)
        start = time.process_time()
        pictures = [
            render(scene, SAMPLES, seed=1000 + seed, integrator="RESTIR", max_bounces=0, reuse=settings)
            for seed in range(args.seeds)
        ]
        seconds = time.process_time() - start
        means = np.stack(pictures).mean((1, 2)) @ LUMINANCE
        error = math.hypot(means.std(ddof=1) / math.sqrt(len(means)), truth_error) / truth
        noise = np.mean([relmse(picture, reference) for picture in pictures])
        off = means.mean() / truth - 1.0
        print(f"| {name} | {100 * off:+.2f} | {100 * error:.2f} | {noise:.4f} | {seconds:.1f} |", flush=True)


if __name__ == "__main__":
    main()
