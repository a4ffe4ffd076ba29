"""Short animations in which one thing moves, or all: lamp, caster of shadows, emitter, camera, meshes that deform.

What does not move stands where it ends. All animations have their last frame in common, so that one picture by PATH is
the truth for all of them.
"""

import math

import numpy as np

from restir_engine.context import FrameContext
from restir_engine.film import Film
from restir_engine.integrators.restir.integrator import RestirIntegrator
from restir_engine.reuse_settings import ReuseSettings
from restir_engine.scene.lamps import area_lamp
from restir_engine.scene.scene import Scene
from restir_engine.settings import RenderSettings, required_passes
from testing.scenes.lights import matrix
from testing.scenes.rooms import UNSEEN, Builder, checkered, coated, diffuse, look, scaled
from testing.scenes.shapes import QUAD

LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
MOVES = ("lamp", "caster", "emitter", "camera", "meshes")
STEPS = 4
_CELLS = 6  # of the grid that deforms, along each side


def animation(moves: str, size: int, steps: int = STEPS) -> list[Scene]:
    """Committed scenes, the last one always the same; `moves` is one of MOVES, or "all"."""
    return [
        _frame({name: step if moves in (name, "all") else steps - 1 for name in MOVES}, size) for step in range(steps)
    ]


def _grid(step: int):
    """A sheet in the unit square whose waves travel with the step."""
    line = np.linspace(-1.0, 1.0, _CELLS + 1)
    x, y = (a.ravel() for a in np.meshgrid(line, line))
    z = 0.12 * np.sin(3.0 * x + 0.8 * step) * np.cos(2.0 * y - 0.5 * step)
    corner = (np.arange(_CELLS)[:, None] * (_CELLS + 1) + np.arange(_CELLS)).ravel()
    triangles = [(c, c + 1, c + _CELLS + 2) for c in corner] + [(c, c + _CELLS + 2, c + _CELLS + 1) for c in corner]
    return np.column_stack([x, y, z]), triangles


def _frame(at: dict[str, int], size: int) -> Scene:
    """The scene with each of MOVES at its step."""
    b = Builder()
    b.add(QUAD, coated((0.6, 0.55, 0.5), 0.5, 0.2), scaled(matrix(), 3.0, 3.0, 1.0))
    x = 0.12 * at["caster"]
    place = scaled(matrix((-0.8 + x, 0.0, 0.6), (0.0, 0.2 - 0.1 * at["caster"], 1.0)), 0.45, 0.3, 1.0)
    b.add(QUAD, diffuse((0.6, 0.2, 0.2)), place)
    sheet = _grid(at["meshes"])
    b.add(sheet, coated((0.3, 0.5, 0.6), 0.5), scaled(matrix((0.5, 0.6, 0.3), (-0.2, -0.4, 1.0)), 0.7, 0.7, 1.0))
    m = 0.1 * at["meshes"]
    pane = np.array([[-1, -1, 0], [1, -1 + m, m], [1 - m, 1, 0], [-1, 1, 0.5 * m]]), QUAD[1]
    x = 0.15 * at["emitter"]
    glow = checkered((9.0, 5.0, 2.0), (1.0, 3.0, 9.0), 3.0)
    b.add(pane, glow, scaled(matrix((1.2 - x, 0.3, 0.7), (-1.0, 0.2 - x, -0.4)), 0.3 + 0.2 * x, 0.25, 1.0), UNSEEN)
    x = 0.15 * at["lamp"]
    place = matrix((-0.6 + x, -0.4, 1.6), (0.2 - x, 0.0, 1.0))
    b.lamp(area_lamp(place, 10.0 * np.ones(3), 0.25 + 0.1 * x, 0.2, key=1, seen_by=UNSEEN))
    x = 0.1 * at["camera"]
    return b.finish(look((0.1 + x, -1.9 + 0.3 * x, 2.4), (0.3 * x, 0.1, 0.1), size))


def reuse_of(**options) -> ReuseSettings:
    """Reuse with one light sample a frame, where what history does shows best."""
    return ReuseSettings(pilot=False, light_samples=1, **options)


def frames_of(scenes, seed: int, reuse: ReuseSettings, samples: int = 1, look_at=None):
    """The mean of the samples of the last scene, (height, width, 3); each scene inherits from the one before.

    look_at(integrator): called after the candidates of each frame are drawn. Returns (picture, the last integrator).
    """
    history = None
    for number, scene in enumerate(scenes):
        settings = RenderSettings(seed=seed * 16 + number, max_bounces=0, reuse=reuse)
        width, height = scene.camera.film_size
        film = Film(width, height, required_passes(settings.passes, False), 1.0)
        integrator = RestirIntegrator(FrameContext(scene), settings, film, history)
        history = integrator.history
        scratch = integrator.scratch()
        for sample in range(samples):
            for turn, stage in enumerate(integrator.stages(sample, 1)):
                for item in stage.items or [(0, 0, width, height)]:
                    stage.run(item, scratch)
                stage.finish()
                if turn == 2 and look_at:
                    look_at(integrator)
    film.samples = samples
    return film.pass_array("Combined")[:, :, :3], integrator


def candidates_light(integrator) -> np.ndarray:
    """What a frame's candidates alone say of the luminance of direct light, (height, width): no bias, no history."""
    r = integrator.frame.reservoirs[0]
    return r["contribution_weight"].astype(float) * r["target"] * np.maximum(r["visibility"].mean(-1), 0.0)


def histories(scenes, reuse: ReuseSettings, seeds) -> tuple[np.ndarray, np.ndarray]:
    """Luminance (seeds, height, width) of each history's last frame, and what its last candidates alone say of it."""
    pictures, candidates = [], []
    for seed in seeds:
        own: list[np.ndarray] = []
        pictures.append(frames_of(scenes, seed, reuse, look_at=lambda i, own=own: own.append(candidates_light(i)))[0])
        candidates.append(own[-1])
    return np.stack(pictures) @ LUMINANCE, np.stack(candidates)


def bias(pictures: np.ndarray, candidates: np.ndarray, truths: np.ndarray) -> tuple[float, float]:
    """(relative bias of the mean of `pictures`, its standard error); all (n, height, width), n independent renders.

    The candidates, whose mean is known to be the truth, are a control variate: their noise is a part of the history's.
    """
    y, x, t = (a.mean((1, 2), dtype=float) for a in (pictures, candidates, truths))
    slope = np.cov(y, x)[0, 1] / x.var(ddof=1)
    rest = y - slope * (x - t.mean())
    error = math.hypot(rest.std(ddof=2) / math.sqrt(len(y)), (1.0 - slope) * t.std(ddof=1) / math.sqrt(len(t)))
    return rest.mean() / t.mean() - 1.0, error / t.mean()


def off(pictures: np.ndarray, truths: np.ndarray) -> np.ndarray:
    """z-scores of the means of two (n, height, width, 3): of all pixels by channel, and of halves of the picture."""
    height, width = pictures.shape[1:3]

    def parts(x):
        halves = x[:, : height // 2], x[:, :, : width // 2]
        return np.concatenate([part.mean((1, 2)) for part in (x, *halves)], 1)

    a, b = parts(pictures), parts(truths)
    error = np.hypot(a.std(0, ddof=1) / math.sqrt(len(a)), b.std(0, ddof=1) / math.sqrt(len(b)))
    return (a.mean(0) - b.mean(0)) / error
