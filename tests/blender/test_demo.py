"""The demo scenes build in every supported Blender."""

import bpy
import pytest

from demo import still_life, translucent


@pytest.mark.parametrize("demo", [still_life, translucent])
def test_demo_scene_builds(demo):
    scene = demo.build(96, 64)
    assert (scene.render.resolution_x, scene.render.resolution_y) == (96, 64)
    assert scene.camera is not None and scene.world is not None
    depsgraph = bpy.context.evaluated_depsgraph_get()
    for item in scene.objects:
        if item.type in {"MESH", "CURVE", "FONT"}:
            mesh = item.evaluated_get(depsgraph).to_mesh()
            assert len(mesh.polygons) > 0, item.name
    used = {slot.material.name for item in scene.objects for slot in item.material_slots}
    assert used == set(demo.MATERIALS)


def test_grapes_share_a_mesh():
    grapes = [item for item in still_life.build(96, 64).objects if item.name.startswith("Grape")]
    assert len(grapes) == 44 and len({item.data for item in grapes}) == 1


def test_hand_is_one_skin():
    """Voxels join the bones: each edge has two faces, all in one piece."""
    hand = translucent.build(96, 64).objects["Hand"]
    mesh = hand.evaluated_get(bpy.context.evaluated_depsgraph_get()).to_mesh()
    faces_of = {}
    for polygon in mesh.polygons:
        for key in polygon.edge_keys:
            faces_of[key] = faces_of.get(key, 0) + 1
    assert set(faces_of.values()) == {2}
