"""What direct light at a second point of each segment in a medium brings: `python -m benchmarks.beside_lamps`.

A cube of 2 that scatters alone, one point lamp, one bounce: noise (relative, between seeds) times the root of the
processor time with it, over that without. Prints Markdown.
"""

import time

import numpy as np

from restir_engine.scene import scene as scenes
from restir_engine.scene.lamps import point_lamp
from testing.scenes.lights import matrix
from testing.scenes.media import along_y, cube, medium, stage
from testing.scenes.rooms import WHITE, render

SIZE, SAMPLES, SEEDS = 16, 256, 4
PLACES = {"lamp inside": (0.2, 0.0, 0.1), "lamp above": (0.2, 0.5, 2.0)}
FLAG = scenes.rec.SCENE_HAS_PIVOTS


def worth(sigma: float, place: tuple[float, float, float], beside: bool) -> float:
    """Noise times the root of the processor time."""
    scenes.rec.SCENE_HAS_PIVOTS = FLAG if beside else 0
    pictures, seconds = [], 0.0
    for seed in range(-1, SEEDS):
        b = stage(world=0.0)
        b.lamp(point_lamp(matrix(place), WHITE, 0.0))
        cube(b, medium(scattering=sigma))
        scene = b.finish(along_y(size=SIZE))
        start = time.process_time()
        picture = render(scene, SAMPLES, max_bounces=1, volume_bounces=1, pixel_filter="BOX", seed=seed + 1)
        if seed >= 0:  # the first compiles
            pictures.append(picture)
            seconds += time.process_time() - start
    pictures = np.stack(pictures)
    return float(np.sqrt(pictures.var(0, ddof=1).mean()) / pictures.mean() * np.sqrt(seconds))


def main() -> None:
    """Print the table."""
    print("| σ | " + " | ".join(PLACES) + " |\n|---|---|---|")
    for sigma in (0.05, 0.5, 3.0):
        ratios = (worth(sigma, place, True) / worth(sigma, place, False) for place in PLACES.values())
        print(f"| {sigma} | " + " | ".join(f"{ratio:.2g}" for ratio in ratios) + " |", flush=True)


if __name__ == "__main__":
    main()
