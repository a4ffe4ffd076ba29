"""Whole paths resampled beside PATH: `python -m benchmarks.whole_paths [SCENE …] [--ladder | --view | --final] …`.

Interiors of testing/scenes/interiors.py at 64 × 64 pixels, twelve bounces, one thread. relMSE (the worst 0.1 % of the
pixels left out) against many samples; time is that of the processor. As noise goes with one over time, the last column
is relMSE × time by PATH's. Two tables in Markdown: final frames of eight samples; the 17th frame of a camera that
moves, one sample a frame, beside PATH in as much time. --ladder: what items of ReSTIR PT Enhanced bring, added one by
one (as in its supplement's table 1), in place of these. --view: what the 3D view does before it rests, one sample a
pixel and four bounces, also in rooms under each kind of light (testing/scenes/rooms.py): while the camera moves, the
17th frame; after an edit, a first one.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator

import numpy as np

from restir_engine.context import FrameContext
from restir_engine.film import Film
from restir_engine.integrators.path.integrator import PathIntegrator
from restir_engine.integrators.restir.integrator import RestirIntegrator
from restir_engine.reuse_settings import ReuseSettings
from restir_engine.settings import RenderSettings, required_passes
from testing.measures import relmse
from testing.scenes import interiors, rooms
from testing.scenes.interiors import SCENES, interior
from testing.scenes.rooms import LIGHTS, look, picture_scene, render

SAMPLES, FRAMES, BOUNCES = 8, 17, 12
ONE = {"light_samples": 1, "light_candidates": 8}  # these rooms have a lamp or two; tiles cost time there
WHOLE = ONE | {"paths": "WHOLE"}
FINAL = {
    "light tiles, no reuse": {"pilot": False},
    "indirect, 1 round of 3": ONE | {"paths": "INDIRECT", "rounds": 1},
    "whole, 1 round of 3": WHOLE | {"rounds": 1},
    "whole, 2 rounds of 6": WHOLE | {"rounds": 2, "neighbours": 6},
    "whole, 3 rounds of 4": WHOLE | {"rounds": 3, "neighbours": 4},
    "whole, 3 rounds of 4, without tiles": WHOLE | {"rounds": 3, "neighbours": 4, "light_candidates": 0},
}
MOVING = {
    "direct, temporal and 1 round": {"temporal": True, "rounds": 1},
    "whole, temporal": WHOLE | {"temporal": True},
    "whole, temporal and 1 round of 3": WHOLE | {"temporal": True, "rounds": 1},
    "whole, temporal and 2 rounds of 6": WHOLE | {"temporal": True, "rounds": 2, "neighbours": 6},
}
VIEW_BOUNCES = 4
EDITED = {
    "light tiles": {"pilot": False},
    "direct, 1 round": {"rounds": 1},
    "indirect, 1 round": {"paths": "INDIRECT", "rounds": 1},
}
ORBITED = {
    "direct, temporal and 1 round": {"temporal": True, "rounds": 1},
    "indirect, temporal and 1 round": {"paths": "INDIRECT", "temporal": True, "rounds": 1},
    "whole, temporal and 1 round": {"paths": "WHOLE", "temporal": True, "rounds": 1},
}
_PLAIN = WHOLE | {"rounds": 2, "neighbours": 6, "pattern": "DISK", "vector_weights": False}
LADDER = {  # each with all before it
    "random replay alone": _PLAIN | {"footprint": 1e9},
    "reconnection wherever lobes are rough": {"footprint": 0.0, "connect_roughness": 0.04},
    "dual footprint threshold": {"footprint": 0.02},
    "black-box connectability": {"connect_roughness": 0.2},
    "paired reuse": {"pattern": "PAIRS"},
    "sum of samples (less noise of color)": {"vector_weights": True},
    "light samples from 32 points of tiles": {"light_candidates": 32},
    "direct light apart": {"paths": "INDIRECT"},
}


def settings_of(options: dict | None, seed: int, bounces: int) -> RenderSettings:
    """Of PATH where there are no options."""
    if options is None:
        return RenderSettings(integrator="PATH", seed=seed, max_bounces=bounces)
    return RenderSettings(integrator="RESTIR", seed=seed, max_bounces=bounces, reuse=ReuseSettings(**options))


def tiles_of(size: int) -> list[tuple[int, int, int, int]]:
    return [(x, y, min(x + 32, size), min(y + 32, size)) for y in range(0, size, 32) for x in range(0, size, 32)]


def step(integrator, sample: int, samples: int, tiles: list) -> float:
    """Render samples on this thread; its processor seconds."""
    scratch = integrator.scratch()
    start = time.process_time()
    for stage in integrator.stages(sample, samples):
        for item in tiles if stage.items is None else stage.items:
            stage.run(item, scratch)
        stage.finish()
    return time.process_time() - start


def final(scene, size: int, options: dict | None, seed: int, samples=SAMPLES, bounces=BOUNCES):
    """(picture of so many samples, processor seconds)."""
    settings = settings_of(options, seed, bounces)
    film = Film(size, size, required_passes(settings.passes, False), 1.0)
    kind = PathIntegrator if options is None else RestirIntegrator
    integrator = kind(FrameContext(scene), settings, film)
    integrator.prepare()
    count = samples if options is None else 1
    seconds = sum(step(integrator, sample, count, tiles_of(size)) for sample in range(0, samples, count))
    film.samples = samples
    return film.pass_array("Combined")[:, :, :3], seconds


def moved(view: tuple, size: int, frame: int):
    """The camera of a frame: it walks sideways and forwards, and stands in its last frame where the scene has it."""
    back = FRAMES - 1 - frame
    eye, target = (np.array(v) for v in view)
    return look(eye + back * np.array([0.03, -0.01, 0.005]), target + back * np.array([0.01, 0.0, 0.0]), size)


def moving(scene, view: tuple, size: int, options: dict, seed: int, bounces=BOUNCES) -> tuple[np.ndarray, float]:
    """(the last of FRAMES frames, the processor seconds that it took)."""
    history = None
    for frame in range(FRAMES):
        settings = settings_of(options, seed * FRAMES + frame, bounces)
        film = Film(size, size, required_passes(settings.passes, False), 1.0)
        integrator = RestirIntegrator(FrameContext(scene, moved(view, size, frame)), settings, film, history)
        integrator.prepare()
        history = integrator.history
        seconds = step(integrator, 0, 1, tiles_of(size))
    film.samples = 1
    return film.pass_array("Combined")[:, :, :3], seconds


def measured(rows: dict, run, reference: np.ndarray, seeds: int) -> Iterator[tuple[str, float, float, float]]:
    """(name, relMSE, processor seconds, the two multiplied) of each row, on average of some seeds."""
    for name, options in rows.items():
        pictures, seconds = zip(*(run(options, seed) for seed in range(seeds)), strict=True)
        noise = float(np.mean([relmse(picture, reference) for picture in pictures]))
        yield name, noise, float(np.mean(seconds)), noise * float(np.mean(seconds))


def table(title: str, name: str, rows: dict, run, reference: np.ndarray, seeds: int, base: float) -> None:
    """Print rows; base: relMSE × seconds of PATH."""
    for row, noise, seconds, work in measured(rows, run, reference, seeds):
        print(f"| {title} | {name} | {row} | {noise:.4f} | {1e3 * seconds:.1f} | {work / base:.2f} |", flush=True)


def compare_in_view(name: str, size: int, samples: int, seeds: int) -> None:
    """Print the rows of --view for a scene."""
    scene = interior(name, size) if name in SCENES else picture_scene(name, size)
    view = interiors.VIEW if name in SCENES else rooms.VIEW
    reference = render(scene, samples, seed=99999, integrator="PATH", max_bounces=VIEW_BOUNCES)

    def first(options, seed):
        return final(scene, size, options, seed, 1, VIEW_BOUNCES)

    def orbit(options, seed):
        return moving(scene, view, size, options, seed, VIEW_BOUNCES)

    (_, noise, seconds, base), *_ = measured({"PATH": None}, first, reference, 2 * seeds)
    print(f"| edited | {name} | PATH | {noise:.4f} | {1e3 * seconds:.1f} | 1 |", flush=True)
    table("edited", name, EDITED, first, reference, seeds, base)
    table("orbited", name, ORBITED, orbit, reference, seeds, base)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scenes", nargs="*", metavar="SCENE", help=", ".join([*SCENES, *LIGHTS]))
    parser.add_argument("--seeds", type=int, default=4)
    parser.add_argument("--size", type=int, default=64)
    parser.add_argument("--reference", type=int, default=4096, help="samples of PATH")
    parser.add_argument("--ladder", action="store_true")
    parser.add_argument("--view", action="store_true")
    parser.add_argument("--final", action="store_true", help="no camera that moves")
    args = parser.parse_args()
    print("| frames | scene | settings | relMSE | CPU ms | at equal time |\n|---|---|---|---|---|---|")
    if args.view:
        for name in args.scenes or [*SCENES, *LIGHTS]:
            compare_in_view(name, args.size, args.reference, args.seeds)
        return
    for name in args.scenes or SCENES:
        scene = interior(name, args.size)
        reference = render(scene, args.reference, seed=99999, integrator="PATH", max_bounces=BOUNCES)

        def still(options, seed, scene=scene):
            return final(scene, args.size, options, seed)

        (_, noise, seconds, base), *_ = measured({"PATH": None}, still, reference, args.seeds)
        print(f"| final | {name} | PATH | {noise:.4f} | {1e3 * seconds:.1f} | 1 |", flush=True)
        if args.ladder:
            options: dict = {}
            rows = {row: (options := options | more) for row, more in LADDER.items()}
            table("final", name, rows, still, reference, args.seeds, base)
            continue
        table("final", name, FINAL, still, reference, args.seeds, base)
        if args.final:
            continue

        def last(options, seed, scene=scene):
            return moving(scene, interiors.VIEW, args.size, options, seed)

        table("moving", name, MOVING, last, reference, args.seeds, base)


if __name__ == "__main__":
    main()
