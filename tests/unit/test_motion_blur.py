"""What moves while the shutter is open: coverage that can be counted, and everything in motion by all integrators."""

import math

import numpy as np
import pytest

from restir_engine.kernels.core import records as rec
from restir_engine.reuse_settings import ReuseSettings
from restir_engine.scene.camera import Camera
from restir_engine.scene.motion import along_arcs, decompose, polylines, rotation_matrices, swept
from restir_engine.scene.shutter import Shutter, inverse_cumulated
from testing.scenes.blurred import blurred, deforming, move, turned
from testing.scenes.lights import emission_program, matrix
from testing.scenes.moving import off
from testing.scenes.rooms import UNSEEN, Builder, diffuse, frames, look, render, scaled
from testing.scenes.shapes import QUAD

WIDTH, HEIGHT = 48, 12
ABOVE = np.array([[1.0, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 5], [0, 0, 0, 1]])
SHINES = emission_program((1.0, 1.0, 1.0))


def strip(b: Builder, steps=None, shutter=None, camera_steps=()):
    """What an orthographic camera sees of [-2, 2] × [-1/2, 1/2] from above; steps: of the first instance."""
    views = [Camera("ORTHO", to_world=place, screen=(-2.0, 2.0, -0.5, 0.5)) for place in camera_steps]
    camera = Camera(
        "ORTHO", to_world=ABOVE, width=WIDTH, height=HEIGHT, screen=(-2.0, 2.0, -0.5, 0.5), steps=tuple(views)
    )
    scene = b.describe(camera)
    if steps is not None:
        move(scene, {0: steps})
    scene.shutter = shutter or Shutter()
    return scene.commit()


def square(width: float = 0.25, x: float = 0.0) -> np.ndarray:
    return scaled(matrix((x, 0.0, 0.0), (0.0, 0.0, 1.0)), width, 1.0, 1.0)


def columns(scene, samples: int = 256) -> np.ndarray:
    """How much of each column of pixels shines."""
    return render(scene, samples, pixel_filter="BOX")[:, :, 0].mean(0)


CENTRES = (np.arange(WIDTH) + 0.5) / WIDTH * 4.0 - 2.0
ERROR = 0.01  # of a column: 12 pixels with 256 samples each have 0.009 at the most if these were independent


def covered(left, right, weights=None) -> np.ndarray:
    """The share of time (0 to 1, weighted) that places across each column are between two edges, functions of it."""
    times = (np.arange(4000) + 0.5) / 4000
    w = np.ones(4000) if weights is None else weights(times)
    x = (CENTRES[:, None] + (np.arange(8) + 0.5) / 8 * 4.0 / WIDTH - 2.0 / WIDTH).ravel()
    inside = (x[:, None] > left(times)) & (x[:, None] < right(times))
    return ((inside * w).sum(1) / w.sum()).reshape(WIDTH, 8).mean(1)


def test_a_sliding_square_covers_what_it_passes():
    b = Builder()
    b.add(QUAD, SHINES, square())
    found = columns(strip(b, [square(x=x) for x in (-1.0, 0.0, 1.0)]))
    truth = covered(lambda t: 2 * t - 1.25, lambda t: 2 * t - 0.75)
    assert np.abs(found - truth).max() < ERROR
    assert np.abs(found - np.roll(truth, 1)).max() > 2 * ERROR  # a pixel beside it is found


def test_steps_are_where_they_should_be():
    """Faster at first than later, in five steps; and the shutter's curve says how much light comes when."""
    places = np.array([-1.5, -0.3, 0.5, 0.9, 1.1])
    b = Builder()
    b.add(QUAD, SHINES, square())
    scene = strip(b, [square(x=x) for x in places], Shutter(np.array([0.0, 1.0, 0.25])))

    def at(t):
        return np.interp(t, np.linspace(0, 1, 5), places)

    truth = covered(lambda t: at(t) - 0.25, lambda t: at(t) + 0.25, lambda t: np.interp(t, [0, 0.5, 1], [0, 1, 0.25]))
    assert np.abs(columns(scene) - truth).max() < ERROR


def test_a_growing_mesh_covers_what_its_vertices_pass():
    shape = np.array(QUAD[0], float)
    steps = [shape * (w, 1, 1) for w in (0.1, 0.4, 1.9)]
    truth = covered(
        lambda t: -np.interp(t, [0, 0.5, 1], [0.1, 0.4, 1.9]), lambda t: np.interp(t, [0, 0.5, 1], [0.1, 0.4, 1.9])
    )
    for copies in (1, 2):  # in the tree over the world, and in one of its own
        b = Builder()
        mesh = deforming(np.array(steps), QUAD[1])
        for k in range(copies):
            b.add(mesh, SHINES, matrix((0.0, 10.0 * k, 0.0), (0.0, 0.0, 1.0)))
        assert np.abs(columns(strip(b)) - truth).max() < ERROR


def test_a_camera_that_moves_sees_what_it_passes():
    b = Builder()
    b.add(QUAD, SHINES, square(0.5))
    places = np.array([ABOVE] * 3)
    places[:, 0, 3] = -0.5, 0.0, 0.5
    found = columns(strip(b, camera_steps=places))
    assert np.abs(found - covered(lambda t: -t, lambda t: 1 - t)).max() < ERROR


def test_a_rolling_shutter_reads_lines_from_the_top():
    b = Builder()
    b.add(QUAD, SHINES, square(0.1))
    scene = strip(b, [square(0.1, x) for x in (-1.5, 0.0, 1.5)], Shutter(rolling=0.0))
    picture = render(scene, 64, pixel_filter="BOX")[:, :, 0]
    middle = (picture * CENTRES).sum(1) / picture.sum(1)
    line = np.arange(HEIGHT) / HEIGHT
    assert np.abs(middle - 3.0 * (0.5 - line)).max() < 0.02
    wide = strip(b, [square(0.1, x) for x in (-1.5, 0.0, 1.5)], Shutter(rolling=0.5))
    picture = render(wide, 256, pixel_filter="BOX")[:, :, 0]
    middle = (picture * CENTRES).sum(1) / picture.sum(1)
    assert np.abs(middle - 1.5 * (0.5 - line)).max() < 0.04
    spread = np.sqrt((picture * (CENTRES - middle[:, None]) ** 2).sum(1) / picture.sum(1))
    assert np.abs(spread - math.hypot(1.5 / math.sqrt(12.0), 0.2 / math.sqrt(12.0))).max() < 0.02


def test_a_propeller_turns_on_an_arc():
    """A blade of half a turn with three steps: each place inside its circle is covered equally long."""
    b = Builder()
    b.add(QUAD, SHINES, matrix())
    blade = [turned(a, (0, 0, 0), 0.45, 0.05, 1.0) for a in (-math.pi / 2 + 0.001, 0.0, math.pi / 2 - 0.001)]
    picture = render(strip(b, blade), 512, pixel_filter="BOX")[:, :, 0]
    x, y = np.meshgrid(CENTRES, (np.arange(HEIGHT) + 0.5) / HEIGHT - 0.5)
    r = np.hypot(x, y)
    ring = (r > 0.15) & (r < 0.4)
    truth = 2.0 * np.arcsin(0.05 / r[ring]) / math.pi
    assert abs((picture[ring] - truth).mean()) < 0.003
    assert np.abs(picture[ring] - truth).max() < 0.08
    assert picture[r > 0.5].max() == 0.0


def test_the_shutters_curve_is_inverted():
    u = np.linspace(0.0, 1.0, rec.SHUTTER_TABLE_SIZE)
    assert np.allclose(inverse_cumulated(np.array([0.0, 1.0])), np.sqrt(u), atol=2e-3)
    assert np.allclose(inverse_cumulated(np.zeros(5)), u, atol=1e-6)
    gap = inverse_cumulated(np.array([1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 1.0]))
    assert ((gap < 0.35) | (gap > 0.65)).all() and np.all(np.diff(gap) >= 0.0)


def test_matrices_are_taken_apart():
    random = np.random.default_rng(4)
    matrices = random.normal(size=(200, 12))
    parts = decompose(matrices)
    rotation = rotation_matrices(parts.rotation)
    linear = matrices.reshape(-1, 3, 4)[:, :, :3]
    assert np.allclose(rotation @ parts.stretch, linear, atol=1e-9)
    assert np.allclose(np.tril(parts.stretch, -1), 0.0, atol=1e-12)
    assert (np.einsum("nii->ni", parts.stretch) * np.sign(np.linalg.det(linear))[:, None] > 0.0).all()
    assert ((parts.rotation[1:] * parts.rotation[:-1]).sum(1) >= 0.0).all()


def test_lines_follow_arcs():
    """What turns by 1.5 radians a step, about its middle and about a place far away, beside places on the arc."""
    angles = np.array([0.0, 1.5, 3.0])
    steps = np.array([turned(a, (0.1 * a, 0.0, 0.0), 1.0, 0.1, 1.0).ravel() for a in angles])
    box = np.array([[-1.0, -1.0, 0.0], [1.0, 1.0, 1.0]])
    for offset in (0.0, 4.0):
        boxes = box + np.array([offset, 0.0, 0.0])
        lines = polylines(np.array([steps, steps]), np.array([boxes, boxes]))[1]
        times = np.linspace(0.0, 1.0, 997)
        place = times * (len(lines) - 1)
        step = np.minimum(place.astype(int), len(lines) - 2)
        found = lines[step] + (lines[step + 1] - lines[step]) * (place - step)[:, None]
        truth = np.array([turned(3.0 * t, (0.3 * t, 0.0, 0.0), 1.0, 0.1, 1.0) for t in times])
        corners = np.array([(x, y, z) for x in boxes[:, 0] for y in boxes[:, 1] for z in boxes[:, 2]])
        away = (found.reshape(-1, 3, 4) - truth)[:, :, :3] @ corners.T + (found.reshape(-1, 3, 4) - truth)[:, :, 3:]
        assert np.linalg.norm(away, axis=1).max() < 2.6e-4 * 2.25  # a 4000th of its size
        assert np.array_equal(lines[:: (len(lines) - 1) // 2], steps)
        low, high = swept(boxes, lines)
        passed = truth[:, :, :3] @ corners.T + truth[:, :, 3:]
        assert (passed.min((0, 2)) >= low - 1e-3).all() and (passed.max((0, 2)) <= high + 1e-3).all()
    assert len(polylines(np.array([[np.eye(3, 4).ravel()] * 3]), box[None])[0]) == 3
    assert np.abs(along_arcs(steps, 1) - steps).max() == 0.0


def test_moving_emitters_are_sampled_as_they_are_found():
    """A lamp of triangles that turns its back to the floor at some times: light samples against paths that find it."""
    pictures = []
    for sampling in (1, 0):
        b = Builder()
        b.add(QUAD, emission_program((4.0, 2.0, 1.0), sampling), matrix(), UNSEEN)
        b.add(QUAD, diffuse((0.8, 0.8, 0.8)), scaled(matrix(), 2.0, 2.0, 1.0))
        scene = b.describe(look((0.3, -2.6, 1.9), (0.0, 0.0, 0.2), 24))
        steps = [scaled(matrix((0.4 * k, 0.0, 0.7), (k, 0.2, 1.0 - 2.5 * k * k)), 0.5, 0.4, 1.0) for k in (-1, 0, 1)]
        move(scene, {0: steps})
        scene.shutter = Shutter()
        pictures.append(frames(scene.commit(), 48, range(12), max_bounces=0))
    assert np.abs(off(*pictures)).max() < 4.0


REUSE = {
    "none": ReuseSettings(pilot=False),
    "disk": ReuseSettings(pilot=False, rounds=2, neighbours=4, radius=3.0, pattern="DISK"),
    "pairs": ReuseSettings(pilot=False, rounds=2, neighbours=2, radius=4.0, pattern="PAIRS"),
    "in time": ReuseSettings(pilot=False, temporal=True, rounds=1, neighbours=2),
}
SIZE, SEEDS = 24, range(12)


@pytest.fixture(scope="module")
def everything_moves():
    scene = blurred(SIZE).commit()
    return scene, frames(scene, 64, SEEDS, max_bounces=0)


@pytest.mark.parametrize(
    "kind",
    [pytest.param("none", marks=pytest.mark.deep), "disk", pytest.param("pairs", marks=pytest.mark.deep), "in time"],
)
def test_pixels_with_different_times_resample_one_another(kind, everything_moves):
    """Each pixel's path has a time of its own, and what it takes from others lights it as it does then."""
    scene, truth = everything_moves
    found = frames(scene, 32, range(100, 112), max_bounces=0, integrator="RESTIR", reuse=REUSE[kind])
    assert np.abs(off(found, truth)).max() < 4.0


def test_a_picture_of_one_moment_is_told_from_it(everything_moves):
    """What these tests can see."""
    _, truth = everything_moves
    still = blurred(SIZE)
    still.shutter = None
    assert np.abs(off(frames(still.commit(), 32, range(100, 112), max_bounces=0), truth)).max() > 6.0


def test_whole_paths_are_not_reused_and_that_is_said():
    scene = blurred(16).commit()
    reuse = ReuseSettings(pilot=False, rounds=1, paths="WHOLE")
    pictures = [
        frames(scene, 4, range(2), max_bounces=1, integrator="RESTIR", reuse=options)
        for options in (reuse, ReuseSettings(pilot=False, rounds=1))
    ]
    assert np.array_equal(*pictures)
    assert any("no whole paths" in line for line in scene.warnings.lines())
