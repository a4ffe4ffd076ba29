"""Meshes that are kept from frame to frame: whatever is changed, what is read is what a fresh reading gives."""

import math

import bpy
import numpy as np
import pytest

from restir_engine import engine
from restir_engine.kernels.core.digest import digest
from restir_engine.settings import RenderSettings
from restir_engine.sync.depsgraph import read_scene
from restir_engine.sync.kept import Kept
from testing.blender import probe

ARRAYS = ("vertices", "triangles", "corners", "polygons", "normals", "smooth", "material_slots")
SCALARS = ("normals_domain", "generated_offset", "generated_scale", "problem")


@pytest.fixture
def stage():
    """A subdivided cube with all that a mesh can have, beside a plain one; their materials ask for an attribute."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    bpy.ops.mesh.primitive_cube_add()
    rich = bpy.context.object
    rich.name = rich.data.name = "Rich"
    rich.shape_key_add(name="Basis")
    rich.shape_key_add(name="Bent").data[0].co.x += 0.5
    rich.modifiers.new("Subdivision", "SUBSURF").render_levels = 1
    values = rich.data.attributes.new("paint", "FLOAT", "POINT").data
    values.foreach_set("value", np.arange(len(values), dtype=np.float32))
    colors = rich.data.color_attributes.new("bytes", "BYTE_COLOR", "CORNER").data
    colors.foreach_set("color", np.linspace(0.0, 1.0, 4 * len(colors)).astype(np.float32))
    bpy.ops.mesh.primitive_cube_add(location=(3.0, 0.0, 0.0))
    plain = bpy.context.object
    plain.name = plain.data.name = "Plain"
    plain.data.polygons.foreach_set("use_smooth", np.arange(6) > 0)
    plain.data.edges[5].use_edge_sharp = True  # so that normals are of corners, whatever is changed
    plain.data.update()
    for item, name in ((rich, "paint"), (plain, "bytes")):
        item.data.materials.append(asking_for(name))
        item.data.materials.append(None)
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    scene.collection.objects.link(camera)
    scene.camera = camera
    return rich, plain


def asking_for(name: str) -> bpy.types.Material:
    def attribute(nodes):
        node = nodes.new("ShaderNodeAttribute")
        node.attribute_name = name
        return node.outputs["Vector"]

    return probe.emission_material(attribute)


def read(kept: Kept | None = None):
    depsgraph = bpy.context.evaluated_depsgraph_get()
    if kept is None:
        return read_scene(depsgraph, RenderSettings())
    kept.begin(object())
    return read_scene(depsgraph, RenderSettings(), meshes=kept.meshes)


def assert_same(found, fresh) -> None:
    """All that a scene reads of meshes, attributes by name; that more have been asked for before does no harm."""
    assert found.warnings.lines() == fresh.warnings.lines()
    assert len(found.meshes) == len(fresh.meshes)
    assert found.instances["mesh"].tolist() == fresh.instances["mesh"].tolist()
    for mesh, expected in zip(found.meshes, fresh.meshes, strict=True):
        for name in ARRAYS:
            np.testing.assert_array_equal(getattr(mesh, name), getattr(expected, name), name)
        assert [getattr(mesh, name) for name in SCALARS] == [getattr(expected, name) for name in SCALARS]
        for name, number in fresh.attribute_names.items():
            there, wanted = mesh.attribute(found.attribute_name(name)), expected.attribute(number)
            if wanted is not None:
                assert there is not None and there.domain == wanted.domain, name
                np.testing.assert_array_equal(there.values, wanted.values, name)


def keyed_shape(rich, plain):
    key = rich.data.shape_keys.key_blocks["Bent"]
    for frame, value in ((1, 0.0), (5, 1.0)):
        key.value = value
        key.keyframe_insert("value", frame=frame)
    bpy.context.scene.frame_set(4)


def armature(rich, plain):
    data = bpy.data.armatures.new("Bones")
    bones = bpy.data.objects.new("Bones", data)
    bpy.context.scene.collection.objects.link(bones)
    bpy.context.view_layer.objects.active = bones
    bpy.ops.object.mode_set(mode="EDIT")
    bone = data.edit_bones.new("Bone")
    bone.head, bone.tail = (0.0, 0.0, -1.0), (0.0, 0.0, 1.0)
    bpy.ops.object.mode_set(mode="OBJECT")
    plain.vertex_groups.new(name="Bone").add(range(4), 1.0, "REPLACE")
    plain.modifiers.new("Armature", "ARMATURE").object = bones
    bones.pose.bones["Bone"].location = (0.0, 0.3, 0.0)


def driver(rich, plain):
    curve = rich.data.shape_keys.key_blocks["Bent"].driver_add("value")
    curve.driver.expression = "0.7"


def material_index(rich, plain):
    plain.data.polygons[2].material_index = 1


def other_material(rich, plain):
    plain.material_slots[0].material = asking_for("paint")
    rich.material_slots[0].material = asking_for("bytes")


def uv_edited(rich, plain):
    plain.data.uv_layers[0].uv[5].vector = (0.1, 0.2)


def uv_map_added(rich, plain):
    layer = rich.data.uv_layers.new(name="Other")
    layer.active_render = True
    layer.uv[0].vector = (0.4, 0.1)


def attribute_edited(rich, plain):
    rich.data.attributes["paint"].data[3].value = 17.0


def color_edited(rich, plain):
    rich.data.color_attributes["bytes"].data[0].color = (1.0, 0.5, 0.2, 1.0)


def attribute_added(rich, plain):
    plain.data.attributes.new("late", "FLOAT_VECTOR", "CORNER").data[1].vector = (1.0, 2.0, 3.0)
    plain.material_slots[0].material = asking_for("late")


def tangents_asked(rich, plain):
    plain.material_slots[0].material = probe.emission_material(lambda nodes: nodes.new("ShaderNodeTangent").outputs[0])


def modifier_changed(rich, plain):
    rich.modifiers["Subdivision"].levels = 2


def modifier_added(rich, plain):
    plain.modifiers.new("Bevel", "BEVEL").width = 0.1


def face_flattened(rich, plain):
    plain.data.polygons[1].use_smooth = False


def sharp_edge(rich, plain):
    for edge in plain.data.edges:
        edge.use_edge_sharp = not edge.use_edge_sharp


def custom_normals(rich, plain):
    plain.data.normals_split_custom_set([(0.0, 0.6, 0.8)] * len(plain.data.loops))


def vertex_moved(rich, plain):
    plain.data.vertices[1].co.z += 0.25


def sign_turned(rich, plain):
    """Only the signs of the positions' bits change."""
    plain.data.transform(((-1, 0, 0, 0), (0, -1, 0, 0), (0, 0, -1, 0), (0, 0, 0, 1)))


def faces_turned(rich, plain):
    plain.data.flip_normals()


def topology(rich, plain):
    plain.data.clear_geometry()
    plain.data.from_pydata([(0, 0, 0), (1, 0, 0), (0, 1, 0), (1, 1, 1)], [], [(0, 1, 2), (1, 3, 2)])


def bad_vertices(rich, plain):
    plain.data.vertices[0].co.x = math.nan


def texture_space(rich, plain):
    plain.data.use_auto_texspace = False
    plain.data.texspace_size = (2.0, 3.0, 4.0)


def basis_moved(rich, plain):
    rich.data.shape_keys.key_blocks["Basis"].data[2].co.y += 0.5


def stretched(rich, plain):
    plain.scale = (1.0, 2.0, 0.5)


def swapped(rich, plain):
    rich.modifiers.clear()
    rich.shape_key_clear()
    rich.data, plain.data = plain.data, rich.data


def removed(rich, plain):
    bpy.data.objects.remove(rich)


def duplicated(rich, plain):
    copy = plain.copy()
    copy.location.y = 2.0
    bpy.context.scene.collection.objects.link(copy)


def copied(rich, plain):
    """A datablock of its own that holds the same."""
    copy = plain.copy()
    copy.data = plain.data.copy()
    bpy.context.scene.collection.objects.link(copy)


def edit_mode(rich, plain):
    bpy.context.view_layer.objects.active = plain
    bpy.ops.object.mode_set(mode="EDIT")


def renamed(rich, plain):
    plain.name = plain.data.name = "Another"


def moved(rich, plain):
    plain.location.z += 1.0


CHANGES = (
    keyed_shape, armature, driver, material_index, other_material, uv_edited, uv_map_added, attribute_edited,
    color_edited, attribute_added, tangents_asked, modifier_changed, modifier_added, face_flattened, sharp_edge,
    custom_normals, vertex_moved, sign_turned, faces_turned, topology, bad_vertices, texture_space, basis_moved,
    stretched, swapped, removed, duplicated, copied, edit_mode, renamed, moved,
)  # fmt: skip


@pytest.mark.parametrize("change", CHANGES, ids=lambda change: change.__name__)
def test_a_change_is_read(stage, change):
    kept = Kept()
    assert_same(read(kept), read())
    change(*stage)
    for item in stage if change is not removed else stage[1:]:
        item.data.update_tag()
    assert_same(read(kept), read())
    assert_same(read(kept), read())  # found again


def test_what_has_not_changed_is_not_read_again(stage):
    rich, plain = stage
    kept = Kept()
    read(kept)  # a mesh has the attributes that are asked for before it is read; now all are known
    first = read(kept).meshes
    second = read(kept).meshes
    assert all(a is b for a, b in zip(first, second, strict=True))
    plain.name = plain.data.name = "Another"
    plain.location.x += 1.0
    rich.material_slots[0].material = asking_for("paint")
    rich.data.update_tag()
    third = read(kept).meshes
    assert all(a is b for a, b in zip(first, third, strict=True))
    plain.data.uv_layers[0].uv[5].vector = (0.1, 0.2)
    plain.data.update_tag()
    found = read(kept).meshes
    changed = next(i for i, mesh in enumerate(first) if mesh.name == "Plain")
    assert found[1 - changed] is first[1 - changed] and found[changed] is not first[changed]
    assert found[changed].vertices is first[changed].vertices  # its structure is still good
    assert found[changed].triangles is first[changed].triangles


def test_undo_is_read(stage):
    """All datablocks are others after it."""
    _, plain = stage
    kept = Kept()
    bpy.ops.ed.undo_push(message="before")
    read(kept)
    plain.data.vertices[1].co.z += 0.25
    bpy.ops.ed.undo_push(message="after")
    assert_same(read(kept), read())
    bpy.ops.ed.undo()
    assert_same(read(kept), read())


def test_what_is_not_shown_any_more_is_given_up(stage):
    kept = Kept()
    read(kept)
    for item in stage:
        item.hide_render = item.hide_viewport = True
    assert len(kept.meshes._meshes) == 2
    read(kept)
    read(kept)
    assert len(kept.meshes._meshes) == len(kept.meshes._shapes) == 0


def test_renders_keep_meshes_from_frame_to_frame_and_forget_them_at_the_end(stage, monkeypatch, tmp_path):
    """Every frame has an engine of its own; all find the meshes of the one before."""
    engine.register()
    scene = bpy.context.scene
    scene.render.engine = "RESTIR"
    scene.render.resolution_x = scene.render.resolution_y = 8
    scene.frame_start, scene.frame_end, scene.restir.samples = 1, 3, 1
    scene.render.filepath = str(tmp_path / "frame_")
    scene.view_layers.new("Second")
    seen = []
    render = engine.RestirEngine.render

    def look(self, depsgraph):
        seen.append((id(self.kept), [id(mesh) for mesh in self.scene.meshes]))
        render(self, depsgraph)

    monkeypatch.setattr(engine.RestirEngine, "render", look)
    bpy.ops.render.render(animation=True)
    assert len(seen) == 6 and all(each == seen[1] for each in seen[1:])
    assert engine.RestirEngine.kept is None
    scene.render.use_persistent_data = True
    bpy.ops.render.render()
    assert engine.RestirEngine.kept is not None
    bpy.ops.wm.read_factory_settings(use_empty=True)
    assert engine.RestirEngine.kept is None


def test_digest_is_murmur3():
    """A published value; and no two of many similar arrays have the same digest."""
    text = np.frombuffer(b"The quick brown fox jumps over the lazy dog", np.uint8)
    assert [x % 2**64 for x in digest(text)] == [0xE34BBC7BBC071B6C, 0x7A433CA9C49A9347]
    assert digest(np.zeros(0)) == (0, 0)
    ones = np.ones((3, 64), np.float32)
    found = {digest(ones)}
    for i in range(192):
        other = ones.copy()
        other.ravel()[: i + 1] *= -1.0
        found.add(digest(other))
        other = ones.copy()
        other.ravel()[i] *= -1.0
        found.add(digest(other))
    assert len(found) == 1 + 2 * 192 - 1  # the first of both are the same
