"""RESTIR's mean is PATH's under every kind of light, whatever is reused and however it is weighed.

Renders stop as soon as they tell the same mean luminance from one that is off by 1 % (a miss in 100, a false alarm in
2000). With --deep they go on until its error is 0.13 %, 16 at least, and it is accepted within 3 standard errors and
within 0.5 %. Blocks of 8 × 8 pixels are accepted by z-scores, of which there are as many beyond 3 as chance allows.
Errors that were planted are found: PAIRWISE weighing by 1/M (−1.5 %, 5 standard errors), null samples of neighbours
that do not count (+1.0 %, 8), with --deep a Jacobian of 1.01 (+0.5 %, 3.4 to 5; CONTRIBUTION alone misses it).
"""

import numpy as np
import pytest

from restir_engine.reuse_settings import ReuseSettings
from testing.measures import block_means, compare
from testing.scenes.rooms import LIGHTS, frames, picture_scene
from testing.statistics import Sequential, Verdict, normal_scores, relative_difference

LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
SAMPLES, PATH_SAMPLES = 4, 16  # of each render
GROUP, MOST = 16, 160  # renders at a time, and at most
ENOUGH = 0.0013  # relative standard error
EARLY = Sequential(bound=0.01, false_alarm=0.0005, miss=0.01, looks=4)


@pytest.fixture(scope="module")
def lit():
    """(scene, PATH's direct light) by name of the light, rendered once."""
    kept = {}

    def scene_and_reference(name):
        if name not in kept:
            scene = picture_scene(name)
            kept[name] = scene, direct(scene, PATH_SAMPLES, integrator="PATH")
        return kept[name]

    return scene_and_reference


def direct(scene, samples: int = SAMPLES, **settings) -> np.ndarray:
    """Independent renders of direct light, (groups, height, width, 4): rgb and luminance."""
    images = np.zeros((0, *scene.camera.film_size[::-1], 3), np.float32)
    error = np.inf
    while error > ENOUGH and len(images) < MOST:
        seeds = range(len(images), len(images) + GROUP)
        images = np.concatenate([images, frames(scene, samples, seeds, **{"max_bounces": 0} | settings)])
        means = (images @ LUMINANCE).mean((1, 2))
        error = means.std(ddof=1) / np.sqrt(len(means)) / means.mean()
    assert np.isfinite(images).all()
    return np.concatenate([images, images @ LUMINANCE[:, None]], -1)


def told(scene, reference: np.ndarray, **settings) -> tuple[Verdict, np.ndarray]:
    """What renders of direct light tell, and z-scores of the luminance of blocks."""
    kept: list[np.ndarray] = []

    def more():
        for look in range(EARLY.looks):
            seeds = range(look * GROUP, (look + 1) * GROUP)
            images = frames(scene, SAMPLES, seeds, **{"max_bounces": 0} | settings)
            kept.append(np.concatenate([images, images @ LUMINANCE[:, None]], -1))
            yield np.concatenate(kept)

    means = reference[..., 3].mean((1, 2))
    verdict, _ = EARLY.told(more(), lambda ours: relative_difference(ours[..., 3].mean((1, 2)), means))
    ours, theirs = (block_means(x[..., 3:]) for x in (np.concatenate(kept), reference))
    return verdict, normal_scores(ours, theirs).ravel()


def check(ours: np.ndarray, reference: np.ndarray, name: str) -> np.ndarray:
    """Absolute z-scores of the luminance of blocks."""
    off, error, z = compare(ours, reference)
    text = f"{name}: r, g, b and luminance off by {off}, standard errors {error}"
    assert error[3] < 0.002, text
    assert abs(off[3]) < min(3.0 * error[3], 0.005), text
    assert (np.abs(off) < 4.0 * error).all(), text  # of which there are many
    return np.abs(z[..., 3]).ravel()


REUSE = {
    "none": {"rounds": 0, "temporal": False},
    "spatial": {"rounds": 1, "temporal": False},
    "temporal": {"rounds": 0, "temporal": True},
    "both": {"rounds": 1, "temporal": True},
}


def reusing(options: dict) -> dict:
    """Settings of RESTIR with these options of reuse."""
    return {"integrator": "RESTIR", "reuse": ReuseSettings(pilot=False, **options)}


@pytest.mark.parametrize(
    "reuse", [pytest.param(name, marks=pytest.mark.deep) if name == "both" else name for name in REUSE]
)
def test_direct_light_is_that_of_path_as_far_as_told(reuse, lit):
    found = {name: told(*lit(name), **reusing(REUSE[reuse])) for name in LIGHTS}
    assert {name: verdict for name, (verdict, _) in found.items()} == dict.fromkeys(LIGHTS, Verdict.SAME)
    z = np.concatenate([blocks for _, blocks in found.values()])
    assert z.mean() < 0.9 and (z > 3.0).mean() < 0.01, f"mean |z| {z.mean()}, beyond 3: {(z > 3.0).mean():.2%}"


@pytest.mark.deep
@pytest.mark.parametrize("reuse", REUSE)
def test_direct_light_is_that_of_path(reuse, lit):
    z = []
    for name in LIGHTS:
        scene, reference = lit(name)
        z.append(check(direct(scene, **reusing(REUSE[reuse])), reference, name))
    z = np.concatenate(z)
    assert z.mean() < 0.9 and (z > 3.0).mean() < 0.01, f"mean |z| {z.mean()}, beyond 3: {(z > 3.0).mean():.2%}"


SPATIAL, BOTH = REUSE["spatial"], REUSE["both"]
KINDS = {
    **{f"spatial {mis}": SPATIAL | {"mis": mis} for mis in ("BALANCE", "PAIRWISE", "CONTRIBUTION")},
    **{
        f"spatial {mis} shaded": SPATIAL | {"mis": mis, "visibility": "SHADED"}
        for mis in ("BALANCE", "PAIRWISE", "DEFENSIVE", "CONTRIBUTION")
    },
    "temporal BALANCE": REUSE["temporal"] | {"mis": "BALANCE"},
    "both BALANCE": BOTH | {"mis": "BALANCE"},
    "both BALANCE, cap 1": BOTH | {"mis": "BALANCE", "confidence_cap": 1.0},
    "both, cap 1": BOTH | {"confidence_cap": 1.0},
    "both, shaded": BOTH | {"visibility": "SHADED"},
    "two rounds": SPATIAL | {"rounds": 2},
    "disk": SPATIAL | {"pattern": "DISK", "radius": 16.0},
    "disk, shaded, two rounds": SPATIAL | {"pattern": "DISK", "visibility": "SHADED", "rounds": 2},
}


@pytest.mark.parametrize("kind", KINDS)
def test_weights_keep_the_mean_as_far_as_told(kind, lit):
    verdict, z = told(*lit("all"), **reusing(KINDS[kind]))
    assert verdict is Verdict.SAME
    assert z.mean() < 1.1 and (z > 3.0).sum() <= 2  # of 64 blocks


@pytest.mark.deep
@pytest.mark.parametrize("kind", KINDS)
def test_weights_keep_the_mean(kind, lit):
    scene, reference = lit("all")
    z = check(direct(scene, **reusing(KINDS[kind])), reference, kind)
    assert z.mean() < 1.1 and (z > 3.0).sum() <= 2  # of 64 blocks


def test_weights_by_confidence_are_told(lit):
    """1/M in place of MIS weights, which all of the above have to find."""
    assert told(*lit("all"), **reusing(KINDS["disk"] | {"mis": "CONFIDENCE"}))[0] is Verdict.DIFFERENT


@pytest.mark.deep
def test_weights_by_confidence_darken(lit):
    """1/M in place of MIS weights, which all of the above have to find."""
    scene, reference = lit("all")
    off, error, _ = compare(direct(scene, **reusing(KINDS["disk"] | {"mis": "CONFIDENCE"})), reference)
    assert off[3] < -4.0 * error[3] and off[3] < -0.01


def test_the_light_of_all_bounces_is_that_of_path():
    scene = picture_scene("world")
    path = direct(scene, PATH_SAMPLES, integrator="PATH", max_bounces=12)
    check(direct(scene, max_bounces=12, **reusing(SPATIAL)), path, "all bounces")
