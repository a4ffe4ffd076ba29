"""Subsurface light that is resampled has the mean of that which is not, by every shift, in space and time, while things
move; and that which is not has PATH's.

Three bodies with textured radii, a thin one and instances under a lamp behind them and one in front. Each render with
reuse is compared with one without of the same seed, whose candidates are the same: much of the noise cancels. Renders
stop as soon as they tell the same mean from one that is off by 1.5 % (6 % where single samples are compared, of what
moves; a miss in 100, a false alarm in 2000). With --deep they go on until the error is 0.12 %, and are accepted within
3 standard errors and within 0.5 %.
"""

import numpy as np
import pytest

from testing.measures import block_means
from testing.scenes.translucent import MOVES, STEPS, subsurface_light, translucent
from testing.statistics import Sequential, Verdict, relative_difference

LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
SHIFTS = ("RECONNECTION", "DELAYED", "HYBRID", "SEQUENTIAL")
METHODS = ("DIFFUSION", "HYBRID")
GROUP, SAMPLES = 24, 4
EARLY = Sequential(bound=0.015, false_alarm=0.0005, miss=0.01, looks=6)
COARSE = Sequential(bound=0.06, false_alarm=0.0005, miss=0.01, looks=6)  # of single samples, and of light that goes on
DEEP_ERROR, DEEP_MOST = 0.0012, 960


@pytest.fixture(scope="module")
def alone():
    """Renders without reuse by seed and settings, each made once."""
    scene, kept = translucent(), {}

    def of(seed, samples, **settings):
        key = seed, samples, *sorted(settings.items())
        if key not in kept:
            kept[key] = subsurface_light(scene, samples, seed=seed, **settings).rgb @ LUMINANCE
        return kept[key]

    return of


@pytest.fixture(scope="module")
def still(alone):
    """Renders of one scene: (with reuse, without)."""
    scene = translucent()

    def pair(seed, sss_shift, sss_temporal=False, **settings):
        reuse = {"sss_shift": sss_shift, "sss_temporal": sss_temporal}
        ours = subsurface_light(scene, SAMPLES, seed=seed, **settings, **reuse).rgb @ LUMINANCE
        return ours, alone(seed, SAMPLES, **settings)

    return pair


@pytest.fixture(scope="module")
def last(alone):
    """Last frames, of one sample, of sequences in which each inherits from the one before: (with reuse, without)."""
    kept = {moves: [translucent(step, moves) for step in range(STEPS)] for moves in (*MOVES, "all")}

    def pair(seed, moves, sss_shift):
        history = None
        for step, scene in enumerate(kept[moves]):
            settings = {"sss_shift": sss_shift, "sss_temporal": True, "seed": STEPS * seed + step}
            light = subsurface_light(scene, 1, history=history, **settings)
            history = light.history
        return light.rgb @ LUMINANCE, alone(STEPS * seed + STEPS - 1, 1)

    return pair


def paired(pairs: np.ndarray) -> tuple[float, float, int]:
    """Relative difference of the means of (n, 2, height, width), its standard error, degrees of freedom."""
    means = pairs.mean((2, 3))
    difference, mean = means[:, 0] - means[:, 1], means[:, 1].mean()
    return difference.mean() / mean, difference.std(ddof=1) / np.sqrt(len(means)) / mean, len(means) - 1


def told(pair, test, **settings) -> Verdict:
    """What pairs of renders, pair(seed, **settings), tell of the difference of their means."""
    kept: list[np.ndarray] = []

    def more():
        for look in range(test.looks):
            kept.extend(np.stack(pair(seed, **settings)) for seed in range(look * GROUP, (look + 1) * GROUP))
            yield np.stack(kept)

    return test.told(more(), paired)[0]


def check(pair, **settings) -> None:
    """The same to within 3 standard errors and 0.5 %, and by blocks of 8 × 8 pixels."""
    kept: list[np.ndarray] = []
    error = 1.0
    while error > DEEP_ERROR and len(kept) < DEEP_MOST:
        kept += [np.stack(pair(seed, **settings)) for seed in range(len(kept), len(kept) + GROUP)]
        off, error, _ = paired(np.stack(kept))
    assert abs(off) < min(3.0 * error, 0.005), f"off by {off:.2%}, standard error {error:.2%}"
    difference = block_means((np.stack(kept)[:, 0] - np.stack(kept)[:, 1])[..., None])[..., 0]
    spread = difference.std(0, ddof=1) / np.sqrt(len(kept))
    z = np.abs(difference.mean(0)[spread > 0.0] / spread[spread > 0.0])
    assert (z > 3.0).sum() <= 2 and z.mean() < 1.1


@pytest.mark.parametrize("method", ["DIFFUSION", pytest.param("HYBRID", marks=pytest.mark.deep)])
def test_light_that_goes_on_from_the_fresh_candidate_is_that_of_path(method, alone):
    settings = {"sss_method": method, "max_bounces": 2}
    reference = np.stack([alone(seed, 8, integrator="PATH", **settings) for seed in range(48)])
    kept: list[np.ndarray] = []

    def more():
        for look in range(COARSE.looks):
            seeds = range(100 + look * GROUP, 100 + (look + 1) * GROUP)
            kept.extend(alone(seed, 8, sss_shift="RECONNECTION", **settings) for seed in seeds)
            yield np.stack(kept)

    means = reference.mean((1, 2))
    verdict, _ = COARSE.told(more(), lambda ours: relative_difference(ours.mean((1, 2)), means))
    assert verdict is Verdict.SAME


QUICK = [(shift, "DIFFUSION") for shift in SHIFTS] + [("RECONNECTION", "HYBRID")]


@pytest.mark.parametrize(("shift", "method"), QUICK)
def test_spatial_reuse_keeps_the_mean_as_far_as_told(shift, method, still):
    assert told(still, EARLY, sss_shift=shift, sss_method=method) is Verdict.SAME


def test_what_moves_keeps_the_mean_as_far_as_told(last):
    """Lamp, body and shape all at once: the light of what is kept is asked for again, in both scenes."""
    assert told(last, COARSE, moves="all", sss_shift="RECONNECTION") is Verdict.SAME


@pytest.mark.deep
@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("temporal", [False, True])
@pytest.mark.parametrize("shift", SHIFTS)
def test_reuse_keeps_the_mean(shift, temporal, method, still):
    check(still, sss_shift=shift, sss_temporal=temporal, sss_method=method)


@pytest.mark.deep
@pytest.mark.parametrize("shift", SHIFTS)
@pytest.mark.parametrize("moves", MOVES)
def test_what_moves_keeps_the_mean(moves, shift, last):
    check(last, moves=moves, sss_shift=shift)
