"""Objects, lamps and pixels found again in the frame before."""

import numpy as np
import pytest

from restir_engine.integrators.resampling.motion import (
    Motion,
    match,
    pixel_before,
    place_before,
)
from restir_engine.integrators.techniques.direct.shift import source_before, source_now
from restir_engine.kernels.core import records as rec
from restir_engine.kernels.core.jit import kernel
from restir_engine.kernels.core.memory import address, store_f64, store_i64
from restir_engine.kernels.core.vec import store3_f64, vec
from restir_engine.kernels.geometry.surface import surface_point
from restir_engine.scene.camera import Camera
from restir_engine.scene.description import SceneDescription
from restir_engine.scene.instances import build_instances
from restir_engine.scene.lamps import point_lamp, sun_lamp
from restir_engine.scene.mesh import Mesh
from restir_engine.scene.scene import Scene
from testing.scenes.lights import emission_program, matrix

TRIANGLE = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], np.float32)


@kernel
def place_kernel(scene, before, motion, scratch, camera, camera_before, instance, u, v, out):
    """Where the point (u, v) of an instance's first triangle was: [instance, p before, n before, p now], and pixel."""
    sp = rec.shading_point_at(scratch, 0)
    surface_point(scene, sp, instance, 0, u, v, 1.0, (0.0, 0.0, -1.0))
    there, p, n = place_before(scene, before, motion, sp)
    store_f64(out, 0, float(there))
    store3_f64(out, 1, p)
    store3_f64(out, 4, n)
    store3_f64(out, 7, vec(sp.p))
    x, y = pixel_before(camera, camera_before, vec(sp.p), p, 20, 10)
    store_f64(out, 10, float(x))
    store_f64(out, 11, float(y))


@kernel
def source_kernel(motion, source, primitive, out):
    store_i64(out, 0, source_before(motion, source, primitive))
    store_i64(out, 1, source_now(motion, source, primitive))


def a_scene(matrices, keys, meshes=None, lamps=(), camera=None) -> Scene:
    scene = SceneDescription()
    scene.shaders.add(emission_program((1.0, 1.0, 1.0)))
    scene.meshes = meshes or [Mesh(TRIANGLE, np.array([[0, 1, 2]], np.uint32))]
    scene.material_slots = np.zeros(1, np.int32)
    scene.instances = build_instances(
        np.stack([np.asarray(m).reshape(12) for m in matrices]),
        np.arange(len(matrices)) % len(scene.meshes),
        n_materials=1,
        seen_by=rec.RAY_ALL,
        key=np.array(keys),
    )
    for lamp in lamps:
        scene.lights.add(lamp)
    scene.camera = camera or Camera(width=40, height=20, screen=(-1.0, 1.0, -0.5, 0.5))
    return scene.commit()


def place(now: Scene, before: Scene, instance: int, u: float = 0.25, v: float = 0.5) -> np.ndarray:
    motion = Motion(now, before)
    scratch = np.zeros(rec.SHADING_POINT.itemsize, np.uint8)
    cameras = [np.array([scene.camera.record()]).view(rec.CAMERA).reshape(1) for scene in (now, before)]
    out = np.zeros(12)
    place_kernel(
        now.record, before.record, motion.record, address(scratch), cameras[0][0], cameras[1][0], instance, u, v,
        address(out),
    )  # fmt: skip
    return out


def sources(motion: Motion, source: int, primitive: int) -> list[int]:
    out = np.zeros(2, np.int64)
    source_kernel(motion.record, source, primitive, address(out))
    return out.tolist()


def test_keys_are_matched_one_to_one():
    there = match(np.array([7, 5, 7, 9, 7]), np.array([5, 7, 7, 8]))
    assert there.tolist() == [1, 0, 2, -1, -1]
    assert match(np.zeros(0, np.int64), np.array([1])).tolist() == []


def test_an_object_that_moved_is_found_where_it_was():
    turned = matrix((3.0, 0.0, 0.0), (0.0, 0.6, 0.8))
    before = a_scene([matrix(), turned], [11, 12])
    now = a_scene([matrix((0.0, 5.0, 0.0)), matrix()], [12, 11])  # in another order
    out = place(now, before, 0)
    assert out[0] == 1
    np.testing.assert_allclose(out[1:4], turned[:, :3] @ [0.25, 0.5, 0.0] + turned[:, 3], atol=1e-7)
    np.testing.assert_allclose(out[4:7], [0.0, 0.6, 0.8], atol=1e-7)
    np.testing.assert_allclose(out[7:10], [0.25, 5.5, 0.0], atol=1e-7)


def test_a_deformed_mesh_is_followed_and_another_topology_is_not():
    before = a_scene([matrix()], [1], [Mesh(TRIANGLE * [1.0, 3.0, 1.0] + [0, 0, 2.0], [[0, 1, 2]])])
    now = a_scene([matrix()], [1])
    out = place(now, before, 0)
    np.testing.assert_allclose(out[:4], [0, 0.25, 1.5, 2.0], atol=1e-7)
    other = a_scene([matrix()], [1], [Mesh(TRIANGLE, [[1, 2, 0]])])
    assert place(now, other, 0)[0] == -1


def test_a_moving_camera_and_object_shift_pixels():
    far = matrix((0.0, 0.0, -4.0))
    now = a_scene([far], [1])
    assert place(now, now, 0)[10:].tolist() == [20, 10]
    to_world = np.eye(4)
    to_world[0, 3] = 2.0  # two units to the right: the picture moves left by 2 / 4 of 20 pixels
    aside = Camera(width=40, height=20, screen=(-1.0, 1.0, -0.5, 0.5), to_world=to_world)
    assert place(now, a_scene([far], [1], camera=aside), 0)[10:].tolist() == [10, 10]
    risen = a_scene([matrix((0.0, 0.4, -4.0))], [1])
    assert place(now, risen, 0)[10:].tolist() == [20, 12]
    behind = a_scene([matrix((0.0, 0.0, 4.0))], [1])
    assert place(now, behind, 0)[10:].tolist() == [-1, -1]


def test_lights_keep_their_points_by_key():
    def lamp(x, key, size=0.1):
        return point_lamp(matrix((x, 0.0, 0.0)), (1.0, 1.0, 1.0), size, key=key)

    sun = sun_lamp(matrix(), (1.0, 1.0, 1.0), 0.1, key=30)
    before = a_scene([matrix(), matrix()], [5, 6], lamps=[sun, lamp(0.0, 31), lamp(1.0, 32), lamp(2.0, 33)])
    now = a_scene([matrix(), matrix()], [6, 7], lamps=[lamp(2.0, 33), lamp(0.0, 31, 0.0), sun])
    motion = Motion(now, before)
    for index in range(len(now.lights.lamps)):
        key = now.lights.lamps["key"][index]
        there, _ = sources(motion, index, rec.POINT_ON_LAMP)
        if key == 31:  # it has lost its size
            assert there == -1
            continue
        assert before.lights.lamps["key"][there] == key
        assert sources(motion, there, rec.POINT_ON_LAMP)[1] == index
    assert [sources(motion, i, 0)[0] for i in range(2)] == [1, -1]
    assert [sources(motion, i, 0)[1] for i in range(2)] == [-1, 0]
    assert sources(motion, 0, rec.POINT_ON_WORLD) == [0, 0]


def test_nothing_changes_within_a_frame():
    scene = a_scene([matrix(), matrix()], [5, 5])
    assert sources(Motion(scene, scene), 1, 0) == [1, 1]
    assert sources(Motion(scene, scene), 17, rec.POINT_ON_LAMP) == [17, 17]


@pytest.mark.parametrize("keys", [([1, 2], [2, 1]), ([4, 4], [4, 4])])
def test_maps_invert_each_other(keys):
    motion = Motion(a_scene([matrix()] * 2, keys[0]), a_scene([matrix()] * 2, keys[1]))
    for i in range(2):
        there = sources(motion, i, 0)[0]
        assert sources(motion, there, 0)[1] == i
