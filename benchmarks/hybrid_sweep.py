"""DIFFUSION, HYBRID as published and as it is here beside random walks: `python -m benchmarks.hybrid_sweep`.

Bodies × mean free path / size × lights; the three channels are three albedos. Truth is RANDOM_WALK with the same entry,
without Cycles' approximations. `--out` names a JSON file with every row, `--plot` a drawing.
"""

from __future__ import annotations

import argparse
import itertools
import json
import time
from pathlib import Path

import numpy as np

from restir_engine.scene.lamps import area_lamp
from testing.measures import block_error, flip
from testing.scenes.lights import matrix
from testing.scenes.scattering import look, render, scatter_scene, subsurface_program

from .scatter_bodies import BODIES

MEAN_FREE_PATHS = (0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0)
COLORS = (0.3, 0.6, 0.9)
SIZE = 64
# Lamps (place, direction in which it shines, watts, edge) and radiance of the sky.
LIGHTS = {
    "even": (None, 1.0),
    "back": (((0.4, 3.0, 0.5), (-0.1, -1.0, -0.15), 150.0, 1.5), 0.0),
    "spot": (((0.25, -0.9, 0.3), (-0.2, 1.0, -0.25), 2.0, 0.06), 0.0),
}
METHODS = {
    "DIFFUSION": {"sss_method": "DIFFUSION"},
    "published": {"sss_method": "HYBRID", "sss_thickness_aware": False},
    "HYBRID": {"sss_method": "HYBRID"},
}
WALK = {"sss_method": "RANDOM_WALK", "exact_walks": True}


def scene_of(body: str, length: float, light: str, entry: str, size=(SIZE, SIZE), width=1.3):
    """A body in one of the lights, seen from its front, which looks along -y; size: pixels, width: scene units."""
    lamp, sky = LIGHTS[light]
    program = subsurface_program(COLORS, length, roughness=0.4, entry=entry)
    lamps = [area_lamp(matrix(lamp[0], -np.asarray(lamp[1])), (lamp[2],) * 3, lamp[3], lamp[3])] if lamp else []
    scene = scatter_scene(BODIES[body](), program, lamps, sky)
    return look(scene, (0.5, -4.0, 0.6), width=size[0], height=size[1], size=width)


def pictures(scene, samples: int, seed: int = 0, **settings) -> tuple[np.ndarray, float]:
    """(the light below the surface, rgb; seconds) on two threads."""
    began = time.perf_counter()
    image = render(scene, samples, ("Combined", "Subsurface"), 2, seed=seed, max_bounces=0, **settings)["Subsurface"]
    return image, time.perf_counter() - began


def rows(bodies, lengths, lights, samples: int, entry: str):
    """A row for each body, length, light, method and albedo."""
    for body, length, light in itertools.product(bodies, lengths, lights):
        scene = scene_of(body, length, light, entry)
        truth, walked = pictures(scene, 2 * samples, 7, **WALK)
        # The block error that the truth's own noise makes: half of what two halves of it differ by, twice over.
        other, _ = pictures(scene, samples, 8, **WALK)
        for method, settings in METHODS.items():
            image, seconds = pictures(scene, samples, **settings)
            for k, color in enumerate(COLORS):
                one, right, noisy = (np.repeat(x[..., k : k + 1], 3, axis=2) for x in (image, truth, other))
                yield {
                    "body": body, "mfp": length, "light": light, "method": method, "color": color,
                    "bias": float(one.mean() / right.mean() - 1.0), "block": block_error(one, right),
                    "flip": flip(one, right), "noise": block_error(noisy, right),
                    "time": 2.0 * seconds / walked,
                }  # fmt: skip


def summary(found: list[dict]) -> str:
    """A Markdown table: the worst bias over the albedos, means of block error and FLIP, by body, light and length."""
    lines = ["| body | light | mfp / size | " + " | ".join(f"{m} bias | block error | FLIP" for m in METHODS) + " |"]
    lines.append("|" + "---|" * (3 + 3 * len(METHODS)))
    for body, light, mfp in sorted({(r["body"], r["light"], r["mfp"]) for r in found}):
        cells = [body, light, f"{mfp:g}"]
        for method in METHODS:
            own = [r for r in found if (r["body"], r["light"], r["mfp"], r["method"]) == (body, light, mfp, method)]
            worst = max((r["bias"] for r in own), key=abs)
            block = np.mean([r["block"] for r in own])
            cells += [f"{100 * worst:+.0f} %", f"{block:.4f}", f"{np.mean([r['flip'] for r in own]):.3f}"]
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines)


def averages(found: list[dict]) -> str:
    """A Markdown table: block error and mean size of the bias by length, means over bodies, lights and albedos."""
    lines = [
        "| mfp / size | " + " | ".join(f"{m} | bias" for m in METHODS) + " |",
        "|" + "---|" * (1 + 2 * len(METHODS)),
    ]
    for mfp in sorted({r["mfp"] for r in found}):
        cells = [f"{mfp:g}"]
        for method in METHODS:
            own = [r for r in found if (r["mfp"], r["method"]) == (mfp, method)]
            cells += [
                f"{np.mean([r['block'] for r in own]):.4f}",
                f"{100 * np.mean([abs(r['bias']) for r in own]):.0f} %",
            ]
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines)


def plot(found: list[dict]) -> str:
    """SVG: block error over mean free path / size, means over bodies, lights and albedos, for each method."""
    lengths = sorted({r["mfp"] for r in found})
    low, high, left, top, width, height = -4.5, 0.0, 64, 34, 440, 260

    def place(length: float, error: float) -> tuple[float, float]:
        x = np.log(length / lengths[0]) / max(np.log(lengths[-1] / lengths[0]), 1e-9)
        return left + width * x, top + height * (high - np.log10(max(error, 10.0**low))) / (high - low)

    def text(x: float, y: float, words: str, anchor: str = "middle", more: str = "") -> str:
        return f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}" {more}>{words}</text>'

    parts = [f'<svg xmlns="http://www.w3.org/2000/svg" width="{left + width + 24}" height="{top + height + 46}"']
    parts.append('font-family="sans-serif" font-size="12"><rect width="100%" height="100%" fill="white"/>')
    for power in range(-4, 1):
        y = place(lengths[0], 10.0**power)[1]
        parts.append(
            f'<path d="M{left},{y:.1f}h{width}" stroke="#ddd"/>{text(left - 8, y + 4, f"{10.0**power:g}", "end")}'
        )
    for length in lengths:
        x = place(length, 1.0)[0]
        parts.append(f'<path d="M{x:.1f},{top}v{height}" stroke="#eee"/>{text(x, top + height + 16, f"{length:g}")}')
    for k, (method, color) in enumerate(zip(METHODS, ("#c33", "#d90", "#26a"), strict=True)):
        points = []
        for n in lengths:
            points.append(place(n, np.mean([r["block"] for r in found if (r["mfp"], r["method"]) == (n, method)])))
        line = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
        parts.append(f'<polyline points="{line}" fill="none" stroke="{color}" stroke-width="2"/>')
        parts += [f'<circle cx="{x:.1f}" cy="{y:.1f}" r="3" fill="{color}"/>' for x, y in points]
        parts.append(text(left + 130 * k, 20, method, "start", f'fill="{color}" font-weight="bold"'))
    parts.append(text(left + width / 2, top + height + 36, "mean free path / size"))
    parts.append(text(14, top + height / 2, "block error", more=f'transform="rotate(-90 14 {top + height / 2})"'))
    return "\n".join(parts) + "</svg>\n"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--bodies", nargs="+", default=list(BODIES))
    parser.add_argument("--lengths", nargs="+", type=float, default=list(MEAN_FREE_PATHS))
    parser.add_argument("--lights", nargs="+", default=list(LIGHTS))
    parser.add_argument("--samples", type=int, default=32)
    parser.add_argument("--entry", default="DIFFUSE")
    parser.add_argument("--out", type=Path)
    parser.add_argument("--plot", type=Path)
    asked = parser.parse_args()
    found = []
    for row in rows(asked.bodies, asked.lengths, asked.lights, asked.samples, asked.entry):
        found.append(row)
        if asked.out:
            asked.out.write_text(json.dumps(found))
    if asked.plot:
        asked.plot.write_text(plot(found))
    print(averages(found), summary(found), sep="\n\n")
    for method in METHODS:
        print(
            method,
            *(f"{np.mean([r[m] for r in found if r['method'] == method]):.4f}" for m in ("block", "flip", "time")),
        )


if __name__ == "__main__":
    main()
