"""Ranges of the samples, merged, beside one render: `python -m benchmarks.sample_ranges [--ranges N] [--seeds N]`.

The scene of testing/blender/ranges.py with all its passes, in multilayer files. For PATH, whose samples are the same:
the greatest difference of any pixel of a pass over the pass's greatest value, Cryptomatte as masks by id, for merged
files and for renders that deliver them (film_from). For what decides by the samples before (noise threshold, control
variates of RESTIR) over the seeds: the difference of the means of Combined with its standard error, the greatest one of
all passes in standard errors, variance and samples of merged pictures by those of renders. Prints Markdown.
"""

from __future__ import annotations

import argparse
import logging
import tempfile
from pathlib import Path

import numpy as np

from restir_engine.farm.exr import MultilayerFile
from restir_engine.farm.films import arrays_of, passes_in, views_of
from restir_engine.farm.merge import merge
from restir_engine.settings import SAMPLE_COUNT
from testing.blender import ranges

KINDS = {
    "PATH, noise threshold": {"integrator": "PATH", "use_adaptive_sampling": True, "adaptive_threshold": 0.1},
    "RESTIR": {"integrator": "RESTIR"},
    "RESTIR, reuse in time": {"integrator": "RESTIR"},
    "RESTIR, noise threshold": {"integrator": "RESTIR", "use_adaptive_sampling": True, "adaptive_threshold": 0.1},
}


def exact(scene, folder: Path, count: int) -> None:
    """Of PATH: the table of passes."""
    whole, merged, film = (folder / f"{name}.exr" for name in ("whole", "merged", "film"))
    ranges.save(scene, whole)
    merge(ranges.save_ranges(scene, folder, count), merged)
    ranges.save(scene, film, film_from=str(merged))
    merge([merged], merged, finish=True)
    print(f"| view layer | pass | merged from {count} ranges | delivered by film_from |\n|{'---|' * 4}")
    rows = zip(ranges.differences(merged, whole), ranges.differences(film, whole), strict=True)
    for (layer, name, one), (_, _, other) in rows:
        print(f"| {layer} | {name} | {one:.1e} | {other:.1e} |")


def pictures(path: Path) -> dict[str, np.ndarray]:
    """The passes of the first view layer that have means, by name; those that were divided times what they were by."""
    file = MultilayerFile(path)
    place = views_of(file)[0]
    arrays = arrays_of(file, *place)
    light = {item.name: arrays[item.divide] for item in passes_in(file, *place) if item.divide in arrays}
    return {name: array * light.get(name, 1.0) for name, array in arrays.items() if not name.startswith("Crypto")}


def in_the_mean(scene, folder: Path, count: int, seeds: int, **own) -> tuple[float, float, str, float, float]:
    """Difference of Combined's mean and its error in %, the pass that differs most; ratios of variances and samples.

    Both pictures of a seed have the same random numbers: errors are those of differences by seed.
    """
    one, other = [], []
    for seed in range(seeds):
        merge(ranges.save_ranges(scene, folder, count, seed=seed, **own), folder / "merged.exr", finish=True)
        other.append(pictures(folder / "merged.exr"))
        one.append(pictures(ranges.save(scene, folder / "whole.exr", seed=seed, **own)))
    off, error, score = {}, {}, {}
    for name in one[0]:
        means = [np.array([each[name].mean(dtype=float) for each in runs]) for runs in (one, other)]
        differences = means[1] - means[0]
        if abs(differences.mean()) > 1e-6 * abs(means[0].mean()):  # else it is rounding
            off[name] = differences.mean() / means[0].mean()
            error[name] = differences.std(ddof=1) / np.sqrt(seeds) / abs(means[0].mean())
            score[name] = abs(off[name]) / error[name]
    samples = 1.0 + off.pop(SAMPLE_COUNT, 0.0)
    worst = max(off, key=score.get, default="")
    noise = [np.var([each["Combined"] for each in runs], axis=0, ddof=1).mean() for runs in (one, other)]
    told = f"{score[worst]:.1f} ({worst})" if worst else "none"
    combined = (100.0 * values.get("Combined", 0.0) for values in (off, error))
    return *combined, told, noise[1] / noise[0], samples


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--ranges", type=int, default=4)
    parser.add_argument("--seeds", type=int, default=16)
    parser.add_argument("--size", type=int, default=64, help="pixels across")
    parser.add_argument("--samples", type=int, default=128)
    parser.add_argument("--means", action="store_true", help="leave out the table of passes")
    parser.add_argument("--only", default="", help="of the table of means, the rows with this in their names")
    args = parser.parse_args()
    logging.disable(logging.WARNING)
    scene = ranges.build(args.size, args.samples)
    scene.restir.reuse.pilot = False  # which takes PATH here
    with tempfile.TemporaryDirectory() as folder:
        if not args.means:
            exact(scene, Path(folder), args.ranges)
        print("\n| | Combined % | standard error % | worst pass, standard errors | variance | samples |")
        print(f"|{'---|' * 6}")
        layer = scene.view_layers[0]
        layer.lightgroups.remove(layer.lightgroups[0])  # with which RESTIR has no control variates
        for kind, own in KINDS.items():
            if args.only not in kind:
                continue
            scene.restir.reuse.temporal = "reuse" in kind
            off, error, told, noise, more = in_the_mean(scene, Path(folder), args.ranges, args.seeds, **own)
            print(f"| {kind} | {off:+.3f} | {error:.3f} | {told} | {noise:.2f} | {more:.2f} |", flush=True)


if __name__ == "__main__":
    main()
