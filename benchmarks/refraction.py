"""Resampled light that crosses straight beside HYBRID without that: `python -m benchmarks.refraction [SCENE …]`.

Scenes of testing/scenes/translucent.py, direct light from below the surface: a thin ear and plates of milk glass and of
darker glass with a lamp and a stick behind them, and milk glass under a checkered sky. Prints tables in Markdown:

still    the error of so many samples, processor time, error × time against HYBRID's by path tracing and by ReSTIR
turn     the same of frames of one sample, looked at one by one while the camera turns

Each error is the mean of (x - r)² / (r² + m² / 25) over the pixels that show the body, m being the reference's mean
there: of the light that crosses straight (*crossed*) and of all light from below (*all*). Times are of one thread, rows
in turns; references are PATH's, of other seeds.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator

import numpy as np

from testing.scenes.translucent import crossed, subsurface_light, view_at

SCENES = "thin ear", "milk glass", "dark glass", "textured light"
PARTS = "Subsurface Boundary", "Subsurface"
STILL = {
    "PATH": {"integrator": "PATH"},
    "RESTIR": {},
    "spatial, 1": {"sss_refraction": "SPATIAL", "sss_refraction_samples": 1},
    "spatial, 2": {"sss_refraction": "SPATIAL", "sss_refraction_samples": 2},
    "spatial, 4": {"sss_refraction": "SPATIAL", "sss_refraction_samples": 4},
    "spatial, 2; 3 neighbours": {"sss_refraction": "SPATIAL", "sss_neighbours": 3},
    "blocks": {"sss_shift": "BLOCKS"},
    "reconnection": {"sss_shift": "RECONNECTION"},
    "reconnection; spatial, 2": {"sss_shift": "RECONNECTION", "sss_refraction": "SPATIAL"},
}
TURN = {
    "PATH": {"integrator": "PATH"},
    "RESTIR": {},
    "spatial, 2": {"sss_refraction": "SPATIAL"},
    "temporal, 2": {"sss_refraction": "TEMPORAL"},
    "temporal, 2; 3 neighbours": {"sss_refraction": "TEMPORAL", "sss_neighbours": 3},
}
FRAMES, STEP = 8, 1.0  # of the camera's path; degrees a frame


class Seen:
    """Renders of a scene from a distance, with PATH's for reference."""

    def __init__(self, name: str, args) -> None:
        self.scene, self._args = crossed(name, args.size, args.distance), args

    def camera(self, turn: float):
        return view_at(turn, self._args.size, self._args.distance)

    def render(self, samples: int, camera=None, history=None, **settings) -> tuple[list[np.ndarray], float, object]:
        """(pictures of PARTS, processor seconds, history)."""
        settings = {"sss_method": "HYBRID", "sss_shift": "NONE"} | settings
        light = subsurface_light(self.scene, samples, camera, history, parts=PARTS, **settings)
        return light.parts, light.seconds, light.history

    def reference(self, camera=None) -> list[np.ndarray]:
        return self.render(self._args.reference, camera, seed=9_999, integrator="PATH", threads=0)[0]


def error(picture: np.ndarray, reference: np.ndarray) -> float:
    """See the module's text."""
    seen = reference.sum(-1) > 0.0
    least = 0.04 * reference[seen].mean() ** 2
    return float(((picture - reference) ** 2 / (reference**2 + least))[seen].mean())


def errors(pictures, references) -> list[float]:
    return [error(picture, reference) for picture, reference in zip(pictures, references, strict=True)]


def stills(name: str, args) -> dict[str, list]:
    """(error crossed, error of all, seconds) of each row of STILL, a list of seeds."""
    seen = Seen(name, args)
    references = seen.reference()
    found = {row: [] for row in STILL}
    for seed in range(args.seeds):
        for row, settings in STILL.items():
            if seed == 0:
                seen.render(1, **settings)
            pictures, seconds, _ = seen.render(args.samples, seed=1 + seed, **settings)
            found[row].append([*errors(pictures, references), seconds])
    return found


def turns(name: str, args) -> dict[str, list]:
    """The same of each row of TURN, a list of seeds and frames."""
    seen = Seen(name, args)
    cameras = [seen.camera(STEP * frame) for frame in range(FRAMES)]
    references = [seen.reference(camera) for camera in cameras]
    found = {row: [] for row in TURN}
    for seed in range(args.seeds):
        for row, settings in TURN.items():
            if seed == 0:
                seen.render(1, cameras[0], seen.render(1, cameras[0], **settings)[2], **settings)
            history = None
            for frame, camera in enumerate(cameras):
                number = 100 * seed + frame + 1
                pictures, seconds, history = seen.render(1, camera, history, seed=number, **settings)
                found[row].append([*errors(pictures, references[frame]), seconds])
    return found


def rows(name: str, found: dict[str, list]) -> Iterator[str]:
    """Lines of a table."""
    means = {row: np.mean(values, 0) for row, values in found.items()}
    base = means["PATH"], means["RESTIR"]
    for row, (straight, every, seconds) in means.items():
        products = straight * seconds, every * seconds
        ratios = [f"{products[k] / (other[k] * other[2]):.2f}" for k in (0, 1) for other in base]
        cells = f"{straight:.4f} | {every:.4f} | {1000.0 * seconds:.0f}", *ratios
        yield f"| {name} | {row} | {' | '.join(cells)} |"


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="*", metavar="SCENE", help=f"{', '.join(SCENES)}; all if none is named")
    parser.add_argument("--size", type=int, default=96, help="pixels along each side")
    parser.add_argument("--distance", type=float, default=2.6, help="of the camera; a body is 1.6 wide")
    parser.add_argument("--samples", type=int, default=4, help="of still frames")
    parser.add_argument("--seeds", type=int, default=4)
    parser.add_argument("--reference", type=int, default=1024, help="samples of references")
    parser.add_argument("--part", choices=("still", "turn"), help="one of the tables alone")
    args = parser.parse_args()
    for part, table in (("still", stills), ("turn", turns)):
        if args.part in (None, part):
            print(f"| scene | {part} | crossed | all | CPU ms | crossed × time: PATH = 1 | RESTIR = 1 ", end="")
            print("| all × time: PATH = 1 | RESTIR = 1 |\n|---|---|---|---|---|---|---|---|---|")
            for name in args.scenes or SCENES:
                print("\n".join(rows(name, table(name, args))), flush=True)


if __name__ == "__main__":
    main()
