"""Light that crosses straight and is resampled has PATH's mean: in space, in time, while things move, beside reuse of
what diffuses, and where paths go on.

The three bodies of testing/scenes/translucent.py: textured radii, a thin one, instances. The pass of that light alone
tells most. Renders stop as soon as they tell the same mean from one that is off by 3 % (6 % of what moves; a miss in
100, a false alarm in 2000). With --deep they go on until the error is 0.15 %, and are accepted within 3 standard errors
and within 0.5 %.
"""

import numpy as np
import pytest

from restir_engine.reuse_settings import ReuseSettings
from testing.measures import block_means
from testing.scenes.translucent import MOVES, STEPS, crossed, subsurface_light, translucent, turning_plate
from testing.statistics import Sequential, Verdict, relative_difference

LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
BOUNDARY = "Subsurface Boundary"
GROUP, SAMPLES = 24, 4
EARLY = Sequential(bound=0.03, false_alarm=0.0005, miss=0.01, looks=8)
COARSE = Sequential(bound=0.06, false_alarm=0.0005, miss=0.01, looks=8)
DEEP_ERROR, DEEP_MOST = 0.0015, 6000
SPACE, TIME = {"sss_refraction": "SPATIAL"}, {"sss_refraction": "TEMPORAL"}
BESIDE = SPACE | {"sss_shift": "RECONNECTION"}


def image(scene, samples, seed, **settings) -> np.ndarray:
    """Luminance by HYBRID, (height, width)."""
    settings = {"parts": (BOUNDARY,), "sss_method": "HYBRID", "sss_shift": "NONE"} | settings
    return subsurface_light(scene, samples, seed=seed, **settings).rgb @ LUMINANCE


@pytest.fixture(scope="module")
def reference():
    """PATH's renders of 4 × SAMPLES, of seeds that nothing else uses, each made once; they grow as they are asked."""
    kept = {}

    def of(scene, count, **settings):
        _, found = kept.setdefault((id(scene), *sorted(settings.items())), (scene, []))
        for seed in range(len(found), count):
            found.append(image(scene, 4 * SAMPLES, 100_000 + seed, integrator="PATH", **settings))
        return np.stack(found[:count])

    return of


@pytest.fixture(scope="module")
def scene():
    return translucent()


def last_frame(scenes, seed, **settings) -> np.ndarray:
    """The last of frames of one sample, of which each inherits from the one before."""
    history = None
    for step, one in enumerate(scenes):
        light = subsurface_light(
            one, 1, history=history, seed=STEPS * seed + step, parts=(BOUNDARY,), sss_method="HYBRID", **settings
        )
        history = light.history
    return light.rgb @ LUMINANCE


def told(test, ours, theirs) -> Verdict:
    """What renders ours(seed) tell of the difference of their mean from that of (n, height, width)."""
    kept: list[float] = []
    means = theirs.mean((1, 2))

    def more():
        for look in range(test.looks):
            kept.extend(ours(seed).mean() for seed in range(look * GROUP, (look + 1) * GROUP))
            yield np.array(kept)

    return test.told(more(), lambda values: relative_difference(values, means))[0]


def test_reuse_keeps_the_mean_as_far_as_told(scene, reference):
    assert told(EARLY, lambda seed: image(scene, SAMPLES, seed, **SPACE), reference(scene, 48)) is Verdict.SAME


def test_what_moves_keeps_the_mean_as_far_as_told(scene, reference):
    """Lamp, body and shape all at once: the light of what is kept is asked for again, in both scenes."""
    scenes = [translucent(step, "all") for step in range(STEPS)]
    assert told(COARSE, lambda seed: last_frame(scenes, seed, **TIME), reference(scene, 48)) is Verdict.SAME


def test_a_picture_does_not_depend_on_threads_or_tiles(scene, monkeypatch):
    """Blocks of pixels that share cross tiles, too."""
    pictures = []
    for threads, tile in ((1, 64), (3, 18)):
        monkeypatch.setattr("restir_engine.film.TILE", tile)
        pictures.append(image(scene, 2, 1, threads=threads, **TIME))
    np.testing.assert_array_equal(*pictures)


@pytest.mark.parametrize("reuse", [SPACE, pytest.param(TIME, marks=pytest.mark.deep)], ids=["space", "time"])
def test_with_an_open_shutter_the_mean_is_kept_as_far_as_told(reuse, reference):
    """Each pixel sees its own moment, and so do the points that it takes from others."""
    plate = turning_plate(48)
    verdict = told(COARSE, lambda seed: image(plate, SAMPLES, seed, **reuse), reference(plate, 48))
    assert verdict is Verdict.SAME


@pytest.mark.parametrize("reuse", [SPACE, BESIDE], ids=["alone", "beside"])
def test_before_a_wide_lamp_no_light_is_lost_or_counted_twice(reuse, reference):
    """Rays find a lamp as often as light samples do, which are all by themselves here (light_candidates=1)."""
    plate = crossed("wide lamp", 32)
    settings = {"parts": ("Subsurface",), "max_bounces": 2}
    drawn = settings | reuse | {"reuse": ReuseSettings(pilot=False, light_candidates=1)}
    verdict = told(COARSE, lambda seed: image(plate, SAMPLES, seed, **drawn), reference(plate, 48, **settings))
    assert verdict is Verdict.SAME


def check(ours, theirs) -> None:
    """The same to within 3 standard errors and 0.5 %, and by blocks of 8 × 8 pixels; both: (count) → renders."""
    count, error = 96, 1.0
    while error > DEEP_ERROR and count < DEEP_MOST:
        count = min(2 * count, DEEP_MOST)
        a, b = ours(count), theirs(count)
        off, error, _ = relative_difference(a.mean((1, 2)), b.mean((1, 2)))
    print(f"off by {off:+.2%}, standard error {error:.2%}, {count} renders")
    assert abs(off) < min(3.0 * error, 0.005), f"off by {off:.2%}, standard error {error:.2%}"
    a, b = (block_means(x[..., None])[..., 0] for x in (a, b))
    spread = np.sqrt((a.var(0, ddof=1) + b.var(0, ddof=1)) / count)
    z = np.abs(a.mean(0) - b.mean(0))[spread > 0.0] / spread[spread > 0.0]
    assert (z > 3.0).sum() <= 2 and z.mean() < 1.1


def growing(make):
    """Renders make(seed) by their count, each made once."""
    kept: list[np.ndarray] = []

    def of(count):
        kept.extend(make(seed) for seed in range(len(kept), count))
        return np.stack(kept[:count])

    return of


@pytest.mark.deep
@pytest.mark.parametrize("samples", [1, 3])
@pytest.mark.parametrize("reuse", [SPACE, TIME, BESIDE], ids=["space", "time", "beside"])
def test_reuse_keeps_the_mean(reuse, samples, scene, reference):
    settings = reuse | {"sss_refraction_samples": samples}
    ours = growing(lambda seed: image(scene, SAMPLES, seed, **settings))
    check(ours, lambda count: reference(scene, count))


@pytest.mark.deep
@pytest.mark.parametrize("moves", MOVES)
def test_what_moves_keeps_the_mean(moves, scene, reference):
    scenes = [translucent(step, moves) for step in range(STEPS)]
    check(growing(lambda seed: last_frame(scenes, seed, **TIME)), lambda count: reference(scene, count))


@pytest.mark.deep
@pytest.mark.parametrize("entry", ["refractive entry", "skin's entry"])
@pytest.mark.parametrize("reuse", [SPACE, TIME], ids=["space", "time"])
def test_other_ways_of_entry_keep_the_mean(entry, reuse, reference):
    plate = crossed(entry, 48)
    ours = growing(lambda seed: image(plate, SAMPLES, seed, **reuse))
    check(ours, lambda count: reference(plate, count))
