"""How far RESTIR's mean is from PATH's, by kind of reuse: `python -m benchmarks.bias [LIGHT] [--seeds N]`.

Direct light alone (no bounces) of the room of tests/unit/pictures.py at 32 × 32 pixels. Prints a table in Markdown:
the relative difference of the mean luminance and its standard error over independent renders, relMSE of 8 samples, the
time of all on the CPU.
"""

from __future__ import annotations

import argparse
import math
import sys
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "unit"))

from pictures import LIGHTS, picture_scene, render

LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
UNBIASED_MIS = ("BALANCE", "PAIRWISE", "DEFENSIVE", "CONTRIBUTION")
SAMPLES = 8  # of one render: the longest history

NONE = {"restir_rounds": 0}
SPATIAL = {"restir_rounds": 1}
TEMPORAL = {"restir_rounds": 0, "restir_temporal": True}
BOTH = {"restir_rounds": 1, "restir_temporal": True}


def combinations() -> dict[str, dict]:
    """Settings by name: those without bias first."""
    found: dict[str, dict] = {}
    for target in ("TARGET", "SHADED"):
        v = {"restir_visibility": target}
        found[f"no reuse, {target}"] = NONE | v
        for mis in UNBIASED_MIS:
            found[f"spatial, {mis}, {target}"] = SPATIAL | v | {"restir_mis": mis}
        for cap in (1.0, 20.0):
            for mis in ("BALANCE", "DEFENSIVE"):
                for name, reuse in (("temporal", TEMPORAL), ("both", BOTH)):
                    c = {"restir_confidence_cap": cap, "restir_mis": mis}
                    found[f"{name}, {mis}, cap {cap:g}, {target}"] = reuse | v | c
    return found


def shortcuts() -> dict[str, dict]:
    """Settings that trade bias for time or noise."""
    reused, estimated = {"restir_visibility": "REUSED"}, {"restir_visibility": "ESTIMATED"}
    return {
        "spatial, CONFIDENCE (1/M)": SPATIAL | {"restir_mis": "CONFIDENCE"},
        "both, CONFIDENCE (1/M)": BOTH | {"restir_mis": "CONFIDENCE"},
        "both, REUSED": BOTH | reused,
        "both, ESTIMATED": BOTH | estimated,
        "both, ESTIMATED by channel": BOTH | estimated | {"restir_by_channel": True},
        "both, ESTIMATED, near 8": BOTH | estimated | {"restir_near": 8.0},
        "both, REUSED, discard": BOTH | reused | {"restir_discard": True},
        "both, ESTIMATED, discard": BOTH | estimated | {"restir_discard": True},
    }


def relmse(x: np.ndarray, reference: np.ndarray) -> float:
    """Mean of (x - r)² / (r² + 0.01), the worst 0.1 % of pixels left out."""
    error = ((x - reference) ** 2 / (reference**2 + 0.01)).mean(-1).ravel()
    return float(np.sort(error)[: math.ceil(0.999 * len(error))].mean())


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("light", nargs="?", default="all", choices=LIGHTS)
    parser.add_argument("--seeds", type=int, default=64)
    parser.add_argument("--only", default="", help="names that contain this")
    args = parser.parse_args()
    scene = picture_scene(args.light, 32)
    references = np.stack([render(scene, 2048, seed=seed, integrator="PATH", max_bounces=0) for seed in range(8)])
    reference = references.mean(0)
    means = references.mean((1, 2)) @ LUMINANCE
    truth, truth_error = means.mean(), means.std(ddof=1) / math.sqrt(len(means))
    print(f"PATH: standard error {100 * truth_error / truth:.3f} %\n")
    print("| settings | bias % | standard error % | relMSE | CPU seconds |\n|---|---|---|---|---|")
    for name, settings in (combinations() | shortcuts()).items():
        if args.only not in name:
            continue
        start = time.process_time()
        pictures = [
            render(scene, SAMPLES, seed=1000 + seed, integrator="RESTIR", max_bounces=0, **settings)
            for seed in range(args.seeds)
        ]
        seconds = time.process_time() - start
        means = np.stack(pictures).mean((1, 2)) @ LUMINANCE
        error = math.hypot(means.std(ddof=1) / math.sqrt(len(means)), truth_error) / truth
        noise = np.mean([relmse(picture, reference) for picture in pictures])
        bias = means.mean() / truth - 1.0
        print(f"| {name} | {100 * bias:+.2f} | {100 * error:.2f} | {noise:.4f} | {seconds:.1f} |", flush=True)


if __name__ == "__main__":
    main()
