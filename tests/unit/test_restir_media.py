"""Resampling where shadow rays cross media: V is that of the pixel's own path, in the frame that it is asked for."""

import numpy as np
import pytest

from restir_engine.kernels.core import records as rec
from restir_engine.kernels.lobes import nodes
from restir_engine.scene.lamps import area_lamp
from testing.scenes.lights import matrix
from testing.scenes.media import cube, medium
from testing.scenes.moving import frames_of, off, reuse_of
from testing.scenes.rooms import UNSEEN, Builder, diffuse, look, program, render, scaled
from testing.scenes.shapes import OUTWARD, QUAD

SIZE = 24


def floor(*fogs) -> Builder:
    """A floor under a lamp with cubes of fog between them, at these places."""
    b = Builder()
    b.add(QUAD, diffuse((0.7, 0.6, 0.5)), scaled(matrix(), 3.0, 3.0, 1.0))
    for place in fogs:
        cube(b, medium(absorption=(1.5, 2.0, 3.0)), place, 0.25)
    b.lamp(area_lamp(matrix((0.3, 0.2, 2.0)), 12.0 * np.ones(3), 0.4, 0.4, key=1, seen_by=UNSEEN))
    return b


def finish(b: Builder):
    return b.finish(look((0.0, -1.8, 2.2), (0.0, 0.0, 0.1), SIZE))


def truth_of(scene) -> np.ndarray:
    return np.stack([render(scene, 256, seed=seed, integrator="PATH", max_bounces=0) for seed in range(4)])


def test_screens_before_one_pixel_do_not_darken_another():
    """Of eight surfaces, paths on the right cross three and shadow rays four, and two of the fog: on the left alone."""
    b = floor((-0.4, 0.0, 0.6))
    glass = program([(nodes.TRANSPARENT, 0, 3)], [1.0, 1.0, 1.0, 0.9, 0.8, 0.9], flags=rec.MATERIAL_TRANSPARENT)
    for i in range(3):
        b.add(QUAD, glass, scaled(matrix((0.42, -1.45 + 0.03 * i, 1.85), (0.0, -1.0, 1.2)), 0.4, 1.0, 1.0))
    for i in range(4):
        b.add(QUAD, glass, scaled(matrix((0.0, 0.0, 1.4 + 0.02 * i)), 1.5, 1.5, 1.0), UNSEEN)
    scene = finish(b)
    found = np.stack([frames_of([scene], seed, reuse_of(rounds=1))[0] for seed in range(24)])
    assert np.abs(off(found, truth_of(scene))).max() < 3.5


def test_media_are_those_that_the_path_has_found_where_meshes_are_not_closed():
    """A cube within a cube of one mesh: behind the inner one a path is outside, whatever is around it."""
    b = floor()
    corners, faces = np.array(OUTWARD[0]), np.array(OUTWARD[1])
    nested = np.concatenate([corners, 0.2 * corners + (0.0, 0.0, 0.4)]), np.concatenate([faces, faces + len(corners)])
    b.add(nested, medium(absorption=(0.5, 1.0, 1.5)), scaled(matrix((0.0, 0.0, 0.5)), 1.4, 1.4, 0.8))
    scene = finish(b)
    found = np.stack([frames_of([scene], seed, reuse_of())[0] for seed in range(24)])
    assert np.abs(off(found, truth_of(scene))).max() < 3.5


@pytest.mark.parametrize(
    "fogs", [[[(0.0, 0.0, 0.6)], []], [[], [(0.0, 0.0, 0.6)]], [[(0.2, 0.0, 0.6)], [(-0.2, 0.0, 0.6)]]]
)
def test_history_with_a_medium_that_comes_and_goes_keeps_the_mean(fogs):
    scenes = [finish(floor(*places)) for places in fogs]
    plan = reuse_of(temporal=True)
    assert (
        np.abs(off(np.stack([frames_of(scenes, seed, plan)[0] for seed in range(60)]), truth_of(scenes[-1]))).max()
        < 3.5
    )
