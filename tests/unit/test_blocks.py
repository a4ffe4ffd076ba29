"""Pixels of a block that share exits: S as vector code has it, and the mean that they keep."""

from dataclasses import replace

import numpy as np
import pytest

from restir_engine.context import FrameContext
from restir_engine.film import Film
from restir_engine.integrators.blocks import integrator as blocks
from restir_engine.integrators.restir.choice import integrator_of
from restir_engine.kernels.subsurface.bssrdf import BSSRDF, CYCLES, MULTIPLE, MULTIPLE_OF_SLAB, WHOLE
from restir_engine.reuse_settings import ReuseSettings
from restir_engine.scene.lamps import point_lamp
from restir_engine.session import Session
from restir_engine.settings import RenderSettings, required_passes
from testing.kernels.blocks import shapes
from testing.scenes.lights import matrix
from testing.scenes.rooms import Builder, diffuse, look, scaled
from testing.scenes.scattering import subsurface_program
from testing.scenes.shapes import QUAD, icosphere
from testing.scenes.translucent import skin

SETTINGS = RenderSettings(
    integrator="RESTIR", samples=4, seed=7, threads=1, sss_method="DIFFUSION", max_bounces=2, filter_width=1.0
)


def domains(kinds, random) -> np.ndarray:
    """A domain of each kind near the origin, with random scales of about a tenth."""
    b = np.zeros(len(kinds), BSSRDF)
    b["kind"] = kinds
    b["p"] = 0.05 * random.normal(size=(len(b), 3))
    n = random.normal((0.0, 0.0, 3.0), size=(len(b), 3))
    b["n"] = n / np.linalg.norm(n, axis=1, keepdims=True)
    b["side"] = b["looks"] = 1.0
    b["weight"] = random.random((len(b), 3))
    b["weight"][0, 1] = 0.0
    b["d"] = b["sampled"] = 0.02 + 0.1 * random.random((len(b), 3))
    b["single"] = 0.6 * b["d"]
    b["share"] = 0.5 * random.random((len(b), 3))
    b["near"], b["far"] = random.random((2, len(b), 3)) + 0.2
    b["wide_near"], b["wide_far"] = 0.5 + random.random((2, len(b), 3))
    b["bend"] = random.normal(size=(len(b), 3))
    b["thickness"] = 0.1 + 0.3 * random.random(len(b))
    return b


@pytest.mark.parametrize(
    "kinds",
    [
        [WHOLE] * 3,
        [MULTIPLE] * 5,
        [MULTIPLE_OF_SLAB] * 4,
        [CYCLES] * 9,
        [WHOLE, CYCLES, MULTIPLE, MULTIPLE_OF_SLAB] * 4,
    ],
    ids=["whole", "multiple", "slab", "Cycles", "all"],
)
def test_a_block_has_the_s_that_paths_have(kinds):
    """In single precision: to 1e-5 of it, and zero where it ends."""
    random = np.random.default_rng(3)
    points = random.normal(size=(200, 3)) * np.geomspace(1e-3, 2.0, 200)[:, None]
    normals = random.normal(size=(200, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    ours, theirs = shapes(domains(kinds, random), points, normals)
    assert (np.abs(theirs) > 0.0).mean() > 0.5
    np.testing.assert_allclose(ours, theirs, rtol=2e-5, atol=1e-7 * np.abs(theirs).max())


def stage(body) -> Builder:
    """Skin above a diffuse floor, under a lamp that is a point."""
    b = Builder()
    b.add(QUAD, diffuse((0.6, 0.4, 0.2)), scaled(matrix((0.0, 0.0, -0.6)), 3.0, 3.0, 1.0))
    b.add(*body)
    b.lamp(point_lamp(matrix((0.7, -1.0, 2.5)), (50.0, 40.0, 60.0), 0.0))
    return b.finish(look((0.0, -2.2, 1.4), (0.0, 0.0, 0.0), 40))


@pytest.fixture(scope="module")
def ball():
    return stage((icosphere(0.5, 3), skin(2.0), matrix()))


def render(scene, **changes) -> np.ndarray:
    session = Session(scene, replace(SETTINGS, **changes))
    assert session.render()
    return session.film.pass_array("Combined")[..., :3]


def kind(scene, **changes) -> type:
    """The integrator that settings get."""
    settings = replace(SETTINGS, **changes)
    film = Film(*scene.camera.film_size, required_passes(settings.passes, False))
    return type(integrator_of(FrameContext(scene), settings, film))


def test_a_pixel_alone_has_the_estimate_of_path_tracing(monkeypatch):
    """Where each probe has one hit that is lit by one lamp: on a flat surface."""
    scene = stage((QUAD, skin(0.5), scaled(matrix(), 3.0, 3.0, 1.0)))
    path = render(scene, integrator="PATH", max_bounces=0)
    assert (path.mean((0, 1)) > 0.01).all()
    monkeypatch.setitem(blocks.SIDES, "DIFFUSION", 1)
    np.testing.assert_allclose(render(scene, max_bounces=0), path, rtol=1e-4, atol=1e-5 * path.max())


def test_what_is_shared_is_less_noisy(ball):
    """In the middle of the ball, whose rim is noisy by itself."""
    ours, path = (
        np.var([render(ball, samples=1, seed=seed, max_bounces=0, **way)[14:26, 14:26] for seed in range(12)], axis=0)
        for way in ({}, {"integrator": "PATH"})
    )
    assert ours.mean() < 0.4 * path.mean()


@pytest.mark.parametrize("spread", [1, 2])
def test_what_lies_beside_is_that_of_path_tracing(spread, ball, monkeypatch):
    """The blocks' pixels are all pixels, and nothing but light from below surfaces is another."""
    monkeypatch.setattr(blocks, "DENOISED_SPREAD", spread)
    ours = render(ball, max_bounces=0, passes=frozenset({"Combined", "Denoising Albedo"}))
    path = render(ball, max_bounces=0, integrator="PATH")
    same = (ours == path).all(-1)
    session = Session(ball, replace(SETTINGS, integrator="PATH", passes=frozenset({"Subsurface"}), max_bounces=0))
    session.render()
    skinless = session.film.pass_array("Subsurface")[..., :3].sum(-1) == 0.0
    assert skinless.mean() > 0.3 and same[skinless].mean() > 0.99
    assert not same[~skinless].all()


@pytest.mark.parametrize("denoised", [False, True])
def test_a_picture_does_not_depend_on_threads(denoised, ball):
    passes = frozenset({"Combined", "Denoising Albedo"} if denoised else {"Combined"})
    one, other = (render(ball, threads=threads, passes=passes) for threads in (1, 3))
    np.testing.assert_array_equal(one, other)


def test_exits_are_shared_where_nothing_else_is(ball):
    others = [
        {"sss_shift": "NONE"},
        {"sss_temporal": True},
        {"sss_method": "RANDOM_WALK"},
        {"integrator": "RESTIR", "reuse": ReuseSettings(rounds=1)},
        {"passes": frozenset({"Combined", "Visibility Estimate"})},
    ]
    assert kind(ball) is kind(ball, sss_shift="BLOCKS") is kind(ball, sss_method="HYBRID") is blocks.BlocksIntegrator
    assert all(kind(ball, **changes) is not blocks.BlocksIntegrator for changes in others)


def test_with_motion_blur_nothing_is_shared(ball):
    """Surfaces are elsewhere at another time; who asks for it is told."""
    settings = replace(SETTINGS, sss_shift="BLOCKS")
    assert blocks.shares_exits(ball, settings)

    class Moving:
        record, warnings, have_flag = {"shutter": 1}, ball.warnings, ball.have_flag

    assert not blocks.shares_exits(Moving, settings)
    assert any("Blocks" in line for line in ball.warnings.lines())


@pytest.mark.parametrize("method", ["BURLEY", "RANDOM_WALK"])
def test_materials_that_ask_for_walks_share_nothing(method):
    body = subsurface_program((0.8, 0.5, 0.35), (0.2, 0.08, 0.05), method=method)
    scene = stage((icosphere(0.5, 2), body, matrix()))
    shares = kind(scene, sss_method="FROM_MATERIAL") is blocks.BlocksIntegrator
    assert shares == (method == "BURLEY")
