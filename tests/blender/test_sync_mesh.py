"""Meshes: arrays against values worked out by hand, and normals, coordinates and attributes against Cycles."""

import math

import bmesh
import bpy
import numpy as np
import pytest

from restir_engine.kernels.core import records as rec
from restir_engine.scene import names
from restir_engine.scene.description import SceneDescription
from restir_engine.sync.mesh import read_mesh
from testing.blender import probe


@pytest.fixture
def monkey():
    """A rotated and stretched monkey that fills the frame."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.mesh.primitive_monkey_add()
    thing = bpy.context.object
    thing.rotation_euler, thing.scale = (0.2, 0.1, 0.5), (1.0, 1.3, 0.8)
    camera_in_front()
    return thing


def camera_in_front():
    scene = bpy.context.scene
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location, camera.rotation_euler = (0.0, -4.0, 0.0), (math.pi / 2, 0.0, 0.0)
    scene.collection.objects.link(camera)
    scene.camera = camera
    scene.render.resolution_x, scene.render.resolution_y = 32, 24
    scene.render.resolution_percentage = 100


def new_mesh(vertices, faces, name="Mesh"):
    data = bpy.data.meshes.new(name)
    data.from_pydata(vertices, [], faces)
    data.update()
    return data


def evaluated(thing):
    return thing.evaluated_get(bpy.context.evaluated_depsgraph_get()).data


def socket(kind, output, **properties):
    """A function for `probe`: a new node's output."""

    def build(nodes):
        node = nodes.new(kind)
        for name, value in properties.items():
            setattr(node, name, value)
        return node.outputs[output]

    return build


def assert_agree(expected, found, tolerance, share=0.97):
    """Same values where both see the object; a few pixels at silhouettes and edges may see something else."""
    near = np.abs(expected - found).max(axis=-1) < tolerance
    assert near.mean() > share, f"{near.mean():.3f} of the pixels agree"


def check(build, name="", column="attribute", tolerance=2e-3, low=-2.0, high=2.0, share=0.97):
    expected, found = probe.both(build, name, low, high)
    hit = found["instance"] >= 0
    assert hit.mean() > 0.2
    if column == "attribute":
        assert found["found"][hit].all()
    assert_agree(expected[hit], found[column][..., :3][hit], tolerance, share)


NORMAL = socket("ShaderNodeNewGeometry", "Normal")
TRUE_NORMAL = socket("ShaderNodeNewGeometry", "True Normal")


@pytest.mark.parametrize("shading", ["flat", "smooth", "sharp_faces", "sharp_edges", "custom", "weighted"])
@pytest.mark.parametrize("mirror", [1.0, -1.0])
def test_normals(monkey, shading, mirror):
    monkey.scale.x *= mirror
    data = monkey.data
    data.shade_smooth()
    if shading == "flat":
        data.shade_flat()
    elif shading == "sharp_faces":
        sharp = np.arange(len(data.polygons)) % 3 == 0
        data.polygons.foreach_set("use_smooth", ~sharp)
    elif shading == "sharp_edges":
        data.edges.foreach_set("use_edge_sharp", np.arange(len(data.edges)) % 2 == 0)
    elif shading == "custom":
        random = np.random.default_rng(1).normal(size=(len(data.loops), 3)) * 0.3
        corner = np.array([normal.vector for normal in data.corner_normals]) + random
        data.normals_split_custom_set(corner / np.linalg.norm(corner, axis=1, keepdims=True))
    elif shading == "weighted":
        monkey.modifiers.new("Weighted", "WEIGHTED_NORMAL")
    check(NORMAL, column="n", tolerance=5e-3)
    check(TRUE_NORMAL, column="ng", tolerance=2e-3)


def test_normals_inside():
    """Seen from inside, both normals are turned to the viewer."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.mesh.primitive_uv_sphere_add(radius=5.0)
    bpy.context.object.data.shade_smooth()
    camera_in_front()
    check(NORMAL, column="n")
    assert (probe.ours(probe.rendered_scene())["backfacing"] == 1).all()


@pytest.mark.parametrize("change", ["none", "subdivided", "shape key", "deformed", "displaced", "array"])
def test_generated(monkey, change):
    if change == "subdivided":
        monkey.modifiers.new("Subdivision", "SUBSURF")
    elif change == "shape key":
        monkey.shape_key_add(name="Basis")
        key = monkey.shape_key_add(name="Long")
        for point in key.data:
            point.co.x *= 1.4
        key.value = 0.7
    elif change == "deformed":
        monkey.modifiers.new("Twist", "SIMPLE_DEFORM").angle = 1.0
    elif change == "displaced":
        monkey.modifiers.new("Displace", "DISPLACE").strength = 0.2
    elif change == "array":
        monkey.modifiers.new("Array", "ARRAY").relative_offset_displace = (0.3, 0.0, 0.0)
    check(socket("ShaderNodeTexCoord", "Generated"), column="generated", share=0.95)


def test_texture_space(monkey):
    monkey.data.use_auto_texspace = False
    monkey.data.texspace_location, monkey.data.texspace_size = (0.3, 0.0, -0.2), (2.0, 0.7, 1.0)
    check(socket("ShaderNodeTexCoord", "Generated"), column="generated", low=-3.0, high=3.0)


def test_generated_of_a_plane():
    """A direction without extent; Blender makes it 1 wide."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.mesh.primitive_plane_add(rotation=(math.pi / 2, 0.0, 0.0))
    camera_in_front()
    check(socket("ShaderNodeTexCoord", "Generated"), column="generated")


def test_uv_maps(monkey):
    data = monkey.data
    first = data.uv_layers[0]
    second = data.uv_layers.new(name="Second")
    values = np.random.default_rng(2).random(2 * len(data.loops)).astype(np.float32)
    second.uv.foreach_set("vector", values)
    check(socket("ShaderNodeUVMap", "UV", uv_map=first.name), first.name)
    check(socket("ShaderNodeUVMap", "UV", uv_map="Second"), "Second", tolerance=5e-3)
    check(socket("ShaderNodeTexCoord", "UV"), names.UV)
    second.active_render = True
    check(socket("ShaderNodeTexCoord", "UV"), names.UV, tolerance=5e-3)


@pytest.mark.parametrize("domain", ["POINT", "CORNER", "FACE"])
@pytest.mark.parametrize(
    "kind",
    ["FLOAT", "INT", "INT8", "BOOLEAN", "FLOAT2", "FLOAT_VECTOR", "FLOAT_COLOR", "BYTE_COLOR"],
)
def test_attribute(monkey, domain, kind):
    attribute = monkey.data.attributes.new("thing", kind, domain)
    count = len(attribute.data)
    random = np.random.default_rng(3)
    field = {"FLOAT2": "vector", "FLOAT_VECTOR": "vector", "FLOAT_COLOR": "color", "BYTE_COLOR": "color"}.get(
        kind, "value"
    )
    size = {"FLOAT2": 2, "FLOAT_VECTOR": 3, "FLOAT_COLOR": 4, "BYTE_COLOR": 4}.get(kind, 1)
    if kind.startswith("INT"):
        values = random.integers(0, 5, count).astype(np.int32)
    elif kind == "BOOLEAN":
        values = random.random(count) < 0.5
    else:
        values = random.random((count, size)).astype(np.float32)
    attribute.data.foreach_set(field, values.ravel())
    build = socket("ShaderNodeAttribute", "Vector", attribute_name="thing")
    check(build, "thing", low=-5.0, high=5.0, tolerance=0.02)


def test_render_color(monkey):
    for name in ("First", "Second"):
        attribute = monkey.data.color_attributes.new(name, "FLOAT_COLOR", "POINT")
        attribute.data.foreach_set("color", np.random.default_rng(len(name)).random(4 * len(attribute.data)))
    monkey.data.color_attributes.render_color_index = 1
    check(socket("ShaderNodeVertexColor", "Color"), names.COLOR, tolerance=0.02)


@pytest.mark.parametrize("name", ["position", "uv", "generated", "pointiness", "random_per_island", "vertex_color"])
def test_attributes_that_cycles_makes(monkey, name):
    colors = monkey.data.color_attributes.new("Paint", "FLOAT_COLOR", "POINT")
    colors.data.foreach_set("color", np.random.default_rng(5).random(4 * len(colors.data)))
    monkey.modifiers.new("Displace", "DISPLACE").strength = 0.1
    check(socket("ShaderNodeAttribute", "Vector", attribute_name=name), name, tolerance=0.01)


@pytest.mark.parametrize("ngons", [False, True])
def test_tangents(monkey, ngons):
    if ngons:
        mesh = bmesh.new()
        mesh.from_mesh(monkey.data)
        bmesh.ops.dissolve_limit(mesh, angle_limit=0.3, verts=mesh.verts, edges=mesh.edges, delimit={"UV"})
        mesh.to_mesh(monkey.data)
        mesh.free()
        assert max(face.loop_total for face in monkey.data.polygons) > 4
    monkey.data.shade_smooth()
    monkey.scale, monkey.rotation_euler = (1.0, 1.0, 1.0), (0.0, 0.0, 0.0)
    assert np.quantile(tangent_angles(), 0.97) < 2e-3


def test_tangents_without_a_uv_map(monkey):
    """Along the parallels of a sphere; where the surface folds over itself, triangles may share theirs otherwise."""
    monkey.data.uv_layers.remove(monkey.data.uv_layers[0])
    monkey.data.shade_smooth()
    monkey.scale, monkey.rotation_euler = (1.0, 1.0, 1.0), (0.0, 0.0, 0.0)
    assert np.quantile(tangent_angles(), 0.75) < 2e-3


def tangent_angles():
    """Angles between Cycles' tangents of the render UV map and ours."""
    build = socket("ShaderNodeTangent", "Tangent", direction_type="UV_MAP")
    expected, found = probe.both(build, names.tangent(), -2.0, 2.0)
    hit = found["instance"] >= 0
    tangent = found["attribute"][hit][:, :3]
    tangent -= (tangent * found["n"][hit]).sum(axis=1, keepdims=True) * found["n"][hit]
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    return np.arccos(np.clip((tangent * expected[hit]).sum(axis=1), -1.0, 1.0))


def test_pointiness(monkey):
    build = socket("ShaderNodeNewGeometry", "Pointiness")
    check(build, names.POINTINESS, tolerance=2e-3)


def test_islands(monkey):
    """The monkey's eyes are islands."""
    build = socket("ShaderNodeNewGeometry", "Random Per Island")
    check(build, names.ISLAND, tolerance=2e-3)


def test_material_slots():
    bpy.ops.wm.read_factory_settings(use_empty=True)
    data = new_mesh(
        [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (2, 0, 0), (2, 1, 0)], [(0, 1, 2, 3), (1, 4, 5), (1, 5, 2)]
    )
    data.polygons.foreach_set("material_index", [2, 0, 1])
    mesh = read_mesh(SceneDescription(), data)
    np.testing.assert_array_equal(mesh.triangles, [[0, 1, 2], [0, 2, 3], [1, 4, 5], [1, 5, 2]])
    np.testing.assert_array_equal(mesh.polygons, [0, 0, 1, 2])
    np.testing.assert_array_equal(mesh.corners, [[0, 1, 2], [0, 2, 3], [4, 5, 6], [7, 8, 9]])
    np.testing.assert_array_equal(mesh.material_slots, [2, 2, 0, 1])
    assert mesh.normals is None


def test_modifiers_and_shape_keys_move_vertices(monkey):
    monkey.shape_key_add(name="Basis")
    key = monkey.shape_key_add(name="Long")
    for point in key.data:
        point.co.z += 1.0
    key.value = 0.5
    before = np.array([vertex.co for vertex in monkey.data.vertices])
    scene = SceneDescription()
    mesh = read_mesh(scene, evaluated(monkey))
    np.testing.assert_allclose(mesh.vertices - before, np.tile([0.0, 0.0, 0.5], (len(before), 1)), atol=1e-6)
    faces = [face.loop_total for face in monkey.data.polygons]
    monkey.modifiers.new("Subdivision", "SUBSURF").levels = 1
    assert len(read_mesh(scene, evaluated(monkey)).triangles) == 2 * sum(faces)


def test_edit_mode(monkey):
    """A mesh in edit mode is rendered with its modifiers, as it was when Blender last wrote the edits to it."""
    monkey.modifiers.new("Array", "ARRAY").relative_offset_displace = (0.5, 0.0, 0.0)
    expected = probe.rendered_scene().meshes[0]
    bpy.ops.object.mode_set(mode="EDIT")
    found = probe.rendered_scene().meshes[0]
    assert len(found.triangles) == len(expected.triangles)
    assert {a.name for a in found.attributes} == {a.name for a in expected.attributes}
    check(socket("ShaderNodeNewGeometry", "Position"), column="p", tolerance=0.02)


def test_byte_colours_are_linear():
    bpy.ops.wm.read_factory_settings(use_empty=True)
    data = new_mesh([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)])
    attribute = data.color_attributes.new("Paint", "BYTE_COLOR", "CORNER")
    for item, value in zip(attribute.data, (0.0, 0.5, 1.0), strict=True):
        item.color_srgb = (value, value, value, value)
    scene = SceneDescription()
    index = scene.attribute_name("Paint")
    found = read_mesh(scene, data).attribute(index)
    assert found.domain == rec.DOMAIN_CORNER
    np.testing.assert_allclose(found.values[:, 0], [0.0, 0.2159, 1.0], atol=1e-3)
    np.testing.assert_allclose(found.values[:, 3], [0.0, 0.502, 1.0], atol=1e-3)


def test_attributes_asked_for_later_are_added():
    bpy.ops.wm.read_factory_settings(use_empty=True)
    data = new_mesh([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)])
    data.attributes.new("late", "FLOAT", "POINT").data.foreach_set("value", [1.0, 2.0, 3.0])
    one, two = (bpy.data.objects.new(name, data) for name in ("One", "Two"))
    for thing in (one, two):
        bpy.context.scene.collection.objects.link(thing)
    data.materials.append(None)
    two.material_slots[0].link = "OBJECT"
    two.material_slots[0].material = probe.emission_material(
        socket("ShaderNodeAttribute", "Vector", attribute_name="late")
    )
    camera_in_front()
    scene = probe.rendered_scene()
    assert len(scene.meshes) == 1 and len(scene.instances) == 2
    found = scene.meshes[0].attribute(scene.attribute_names["late"])
    np.testing.assert_allclose(found.values.ravel(), [1.0, 2.0, 3.0])


def test_bad_vertices_are_dropped_with_a_warning():
    bpy.ops.wm.read_factory_settings(use_empty=True)
    data = new_mesh(
        [(0, 0, 0), (1, 0, 0), (0, 1, 0), (math.nan, 0, 0), (math.inf, 1, 1)], [(0, 1, 2), (0, 1, 3), (1, 2, 4)]
    )
    scene = SceneDescription()
    mesh = read_mesh(scene, data)
    assert len(mesh.triangles) == 1 and np.isfinite(mesh.vertices).all()
    assert "2 triangles" in scene.warnings.lines()[0] and data.name in scene.warnings.lines()[0]


def test_meshes_without_faces_are_nothing():
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = SceneDescription()
    assert read_mesh(scene, new_mesh([(0, 0, 0), (1, 0, 0)], [])) is None
    assert read_mesh(scene, new_mesh([], [])) is None
    assert len(scene.warnings) == 0
