"""Baking: points of a surface in place of camera rays, and the passes that each kind of bake is made of."""

import math
from dataclasses import replace

import numpy as np
import pytest

from restir_engine.baking import ALL_LIGHT, BAKES, LOBES, bake_picture, bake_settings
from restir_engine.kernels.core import records as rec
from restir_engine.kernels.lobes import nodes
from restir_engine.kernels.shading import opcodes as ops
from restir_engine.scene import names
from restir_engine.scene.camera import Camera
from restir_engine.scene.mesh import Mesh
from restir_engine.scene.shape import Attribute
from restir_engine.scene.texels import Texels
from restir_engine.session import Session
from restir_engine.settings import RenderSettings
from testing.scenes import rooms
from testing.scenes.lights import emission_program, matrix
from testing.scenes.shapes import CUBE, QUAD

SIZE = 16
UV = names.RESERVED.index(names.UV)


def sheet() -> Mesh:
    """The square [-1, 1]² with texture coordinates from 0 to 1."""
    mesh = Mesh(*(np.array(part) for part in QUAD))
    mesh.attributes.append(Attribute(UV, rec.DOMAIN_POINT, (0.5 * mesh.vertices[:, :2] + 0.5).astype(np.float32)))
    return mesh


def texels(instance: int = 0, size: int = SIZE, **options) -> Texels:
    """The pixels of a picture that covers a `sheet`."""
    y, x = (np.mgrid[:size, :size] + 0.5) / size
    upper = y >= x  # the second triangle
    u, v = np.where(upper, x, x - y), np.where(upper, y - x, y)
    by_x, by_y = np.where(upper, -1.0, 0.0), np.where(upper, 1.0, 1.0)  # of v
    slopes = [np.ones_like(u), np.where(upper, 0.0, -1.0), by_x, by_y]
    return Texels(instance, upper.astype(np.int32), np.stack([u, v, *(s / size for s in slopes)], 2), **options)


def baked(scene, kind: str, parts=ALL_LIGHT, samples: int = 64, **options) -> np.ndarray:
    """The picture of a bake of the first instance of a scene that is not committed, or is."""
    points = options.pop("texels", None) or texels(jittered=kind != "POSITION")
    settings = bake_settings(RenderSettings(samples=samples, max_bounces=4, **options), kind, frozenset(parts))
    session = Session(scene, settings, replace(scene.camera, texels=points))
    assert session.render()
    return bake_picture(session, kind, frozenset(parts))


def room() -> rooms.Builder:
    """A sheet with all lobes that glows, under a lamp, beside a box."""
    b = rooms.Builder()
    glow = (0.1, 0.2, 0.3)
    lobes = [(nodes.DIFFUSE, 0, 6, 9, -1), (nodes.GLOSSY, 3, 10, 13, 9, 9, -1, -1, nodes.GGX)]
    constants = [*(0.6,) * 3, *(0.4,) * 3, 0.6, 0.3, 0.2, 0.0, 1.0, 1.0, 1.0, 0.4, *glow, 1.0]
    emits = {"flags": rec.MATERIAL_EMITS, "emission_sampling": 1, "emission_estimate": glow}
    b.add(sheet(), rooms.program([*lobes, (ops.EMISSION, 10, 14, 17)], constants, **emits), matrix())
    b.add(CUBE, rooms.diffuse((0.2, 0.7, 0.3)), rooms.scaled(matrix((0.6, 0.0, 0.3)), 0.25, 0.4, 0.3))
    b.lamp(rooms.area_lamp(matrix((-0.5, -0.4, 1.5)), (12.0, 10.0, 8.0), 0.5, 0.5))
    return b


@pytest.fixture(scope="module")
def scene():
    return room().finish(Camera())


def test_a_texel_is_the_place_that_it_is_said_to_be(scene):
    found = baked(scene, "POSITION")[..., :3]
    y, x = (np.mgrid[:SIZE, :SIZE] + 0.5) / SIZE
    np.testing.assert_allclose(found, np.stack([2.0 * x - 1.0, 2.0 * y - 1.0, np.zeros_like(x)], 2), atol=1e-6)


def test_samples_are_even_over_what_a_triangle_has_of_a_texel(scene):
    """Their mean is the middle of the texel, or of the half of it that lies above the diagonal."""
    samples = 256
    found = SIZE * baked(scene, "UV", samples=samples)[..., :2]
    y, x = np.mgrid[:SIZE, :SIZE] + 0.5
    middle = np.where((x == y)[..., None], np.stack([x - 1 / 6, y + 1 / 6], 2), np.stack([x, y], 2))
    error = np.where(x == y, 1 / math.sqrt(18), 1 / math.sqrt(12)) / math.sqrt(samples)
    z = (found - middle) / error[..., None]
    assert np.abs(z).max() < 4.0
    single = SIZE * baked(scene, "UV", samples=1, texels=texels(jittered=False))[..., :2]
    np.testing.assert_allclose(single, np.stack([x, y], 2), atol=1e-5)


def test_parts_of_combined_add_up_to_it(scene):
    """The same random numbers find the same light, whatever part of it is asked for."""
    parts = [{"EMIT"}, *({lobe, half} for lobe in LOBES for half in ("DIRECT", "INDIRECT"))]
    whole = baked(scene, "COMBINED", samples=8)
    assert whole[..., :3].mean() > 0.05 and (whole[..., 3] == 1.0).all()
    total = sum(baked(scene, "COMBINED", part, samples=8)[..., :3] for part in parts)
    np.testing.assert_allclose(total, whole[..., :3], rtol=1e-4, atol=1e-6)


def test_light_of_a_class_of_lobes_comes_with_its_colour_or_without(scene):
    direct = baked(scene, "DIFFUSE", {"DIRECT"}, samples=8)[..., :3]
    color = baked(scene, "DIFFUSE", {"COLOR"}, samples=8)[..., :3]
    both = baked(scene, "DIFFUSE", {"DIRECT", "COLOR"}, samples=8)[..., :3]
    assert direct.mean() > 0.05
    np.testing.assert_allclose(color, np.broadcast_to(0.6 * np.array((0.6, 0.3, 0.2)), color.shape), rtol=1e-5)
    np.testing.assert_allclose(both, direct * color, rtol=1e-4)


def test_a_bake_is_what_a_camera_sees_along_the_normals(scene):
    camera = Camera(
        "ORTHO", np.hstack([np.eye(3), [[0.0], [0.0], [5.0]]]), SIZE, SIZE, screen=(-1.0, 1.0, -1.0, 1.0)
    )  # the box hides its own foot
    settings = RenderSettings(samples=64, max_bounces=4, pixel_filter="BOX", passes=frozenset({"Position"}))
    seen = Session(scene, settings, camera)
    assert seen.render()
    floor = np.abs(seen.film.pass_array("Position")[..., 2]) < 1e-4
    floor &= np.roll(floor, 1, 1) & np.roll(floor, -1, 1) & np.roll(floor, 1, 0) & np.roll(floor, -1, 0)
    ours = [baked(scene, "COMBINED", samples=64, seed=seed)[floor][:, :3] for seed in (1, 2)]
    off = np.mean(ours, 0) - seen.combined()[floor][:, :3]
    error = math.sqrt(1.5) * np.std(ours[0] - ours[1], 0) / math.sqrt(2.0 * floor.sum())
    assert floor.sum() > 100 and (np.abs(off.mean(0)) < 4.0 * error).all()


def test_nothing_is_seen_through_a_surface():
    b = rooms.Builder()
    b.add(sheet(), rooms.screen((0.5, 0.5, 0.5), 0.25), matrix())
    b.add(QUAD, emission_program((5.0, 5.0, 5.0)), rooms.scaled(matrix((0.0, 0.0, -0.5)), 3.0, 3.0, 1.0))
    found = baked(b.finish(Camera()), "COMBINED", samples=64)
    np.testing.assert_allclose(found[..., :3].max(), 0.0, atol=1e-6)
    np.testing.assert_allclose(found[..., 3].mean(), 0.25 + 0.75 * np.mean([0.0, 0.1, 0.2]), rtol=0.02)


def test_pixels_of_one_seed_have_the_same_noise(scene):
    alike = texels(seeds=np.full((SIZE, SIZE), 3), jittered=False)
    point = texels(jittered=False)
    middle = np.broadcast_to(point.places[4, 4], point.places.shape)
    same = Texels(0, np.full((SIZE, SIZE), point.primitives[4, 4]), middle, np.full((SIZE, SIZE), 3), False)
    other = Texels(0, same.primitives, middle, None, False)
    assert np.ptp(baked(scene, "COMBINED", samples=2, texels=same)[..., 0]) == 0.0
    assert np.ptp(baked(scene, "COMBINED", samples=2, texels=other)[..., 0]) > 0.01
    assert np.ptp(baked(scene, "COMBINED", samples=2, texels=alike)[..., 0]) > 0.01


def test_ambient_occlusion_below_a_roof_is_its_form_factor():
    """Of a square of side 2 at height h, from below its middle: four times that of a quarter from its corner."""
    height = 0.8
    a = 1.0 / height
    quarter = a / math.sqrt(1 + a * a) * math.atan(a / math.sqrt(1 + a * a)) / math.pi
    b = rooms.Builder()
    b.add(sheet(), rooms.diffuse((0.2, 0.2, 0.2)), rooms.scaled(matrix(), 0.01, 0.01, 1.0))
    b.add(QUAD, rooms.diffuse((0.2, 0.2, 0.2)), matrix((0.0, 0.0, height)))
    committed = b.finish(Camera())
    open_sky = 1.0 - 4.0 * quarter
    found = baked(committed, "AO", samples=256)[..., 0]
    error = math.sqrt(open_sky * (1.0 - open_sky) / found.size / 256)
    assert abs(found.mean() - open_sky) < 4.0 * error
    assert (baked(committed, "AO", samples=16, occlusion_distance=0.5 * height)[..., 0] == 1.0).all()


@pytest.mark.parametrize("kind", BAKES)
def test_every_kind_is_a_picture(scene, kind):
    found = baked(scene, kind, samples=2)
    assert found.shape == (SIZE, SIZE, 4) and found.dtype == np.float32 and np.isfinite(found).all()
