"""Every RNA property that changes Cycles' picture of a small scene is read, or named by a warning, or need not be.

Which ones do was found by rendering: `testing.blender.rna_walk` keeps its table in cycles_properties.txt.
"""

import re
from pathlib import Path

import numpy as np
import pytest

from restir_engine.sync import left_out
from testing.blender import render, rna_walk

PACKAGE = Path(left_out.__file__).parents[1]
VERSIONS, TABLE = rna_walk.read_table(Path(__file__).with_name("cycles_properties.txt"))

# Where properties are read, by owner, under their own names.
MODULES = {
    "RenderSettings": ("sync/camera.py", "properties.py", "sync/culling.py"),
    "ViewLayer": ("properties.py", "sync/world.py", "sync/depsgraph.py"),
    "Object": ("sync/objects.py", "sync/depsgraph.py", "sync/motion.py"),
    "Camera": ("sync/camera.py",),
    "Camera.dof": ("sync/camera.py",),
    "AreaLight": ("sync/lights.py",),
    "SunLight": ("sync/lights.py",),
    "SpotLight": ("sync/lights.py",),
    "PointLight": ("sync/lights.py",),
    "Light.cycles": ("sync/lights.py",),
    "World": ("sync/world.py", "sync/materials.py"),
    "World.cycles": ("sync/world.py",),
    "World.cycles_visibility": ("sync/world.py",),
    "Material": ("sync/materials.py",),
    "Material.cycles": ("sync/materials.py",),
    "Scene.cycles": ("properties.py", "../operators/cycles_settings.py"),  # most are copied to scene.restir, once
}
# What is read under another name.
BY_ANOTHER_NAME = {
    **dict.fromkeys(
        (
            f"Object.{name}"
            for name in (
                "location",
                "rotation_euler",
                "scale",
                "dimensions",
                "delta_location",
                "delta_rotation_euler",
                "delta_scale",
            )
        ),
        "matrix_world",
    ),
    "Object.is_holdout": "holdout_get",  # with that of its collections
    **dict.fromkeys(("Camera.angle", "Camera.angle_x", "Camera.angle_y"), "lens"),  # by the sensor's size
    "Camera.dof.focus_distance": "focus_distance",
}
REASONS = {
    "RenderSettings.use_stamp": "Blender draws it into the picture",
    "RenderSettings.simplify_subdivision_render": "Blender's modifiers have done so",
    "Object.hide_render": "the depsgraph has no such objects",
    "Scene.cycles.use_light_tree": "chooses light samples: noise alone",
    "Scene.cycles.min_transparent_bounces": "when roulette begins: noise alone",
    "Scene.cycles.volume_biased": "media are the same everywhere here",
    "Scene.cycles.debug_use_compact_bvh": "rounding of intersections",
    "Scene.cycles.use_pixel_jitter": "how samples are spread over the pixel: noise alone",
    "Scene.cycles.tile_size": "noise alone",
}
# Of those that are read: they are warned of, or change how the world is sampled, which needs more than two samples.
NOT_SEEN = {
    "Light.cycles.is_portal",
    "Material.displacement_method",
    "World.cycles.sample_map_resolution",
}


def named() -> set[str]:
    """The last name of each property that a warning tells of."""
    tables = left_out.SCENE, left_out.WHEN_SIMPLIFIED, left_out.PASSES, left_out.LIGHT, left_out.WORLD
    return {entry.path.split(".")[-1] for table in tables for entry in table}


def changing(version: str) -> list[str]:
    return [name for name, words in TABLE.items() if words[version] == rna_walk.CHANGES]


def test_every_property_of_this_blender_was_tried():
    """A new version's new properties are tried by the tool, and then accounted for below."""
    assert rna_walk.version() in VERSIONS, "run testing.blender.rna_walk"
    render.register()
    known = {name for name, words in TABLE.items() if words[rna_walk.version()] != rna_walk.ABSENT}
    owners = rna_walk.build()
    found = {f"{name}.{item.identifier}" for name, owner in owners.items() for item in rna_walk.tried(owner)}
    assert found == known


@pytest.mark.parametrize("version", VERSIONS)
def test_what_changes_the_picture_is_accounted_for(version):
    unread = []
    for name in changing(version):
        owner, own = name.rsplit(".", 1)
        if name in REASONS or own in named():
            continue
        word = re.compile(rf"\b{BY_ANOTHER_NAME.get(name, own)}\b")
        if not any(word.search((PACKAGE / file).read_text()) for file in MODULES.get(owner, ())):
            unread.append(name)
    assert not unread


def test_no_reason_is_idle():
    everywhere = {name for version in VERSIONS for name in changing(version)}
    assert set(REASONS) | set(BY_ANOTHER_NAME) <= everywhere


def test_an_unread_property_is_found(monkeypatch):
    monkeypatch.setitem(TABLE, "Object.shines", dict.fromkeys(VERSIONS, rna_walk.CHANGES))
    with pytest.raises(AssertionError, match="shines"):
        test_what_changes_the_picture_is_accounted_for(VERSIONS[0])


@pytest.mark.deep
def test_what_is_read_changes_our_picture():
    """Properties of datablocks, one by one; those of Scene.cycles are copied."""
    render.register()
    owners = rna_walk.build()

    def picture() -> np.ndarray:
        with render.quiet():
            return render.render("RESTIR", 2, 0)

    reference = picture()
    idle = []
    for name in changing(rna_walk.version()):
        owner, own = name.rsplit(".", 1)
        if name in REASONS or own in named() or owner == "Scene.cycles" or name in NOT_SEEN:
            continue
        if not rna_walk.changes(owners[owner], owners[owner].bl_rna.properties[own], reference, picture):
            idle.append(name)
        if not np.array_equal(picture(), reference):
            owners = rna_walk.build()
            reference = picture()
    assert not idle
