"""A picture of whole paths that are reused is PATH's, in its mean and in its light passes.

An error that was found here: a first frame without history that was lit by F in place of F W (-10 %). A Jacobian of 1
is not (the still life is 0.3 ± 0.2 % brighter by it): `test_path_shift` finds it by finite differences.
"""

from dataclasses import replace

import numpy as np
import pytest

from restir_engine.reuse_settings import ReuseSettings
from restir_engine.session import Session
from restir_engine.settings import RenderSettings
from testing.scenes.interiors import SCENES, interior
from testing.scenes.lights import matrix
from testing.scenes.rooms import LIGHTS, frames, look, picture_scene, room, scaled
from testing.scenes.scattering import subsurface_program
from testing.scenes.shapes import CUBE
from testing.statistics import Sequential, Verdict, relative_difference

LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
GROUP, SAMPLES = 16, 4
EARLY = Sequential(bound=0.01, false_alarm=0.0005, miss=0.01, looks=4)
REUSE = {
    "whole": {"paths": "WHOLE", "rounds": 1},
    "indirect": {"paths": "INDIRECT", "rounds": 1},
    "temporal": {"paths": "WHOLE", "temporal": True},
}
DRAWN = {"without tiles": {"paths": "WHOLE", "rounds": 3, "neighbours": 4, "light_candidates": 0}}
KINDS = {
    **{f"{mis}, {pattern}": {"mis": mis, "pattern": pattern} for mis in ("BALANCE", "PAIRWISE", "CONTRIBUTION")
       for pattern in ("DISK", "PAIRS")},
    "one sample": {"vector_weights": False},
    "replayed": {"footprint": 1000.0},
    "reconnected": {"footprint": 0.0, "connect_roughness": 0.0001},
    "two rounds, temporal, cap 1": {"rounds": 2, "temporal": True, "confidence_cap": 1.0},
    "two rounds, temporal": {"rounds": 2, "temporal": True},
}  # fmt: skip


def renders(scene, first: int, samples: int, **settings) -> np.ndarray:
    """Mean luminances of a GROUP of renders."""
    return (frames(scene, samples, range(first, first + GROUP), **settings) @ LUMINANCE).mean((1, 2))


def told(scene, path: np.ndarray, more: dict | None = None, groups: int = 3, **options) -> Verdict:
    """Whether the mean luminance of renders that reuse paths is told from PATH's.

    more: settings of the render; groups: renders by GROUP at each look.
    """
    reuse = ReuseSettings(**{"light_candidates": 8, "light_samples": 1} | options)
    settings = {"integrator": "RESTIR", "reuse": reuse} | (more or {})
    means = np.zeros(0)

    def looks():
        nonlocal means
        for turn in range(EARLY.looks):
            seeds = (1000 + (groups * turn + k) * GROUP for k in range(groups))
            means = np.concatenate([means, *(renders(scene, seed, SAMPLES, **settings) for seed in seeds)])
            yield means

    verdict, _ = EARLY.told(looks(), lambda ours: relative_difference(ours, path))
    return verdict


@pytest.fixture(scope="module")
def still_life():
    """(scene, mean luminances of renders of PATH)."""
    scene = interior("still life", 32)
    return scene, np.concatenate([renders(scene, k * GROUP, 64, integrator="PATH") for k in range(2)])


@pytest.mark.parametrize("reuse", REUSE)
def test_a_picture_is_that_of_path_as_far_as_told(reuse, still_life):
    assert told(*still_life, **REUSE[reuse]) is Verdict.SAME


@pytest.mark.deep
@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_of_reuse_keeps_the_picture(kind, still_life):
    assert told(*still_life, groups=10, **REUSE["whole"] | KINDS[kind]) is Verdict.SAME


@pytest.mark.deep
@pytest.mark.parametrize("name", [*SCENES, "area", "point", "spot", "sun", "mesh", "world", "many", "all"])
@pytest.mark.parametrize("reuse", REUSE | DRAWN)
def test_pictures_are_those_of_path(name, reuse):
    scene = interior(name, 32) if name in SCENES else picture_scene(name, 32)
    path = np.concatenate([renders(scene, k * GROUP, 256, integrator="PATH") for k in range(2)])
    assert told(scene, path, **(REUSE | DRAWN)[reuse]) is not Verdict.DIFFERENT


def test_light_passes_are_those_of_path():
    """Direct and indirect light by class of lobes add up to the picture, and each has PATH's mean."""
    names = [f"{lobe} {half}" for lobe in ("Diffuse", "Glossy", "Transmission") for half in ("Direct", "Indirect")]
    sums = {}
    for integrator, samples in (("PATH", 32), ("RESTIR", 8)):
        reuse = ReuseSettings(paths="WHOLE", rounds=1, temporal=True)
        settings = RenderSettings(
            integrator, samples, passes=frozenset([*names, "Combined", "Emission", "Environment"])
        )
        rows = []
        for seed in range(8):
            session = Session(picture_scene("all", 32), replace(settings, seed=seed, reuse=reuse))
            session.render()
            combined = session.film.sums("Combined")[..., :3].astype(float)
            each = [session.film.sums(name).astype(float) for name in (*names, "Emission", "Environment")]
            np.testing.assert_allclose(sum(each), combined, rtol=1e-5, atol=1e-3)
            rows.append([one.mean() / samples for one in each])
        sums[integrator] = np.array(rows)
    difference, error, _ = relative_difference(sums["RESTIR"][:, :6], sums["PATH"][:, :6])
    assert (np.abs(difference) < 4.5 * error + 1e-4).all(), (difference, error)
    assert (error[:4] < 0.1).all()  # little is transmitted in this room


@pytest.mark.deep
def test_filter_glossy_and_light_below_surfaces_are_those_of_path(still_life):
    """What a path cannot keep behind its reconnection goes to the film as it is."""
    scene, _ = still_life
    for filter_glossy in (1.0, 0.2):
        more = {"filter_glossy": filter_glossy}
        path = np.concatenate([renders(scene, k * GROUP, 64, integrator="PATH", **more) for k in range(2)])
        assert told(scene, path, more, **REUSE["whole"]) is Verdict.SAME
    b = room()
    skin = subsurface_program((0.8, 0.5, 0.4), (0.4, 0.2, 0.1))
    b.add(CUBE, skin, scaled(matrix((0.5, 0.2, 0.3)), 0.3, 0.3, 0.3))
    LIGHTS["area"](b)
    scene = b.finish(look((0.4, -3.2, 1.9), (0.0, 0.0, 0.45), 32))
    path = np.concatenate([renders(scene, k * GROUP, 64, integrator="PATH") for k in range(2)])
    assert told(scene, path, **REUSE["whole"]) is Verdict.SAME
