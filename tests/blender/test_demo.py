"""The demo scene builds in every supported Blender."""

import bpy

from demo import still_life


def test_still_life_builds():
    scene = still_life.build(96, 64)
    assert (scene.render.resolution_x, scene.render.resolution_y) == (96, 64)
    assert scene.camera is not None and scene.world is not None
    depsgraph = bpy.context.evaluated_depsgraph_get()
    for item in scene.objects:
        if item.type in {"MESH", "CURVE", "FONT"}:
            mesh = item.evaluated_get(depsgraph).to_mesh()
            assert len(mesh.polygons) > 0, item.name
    grapes = [item for item in scene.objects if item.name.startswith("Grape")]
    assert len(grapes) == 44 and len({item.data for item in grapes}) == 1
    used = {slot.material.name for item in scene.objects for slot in item.material_slots}
    assert used == set(still_life.MATERIALS)
