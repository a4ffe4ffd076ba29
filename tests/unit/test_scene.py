"""A committed scene does not change, whoever renders it; acceleration structures are kept from scene to scene."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from restir_engine.context import FrameContext
from restir_engine.reuse_settings import ReuseSettings
from restir_engine.scene import trees as kept_trees
from restir_engine.scene.light_tiles import LightTiles
from restir_engine.scene.mesh import Mesh
from restir_engine.scene.recent import Recent
from restir_engine.scene.trees import Trees
from restir_engine.session import Session
from restir_engine.settings import RenderSettings
from testing.scenes.lights import matrix
from testing.scenes.rooms import LIGHTS, diffuse, look, picture_scene, room, scaled

SIZE = 48
REUSE = {"integrator": "RESTIR", "reuse": ReuseSettings(temporal=True, rounds=1)}


def arrays_of(scene):
    """Every array that a committed scene holds, by the path to it."""
    seen, todo, found = set(), [("scene", scene)], {}
    while todo:
        path, item = todo.pop()
        if id(item) in seen:
            continue
        seen.add(id(item))
        if isinstance(item, np.ndarray):
            found[path] = item
        elif isinstance(item, (list, tuple)):
            todo += [(f"{path}[{i}]", x) for i, x in enumerate(item)]
        elif type(item).__module__.startswith("restir_engine.scene"):
            todo += [(f"{path}.{name}", x) for name, x in vars(item).items()]
    return found


def test_no_array_of_a_committed_scene_can_be_written():
    scene = picture_scene("all", SIZE)
    arrays = arrays_of(scene)
    assert len(arrays) > 40
    writable = [path for path, array in arrays.items() if array.flags.writeable and array.size]
    assert writable == []
    with pytest.raises(ValueError, match="read-only"):
        scene.record["camera"] = 0
    with pytest.raises(ValueError, match="read-only"):
        scene.instances["to_world"] += 1.0


def test_parts_of_a_committed_scene_cannot_be_replaced():
    scene = picture_scene("point", SIZE)
    with pytest.raises(AttributeError, match="does not change"):
        scene.camera = look((0.0, -1.0, 1.0), (0.0, 0.0, 0.0))
    with pytest.raises(AttributeError, match="does not change"):
        scene.another = 1


def test_what_is_added_to_a_description_is_not_seen_in_what_was_committed():
    b = room()
    before = b.finish(look((0.4, -3.2, 1.9), (0.0, 0.0, 0.45), SIZE))
    memory = {path: array.tobytes() for path, array in arrays_of(before).items()}
    b.add(([[-1, -1, 0], [1, -1, 0], [1, 1, 0]], [[0, 1, 2]]), diffuse((0.1, 0.2, 0.3)), matrix())
    b.scene.world.max_bounces = 1
    after = b.finish(look((0.4, -3.2, 1.9), (0.0, 0.0, 0.45), SIZE))
    assert len(after.instances) == len(before.instances) + 1
    assert {path: array.tobytes() for path, array in arrays_of(before).items()} == memory


@pytest.mark.parametrize("settings", [{"integrator": "PATH"}, REUSE], ids=["PATH", "RESTIR"])
def test_two_cameras_see_one_scene_at_the_same_time(settings):
    """Sessions with cameras, sizes and light tiles of their own; the pictures are those of one after the other."""
    scene = picture_scene("all", SIZE)
    memory = {path: array.tobytes() for path, array in arrays_of(scene).items()}
    views = [look((0.4, -3.2, 1.9), (0.0, 0.0, 0.45), SIZE), look((-2.0, -1.0, 1.2), (0.0, 0.0, 0.3), 56)]

    def picture(view):
        session = Session(scene, RenderSettings(samples=8, threads=1, max_bounces=2, **settings), view)
        assert session.render()
        return session.combined()

    alone = [picture(view) for view in views]
    with ThreadPoolExecutor(2) as pool:
        together = list(pool.map(picture, views * 2))
    for view, image in zip(alone * 2, together, strict=True):
        np.testing.assert_array_equal(image, view)
    assert {path: array.tobytes() for path, array in arrays_of(scene).items()} == memory


def test_a_context_has_a_camera_and_tiles_of_its_own():
    scene = picture_scene("many", SIZE)
    view = look((0.0, -1.0, 1.0), (0.0, 0.0, 0.0), 32)
    plain, tiled = FrameContext(scene), FrameContext(scene, view, LightTiles(scene, 4, 64))
    assert plain.camera is scene.camera and plain.record["light_table"] != tiled.record["light_table"]
    assert tiled.camera_record["width"] == 32 and plain.camera_record["width"] == SIZE
    assert scene.lights.record["tiles"] == 0
    with pytest.raises(ValueError, match="read-only"):
        tiled.record["camera"] = 0


# Structures that are kept ---------------------------------------------------------------------------------------------


def sheet(n: int, phase: float = 0.0):
    """A wavy sheet of 2 n² triangles in the unit square."""
    line = np.linspace(-1.0, 1.0, n + 1)
    x, y = (a.ravel() for a in np.meshgrid(line, line))
    corner = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).ravel()
    triangles = np.concatenate([
        np.stack([corner, corner + 1, corner + n + 2], 1), np.stack([corner, corner + n + 2, corner + n + 1], 1)
    ])  # fmt: skip
    return np.column_stack([x, y, 0.2 * np.sin(5.0 * x + phase) * np.cos(4.0 * y)]), triangles


def render(scene, **settings) -> np.ndarray:
    session = Session(scene, RenderSettings(samples=8, threads=1, max_bounces=2, **settings))
    assert session.render()
    return session.combined()


@pytest.fixture
def frame(monkeypatch):
    """frame(mesh, place, trees): a room with a large mesh in it, committed."""
    monkeypatch.setattr(kept_trees, "LARGE", 1000)

    def make(mesh, place, trees):
        b = room()
        LIGHTS["point"](b)
        b.add(mesh, diffuse((0.5, 0.6, 0.7)), place)
        return b.describe(look((0.4, -3.2, 1.9), (0.0, 0.0, 0.45), SIZE)).commit(trees)

    return make


PLACE = scaled(matrix((0.1, -0.5, 0.5), (0.2, -0.3, 1.0)), 0.6, 0.5, 0.9)


def test_what_stands_still_is_built_once_and_looks_the_same_to_the_last_bit(frame):
    mesh, trees = Mesh(*sheet(40)), Trees()
    expected = render(frame(mesh, PLACE, Trees()))
    standing = []
    for _ in range(4):
        trees.next_frame()
        np.testing.assert_array_equal(render(frame(mesh, PLACE, trees)), expected)
        standing.append(trees._standing.get(kept_trees._identity(mesh)))
    assert standing[0] is None and standing[1] is not None
    assert all(kept.tree is standing[1].tree for kept in standing[1:])


def test_what_moves_is_built_once_and_looks_the_same(frame):
    """Hits of an instance differ in the last bits, so that a few paths go elsewhere."""
    mesh, trees = Mesh(*sheet(40)), Trees(instanced=True)
    own = []
    for step in range(4):
        place = PLACE + 0.05 * step * np.eye(3, 4, 3)
        trees.next_frame()
        image = render(frame(mesh, place, trees))
        expected = render(frame(mesh, place, Trees()))
        assert np.quantile(np.abs(image - expected), 0.95) < 1e-3
        assert image.mean() == pytest.approx(expected.mean(), rel=0.01)
        own.append(trees._own.get(kept_trees._identity(mesh)))
    assert own[0] is not None
    assert all(kept.tree is own[0].tree for kept in own)


def test_final_frames_of_what_moves_are_the_same_to_the_last_bit(frame):
    """Whatever has been kept, so that a frame of an animation is the one that is rendered alone."""
    mesh, trees = Mesh(*sheet(40)), Trees()
    for step in (0, 0, 1, 1, 1, 2):
        place = PLACE + 0.05 * step * np.eye(3, 4, 3)
        trees.next_frame()
        np.testing.assert_array_equal(render(frame(mesh, place, trees)), render(frame(mesh, place, Trees())))


def test_nothing_is_kept_for_renders_that_take_longer_than_building(frame):
    mesh, trees = Mesh(*sheet(40)), Trees()
    for _ in range(3):
        trees.next_frame()
        frame(mesh, PLACE, trees)
        trees.rendered(60.0)
    assert trees._standing.get(kept_trees._identity(mesh)) is None


def test_another_shape_is_not_taken_for_the_one_before(frame):
    """A mesh that deforms is new in every frame, also where the old one's memory is used again."""
    trees = Trees()
    for step in range(4):
        trees.next_frame()
        image = render(frame(Mesh(*sheet(40, 0.3 * step)), PLACE, trees))
        np.testing.assert_array_equal(image, render(frame(Mesh(*sheet(40, 0.3 * step)), PLACE, Trees())))
    assert len(trees._seen) == 2 and not len(trees._standing)


def test_recent_keeps_what_this_frame_or_the_last_has_asked_for():
    recent = Recent()
    recent.put("a", 1)
    recent.put("b", 2)
    recent.next_frame()
    assert recent.get("a") == 1 and len(recent) == 2
    recent.next_frame()
    assert recent.get("b") is None and recent.get("a") == 1 and len(recent) == 1
    recent.put("a", 3)
    assert recent.get("a") == 3
