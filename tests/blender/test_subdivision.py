"""Subdivision beside Blender's own (OpenSubdiv): the points of level after level, and adaptive subdivision."""

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")
from mathutils.kdtree import KDTree  # noqa: E402

from restir_engine.kernels.core.records import DOMAIN_CORNER, DOMAIN_POINT  # noqa: E402
from restir_engine.scene.description import SceneDescription  # noqa: E402
from restir_engine.scene.shape import Attribute  # noqa: E402
from restir_engine.scene.subdivision import (  # noqa: E402
    Options,
    Surface,
    cage,
    control_points,
    finer,
    on_limit,
    subdivided,
)
from restir_engine.settings import RenderSettings  # noqa: E402
from restir_engine.sync.depsgraph import read_scene  # noqa: E402
from restir_engine.sync.mesh import read_mesh  # noqa: E402
from testing.blender import kit  # noqa: E402
from testing.blender.scenes.displacement import adaptive  # noqa: E402


def arrays(mesh):
    """(points, corners' vertices, corners' faces) of a bpy mesh."""
    points, vertices = np.empty((len(mesh.vertices), 3), np.float32), np.empty(len(mesh.loops), np.int32)
    counts = np.empty(len(mesh.polygons), np.int32)
    mesh.vertices.foreach_get("co", points.ravel())
    mesh.loops.foreach_get("vertex_index", vertices)
    mesh.polygons.foreach_get("loop_total", counts)
    return points, vertices, np.repeat(np.arange(len(counts)), counts)


def blenders(thing, level: int, **properties):
    """The points of Blender's subdivision."""
    modifier = thing.modifiers.new("Subdivision", "SUBSURF")
    modifier.levels, modifier.quality = level, 6
    kit.assign(modifier, properties)
    evaluated = thing.evaluated_get(bpy.context.evaluated_depsgraph_get())
    found = arrays(evaluated.to_mesh())
    evaluated.to_mesh_clear()
    thing.modifiers.remove(modifier)
    return found


def farthest(points, others) -> float:
    tree = KDTree(len(others))
    for index, point in enumerate(others):
        tree.insert(point, index)
    tree.balance()
    return max(tree.find(point)[2] for point in points)


@pytest.mark.parametrize("shape", ["cube", "monkey", "cylinder"])
def test_limit_is_that_of_opensubdiv(shape):
    kit.reset()
    thing = kit.put(shape, None)
    fine = cage(*arrays(thing.data))
    for _ in range(2):
        fine = finer(fine, Options())
    assert farthest(on_limit(fine), blenders(thing, 2)[0]) < 2e-6


@pytest.mark.parametrize("crease", [0.5, 1.0])
def test_creases_are_those_of_opensubdiv(crease):
    """Cycles takes ten times the crease for the sharpness, Blender ten times its square: here Blender's."""
    kit.reset()
    thing = kit.put("cube", None)
    edges = np.empty((12, 2), np.int32)
    thing.data.edges.foreach_get("vertices", edges.ravel())
    values = np.where(np.arange(12) < 4, crease, 0.0).astype(np.float32)
    thing.data.attributes.new("crease_edge", "FLOAT", "EDGE").data.foreach_set("value", values)
    fine = cage(*arrays(thing.data), creases=(edges, 10.0 * values**2))
    for _ in range(3):
        fine = finer(fine, Options())
    assert farthest(on_limit(fine), blenders(thing, 3)[0]) < 2e-6


def test_a_surface_that_is_subdivided_goes_on_to_the_same_limit():
    kit.reset()
    thing = kit.put("monkey", None)
    points, vertices, faces = blenders(thing, 1)
    fine = cage(points, vertices, faces)
    fine = finer(cage(control_points(fine), vertices, faces), Options())
    assert farthest(on_limit(fine), blenders(thing, 2)[0]) < 2e-4


def test_adaptive_subdivision_goes_by_the_size_in_the_picture():
    scene = kit.reset()
    scene.render.resolution_x = scene.render.resolution_y = 64
    thing = kit.put("cube", kit.diffuse(), smooth=True)
    adaptive(thing)
    faces = []
    for rate in (1.0, 4.0):
        scene.cycles.dicing_rate = scene.cycles.preview_dicing_rate = rate
        thing.update_tag()
        description = read_scene(bpy.context.evaluated_depsgraph_get(), RenderSettings())
        mesh = description.meshes[-1]
        faces.append(len(mesh.triangles))
        assert np.linalg.norm(mesh.vertices, axis=1).max() < 1.0  # a ball within the cube
        assert np.allclose(np.linalg.norm(mesh.normals, axis=1), 1.0, atol=1e-5)
        uv = mesh.attribute(0)
        assert len(uv.values) == mesh.corners.max() + 1 and uv.values.min() >= 0.0 and uv.values.max() <= 1.0
    assert 10 < faces[0] / faces[1] < 20


def test_faces_of_different_levels_leave_no_gaps():
    """A cage of which faces on one side are refined most: each point has its place on the limit surface, each edge two
    triangles, and each corner the coordinates of its point.
    """
    kit.reset()
    thing = kit.put("monkey", None)
    for polygon in thing.data.polygons:
        polygon.use_smooth = True
    data = thing.data
    points, vertices, faces = arrays(data)
    mesh = read_mesh(SceneDescription(), data)
    uv = Attribute(77, DOMAIN_CORNER, points[vertices][:, :2].copy())
    mesh.attributes = [uv, Attribute(78, DOMAIN_POINT, points[:, 1:].copy())]

    def need(cage, level):
        x = np.bincount(cage.corner_faces, cage.points[cage.corner_points, 0]) / np.bincount(cage.corner_faces)
        return np.where(x > 0.2, 3 - level, 0)

    surface = Surface(np.bincount(faces), vertices, None, None, frozenset(), False, False)
    fine = subdivided(mesh, surface, need, Options())
    assert len(np.unique(np.bincount(fine.polygons))) > 4 and fine.polygons.max() == len(data.polygons) - 1
    even = subdivided(mesh, surface, lambda cage, level: np.full(cage.faces, 3 - level), Options())
    assert len(even.triangles) == 2 * 4**2 * len(vertices) > 2 * len(fine.triangles)
    assert farthest(fine.vertices, even.vertices) < 2e-6
    edges = np.sort(fine.triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    ends, users = np.unique(edges, axis=0, return_counts=True)
    rim = np.unique(ends[users == 1])
    assert users.max() == 2 and len(rim) == (users == 1).sum()  # closed lines: those of the monkey's eyes
    of_points, of_corners = fine.attributes
    assert np.allclose(of_points.values, fine.vertices[:, 1:], atol=1e-6)
    assert np.abs(of_corners.values[fine.corners] - fine.vertices[fine.triangles][:, :, :2]).max() < 0.12  # the cage's
    cross = np.cross(*(fine.vertices[fine.triangles[:, k]] - fine.vertices[fine.triangles[:, 0]] for k in (1, 2)))
    smooth = fine.normals[fine.triangles[:, 0]]
    assert fine.normals.dtype == np.float32 and ((cross * smooth).sum(1) > 0.0).mean() > 0.99
