"""Random walks that the pixels of a block share have the mean of PATH's, with less noise; and how light enters.

Both ways take the same walks for a seed, so that the difference of two pictures is much less noisy than either. The
scene has textured colours and radii, several objects, instances, thin parts, deep folds, surfaces that are diffuse in
part, and light from behind; pixels are about as wide as mean free paths, so that neighbors see it differently. Renders
stop as soon as they tell the same mean from one that is off by 0.5 %, in the picture and in each part of its subsurface
light.
"""

from dataclasses import replace

import numpy as np
import pytest

from restir_engine.context import FrameContext
from restir_engine.film import Film
from restir_engine.integrators.base import Integrator
from restir_engine.integrators.path import PathIntegrator
from restir_engine.integrators.restir import choice
from restir_engine.integrators.restir.walks import SIDE, SharedWalks, shares_walks
from restir_engine.kernels.lobes.closure import ENTRY_DIFFUSE, ENTRY_REFRACTIVE, ENTRY_SKIN
from restir_engine.reuse_settings import ReuseSettings
from restir_engine.scene.lamps import area_lamp, point_lamp
from restir_engine.scene.mesh import Mesh
from restir_engine.scene.scene import Scene
from restir_engine.scene.shutter import Shutter
from restir_engine.settings import RenderSettings, required_passes
from testing.kernels.entries import Entry
from testing.measures import block_means
from testing.scenes.blurred import move
from testing.scenes.lights import matrix
from testing.scenes.rooms import UNSEEN, Builder, look, render, scaled
from testing.scenes.scattering import look as straight_look
from testing.scenes.scattering import scatter_scene
from testing.scenes.shapes import OUTWARD, box, icosphere
from testing.scenes.translucent import checkered_skin, skin
from testing.statistics import Sequential, Verdict

PARTS = ("Combined", "Subsurface Boundary", "Subsurface Single", "Subsurface Multiple", "Diffuse Indirect")
OF_PATH = ReuseSettings(light_candidates=0)  # light samples as PATH draws them
SIZE, GROUP, SAMPLES = 24, 12, 16
EARLY = Sequential(bound=0.005, false_alarm=0.0005, miss=0.01, looks=6)
DEEP_ERROR, DEEP_MOST = 0.0005, 960

SLANTED = np.array([0.6, -0.3, 0.5]) / np.linalg.norm([0.6, -0.3, 0.5])
BUMPED = np.array([0.2, 0.3, 1.0]) / np.linalg.norm([0.2, 0.3, 1.0])
ENTRIES = {
    "diffuse": Entry(ENTRY_DIFFUSE, 1.0, 1.4, SLANTED),
    "diffuse, bumped": Entry(ENTRY_DIFFUSE, 1.0, 1.4, SLANTED, n=BUMPED),
    "refractive": Entry(ENTRY_REFRACTIVE, 0.25, 1.4, SLANTED),
    "refractive, rough, bumped": Entry(ENTRY_REFRACTIVE, 1.0, 1.3, SLANTED, n=BUMPED),
    "refractive, dense": Entry(ENTRY_REFRACTIVE, 0.5, 2.5, (0.0, 0.0, 1.0)),
    "skin": Entry(ENTRY_SKIN, 0.3, 1.4, SLANTED),
}


@pytest.mark.parametrize("name", ENTRIES)
def test_density_of_entry_is_that_of_what_is_sampled(name):
    """By regions of equal solid angle: the share of the samples in each is the density's integral over it."""
    entry = ENTRIES[name]
    rows, columns, fine, n = 16, 16, 24, 400_000
    line = (np.arange(rows * fine) + 0.5) / (rows * fine)
    turn = (np.arange(columns * fine) + 0.5) / (columns * fine) * 2.0 * np.pi
    z, phi = np.meshgrid(2.0 * line - 1.0, turn, indexing="ij")
    r = np.sqrt(1.0 - z * z)
    directions = np.stack([r * np.cos(phi), r * np.sin(phi), z], -1).reshape(-1, 3)
    density = entry.densities(directions).reshape(rows, fine, columns, fine).mean((1, 3))
    expected = n * density * 4.0 * np.pi / (rows * columns)
    enters, d = entry.directions(np.random.default_rng(1).random((n, 2)))
    d = d[enters]
    found, _, _ = np.histogram2d(
        d[:, 2], np.arctan2(d[:, 1], d[:, 0]) % (2.0 * np.pi), (rows, columns), [(-1.0, 1.0), (0.0, 2.0 * np.pi)]
    )
    off = (found - expected) / np.sqrt(
        expected + 1.0 + (0.01 * expected) ** 2
    )  # the sums of the integral, too, are off
    assert np.abs(off).max() < 4.5 and np.mean(off**2) < 1.5
    assert len(d) == pytest.approx(expected.sum(), rel=0.005)


def picture(context, settings, kind=SharedWalks, active=None, **how) -> np.ndarray:
    """The parts of a picture, float64 (parts, height, width, 3), by an integrator on this thread."""
    width, height = context.camera.film_size
    film = Film(width, height, required_passes(frozenset(PARTS), False))
    if active is not None:
        film.count_pixels()
        film.sample_only(active)
    integrator = kind(context, settings, film, **how)
    integrator.prepare()
    scratch = Integrator.scratch()
    for sample in range(0, settings.samples, 4):
        for stage in integrator.stages(sample, 4):
            for item in film.tiles() if stage.items is None else stage.items:
                stage.run(item, scratch)
            stage.finish()
    return np.stack([film.sums(name)[..., :3] / settings.samples for name in PARTS]).astype(float)


def settings_of(seed: int, **changes) -> RenderSettings:
    defaults = {"samples": SAMPLES, "max_bounces": 2, "passes": frozenset(PARTS), "reuse": OF_PATH}
    return RenderSettings(seed=seed, integrator="RESTIR", **defaults | changes)


def folded(**entry) -> Scene:
    """The scene; entry: how light enters, and the anisotropy g of what is inside."""
    b = Builder()
    vertices, triangles = icosphere(0.7, 4)
    vertices = np.asarray(vertices)
    folds = 1.0 + 0.35 * np.sin(9.0 * vertices[:, :1]) * np.sin(9.0 * vertices[:, 2:])
    near = {"contrast": (0.98, 0.95), **entry}  # so near that both kinds of squares share walks
    b.add((vertices * folds, triangles), checkered_skin(7.0, shares=(0.6, 0.6), **near), matrix((-0.35, 0.0, 0.1)))
    b.add(OUTWARD, checkered_skin(5.0, **entry), scaled(matrix((0.6, -0.2, 0.1), (0.3, -0.2, 1.0)), 0.3, 0.03, 0.5))
    for x in (0.3, 0.62):
        b.add(OUTWARD, skin(0.7, **entry), scaled(matrix((x, -0.5, -0.6), (0.1, x, 1.0)), 0.14, 0.14, 0.14))
    b.lamp(area_lamp(matrix((0.4, 1.6, 1.2), (0.1, 1.0, 0.5)), 12.0 * np.ones(3), 0.5, 0.5, seen_by=UNSEEN))
    b.lamp(point_lamp(matrix((-1.2, -2.2, 1.2)), (90.0, 100.0, 120.0), 0.1, seen_by=UNSEEN))
    return b.finish(look((0.2, -2.6, 0.5), (0.0, 0.0, 0.0), SIZE))


@pytest.fixture(scope="module")
def scenes():
    """Contexts of the scene by how light enters, each made once."""
    kept = {}

    def of(**entry):
        key = tuple(sorted(entry.items()))
        if key not in kept:
            kept[key] = FrameContext(folded(**entry))
        return kept[key]

    return of


def differences(context, seeds, **settings) -> np.ndarray:
    """(n, 2, parts, height, width, 3): with shared walks less PATH's, and PATH's."""
    both = []
    for seed in seeds:
        path = picture(context, settings_of(seed, **settings), PathIntegrator)
        both.append((picture(context, settings_of(seed, **settings)) - path, path))
    return np.array(both)


def means(kept) -> tuple[np.ndarray, np.ndarray, int]:
    """Of the differences of means, by part: relative to the whole picture, the standard error, degrees of freedom."""
    by_seed = kept.mean((3, 4, 5))
    whole = by_seed[:, 1, 0].mean()
    off = by_seed[:, 0] / whole
    return off.mean(0), off.std(0, ddof=1) / np.sqrt(len(off)), len(off) - 1


CASES = {
    "diffuse": ({}, {}),
    "skin": ({"entry": "SKIN"}, {}),
    "refractive": ({"entry": "REFRACTIVE"}, {}),
    "anisotropic": ({"g": 0.7}, {}),
    "exact": ({"entry": "SKIN"}, {"exact_walks": True}),
    "from light tiles": ({}, {"reuse": ReuseSettings()}),
    "clamped": ({}, {"clamp_direct": 0.4, "clamp_indirect": 0.1}),
}


@pytest.mark.parametrize("case", ["skin", "anisotropic", "clamped"])
def test_the_mean_is_that_of_path_as_far_as_told(case, scenes):
    entry, settings = CASES[case]
    kept: list[np.ndarray] = []

    def more():
        for turn in range(EARLY.looks):
            kept.extend(differences(scenes(**entry), range(turn * GROUP, (turn + 1) * GROUP), **settings))
            yield np.array(kept)

    verdict, measured = EARLY.told(more(), means)
    assert verdict is Verdict.SAME, measured


@pytest.mark.deep
@pytest.mark.parametrize("case", CASES)
def test_the_mean_is_that_of_path(case, scenes):
    """Within 3 standard errors and 0.5 %, by parts of the light; and by blocks of 8 × 8 pixels."""
    entry, settings = CASES[case]
    kept, error = [], np.ones(1)
    while error.max() > DEEP_ERROR and len(kept) < DEEP_MOST:
        kept.extend(differences(scenes(**entry), range(len(kept), len(kept) + 4 * GROUP), **settings))
        off, error, _ = means(np.array(kept))
    print(case, off, error)
    assert (np.abs(off) < np.minimum(3.5 * error, 0.005)).all(), (off, error)
    by_block = block_means(np.array(kept)[:, 0, 0].mean(-1)[..., None])[..., 0]
    spread = by_block.std(0, ddof=1) / np.sqrt(len(by_block))
    z = np.abs(by_block.mean(0)[spread > 0.0] / spread[spread > 0.0])
    assert (z > 3.0).sum() <= 2 and z.mean() < 1.1


def plate(entry: str) -> Scene:
    """Squares as large as a pixel, of two kinds that share walks: unlike enough for the pictures of both to differ."""
    material = checkered_skin(1.0, entry, scale=6.0, contrast=(0.95, 0.93), shares=(0.9, 0.8))
    description = scatter_scene(Mesh(*box(8.0, 8.0, 4.5)), material, sky=1.0)
    return straight_look(description, (0.0, 0.0, 20.0), width=16, height=16, size=16.0).commit()


def comb(entry: str) -> Scene:
    """Teeth as wide as a pixel, by turns thin and thick, of one mesh, with light from behind."""
    vertices, triangles = (np.asarray(a) for a in OUTWARD)
    teeth, faces = [], []
    for k in range(16):
        depth = (0.2, 3.0)[k % 2]
        teeth.append(vertices * (0.45, 8.0, 0.5 * depth) + (k - 7.5, 0.0, -0.5 * depth))
        faces.append(triangles + 8 * k)
    mesh = Mesh(np.concatenate(teeth), np.concatenate(faces))
    lamp = point_lamp(matrix((0.0, 0.0, -20.0)), 40000.0 * np.ones(3), 0.1, seen_by=UNSEEN)
    description = scatter_scene(mesh, skin(6.0, entry), [lamp], sky=0.1)
    return straight_look(description, (0.0, 0.0, 20.0), width=16, height=16, size=16.0).commit()


@pytest.mark.parametrize("entry", ["DIFFUSE", "REFRACTIVE"])
@pytest.mark.parametrize(("scene", "kinds"), [(plate, (1, 1)), (comb, (1, 0))])
def test_neighbours_that_share_walks_stay_what_they_are(scene, kinds, entry):
    """Of two kinds of pixels, which alternate, each has PATH's mean, to within 0.6 %: nothing leaks."""
    x, y = np.meshgrid(range(16), range(16))
    odd = (kinds[0] * x + kinds[1] * y) % 2 == 1
    context, seeds = FrameContext(scene(entry)), range(12)
    both = differences(context, seeds, samples=32, max_bounces=0, pixel_filter="BOX")[:, :, 0].mean(-1)
    for kind in (odd, ~odd):
        off, path = both[:, 0, kind].mean(-1), both[:, 1, kind].mean()
        error = off.std(ddof=1) / np.sqrt(len(off))
        print(f"{path:.4f} off by {off.mean() / path:+.3%}, standard error {error / path:.3%}")
        assert abs(off.mean()) < 3.5 * error and error < 0.002 * path


def test_blocks_of_one_pixel_are_path_bit_for_bit(scenes):
    path, alone = (
        picture(scenes(entry="SKIN"), settings_of(3), *how)
        for how in ((PathIntegrator,), (lambda *a: SharedWalks(*a, side=1),))
    )
    np.testing.assert_array_equal(alone, path)


def test_a_pixel_alone_in_its_block_is_that_of_path(scenes):
    """All but one pixel of each block are done: there is nobody to share with."""
    active = np.zeros((SIZE, SIZE), bool)
    active[1::SIDE, 2::SIDE] = True
    settings = settings_of(3, reuse=replace(OF_PATH, moving_blocks=False))
    path, alone = (picture(scenes(entry="SKIN"), settings, kind, active) for kind in (PathIntegrator, SharedWalks))
    np.testing.assert_allclose(alone, path, rtol=1e-5, atol=1e-7)
    assert path[0].any()


def close_up(size: int = 64, scale: float = 1.0):
    """A ball of skin that is lit from one side; scale: of its mean free paths, the longest a tenth of its width."""
    b = Builder()
    b.add(icosphere(0.9, 4), skin(scale), matrix())
    b.lamp(point_lamp(matrix((-1.6, -3.2, 1.8)), 120.0 * np.ones(3), 0.03, seen_by=UNSEEN))
    return b.finish(look((0.0, -2.6, 0.4), (0.0, 0.0, 0.0), size))


def test_shared_walks_are_less_noisy():
    """Pixels are a sixth of the mean free path of red light."""
    context = FrameContext(close_up())
    noise = [
        np.stack([picture(context, settings_of(seed, max_bounces=0), kind)[0] for seed in range(4)]).var(0, ddof=1)
        for kind in (PathIntegrator, SharedWalks)
    ]
    assert noise[1].mean() < 0.6 * noise[0].mean()


def test_a_picture_does_not_depend_on_threads():
    one, other = (
        render(close_up(48), 4, threads=threads, integrator="RESTIR", max_bounces=1, sss_walks="SHARED")
        for threads in (1, 3)
    )
    np.testing.assert_array_equal(one, other)


def kind_of(scale, size=128, **changes) -> type:
    context = FrameContext(close_up(size, scale))
    film = Film(size, size, required_passes(frozenset(), False))
    settings = RenderSettings(integrator="RESTIR", max_bounces=0, **{"samples": 512} | changes)
    return type(choice.integrator_of(context, settings, film))


@pytest.mark.parametrize(
    ("scale", "changes", "kind"),
    [
        (1.0, {}, SharedWalks),
        (0.03, {}, PathIntegrator),  # pixels are wide
        (0.03, {"sss_walks": "SHARED", "samples": 4, "size": 32}, SharedWalks),
        (1.0, {"sss_walks": "OWN"}, PathIntegrator),
        (1.0, {"use_denoising": True}, PathIntegrator),
        (1.0, {"samples": 64}, PathIntegrator),
        (1.0, {"sss_method": "DIFFUSION", "sss_shift": "NONE"}, PathIntegrator),
    ],
)
def test_walks_are_shared_where_it_pays(scale, changes, kind):
    assert kind_of(scale, **changes) is kind


def test_what_moves_has_walks_of_its_own():
    """With motion blur each path has its own moment: the picture is PATH's."""
    description = scatter_scene(Mesh(*icosphere(0.5, 3)), skin(2.0), sky=1.0)
    move(description, {0: np.array([matrix((x, 0.0, 0.0)) for x in (-0.3, 0.0, 0.3)])})
    description.shutter = Shutter()
    scene = straight_look(description, (0.0, 0.0, 4.0), width=16, height=16).commit()
    path = render(scene, 2)
    np.testing.assert_array_equal(render(scene, 2, integrator="RESTIR", sss_walks="SHARED"), path)
    assert any("motion blur" in str(warning) for warning in scene.warnings)


def test_what_hinders_sharing_is_said(scenes):
    context = scenes()
    settings = settings_of(0, sss_walks="SHARED", light_groups=("key",))
    assert shares_walks(context, settings_of(0, sss_walks="SHARED"))
    assert not shares_walks(context, settings)
    assert any("light groups" in str(warning) for warning in context.scene.warnings)
