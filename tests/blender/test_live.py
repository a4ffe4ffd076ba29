"""What a 3D view keeps from reading to reading: after whatever edits, its scene is the one that is read afresh.

Every edit is followed by a picture of what was kept and by one of a full reading: they are the same to the last bit.
"""

import random

import bpy
import numpy as np
import pytest

from restir_engine.scene.trees import Trees
from restir_engine.session import Session
from restir_engine.settings import RenderSettings
from restir_engine.sync.camera import sync_camera
from restir_engine.sync.depsgraph import read_scene
from restir_engine.sync.live import LiveReader, same_picture
from testing.blender import kit

SETTINGS = RenderSettings(samples=1, max_bounces=2, threads=1)
OLD = bpy.app.version < (5, 0, 0)


class Follower:
    """A `LiveReader` that is called as a 3D view's `view_update` is: at every update of the depsgraph."""

    def __init__(self) -> None:
        self.reader, self.trees = LiveReader(), Trees()
        self.description = self.scene = None
        self.readings = 0

    def update(self, scene, depsgraph) -> None:
        self.readings += 1
        found = self.reader.read(depsgraph, SETTINGS, sync_camera(depsgraph, None))
        if found is None:
            return
        self.trees.next_frame()
        self.description = found
        self.scene = found.commit(self.trees, self.scene)


@pytest.fixture
def follower():
    """One that follows the stage from its beginning."""
    stage()
    follower = Follower()
    follower.update(None, bpy.context.evaluated_depsgraph_get())
    bpy.app.handlers.depsgraph_update_post.append(follower.update)
    bpy.app.handlers.frame_change_post.append(follower.update)
    yield follower
    bpy.app.handlers.depsgraph_update_post.remove(follower.update)
    bpy.app.handlers.frame_change_post.remove(follower.update)


def picture(scene) -> np.ndarray:
    session = Session(scene, SETTINGS)
    assert session.render()
    return session.combined()


def assert_read(follower, what: str) -> None:
    """The follower has what a full reading gives."""
    bpy.context.view_layer.update()
    depsgraph = bpy.context.evaluated_depsgraph_get()
    fresh = read_scene(depsgraph, SETTINGS, sync_camera(depsgraph, None))
    found = follower.description
    assert len(found.instances) == len(fresh.instances), what
    for name in ("to_world", "seen_by", "flags", "color", "random", "object_index", "terminator", "key"):
        np.testing.assert_array_equal(found.instances[name], fresh.instances[name], f"{what}: {name}")
    np.testing.assert_array_equal(picture(follower.scene), picture(fresh.commit()), what)


# The stage ------------------------------------------------------------------------------------------------------------


def nodes(material):
    if OLD:
        material.use_nodes = True
    return material.node_tree.nodes


def principled(name: str, **values) -> bpy.types.Material:
    material = bpy.data.materials.new(name)
    node = next(node for node in nodes(material) if node.bl_idname == "ShaderNodeBsdfPrincipled")
    for socket, value in values.items():
        node.inputs[socket.replace("_", " ")].default_value = value
    return material


def checker() -> bpy.types.Image:
    image = bpy.data.images.new("Checker", 4, 4)
    image.pixels.foreach_set(np.random.default_rng(1).random(64, np.float32))
    image.update_tag()
    return image


def link(material, output, name: str) -> None:
    node = next(node for node in nodes(material) if node.bl_idname == "ShaderNodeBsdfPrincipled")
    material.node_tree.links.new(output, node.inputs[name])


def stage() -> None:
    """Objects of many kinds, whose materials read images, groups, attributes, colours and the place of an empty."""
    scene = kit.reset()
    scene.render.resolution_x = scene.render.resolution_y = 12
    scene.render.resolution_percentage = 100
    tree = scene.world.node_tree
    tree.nodes["Background"].inputs["Strength"].default_value = 0.3
    plain, textured, grouped = principled("Plain"), principled("Textured"), principled("Grouped", Roughness=0.3)
    texture = nodes(textured).new("ShaderNodeTexImage")
    texture.image = checker()
    link(textured, texture.outputs["Color"], "Base Color")
    group = bpy.data.node_groups.new("Group", "ShaderNodeTree")
    group.interface.new_socket("Color", in_out="OUTPUT", socket_type="NodeSocketColor")
    inside, out = group.nodes.new("ShaderNodeRGB"), group.nodes.new("NodeGroupOutput")
    inside.name = "Inside"
    inside.outputs[0].default_value = (0.7, 0.2, 0.1, 1.0)
    group.links.new(inside.outputs[0], out.inputs[0])
    user = nodes(grouped).new("ShaderNodeGroup")
    user.node_tree = group
    link(grouped, user.outputs[0], "Base Color")
    empty = kit.add(None, (0.3, 0.0, 0.5))
    empty.name = "Origin"
    placed = principled("Placed")
    coordinates = nodes(placed).new("ShaderNodeTexCoord")
    coordinates.object = empty
    link(placed, coordinates.outputs["Object"], "Base Color")
    asking = principled("Asking")
    attribute = nodes(asking).new("ShaderNodeAttribute")
    attribute.attribute_type, attribute.attribute_name = "OBJECT", "tint"
    info = nodes(asking).new("ShaderNodeObjectInfo")
    link(asking, info.outputs["Color"], "Base Color")
    link(asking, attribute.outputs["Fac"], "Roughness")
    glow = principled("Glow", Emission_Strength=2.0, Emission_Color=(1.0, 0.6, 0.3, 1.0))
    kit.floor(plain).name = "Floor"
    kit.put("ball", textured, (-1.2, 0.0, 0.7), 0.6).name = "Ball"
    kit.put("cube", [grouped, plain], (0.0, 0.6, 0.5), 0.4).name = "Cube"
    kit.put("coarse ball", placed, (1.1, -0.2, 0.6), (0.6, 0.5, 0.4)).name = "Egg"
    asker = kit.put("monkey", asking, (0.3, -1.3, 0.5), 0.4)
    asker.name, asker["tint"] = "Asker", 0.2
    asker.modifiers.new("Wave", "DISPLACE").strength = 0.05
    kit.put("plane", glow, (0.0, 1.5, 2.0), 0.4, rotation=(60.0, 0.0, 0.0)).name = "Lamp Mesh"
    light = bpy.data.lights.new("Spot", "SPOT")
    light.energy = 200.0
    kit.add(light, (2.0, -2.0, 3.0), (0.0, 0.0, 0.0)).name = "Spot"
    child = kit.put("cube", plain, (0.0, 0.0, 0.8), 0.2)
    child.name, child.parent = "Child", bpy.data.objects["Ball"]
    bpy.data.objects["Cube"].keyframe_insert("location", frame=1)
    bpy.data.objects["Cube"].location.z = 1.2
    bpy.data.objects["Cube"].keyframe_insert("location", frame=10)
    driver = next(n for n in nodes(plain) if n.bl_idname == "ShaderNodeBsdfPrincipled").inputs["Metallic"]
    driver.driver_add("default_value").driver.expression = "frame / 20"


# Edits: name → function of a random number generator ------------------------------------------------------------------


def thing(name: str) -> bpy.types.Object:
    return bpy.data.objects[name]


def solid(r) -> bpy.types.Object:
    return thing(r.choice(["Floor", "Ball", "Cube", "Egg", "Asker", "Child", "Lamp Mesh"]))


def move(r):
    solid(r).location.z += r.uniform(-0.2, 0.2)


def stretch(r):
    solid(r).scale.x *= r.uniform(0.8, 1.25)


def move_light(r):
    thing("Spot").location.x += r.uniform(-0.5, 0.5)


def dim(r):
    bpy.data.lights[0].energy *= r.uniform(0.7, 1.4)


def other_light(r):
    bpy.data.lights[0].type = r.choice(["POINT", "SUN", "AREA", "SPOT"])


def origin(r):
    thing("Origin").location.x += r.uniform(-0.3, 0.3)


def socket(r):
    material = bpy.data.materials[r.choice(["Plain", "Textured", "Placed", "Glow"])]
    node = next(n for n in nodes(material) if n.bl_idname == "ShaderNodeBsdfPrincipled")
    node.inputs["Roughness"].default_value = r.random()


def ramp(r):
    material = bpy.data.materials[r.choice(["Textured", "Placed"])]
    node = nodes(material).new("ShaderNodeValToRGB")
    node.color_ramp.elements[0].color = (r.random(), r.random(), r.random(), 1.0)
    link(material, node.outputs["Color"], "Base Color")
    node.inputs[0].default_value = r.random()


def in_group(r):
    bpy.data.node_groups["Group"].nodes["Inside"].outputs[0].default_value = (r.random(), r.random(), 0.5, 1.0)


def paint(r):
    image = bpy.data.images["Checker"]
    image.pixels.foreach_set(np.random.default_rng(r.randrange(1000)).random(64, np.float32))
    image.update_tag()


def other_space(r):
    bpy.data.images["Checker"].colorspace_settings.name = r.choice(["sRGB", "Non-Color"])


def world(r):
    bpy.context.scene.world.node_tree.nodes["Background"].inputs["Strength"].default_value = r.uniform(0.1, 0.6)


def vertex(r):
    data = solid(r).data
    data.vertices[r.randrange(len(data.vertices))].co.z += r.uniform(-0.3, 0.3)
    data.update()


def unwrap(r):
    thing("Ball").data.uv_layers[0].uv[r.randrange(20)].vector = (r.random(), r.random())
    thing("Ball").data.update()


def faces(r):
    data = thing("Cube").data
    data.polygons[r.randrange(6)].material_index = r.randrange(2)
    data.update()


def modifier(r):
    thing("Asker").modifiers[0].strength = r.uniform(-0.1, 0.1)


def slot(r):
    thing("Egg").material_slots[0].material = bpy.data.materials[r.choice(["Placed", "Plain", "Glow"])]


def tint(r):
    thing("Asker")["tint"] = r.random()
    thing("Asker").update_tag()


def color(r):
    thing("Asker").color = (r.random(), r.random(), r.random(), 1.0)


def rays(r):
    item = solid(r)
    name = r.choice(["visible_camera", "visible_shadow", "is_holdout", "visible_diffuse"])
    setattr(item, name, not getattr(item, name))


def hide(r):
    item = solid(r)
    item.hide_viewport = not item.hide_viewport


def holdout(r):
    layer = bpy.context.view_layer.layer_collection
    layer.holdout = not layer.holdout


def number(r):
    solid(r).pass_index = r.randrange(10)


def offset(r):
    thing("Ball").shadow_terminator_geometry_offset = r.random()


def frame(r):
    bpy.context.scene.frame_set(r.randrange(1, 12))


def apart(r, y: float, z: float) -> tuple[float, float, float]:
    """A place where no face lies in one plane with another's: of two such faces either may be seen."""
    return r.uniform(-2, 2), y + r.uniform(-0.05, 0.05), z + r.uniform(-0.05, 0.05)


def add(r):
    name = r.choice(["Plain", "Textured", "Grouped"])
    kit.put("cube", bpy.data.materials[name], apart(r, -1.0, 0.2), 0.2).name = "Added"


def remove(r):
    for item in [item for item in bpy.data.objects if item.name.startswith("Added")]:
        bpy.data.objects.remove(item)


def duplicate(r):
    item = bpy.data.objects.new("Added", thing("Cube").data)
    item.location = apart(r, -0.8, 0.3)
    item.scale = (0.2, 0.2, 0.2)
    bpy.context.scene.collection.objects.link(item)


def rename(r):
    solid(r).data.name = f"Data {r.random()}"


EDITS = [
    move, stretch, move_light, dim, other_light, origin, socket, ramp, in_group, paint, other_space, world, vertex,
    unwrap, faces, modifier, slot, tint, color, rays, hide, holdout, number, offset, frame, add, remove, duplicate,
    rename,
]  # fmt: skip


def test_every_edit_is_read_as_by_a_full_reading(follower):
    r = random.Random(7)
    for edit in EDITS:
        edit(r)
        assert_read(follower, edit.__name__)


@pytest.mark.deep
@pytest.mark.parametrize("seed", range(4))
def test_random_edits_are_read_as_by_a_full_reading(follower, seed):
    r, done = random.Random(seed), []
    for _ in range(100):
        for _ in range(r.randrange(1, 4)):
            edit = r.choice(EDITS)
            done.append(edit.__name__)
            edit(r)
        assert_read(follower, f"seed {seed}: {done}")


def test_what_cannot_be_seen_gives_no_new_scene(follower):
    before = follower.description
    for item in bpy.data.objects:
        item.select_set(not item.select_get())
    bpy.context.view_layer.update()
    assert follower.description is before
    assert follower.readings > 1


def test_what_is_not_named_is_kept(follower):
    """A moved object: all meshes and programs, the world's map, the emissive triangles."""
    before, scene = follower.description, follower.scene
    thing("Ball").location.z += 0.1
    bpy.context.view_layer.update()
    after = follower.description
    assert after is not before and not same_picture(after, before)
    assert all(a.vertices is b.vertices for a, b in zip(after.meshes, before.meshes, strict=True))
    assert after.shaders.same_as(before.shaders) and after.images.same_as(before.images)
    assert follower.scene.world is scene.world
    groups = [table.groups for table in (follower.scene.lights, scene.lights)]
    assert groups[0] and all(groups[0][key] is groups[1][key] for key in groups[0])
