"""Which way of lighting serves a scene best, when RESTIR is asked for and nothing is reused.

Light tiles find the lights that matter among many and the bright parts of a picture; under one lamp, or where most of
the light is behind walls, they bring nothing for the time they take. All WAYS have the same mean. Before a render each
draws a few samples of a small picture of the scene, and the render is of the one with the least noise in the same time.
The choice depends on these samples and on what ways are known to cost, not on a clock: a seed gives one picture.

Exits of light that diffuses below surfaces are shared by blocks of pixels in any case, where nothing else is reused
(`integrators.blocks`): no scene is known where that does not pay.

Whole paths that neighbors share (`REUSED`) are noise of another kind, and it depends on how near neighbors
are: they are tried in blocks of the picture itself, beside PATH, and taken where they gain by a MARGIN. What they cost
follows from how many vertices, shifts and replayed bounces there are (techniques.path.work). Random walks that
neighbors share (`walks`) are tried likewise, beside the way that is best for the scene's lights.
"""

from __future__ import annotations

import logging
import math
import os
from collections import deque
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import partial
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from ...context import FrameContext
from ...film import Film
from ...kernels.core.jit import begin
from ...kernels.core.records import SCENE_HAS_SUBSURFACE, SCENE_HAS_VARYING_MEDIA
from ...scene.camera import Camera
from ...scene.light_tiles import has_choice
from ...scene.scene import Scene
from ...settings import RenderSettings, is_denoised, required_passes, resampled_shift
from ..base import Integrator, Stage, Tile
from ..blocks.integrator import BlocksIntegrator, shares_exits
from ..path.integrator import PathIntegrator
from ..path.tile import render_tile
from ..resampling.history import History
from ..resampling.spatial import spatial_tile
from ..techniques.direct.candidates import candidates_tile
from ..techniques.path.shift import shift_path
from ..techniques.path.work import RAYS, SHIFTS, VERTICES, work_done
from ..techniques.refraction.layer import resamples_refraction
from ..techniques.subsurface.layer import resamples_subsurface
from .gbuffer import gbuffer_tile
from .integrator import RestirIntegrator
from .paths import PathSteps, resamples_paths
from .shade import shade_tile
from .walks import SharedWalks, shares_walks

log = logging.getLogger(__name__)


class Way(NamedTuple):
    """An integrator, what it changes in ReuseSettings, and its processor time by PATH's.

    Walks below surfaces take most of the time of all: `with_walks` is that of scenes that have them.
    """

    name: str
    kind: type[Integrator]
    changes: dict
    cost: float = math.nan  # not known beforehand
    with_walks: float = math.nan


WAYS = (
    Way("path tracing", PathIntegrator, {}, 1.0, 1.0),
    Way("light tiles", RestirIntegrator, {}, 2.2, 1.85),
    Way("light tiles, fewer samples", RestirIntegrator, {"light_samples": 1, "exit_lights": 1}, 1.8, 1.4),
)

REUSED = Way(
    "whole paths",
    RestirIntegrator,
    {"paths": "WHOLE", "rounds": 3, "neighbours": 4, "light_samples": 1, "light_candidates": 0},
)
# Its time by PATH's is 1 + (OVERHEAD + Σ WORK × counts) / vertices, within a fifth of what was measured in ten rooms.
OVERHEAD, SHIFT_WORK, RAY_WORK = 1.7, 0.8, 0.6
# What shared walks take more than the ways that sample lights likewise, by PATH's time: 0.3 to 0.6 was measured.
SHARING = 0.5
MARGIN = 0.7
BLOCKS, BLOCK = 24, 8  # in which whole paths are tried, and their side in pixels
LONG = 4e6  # samples of all pixels of a render for which that is worth the while

FIRST_KERNELS = [render_tile]  # what a render needs where nothing is reused, which is the default

# Noise is that of means of BATCH samples: they are stratified, some ways gain more by it than others.
BATCH, BATCHES = 4, 2
# Pixels of the small picture: so many that it tells (else tiles are taken), so few that it takes 5 % of the render. A
# time limit is turned into samples by what one of PATH takes on two cores of today, in seconds, without and with walks.
MOST, FEWEST, SHARE = 1500, 250, 0.05
SAMPLE, SAMPLE_WITH_WALKS, CORES = 1.3e-6, 3.5e-6, 2
STRIPS = 4  # of the small picture, which threads share out
TRIAL_SEED = 0x5EED  # the render's own random numbers must have no say in the choice


def integrator_of(
    context: FrameContext, settings: RenderSettings, film: Film, history: History | None = None
) -> Integrator:
    """The integrator of a render that asks for RESTIR."""
    if context.scene.record["flags"] & SCENE_HAS_VARYING_MEDIA:
        settings = _without_reuse(settings, context.scene)
    reuse = settings.reuse
    exits = shares_exits(context.scene, settings) and not resamples_refraction(context.scene, settings)
    resamples = reuse.temporal or reuse.rounds or _resamples_below(context.scene, settings)
    if not exits and (resamples or "Visibility Estimate" in settings.passes):
        return RestirIntegrator(context, settings, film, history)
    shares = not exits and settings.sss_walks != "OWN" and shares_walks(context, settings)
    always = shares and settings.sss_walks == "SHARED"
    untried = partial(SharedWalks, context, settings, film)
    if not always:
        untried = partial(RestirIntegrator, context, settings, film, history)
    if not reuse.pilot and not exits:
        return untried()
    walks = bool(context.scene.record["flags"] & SCENE_HAS_SUBSURFACE)
    trial = replace(settings, seed=settings.seed ^ TRIAL_SEED)
    chosen, worth = WAYS[0], 1.0
    if has_choice(context.scene):
        samples = _samples(film, settings, settings.share, walks)
        chosen, worth = _best(context, trial, samples, walks) if reuse.pilot else (None, 1.0)
    if exits:
        from_tiles = chosen is None or chosen.kind is RestirIntegrator
        return BlocksIntegrator(context, settings, film, from_tiles)
    if chosen is None:
        return untried()
    # Parts of a render, which take a share of its samples, choose alike.
    is_long = _samples(film, settings, 1.0, walks) >= LONG
    if always or (shares and is_long and _may_share(context, settings)):
        shared = _shared(chosen)
        if always or worth_of_sharing(context, trial, shared) < MARGIN * worth:
            return SharedWalks(context, replace(_with(settings, shared), sss_walks="SHARED"), film)
    if is_long and not walks and can_reuse(context, settings):
        begin([gbuffer_tile, *PathSteps.kernels, spatial_tile, shift_path])  # while PATH's is waited for
        reused = worth_of_reuse(context, trial)
        log.debug("Noise × time by path tracing's: %s %.3g, %s %.3g", chosen.name, worth, REUSED.name, reused)
        chosen = REUSED if reused < MARGIN * worth else chosen
    return chosen.kind(context, _with(settings, chosen), film)


def _samples(film: Film, settings: RenderSettings, share: float, walks: bool) -> float:
    """About how many samples of all pixels a share of the render has, by its samples and its time limit."""
    found = film.width * film.height * settings.samples
    if settings.time_limit:
        found = min(found, CORES * settings.time_limit / (SAMPLE_WITH_WALKS if walks else SAMPLE))
    return share * found


def _best(context: FrameContext, settings: RenderSettings, affordable: float, walks: bool) -> tuple[Way | None, float]:
    """The best of WAYS, and its noise × time by PATH's; None where there are too few samples to try them."""
    costs = [way.with_walks if walks else way.cost for way in WAYS]
    pixels = min(MOST, int(SHARE * affordable / (BATCH * BATCHES * sum(costs))))
    if pixels < FEWEST:
        return None, 1.0
    begin([gbuffer_tile, candidates_tile, shade_tile])  # while PATH's is waited for
    small = FrameContext(context.scene, smaller(context.camera, pixels))
    worths = [noise * cost for noise, cost in zip(compare(small, settings), costs, strict=True)]
    log.debug("Noise × time: %s", ", ".join(f"{way.name} {x:.3g}" for way, x in zip(WAYS, worths, strict=True)))
    least = min(worths)
    return WAYS[worths.index(least)], least / worths[0] if worths[0] > 0.0 else 1.0


def can_reuse(context: FrameContext, settings: RenderSettings) -> bool:
    """Whether whole paths can be reused, and the picture has room for blocks; none that is to be denoised.

    Denoisers take what neighbors share for a part of the picture: twice the error that they leave of PATH.
    """
    still = not context.scene.record["shutter"] and not context.camera.texels
    return still and _may_share(context, settings) and resamples_paths(_with(settings, REUSED).reuse, context.scene)


def _may_share(context: FrameContext, settings: RenderSettings) -> bool:
    """Whether neighbors may have noise in common, and the picture has room for the blocks of a trial."""
    return not is_denoised(settings) and min(context.camera.film_size) >= 4 * BLOCK


def _shared(way: Way) -> Way:
    """Shared walks with the light samples of one of WAYS."""
    changes = way.changes if way.kind is RestirIntegrator else {"light_candidates": 0}
    return Way(f"shared walks, {way.name}", SharedWalks, changes, with_walks=way.with_walks + SHARING)


def _resamples_below(scene: Scene, settings: RenderSettings) -> bool:
    return resamples_subsurface(scene, settings) or resamples_refraction(scene, settings)


def _without_reuse(settings: RenderSettings, scene: Scene) -> RenderSettings:
    """The settings where media vary in space: light through them is an estimate, which reuse would weigh as exact."""
    reuse = settings.reuse
    if reuse.temporal or reuse.rounds or _resamples_below(scene, settings):
        scene.warnings.add("Render", "Reuse", "is off, as there are volumes that vary in space")
    shift = settings.sss_shift if resampled_shift(settings) == "NONE" else "NONE"
    return replace(settings, sss_shift=shift, sss_refraction="NONE", reuse=replace(reuse, temporal=False, rounds=0))


def smaller(camera: Camera, pixels: int) -> Camera:
    """The same view with about so many pixels in what is rendered of it."""
    width, height = camera.film_size
    scale = min(1.0, math.sqrt(pixels / (width * height)))
    changes = {"width": max(1, round(scale * camera.width)), "height": max(1, round(scale * camera.height))}
    if camera.region:
        x, y = (int(scale * corner) for corner in camera.region[:2])
        changes["region"] = (x, y, max(1, round(scale * width)), max(1, round(scale * height)))
    return replace(camera, **changes)


def compare(context: FrameContext, settings: RenderSettings) -> list[float]:
    """The noise of each of WAYS in a picture: variance over (mean² + 0.01), without the worst 0.1 % of the pixels."""
    width, height = context.camera.film_size
    rows = [height * k // STRIPS for k in range(STRIPS + 1)]
    strips = [(0, low, width, high) for low, high in pairwise(rows) if high > low]
    tried = [_tried(context, settings, way, strips) for way in WAYS]
    means = [np.concatenate(means, 1) for means, _ in tried]
    mean = _blurred(np.concatenate(means).mean(0))
    return [_noise(each, mean) for each in means]


def worth_of_reuse(context: FrameContext, settings: RenderSettings) -> float:
    """Noise × time of REUSED by that of PATH, in some blocks of the picture."""
    noise, work, samples = _noise_in_blocks(context, settings, REUSED)
    if not work[VERTICES]:
        return 1.0
    more = OVERHEAD * samples + SHIFT_WORK * work[SHIFTS] + RAY_WORK * work[RAYS]
    return noise * (1.0 + more / work[VERTICES])


def worth_of_sharing(context: FrameContext, settings: RenderSettings, shared: Way) -> float:
    """Noise × time of shared walks by that of PATH, in some blocks of the picture."""
    noise, _, _ = _noise_in_blocks(context, settings, shared)
    log.debug("Noise × time by path tracing's: %s %.3g", shared.name, noise * shared.with_walks)
    return noise * shared.with_walks


def _noise_in_blocks(context: FrameContext, settings: RenderSettings, way: Way) -> tuple[float, np.ndarray, int]:
    """(the noise of a way by PATH's in BLOCKS of the picture, the work counted, samples); 1 where PATH has none."""
    still = way._replace(changes=way.changes | {"moving_blocks": False})
    (path, _), (other, work) = (_tried(context, settings, each, blocks(context.camera)) for each in (WAYS[0], still))
    means = [_blurred(np.concatenate(pair).mean(0)) for pair in zip(path, other, strict=True)]
    mean, path, other = np.concatenate(means), np.concatenate(path, 1), np.concatenate(other, 1)
    noise = _noise(path, mean)
    return _noise(other, mean) / noise if noise > 0.0 else 1.0, work, BATCH * BATCHES * path.shape[1] * path.shape[2]


def blocks(camera: Camera) -> list[Tile]:
    """BLOCKS of a picture in which pixels share paths, spread evenly."""
    width, height = (n // BLOCK for n in camera.film_size)
    across = max(round(math.sqrt(BLOCKS * width / height)), 1)
    down = max(BLOCKS // across, 1)
    key = np.random.default_rng(TRIAL_SEED)
    found = {}
    for row in range(down):
        for column in range(across):
            u, v = key.random(2)
            x, y = int((column + u) * width / across), int((row + v) * height / down)
            found[x, y] = (BLOCK * x, BLOCK * y, BLOCK * x + BLOCK, BLOCK * y + BLOCK)
    return list(found.values())


def _tried(
    context: FrameContext, settings: RenderSettings, way: Way, tiles: list[Tile]
) -> tuple[list[np.ndarray], np.ndarray]:
    """Means of BATCH samples of some tiles by a way, each (BATCHES, height, width, 3), and the work counted."""
    threads = settings.threads or os.cpu_count() or 1
    scratch = deque(Integrator.scratch() for _ in range(threads))
    film = Film(*context.camera.film_size, required_passes(frozenset(), False))
    integrator = way.kind(context, _with(settings, way), film)
    integrator.prepare()
    with ThreadPoolExecutor(threads) as pool:
        batches = [_means(integrator, film, BATCH * k, tiles, pool, scratch) for k in range(BATCHES)]
    return [np.stack(of_tile) for of_tile in zip(*batches, strict=True)], sum(work_done(each) for each in scratch)


def _with(settings: RenderSettings, way: Way) -> RenderSettings:
    return replace(settings, reuse=replace(settings.reuse, **way.changes))


def _means(
    integrator: Integrator, film: Film, first_sample: int, tiles: list[Tile], pool: ThreadPoolExecutor, scratch: deque
) -> list[np.ndarray]:
    """The mean of BATCH samples in each tile, (height, width, 3); scratch: working memory of the pool's threads."""
    pictures = [film.pixels[y0:y1, x0:x1] for x0, y0, x1, y1 in tiles]
    for picture in pictures:
        picture[:] = 0.0

    def run(stage: Stage, item: tuple) -> None:
        memory = scratch.pop()
        stage.run(item, memory)
        scratch.append(memory)

    step = min(BATCH, integrator.max_batch)
    for sample in range(first_sample, first_sample + BATCH, step):
        for stage in integrator.stages(sample, step):
            list(pool.map(partial(run, stage), tiles if stage.items is None else stage.items))
            stage.finish()
    sums = film.sums("Combined")
    return [sums[y0:y1, x0:x1, :3] / BATCH for x0, y0, x1, y1 in tiles]


def _noise(means: np.ndarray, mean: np.ndarray) -> float:
    """See `compare`; means: (BATCHES, height, width, 3)."""
    each = (means.var(0, ddof=1) / (mean**2 + 0.01)).mean(2).ravel()
    each = np.sort(each[np.isfinite(each)])
    return float(each[: each.size - each.size // 1000].mean()) if each.size else 0.0


def _blurred(picture: np.ndarray) -> np.ndarray:
    """Each pixel with its neighbors: single ones may be bright by chance."""
    for axis in (0, 1):
        width = [(1, 1) if k == axis else (0, 0) for k in range(3)]
        padded, n = np.pad(picture, width, "edge"), picture.shape[axis]
        picture = sum(np.take(padded, range(k, k + n), axis) for k in range(3)) / 3.0
    return picture
