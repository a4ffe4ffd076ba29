"""Instances of every kind: shared meshes, matrices, visibility and Object Info, against Cycles where it matters."""

import math

import bpy
import numpy as np
import pytest
from mathutils import Matrix

from restir_engine.kernels.core import records as rec
from restir_engine.scene import names
from restir_engine.scene.errors import SceneError
from testing.blender import probe
from testing.blender import render as side_by_side


@pytest.fixture
def stage():
    """A cube mesh with no object yet, and a camera that sees about 8 × 6 units around the origin from -y."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location, camera.rotation_euler = (0.0, -11.0, 0.0), (math.pi / 2, 0.0, 0.0)
    scene.collection.objects.link(camera)
    scene.camera = camera
    scene.render.resolution_x, scene.render.resolution_y = 32, 24
    scene.render.resolution_percentage = 100
    bpy.ops.mesh.primitive_cube_add(size=1.0)
    cube = bpy.context.object.data
    bpy.data.objects.remove(bpy.context.object)
    return cube


def place(data, location=(0.0, 0.0, 0.0), name="Thing", collection=None):
    thing = bpy.data.objects.new(name, data)
    thing.location = location
    (collection or bpy.context.scene.collection).objects.link(thing)
    return thing


def instancing_nodes(group_name="Instances"):
    """Geometry nodes that put an ico sphere with its own material on every point and keep the points' mesh."""
    group = bpy.data.node_groups.new(group_name, "GeometryNodeTree")
    for direction in ("INPUT", "OUTPUT"):
        group.interface.new_socket("Geometry", in_out=direction, socket_type="NodeSocketGeometry")
    node = {
        name: group.nodes.new(kind)
        for name, kind in (
            ("in", "NodeGroupInput"),
            ("out", "NodeGroupOutput"),
            ("ball", "GeometryNodeMeshIcoSphere"),
            ("material", "GeometryNodeSetMaterial"),
            ("instance", "GeometryNodeInstanceOnPoints"),
            ("join", "GeometryNodeJoinGeometry"),
        )
    }
    node["ball"].inputs["Radius"].default_value = 0.3
    node["material"].inputs["Material"].default_value = bpy.data.materials.new("Ball")
    for source, target, socket in (
        ("ball", "material", "Geometry"),
        ("in", "instance", "Points"),
        ("material", "instance", "Instance"),
        ("in", "join", "Geometry"),
        ("instance", "join", "Geometry"),
        ("join", "out", "Geometry"),
    ):
        group.links.new(node[source].outputs[0], node[target].inputs[socket])
    return group


def locations(scene):
    return sorted(tuple(np.round(row, 3)) for row in scene.instances["location"])


def assert_same_picture(socket="Position"):
    """Cycles and we see the same points of the same things."""

    def build(nodes):
        return nodes.new("ShaderNodeNewGeometry").outputs[socket]

    expected, found = probe.both(build, "", -20.0, 20.0)
    hit = found["instance"] >= 0
    seen = np.abs(expected - -20.0).max(axis=-1) > 1e-3  # background is black: -20
    assert (hit == seen).mean() > 0.97
    near = np.abs(found["p"] - expected).max(axis=-1)[hit & seen] < 0.02
    assert near.mean() > 0.97


def test_users_of_a_mesh_share_it(stage):
    place(stage, (-2.0, 0.0, 0.0))
    place(stage, (2.0, 0.0, 0.0)).scale = (1.0, -2.0, 0.5)
    place(stage).modifiers.new("Subdivision", "SUBSURF")
    scene = probe.rendered_scene()
    assert len(scene.meshes) == 2 and len(scene.instances) == 3
    flags = {tuple(row["location"]): row["flags"] for row in scene.instances}
    assert flags[(2.0, 0.0, 0.0)] & rec.INSTANCE_MIRRORED and not flags[(-2.0, 0.0, 0.0)] & rec.INSTANCE_MIRRORED
    assert_same_picture()


def test_collection_instances(stage):
    group = bpy.data.collections.new("Group")
    place(stage, (0.5, 0.0, 0.0), "Member", group)
    place(stage, (0.0, 0.0, 9.0), "Hidden", group).hide_render = True
    inner = bpy.data.objects.new("Inner", None)
    inner.instance_type, inner.location = "COLLECTION", (0.0, 0.0, 1.5)
    inner.instance_collection = bpy.data.collections.new("Nested")
    place(stage, (0.0, 0.0, 0.0), "Nested member", inner.instance_collection)
    group.objects.link(inner)
    for x in (-2.0, 1.0):
        empty = bpy.data.objects.new("Instancer", None)
        empty.instance_type, empty.instance_collection, empty.location = "COLLECTION", group, (x, 0.0, 0.0)
        empty.rotation_euler = (0.0, 0.0, x)
        bpy.context.scene.collection.objects.link(empty)
    scene = probe.rendered_scene()
    assert len(scene.meshes) == 1 and len(scene.instances) == 4
    assert len(set(scene.instances["random"])) == 4
    assert_same_picture()


@pytest.mark.parametrize("kind", ["VERTS", "FACES"])
@pytest.mark.parametrize("shown", [True, False])
def test_instancing_objects(stage, kind, shown):
    bpy.ops.mesh.primitive_plane_add(size=4.0, rotation=(math.pi / 2, 0.0, 0.0))
    parent = bpy.context.object
    parent.instance_type, parent.show_instancer_for_render = kind, shown
    place(stage).parent = parent
    scene = probe.rendered_scene()
    assert len(scene.instances) == (4 if kind == "VERTS" else 1) + shown
    assert_same_picture()


def test_geometry_nodes_instances(stage):
    bpy.ops.mesh.primitive_plane_add(size=4.0, rotation=(math.pi / 2, 0.0, 0.0))
    thing = bpy.context.object
    thing.modifiers.new("Nodes", "NODES").node_group = instancing_nodes()
    scene = probe.rendered_scene()
    assert len(scene.meshes) == 2 and len(scene.instances) == 5
    balls = scene.instances[scene.instances["mesh"] == np.bincount(scene.instances["mesh"]).argmax()]
    corners = {(x, z) for x in (-2, 2) for z in (-2, 2)}
    assert {(round(row[0]), round(row[2])) for row in balls["location"]} == corners
    assert_same_picture()


@pytest.mark.parametrize("kind", ["CURVE", "FONT", "SURFACE", "META"])
def test_objects_that_evaluate_to_meshes(stage, kind):
    if kind == "CURVE":
        bpy.ops.curve.primitive_bezier_circle_add(radius=2.0, rotation=(math.pi / 2, 0.0, 0.0))
        bpy.context.object.data.bevel_depth = 0.3
    elif kind == "FONT":
        bpy.ops.object.text_add(radius=3.0, location=(-2.0, 0.0, 0.0), rotation=(math.pi / 2, 0.0, 0.0))
        bpy.context.object.data.body = "ab"
        bpy.context.object.data.extrude = 0.1
    elif kind == "SURFACE":
        bpy.ops.surface.primitive_nurbs_surface_sphere_add(radius=2.0)
    else:
        bpy.ops.object.metaball_add(radius=2.0, location=(-1.0, 0.0, 0.0))
        bpy.ops.object.metaball_add(radius=2.0, location=(1.0, 0.0, 0.0))
    scene = probe.rendered_scene()
    assert len(scene.instances) == 1 and len(scene.warnings) == 0
    assert_same_picture()


def test_curves_without_faces_are_nothing(stage):
    bpy.ops.curve.primitive_bezier_circle_add(radius=2.0)
    assert len(probe.rendered_scene().instances) == 0


def test_visibility(stage):
    for x, name in enumerate(("camera", "diffuse", "glossy", "transmission", "volume_scatter", "shadow")):
        setattr(place(stage, (x, 0.0, 0.0)), f"visible_{name}", False)
    nobody = place(stage, (9.0, 0.0, 0.0))
    for name in ("camera", "diffuse", "glossy", "transmission", "volume_scatter", "shadow"):
        setattr(nobody, f"visible_{name}", False)
    scene = probe.rendered_scene()
    everyone = rec.RAY_CAMERA | rec.RAY_DIFFUSE | rec.RAY_GLOSSY | rec.RAY_TRANSMIT | rec.RAY_VOLUME | rec.RAY_SHADOW
    missing = {int(row["location"][0]): everyone & ~int(row["seen_by"]) for row in scene.instances}
    assert missing == {
        0: rec.RAY_CAMERA,
        1: rec.RAY_DIFFUSE,
        2: rec.RAY_GLOSSY,
        3: rec.RAY_TRANSMIT,
        4: rec.RAY_VOLUME,
        5: rec.RAY_SHADOW,
    }
    assert_same_picture()


def test_instancers_restrict_what_sees_their_instances(stage):
    group = bpy.data.collections.new("Group")
    place(stage, (0.0, 0.0, 0.0), "Member", group)
    for x, visible in ((-2.0, True), (2.0, False)):
        empty = bpy.data.objects.new("Instancer", None)
        empty.instance_type, empty.instance_collection, empty.location = "COLLECTION", group, (x, 0.0, 0.0)
        empty.visible_camera = visible
        bpy.context.scene.collection.objects.link(empty)
    scene = probe.rendered_scene()
    seen = {row["location"][0]: bool(row["seen_by"] & rec.RAY_CAMERA) for row in scene.instances}
    assert seen == {-2.0: True, 2.0: False}
    assert_same_picture()


def test_view_layer(stage):
    """Excluded collections are not there, holdout and indirect-only ones are marked, hidden objects are not there."""
    parts = {}
    for x, name in enumerate(("excluded", "holdout", "indirect_only", "plain")):
        collection = bpy.data.collections.new(name)
        bpy.context.scene.collection.children.link(collection)
        place(stage, (x, 0.0, 0.0), name, collection)
        parts[name] = bpy.context.view_layer.layer_collection.children[name]
    parts["excluded"].exclude = parts["holdout"].holdout = parts["indirect_only"].indirect_only = True
    place(stage, (7.0, 0.0, 0.0)).hide_render = True
    place(stage, (8.0, 0.0, 0.0)).is_holdout = True
    scene = probe.rendered_scene()
    rows = {int(row["location"][0]): row for row in scene.instances}
    assert sorted(rows) == [1, 2, 3, 8]
    assert [bool(rows[x]["flags"] & rec.INSTANCE_HOLDOUT) for x in (1, 2, 3, 8)] == [True, False, False, True]
    assert [bool(rows[x]["seen_by"] & rec.RAY_CAMERA) for x in (1, 2, 3, 8)] == [True, False, True, True]


def instanced(thing, depth):
    """Put a thing into a collection that `depth` nested empties instance; the outermost empty."""
    for i in range(depth):
        collection = bpy.data.collections.new(f"Level {i}")
        collection.objects.link(thing)
        thing = bpy.data.objects.new(f"Instancer {i}", None)
        thing.instance_type, thing.instance_collection = "COLLECTION", collection
    return thing


@pytest.mark.parametrize("depth", [0, 1, 2])
@pytest.mark.parametrize(
    ("says", "what"),
    [
        *[(who, what) for who in ("instancer", "instanced") for what in ("is_holdout", "visible_camera", "both")],
        *[("collection", what) for what in ("holdout", "indirect_only", "both")],
    ],
)
def test_instancer_decides(stage, depth, says, what):
    """Alpha beside Cycles: whose Holdout, Indirect Only and camera visibility count."""
    scene = bpy.context.scene
    thing = bpy.data.objects.new("Thing", stage)
    thing.scale = (5.0, 5.0, 5.0)
    outermost = instanced(thing, depth)
    collection = bpy.data.collections.new("Shown")
    scene.collection.children.link(collection)
    collection.objects.link(outermost)
    of_layer = bpy.context.view_layer.layer_collection.children["Shown"]
    if says == "collection":
        for name in ("holdout", "indirect_only"):
            setattr(of_layer, name, what in (name, "both"))
    else:
        owner = outermost if says == "instancer" else thing
        owner.is_holdout, owner.visible_camera = what in ("is_holdout", "both"), what not in ("visible_camera", "both")
    scene.render.film_transparent = True
    scene.render.resolution_x, scene.render.resolution_y = 8, 6
    side_by_side.exact_files(scene)
    alphas = [side_by_side.render(name, 4, 0)[2:4, 3:5, 3] for name in ("CYCLES", "RESTIR")]
    np.testing.assert_array_equal(*alphas)


def test_object_info(stage):
    one = place(stage, (-2.0, 0.0, 1.0), "Namé one")
    one.color, one.pass_index = (0.1, 0.2, 0.3, 0.4), 7
    place(stage, (2.0, 0.0, 1.0), "Two")
    group = bpy.data.collections.new("Group")
    place(stage, (0.0, 0.0, -1.5), "Member", group)
    for x in (-2.0, 2.0):
        empty = bpy.data.objects.new("Instancer", None)
        empty.instance_type, empty.instance_collection, empty.location = "COLLECTION", group, (x, 0.0, 0.0)
        bpy.context.scene.collection.objects.link(empty)

    def random(nodes):
        return nodes.new("ShaderNodeObjectInfo").outputs["Random"]

    expected, found = probe.both(random)
    hit = found["instance"] >= 0
    assert len(np.unique(found["instance"][hit])) == 4
    near = np.abs(expected[..., 0] - found["random"])[hit] < 1e-3
    assert near.mean() > 0.95
    row = next(
        row for row in probe.rendered_scene().instances if row["location"][0] == -2.0 and row["location"][2] == 1.0
    )
    np.testing.assert_allclose(row["color"], (0.1, 0.2, 0.3, 0.4), rtol=1e-6)
    assert row["object_index"] == 7


def test_instancer_coordinates(stage):
    """Texture Coordinate > From Instancer: Generated and UV of the face that an instance sits on."""
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=2, y_subdivisions=2, size=6.0, rotation=(math.pi / 2, 0.0, 0.0))
    parent = bpy.context.object
    parent.instance_type, parent.show_instancer_for_render = "FACES", False
    place(stage).parent = parent
    for output, field in (("Generated", "dupli_generated"), ("UV", "dupli_uv")):

        def coordinates(nodes, output=output):
            node = nodes.new("ShaderNodeTexCoord")
            node.from_instancer = True
            return node.outputs[output]

        expected, found = probe.both(coordinates, "", -4.0, 4.0)
        hit = found["instance"] >= 0
        values = probe.rendered_scene().instances[field][found["instance"][hit].astype(int)]
        assert output == "Generated" or np.ptp(values, axis=0).max() > 0.1  # no Generated without Blender's orco
        near = np.abs(expected[hit][:, : values.shape[1]] - values).max(axis=1) < 2e-3
        assert near.mean() > 0.95, output


def test_properties_of_objects(stage):
    one, two = place(stage, (-2.0, 0.0, 0.0), "One"), place(stage, (2.0, 0.0, 0.0), "Two")
    one["heat"], two["heat"] = 0.25, (0.5, 0.75, 1.0)

    def heat(nodes):
        node = nodes.new("ShaderNodeAttribute")
        node.attribute_type, node.attribute_name = "OBJECT", "heat"
        return node.outputs["Color"]

    expected, found = probe.both(heat, names.object_property("heat"))
    hit = found["instance"] >= 0
    near = np.abs(expected - found["attribute"][..., :3]).max(axis=-1)[hit] < 2e-3
    assert near.mean() > 0.95


def test_attributes_of_instances(stage):
    """Attributes that geometry nodes store on instances."""
    group = instancing_nodes()
    store = group.nodes.new("GeometryNodeStoreNamedAttribute")
    store.data_type, store.domain = "FLOAT_VECTOR", "INSTANCE"
    store.inputs["Name"].default_value = "shade"
    value = next(socket for socket in store.inputs if socket.name == "Value" and socket.enabled)
    group.links.new(group.nodes.new("GeometryNodeInputPosition").outputs[0], value)
    instances = next(node for node in group.nodes if node.bl_idname == "GeometryNodeInstanceOnPoints")
    join = next(node for node in group.nodes if node.bl_idname == "GeometryNodeJoinGeometry")
    for link in list(instances.outputs[0].links):
        group.links.remove(link)
    group.links.new(instances.outputs[0], store.inputs["Geometry"])
    group.links.new(store.outputs[0], join.inputs["Geometry"])
    bpy.ops.mesh.primitive_plane_add(size=4.0, rotation=(math.pi / 2, 0.0, 0.0))
    bpy.context.object.modifiers.new("Nodes", "NODES").node_group = group

    def shade(nodes):
        node = nodes.new("ShaderNodeAttribute")
        node.attribute_type, node.attribute_name = "INSTANCER", "shade"
        return node.outputs["Vector"]

    expected, found = probe.both(shade, names.object_property("shade", "INSTANCER"), -4.0, 4.0)
    hit = found["found"] > 0.0
    assert len(np.unique(found["instance"][hit])) == 4
    near = np.abs(expected - found["attribute"][..., :3]).max(axis=-1)[hit] < 2e-3
    assert near.mean() > 0.95


def test_keys_outlive_changes(stage):
    """Objects, instances and lamps keep their keys when they move and when others come."""
    bpy.ops.mesh.primitive_plane_add(size=4.0, rotation=(math.pi / 2, 0.0, 0.0))
    plane = bpy.context.object
    plane.modifiers.new("Nodes", "NODES").node_group = instancing_nodes()
    place(stage, name="Mover")
    place(bpy.data.lights.new("Lamp", "POINT"), name="Lamp")
    before = probe.rendered_scene()
    bpy.data.objects["Mover"].location.x += 1.0
    plane.location.y += 3.0
    place(stage, name="Another")
    place(bpy.data.lights.new("A lamp", "SUN"), name="A lamp")
    after = probe.rendered_scene()
    keys = set(before.instances["key"])
    assert len(keys) == len(before.instances) == len(after.instances) - 1
    assert keys < set(after.instances["key"])
    assert set(before.lights.lamps["key"]) < set(after.lights.lamps["key"])
    row = {int(each["key"]): each["location"] for each in before.instances}
    moved = {tuple(np.round(i["location"] - row[i["key"]], 3)) for i in after.instances if i["key"] in keys}
    assert moved == {(1.0, 0.0, 0.0), (0.0, 3.0, 0.0)}


def test_materials_by_slot_and_object(stage):
    stage.materials.append(bpy.data.materials.new("Data"))
    stage.materials.append(None)
    one, two = place(stage, (-2.0, 0.0, 0.0)), place(stage, (2.0, 0.0, 0.0))
    two.material_slots[0].link = "OBJECT"
    two.material_slots[0].material = bpy.data.materials.new("Own")
    bare = stage.copy()
    bare.materials.clear()
    place(bare, (0.0, 0.0, 2.0))
    scene = probe.rendered_scene()
    slots = {}
    for row in scene.instances:
        slots[tuple(row["location"])] = list(scene.material_slots[row["materials"] :][: row["n_materials"]])
    first, second, third = slots[(-2.0, 0.0, 0.0)], slots[(2.0, 0.0, 0.0)], slots[(0.0, 0.0, 2.0)]
    assert first[0] != second[0] and first[1] == second[1] == third[0] and len(third) == 1
    assert one.name != two.name


def test_singular_matrices_are_left_out(stage):
    place(stage, (1.0, 0.0, 0.0)).scale = (0.0, 0.0, 0.0)
    place(stage, (2.0, 0.0, 0.0)).scale = (1e-4, 1e-4, 1e-4)
    bad = place(stage, (3.0, 0.0, 0.0))
    bad.matrix_world = Matrix([[math.nan] * 4] * 4)
    scene = probe.rendered_scene()
    assert locations(scene) == [(2.0, 0.0, 0.0)]
    assert len(scene.warnings) == 0


def test_unsupported_geometry_is_named(stage):
    smoke = bpy.data.volumes.new("Smoke")
    smoke.filepath = "//nowhere.vdb"
    place(smoke, name="Smoke")
    assert "Smoke" in "\n".join(probe.rendered_scene().warnings.lines())


def test_many_instances(stage):
    """Forty thousand instances of one mesh; the time is printed by pytest's --durations."""
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=199, y_subdivisions=199, size=4.0)
    bpy.context.object.modifiers.new("Nodes", "NODES").node_group = instancing_nodes()
    scene = probe.rendered_scene()
    assert len(scene.instances) == 40001 and len(scene.meshes) == 2


def test_no_camera(stage):
    place(stage)
    bpy.context.scene.camera = None
    with pytest.raises((SceneError, RuntimeError), match="camera"):
        probe.rendered_scene()
