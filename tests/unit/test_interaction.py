"""Shading points, attributes and ray origins on meshes small enough to work out by hand."""

import numpy as np
import pytest

from restir_engine.embree.scenes import MeshScene, Placed, WorldScene
from restir_engine.kernels.core import records as rec
from restir_engine.kernels.core.jit import kernel
from restir_engine.kernels.core.memory import address, load_f64, store_f64, store_u8
from restir_engine.kernels.core.vec import load3_f64, store3_f64
from restir_engine.kernels.geometry.attributes import attribute, generated
from restir_engine.kernels.geometry.intersect import occluded
from restir_engine.kernels.geometry.surface import offset_origin, shadow_origin, surface_point
from restir_engine.scene.instances import build_instances, inverse, usable
from restir_engine.scene.mesh import Mesh, clean, moved
from restir_engine.scene.shape import Attribute, attribute_table

TRIANGLE = np.array([[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
IDENTITY = np.eye(4)[:3].reshape(1, 12)


@kernel
def make_point(scene, sp, instance, primitive, u, v, t, d):
    surface_point(scene, sp, instance, primitive, u, v, t, load3_f64(d, 0))


@kernel
def read_attribute(scene, sp, name, du, dv, out):
    found, x, y, z, w = attribute(scene, sp, name, du, dv)
    store_f64(out, 0, 1.0 if found else 0.0)
    store3_f64(out, 1, (x, y, z))
    store_f64(out, 4, w)
    store3_f64(out, 5, generated(scene, sp, du, dv))


@kernel
def shadow_rays(scene, scratch, sp, d, picks, directions, hits, count):
    for i in range(count):
        surface_point(scene, sp, 0, 0, load_f64(picks, 2 * i), load_f64(picks, 2 * i + 1), 1.0, load3_f64(d, 0))
        wi = load3_f64(directions, 3 * i)
        o = offset_origin(sp, wi)
        store_u8(hits, i, 1 if occluded(scene, scratch, o, wi, 1e30, -1) else 0)


class Small:
    """A SCENE record of a few meshes and instances without anything else."""

    def __init__(self, meshes, instances, slots=(0,)):
        tables = [attribute_table(mesh.attributes) for mesh in meshes]
        self.keep = [meshes, instances, tables]
        records = [mesh.record(table) for mesh, table in zip(meshes, tables, strict=True)]
        self.meshes = np.array(records, rec.MESH)
        self.instances = instances
        self.slots = np.array(slots, np.int32)
        self.scene = np.zeros(1, rec.SCENE)
        self.scene[0]["meshes"] = address(self.meshes)
        self.scene[0]["instances"] = address(instances)
        self.scene[0]["material_slots"] = address(self.slots)
        self.sp = np.zeros(1, rec.SHADING_POINT)

    def point(self, u, v, d, instance=0, primitive=0):
        direction = np.asarray(d, np.float64) / np.linalg.norm(d)
        make_point(self.scene[0], self.sp[0], instance, primitive, float(u), float(v), 1.5, address(direction))
        return self.sp[0]

    def attribute(self, name, du=0.0, dv=0.0):
        out = np.zeros(8)
        read_attribute(self.scene[0], self.sp[0], name, float(du), float(dv), address(out))
        return out[:5], out[5:]


def one(mesh, matrix=IDENTITY, **columns):
    return Small([mesh], build_instances(np.asarray(matrix).reshape(1, 12), np.zeros(1, int), **columns))


def test_flat_triangle_from_both_sides():
    small = one(Mesh(TRIANGLE, [[0, 1, 2]]), n_materials=1)
    sp = small.point(0.25, 0.5, (0, 0, -1))
    np.testing.assert_allclose(sp["p"], [0.5, 0.5, 0.0])
    for name, value in (
        ("n", (0, 0, 1)),
        ("ng", (0, 0, 1)),
        ("wo", (0, 0, 1)),
        ("dpdu", (2, 0, 0)),
        ("dpdv", (0, 1, 0)),
    ):
        np.testing.assert_allclose(sp[name], value)
    assert (sp["backfacing"], sp["light"], sp["t"], sp["u"], sp["v"]) == (0, -1, 1.5, 0.25, 0.5)
    sp = small.point(0.25, 0.5, (0, 0, 1))
    for name, value in (("n", (0, 0, -1)), ("ng", (0, 0, -1)), ("dpdu", (-2, 0, 0)), ("dpdv", (0, -1, 0))):
        np.testing.assert_allclose(sp[name], value, atol=0)
    assert sp["backfacing"] == 1


def test_smooth_normals_by_point_and_corner():
    normals = np.array([[0, 0, 1], [1, 0, 1], [0, 0, 1]]) / np.array([[1], [2**0.5], [1]])
    expected = 0.5 * normals[0] + 0.5 * normals[1]
    expected /= np.linalg.norm(expected)
    for domain, corners in ((rec.DOMAIN_POINT, None), (rec.DOMAIN_CORNER, [[0, 1, 2]])):
        mesh = Mesh(TRIANGLE, [[0, 1, 2]], corners=corners, normals=normals, normals_domain=domain)
        small = one(mesh)
        np.testing.assert_allclose(small.point(0.5, 0.0, (0, 0, -1))["n"], expected, atol=1e-6)
        np.testing.assert_allclose(small.point(0.5, 0.0, (0, 0, 1))["n"], -expected, atol=1e-6)
    flat = Mesh(TRIANGLE, [[0, 1, 2]], normals=normals, smooth=[0])
    np.testing.assert_allclose(one(flat).point(0.5, 0.0, (0, 0, -1))["n"], (0, 0, 1))


def test_degenerate_normals_fall_back_to_the_geometric_one():
    mesh = Mesh(TRIANGLE, [[0, 1, 2]], normals=np.zeros((3, 3)))
    np.testing.assert_allclose(one(mesh).point(0.2, 0.2, (0, 0, -1))["n"], (0, 0, 1))
    line = Mesh([[0, 0, 0], [1, 0, 0], [2, 0, 0]], [[0, 1, 2]])
    sp = one(line).point(0.2, 0.2, (0, 1, 0))
    np.testing.assert_allclose(sp["ng"], (0, -1, 0))
    np.testing.assert_allclose(sp["n"], (0, -1, 0))


@pytest.mark.parametrize("mirror", [1.0, -1.0])
def test_instance_matrix(mirror):
    """A slope of 45 degrees, stretched by 2 along x, mirrored or not: normals follow the surface, not the winding."""
    slope = Mesh([[0, 0, 0], [1, 0, 1], [0, 1, 0]], [[0, 1, 2]], normals=np.tile([-1.0, 0.0, 1.0], (3, 1)) / 2**0.5)
    matrix = np.array([[2, 0, 0, 5], [0, mirror, 0, 6], [0, 0, 1, 7]], float)
    small = one(slope, matrix)
    assert (small.instances["flags"][0] & rec.INSTANCE_MIRRORED != 0) == (mirror < 0)
    sp = small.point(0.5, 0.25, (0, 0, -1))
    np.testing.assert_allclose(sp["p"], [6.0, 6.0 + 0.25 * mirror, 7.5])
    np.testing.assert_allclose(sp["ng"], np.array([-1, 0, 2]) / 5**0.5, atol=1e-12)
    np.testing.assert_allclose(sp["n"], np.array([-1, 0, 2]) / 5**0.5, atol=1e-6)
    np.testing.assert_allclose(sp["dpdu"], [2, 0, 1])
    assert sp["backfacing"] == 0
    np.testing.assert_allclose(small.instances["location"][0], [5, 6, 7])


def test_material_slots_are_clamped():
    vertices = np.tile(TRIANGLE, (4, 1))
    mesh = Mesh(vertices, np.arange(12).reshape(4, 3), material_slots=[0, 1, 7, -3])
    small = Small([mesh], build_instances(IDENTITY, [0], materials=1, n_materials=2), slots=(9, 4, 5))
    assert [small.point(0.1, 0.1, (0, 0, -1), primitive=i)["material"] for i in range(4)] == [4, 5, 5, 4]


def test_attributes_of_every_domain():
    quad = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], float)
    mesh = Mesh(
        quad,
        [[0, 1, 2], [0, 2, 3]],
        corners=[[0, 1, 2], [0, 2, 3]],
        polygons=[1, 1],
        attributes=[
            Attribute(0, rec.DOMAIN_CORNER, np.array([[0, 0], [1, 0], [1, 1], [0, 1]])),
            Attribute(5, rec.DOMAIN_POINT, np.array([1.0, 2.0, 3.0, 4.0])),
            Attribute(6, rec.DOMAIN_FACE, np.array([[9, 9, 9, 9], [1, 2, 3, 4]])),
            Attribute(7, rec.DOMAIN_MESH, np.array([[0.25, 0.5, 0.75]])),
        ],
        generated_offset=(-1, -1, -1),
        generated_scale=(0.5, 0.5, 0.5),
    )
    table = np.zeros(1, rec.ATTRIBUTE)
    values = np.array([3.0], np.float32)
    table[0] = (8, rec.DOMAIN_MESH, 1, address(values))
    small = one(mesh, attributes=address(table), n_attributes=1)
    small.point(0.5, 0.25, (0, 0, -1), primitive=1)
    np.testing.assert_allclose(small.attribute(0)[0], [1, 0.5, 0.75, 0, 1])
    np.testing.assert_allclose(small.attribute(0, 0.25, -0.125)[0], [1, 0.75, 0.875, 0, 1])
    np.testing.assert_allclose(small.attribute(5)[0], [1, 2.75, 2.75, 2.75, 1])
    np.testing.assert_allclose(small.attribute(6)[0], [1, 1, 2, 3, 4])
    np.testing.assert_allclose(small.attribute(7)[0], [1, 0.25, 0.5, 0.75, 1])
    np.testing.assert_allclose(small.attribute(8)[0], [1, 3, 3, 3, 1])
    np.testing.assert_allclose(small.attribute(99)[0], 0)
    np.testing.assert_allclose(small.attribute(99, 0.25, 0.0)[1], [0.875, 1.0, 0.5])
    mesh.attributes.append(Attribute(rec.ATTRIBUTE_GENERATED, rec.DOMAIN_POINT, quad * 7))
    small = one(mesh)
    small.point(0.5, 0.25, (0, 0, -1), primitive=1)
    np.testing.assert_allclose(small.attribute(0)[1], [3.5, 5.25, 0])
    small.sp[0]["instance"] = -1
    np.testing.assert_allclose(small.attribute(0)[0], 0)


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
@pytest.mark.parametrize("distance", [0.0, 100.0])
@pytest.mark.parametrize("far", [0.0, 1000.0])
@pytest.mark.parametrize("instanced", [True, False])
def test_rays_leave_their_triangle(scale, distance, far, instanced):
    """No ray from a tilted, scaled and moved triangle hits it, nor when its mesh is modelled far from its origin."""
    random = np.random.default_rng(3)
    rotation, _ = np.linalg.qr(random.normal(size=(3, 3)))
    matrix = np.empty((3, 4))
    matrix[:, :3] = rotation * scale
    matrix[:, 3] = random.normal(size=3) * distance * scale
    vertices = random.normal(size=(3, 3)) + far
    matrix[:, 3] -= matrix[:, :3] @ np.full(3, far)
    mesh = Mesh(vertices, [[0, 1, 2]])
    small = one(mesh, matrix)
    transform = small.instances["to_world"][0].astype(np.float32)
    if instanced:
        placed = Placed(rec.RAY_ALL, transform, scene=MeshScene(mesh.vertices, mesh.triangles))
    else:
        vertices = moved(mesh.vertices, transform.reshape(3, 4))
        placed = Placed(rec.RAY_ALL, transform, vertices=vertices, triangles=mesh.triangles)
    top = WorldScene([placed])
    small.scene[0]["embree"] = top.handle
    n = 4000
    picks = random.random((n, 2))
    picks = np.where(picks.sum(axis=1, keepdims=True) > 1.0, 1.0 - picks, picks)
    directions = random.normal(size=(n, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    hits = np.zeros(n, np.uint8)
    scratch = np.zeros(rec.SCRATCH_BYTES + 64, np.uint8)
    start = address(scratch) + -address(scratch) % 64
    d = -np.linalg.inv(matrix[:, :3])[2]
    d /= np.linalg.norm(d)
    shadow_rays(small.scene[0], start, small.sp[0], address(d), address(picks), address(directions), address(hits), n)
    assert hits.sum() == 0


def test_only_invertible_matrices_are_usable():
    matrices = np.tile(IDENTITY, (5, 1))
    matrices[1, 0] = 0.0
    matrices[2, [0, 5, 10]] = 1e-6
    matrices[3, 3] = np.nan
    matrices[4, 4:7] = matrices[4, 0:3]
    np.testing.assert_array_equal(usable(matrices), [True, False, True, False, False])
    random = np.random.default_rng(0).normal(size=(6, 3, 4))
    back = inverse(random.reshape(6, 12)).reshape(6, 3, 4)
    points = np.random.default_rng(1).normal(size=(6, 3))
    there = np.einsum("nij,nj->ni", random[:, :, :3], points) + random[:, :, 3]
    np.testing.assert_allclose(np.einsum("nij,nj->ni", back[:, :, :3], there) + back[:, :, 3], points, atol=1e-9)


def test_bad_geometry_is_dropped():
    vertices = np.zeros((6, 3))
    vertices[:, 0] = np.arange(6)
    vertices[4, 1] = np.nan
    values = np.arange(6.0)
    values[0] = np.inf
    mesh = Mesh(
        vertices,
        [[0, 1, 2], [1, 2, 77], [2, 3, 4], [3, 5, 0]],
        material_slots=[0, 1, 2, 3],
        attributes=[Attribute(0, rec.DOMAIN_POINT, values)],
    )
    assert "2 triangles" in clean(mesh)
    np.testing.assert_array_equal(mesh.triangles, [[0, 1, 2], [3, 5, 0]])
    np.testing.assert_array_equal(mesh.material_slots, [0, 3])
    np.testing.assert_array_equal(mesh.corners, [[0, 1, 2], [9, 10, 11]])
    assert np.isfinite(mesh.vertices).all() and mesh.attributes[0].values[0, 0] == 0.0
    assert clean(Mesh(TRIANGLE, [[0, 1, 2]])) == ""


def test_vertices_are_padded_without_a_second_copy():
    mesh = Mesh(TRIANGLE, [[0, 1, 2]])
    assert mesh.vertices.base.nbytes >= mesh.vertices.nbytes + 16
    assert Mesh(mesh.vertices, mesh.triangles).vertices is mesh.vertices


@kernel
def lifted(scene, sp, d, out):
    store3_f64(out, 0, shadow_origin(scene, sp, load3_f64(d, 0)))


def corner_of_a_sphere(smooth=True):
    """A triangle whose corners lie on the unit sphere, with the sphere's normals."""
    corners = np.array([[0.3, 0.0, 0.0], [0.0, 0.3, 0.0], [-0.2, -0.2, 0.0]])
    corners[:, 2] = np.sqrt(1.0 - (corners**2).sum(1))
    normals = corners if smooth else None
    return one(Mesh(corners, np.array([[0, 1, 2]]), normals=normals, normals_domain=rec.DOMAIN_POINT), terminator=0.1)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_shadow_rays_along_a_smooth_surface_start_above_the_triangle(side):
    scene = corner_of_a_sphere()
    out = np.zeros(3)
    sp = scene.point(0.3, 0.3, (0.0, 0.0, -side))
    tangent = np.cross(sp["n"], (0.3, 1.0, 0.2))
    tangent /= np.linalg.norm(tangent)
    lifted(scene.scene[0], sp, address(tangent), address(out))
    sagitta = 1.0 - np.linalg.norm(sp["p"])
    assert np.dot(out - sp["p"], sp["ng"]) > 0.5 * sagitta
    if side > 0:  # the lowest of the tangent planes lies above the sphere
        assert 1.0 <= np.linalg.norm(out) < 1.0 + 2.0 * sagitta


@pytest.mark.parametrize(("smooth", "direction"), [(True, (0.1, 0.2, 1.0)), (False, (1.0, 0.1, 0.01))])
def test_shadow_rays_start_on_the_triangle_far_from_the_terminator_and_on_flat_faces(smooth, direction):
    scene = corner_of_a_sphere(smooth)
    out = np.zeros(3)
    wi = np.array(direction) / np.linalg.norm(direction)
    sp = scene.point(0.3, 0.3, (0.0, 0.0, -1.0))
    lifted(scene.scene[0], sp, address(wi), address(out))
    assert out == pytest.approx(sp["p"], abs=1e-5)
