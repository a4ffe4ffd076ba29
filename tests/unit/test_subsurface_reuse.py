"""Subsurface light that is resampled has the mean of that which is not, by every shift, in space and time, while things
move; and that which is not has PATH's.

Three bodies with textured radii, a thin one and instances under a lamp behind them and one in front. Each render with
reuse is compared with one without of the same seed, whose candidates are the same: much of the noise cancels. Renders
stop as soon as they tell the same mean from one that is off by 1.5 % (6 % where single samples are compared, of what
moves; a miss in 100, a false alarm in 2000). With --deep they go on until the error is 0.12 %, and are accepted within
3 standard errors and within 0.5 %.

What moves is noisy, as most of a frame's light is what its history has copied. Deep tests of it compare with PATH's
many samples, and know two things that go along with the noise and should be right: the frame without reuse, and the
first frame of the sequence, which inherits from none.
"""

import numpy as np
import pytest

from testing.measures import block_means
from testing.scenes.translucent import MOVES, STEPS, subsurface_light, translucent
from testing.statistics import Sequential, Verdict, controlled_mean, relative_difference

LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
SHIFTS = ("RECONNECTION", "DELAYED", "HYBRID", "SEQUENTIAL")
METHODS = ("DIFFUSION", "HYBRID")
GROUP, SAMPLES = 24, 4
EARLY = Sequential(bound=0.015, false_alarm=0.0005, miss=0.01, looks=6)
COARSE = Sequential(bound=0.06, false_alarm=0.0005, miss=0.01, looks=6)  # of single samples, and of light that goes on
DEEP_ERROR, DEEP_MOST = 0.0012, 960
# Of what moves: copies are fewer, and noise more than in proportion less, of few neighbours in a larger picture.
FEW = {"sss_temporal": True, "sss_neighbours": 2}
LARGE, TRUTHS, TRUTH_SAMPLES, MOVED_MOST = 128, 12, 256, 2000


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
    scenes = [translucent(step, "all") for step in range(STEPS)]

    def pair(seed, sss_shift):
        frames = sequence(scenes, seed, sss_shift=sss_shift, sss_temporal=True)
        return frames[-1], alone(STEPS * seed + STEPS - 1, 1)

    return pair


def sequence(scenes, seed, **settings) -> list[np.ndarray]:
    """Frames of one sample, of which each inherits from the one before; the last has the seed STEPS · seed + 2."""
    frames, history = [], None
    for step, scene in enumerate(scenes):
        light = subsurface_light(scene, 1, history=history, seed=STEPS * seed + step, **settings)
        history = light.history
        frames.append(light.rgb @ LUMINANCE)
    return frames


@pytest.fixture(scope="module")
def moved():
    """What moves, large: seed → (frames, the last one without reuse); PATH's mean of the first and of the last frame.

    The means with their relative standard errors. All that cases share is made once.
    """
    kept = {}

    def once(key, make):
        if key not in kept:
            kept[key] = make()
        return kept[key]

    def true_mean(scene):
        settings = {"integrator": "PATH", "threads": 0}
        means = [subsurface_light(scene, TRUTH_SAMPLES, seed=-1 - k, **settings).rgb @ LUMINANCE for k in range(TRUTHS)]
        means = np.mean(means, (1, 2))
        return means.mean(), means.std(ddof=1) / np.sqrt(TRUTHS) / means.mean()

    def of(moves, **settings):
        scenes = once(moves, lambda: [translucent(step, moves, LARGE) for step in range(STEPS)])
        still = once("", lambda: scenes[-1])  # the same of all that moves
        truths = once((moves, 0), lambda: true_mean(scenes[0])), once(("", 0), lambda: true_mean(still))

        def at(seed):
            frames = sequence(scenes, seed, **FEW, **settings)
            number = STEPS * seed + STEPS - 1
            fresh = once(number, lambda: (subsurface_light(still, 1, seed=number).rgb @ LUMINANCE).astype(np.float32))
            return frames, fresh

        return at, truths

    return of


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
    pairs = np.stack(kept)
    check_blocks(block_means((pairs[:, 0] - pairs[:, 1])[..., None])[..., 0])


def check_blocks(difference: np.ndarray) -> None:
    """Differences (n, rows, columns) have the mean 0 in all blocks but for as many as chance explains."""
    spread = difference.std(0, ddof=1) / np.sqrt(len(difference))
    z = np.abs(difference.mean(0)[spread > 0.0] / spread[spread > 0.0])
    assert (z > 3.0).sum() <= 2 and z.mean() < 1.1


def off_in_time(frames: np.ndarray, fresh: np.ndarray, truths) -> tuple[float, float]:
    """How far the last frames (n, STEPS) are off PATH's mean, and the standard error, relative; means of pictures.

    fresh (n,): the last frames without reuse; truths: PATH's mean of the first and of the last, and their errors.
    """
    (first, error_of_first), (last, error_of_last) = truths
    controls = np.column_stack([frames[:, 0] / first, fresh / last]) - 1.0
    off, error, (by_first, by_fresh) = controlled_mean(frames[:, -1] / last - 1.0, controls)
    return off, np.linalg.norm([error, by_first * error_of_first, (1.0 - by_fresh) * error_of_last])


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


QUICK = [(shift, "DIFFUSION") for shift in ("BLOCKS", *SHIFTS)] + [("BLOCKS", "HYBRID"), ("RECONNECTION", "HYBRID")]


@pytest.mark.parametrize(("shift", "method"), QUICK)
def test_spatial_reuse_keeps_the_mean_as_far_as_told(shift, method, still):
    assert told(still, EARLY, sss_shift=shift, sss_method=method) is Verdict.SAME


def test_what_moves_keeps_the_mean_as_far_as_told(last):
    """Lamp, body and shape all at once: the light of what is kept is asked for again, in both scenes."""
    assert told(last, COARSE, sss_shift="RECONNECTION") is Verdict.SAME


@pytest.mark.deep
@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(("shift", "temporal"), [("BLOCKS", False), *((s, t) for s in SHIFTS for t in (False, True))])
def test_reuse_keeps_the_mean(shift, temporal, method, still):
    check(still, sss_shift=shift, sss_temporal=temporal, sss_method=method)


@pytest.mark.deep
@pytest.mark.parametrize("shift", SHIFTS)
@pytest.mark.parametrize("moves", MOVES)
def test_what_moves_keeps_the_mean(moves, shift, moved):
    """The first frame has no history: that its mean is right is what test_reuse_keeps_the_mean shows."""
    at, truths = moved(moves, sss_shift=shift)
    means, blocks, error = [], [], 1.0
    while error > DEEP_ERROR and len(means) < MOVED_MOST:
        for seed in range(len(means), len(means) + GROUP):
            frames, fresh = at(seed)
            means.append([*(frame.mean() for frame in frames), fresh.mean(dtype=float)])
            blocks.append(block_means((frames[-1] - fresh)[None, ..., None], LARGE // 8)[0, ..., 0])
        values = np.array(means)
        off, error = off_in_time(values[:, :-1], values[:, -1], truths)
    print(f"{moves} {shift}: off by {off:+.2%}, standard error {error:.2%}, {len(means)} sequences")
    assert error <= DEEP_ERROR and abs(off) < min(3.0 * error, 0.005), f"off by {off:.2%}, standard error {error:.2%}"
    check_blocks(np.stack(blocks))
