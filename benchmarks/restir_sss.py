"""ReSTIR SSS beside path-traced DIFFUSION, after its paper's experiments: `python -m benchmarks.restir_sss [SCENE …]`.

Scenes of testing/scenes/translucent.py: a thin ear with light from behind, a ball among many lights, under a large
light, and under the boundary of a shadow; that boundary in a part of a picture of 1280 pixels; with RESTIR_ASSETS a
dragon. Direct light from below the surface. The error is the mean squared one, (x - r)² / (r² + 0.01), of the pixels
that show a translucent body. Prints tables in Markdown:

still    the error of so many samples, and error × processor time against PATH's: what it is at equal time
denoised the errors of Combined before and after it is denoised, of several numbers of samples
path     one sample a frame while the camera turns through 16 frames: the mean error and time of the frames, their
         product against PATH's, and the errors of frames 1, 2, 4, 8 and 16

Times are of one thread. References are PATH's, of other seeds. `--method` is the subsurface method.
"""

from __future__ import annotations

import argparse

import numpy as np

from restir_engine.integrators.blocks import integrator as blocks
from restir_engine.session import Session
from restir_engine.settings import RenderSettings
from testing.scenes.translucent import EXPERIMENTS, camera_at, experiment, subsurface_light

PATH = {"integrator": "PATH"}
NAMES = ("RECONNECTION", "DELAYED", "HYBRID", "SEQUENTIAL", "SEQUENTIAL_FAST")
BLOCKS = {"sss_shift": "BLOCKS"}
STILL = {"PATH": PATH, "no reuse": {}, "BLOCKS": BLOCKS, **{name: {"sss_shift": name} for name in NAMES}}
IN_TIME = {f"{name}, in time": {"sss_shift": name, "sss_temporal": True} for name in NAMES}
DENOISED_SAMPLES = 4, 16, 64
FRAMES, STEP = 16, 1.0  # of the camera's path; degrees a frame
SHOWN = (1, 2, 4, 8, 16)


def error(picture: np.ndarray, reference: np.ndarray) -> float:
    """Relative mean squared error of the pixels that are lit from below."""
    seen = reference.sum(-1) > 0.0
    return float(((picture - reference) ** 2 / (reference**2 + 0.01))[seen].mean())


def averaged(scene, args, camera=None) -> np.ndarray:
    """PATH's light, of seeds that nothing else uses."""
    return subsurface_light(scene, args.reference, camera, seed=9_999, sss_method=args.method, **PATH).rgb


def chosen(rows: dict[str, dict], args) -> list[tuple[str, dict]]:
    """Those rows that are asked for, with their settings."""
    wanted = args.rows.split(",") if args.rows else rows
    return [(row, {"sss_method": args.method, **rows[row]}) for row in wanted]


def stills(name: str, args) -> None:
    """Rows of still frames of a scene."""
    scene = experiment(name, args.size)
    reference = averaged(scene, args)
    base = 0.0
    for row, settings in chosen(STILL, args):
        subsurface_light(scene, 1, **settings)
        found = [subsurface_light(scene, args.samples, seed=1 + seed, **settings) for seed in range(args.seeds)]
        off = np.mean([error(light.rgb, reference) for light in found])
        seconds = np.mean([light.seconds for light in found])
        base = base or off * seconds
        print(f"| {name} | {row} | {off:.5f} | {seconds:.2f} | {off * seconds / base:.2f} |", flush=True)


def denoised(name: str, args) -> None:
    """Rows of pictures before and after they are denoised, by PATH's."""
    import bpy  # noqa: F401, by which its library is found

    scene = experiment(name, args.size)

    def picture(spread: int, samples: int, seed: int, filtered: bool, **settings) -> np.ndarray:
        blocks.DENOISED_SPREAD = spread
        fixed = {"integrator": "RESTIR", "sss_method": args.method, "max_bounces": 2, "threads": 1}
        session = Session(scene, RenderSettings(samples=samples, seed=seed, use_denoising=filtered, **fixed | settings))
        assert session.render()
        return np.array(session.combined())[..., :3].astype(float)

    ways = {"PATH": (1, PATH), "contiguous": (1, BLOCKS), "BLOCKS": (blocks.DENOISED_SPREAD, BLOCKS)}
    reference = picture(1, args.reference, 9_999, False, **BLOCKS)
    for samples in DENOISED_SAMPLES:
        base: tuple = ()
        for row, (spread, settings) in ways.items():
            found = [
                [error(picture(spread, samples, seed, filtered, **settings), reference) for filtered in (False, True)]
                for seed in range(1, 1 + args.seeds)
            ]
            raw, after = np.mean(found, 0)
            base = base or (raw, after)
            cells = f"{raw:.5f} | {raw / base[0]:.2f} | {after:.5f} | {after / base[1]:.2f}"
            print(f"| {name} | {samples} | {row} | {cells} |", flush=True)


def turns(name: str, args) -> None:
    """Rows of a camera's path about a scene."""
    scene = experiment(name, args.size)
    cameras = [camera_at(name, STEP * frame, args.size) for frame in range(FRAMES)]
    references = [averaged(scene, args, camera) for camera in cameras]
    base = 0.0
    for row, settings in chosen(STILL | IN_TIME, args):
        errors, seconds = np.zeros(FRAMES), 0.0
        subsurface_light(scene, 1, **settings)
        for seed in range(args.seeds):
            history = None
            for frame, camera in enumerate(cameras):
                light = subsurface_light(scene, 1, camera, history, seed=100 * seed + frame, **settings)
                history = light.history
                errors[frame] += error(light.rgb, references[frame]) / args.seeds
                seconds += light.seconds / args.seeds / FRAMES
        off = errors.mean()
        base = base or off * seconds
        shown = " ".join(f"{errors[frame - 1]:.3f}" for frame in SHOWN)
        cells = f"{off:.4f} | {1000.0 * seconds:.0f} | {off * seconds / base:.2f} | {shown}"
        print(f"| {name} | {row} | {cells} |", flush=True)


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="*", metavar="SCENE", help=f"{', '.join(EXPERIMENTS)}; all if none is named")
    parser.add_argument("--size", type=int, default=160, help="pixels along each side")
    parser.add_argument("--samples", type=int, default=8, help="of still frames")
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--reference", type=int, default=1024, help="samples of references")
    parser.add_argument("--method", choices=("DIFFUSION", "HYBRID"), default="DIFFUSION")
    parser.add_argument("--rows", help="names of rows, with commas; the first is what the others are compared with")
    parser.add_argument(
        "--part", choices=("still", "denoised", "path"), help="one of the tables alone; denoised is no part of all"
    )
    args = parser.parse_args()
    names = args.scenes or list(EXPERIMENTS)
    if args.part == "denoised":
        print("| scene | samples | | error | by PATH's | denoised | by PATH's |\n|---|---|---|---|---|---|---|")
        for name in names:
            denoised(name, args)
        return
    if args.part != "path":
        print("| scene | still | error | CPU s | error × time, PATH = 1 |\n|---|---|---|---|---|")
        for name in names:
            stills(name, args)
    if args.part != "still":
        print("\n| scene | camera's path | error | CPU ms a frame | error × time | of frames 1, 2, 4, 8, 16 |")
        print("|---|---|---|---|---|---|")
        for name in names:
            turns(name, args)


if __name__ == "__main__":
    main()
