"""Each kind of lamp over a diffuse plane: our irradiance against Cycles' picture, at most 0.5 % apart in the mean."""

import math

import bpy
import numpy as np
import pytest

from restir_engine.kernels.core.records import (
    RAY_ALL,
)
from restir_engine.scene.description import SceneDescription
from restir_engine.sync.lights import sync_light
from restir_engine.sync.materials import Materials
from testing.blender.plane import cycles, plane_irradiance


def read_lights(scene: SceneDescription, seen_by: int) -> SceneDescription:
    materials = Materials(scene)
    for instance in bpy.context.evaluated_depsgraph_get().object_instances:
        if instance.object.type == "LIGHT":
            sync_light(scene, instance, materials, seen_by)
    return scene


def ours() -> np.ndarray:
    scene = read_lights(SceneDescription(), RAY_ALL)
    scene = scene.commit()
    assert not scene.warnings.lines()
    return plane_irradiance(scene, 256)


def add_lamp(scene, kind, place, values):
    light = bpy.data.lights.new("lamp", kind)
    light.energy = 10.0
    for name, value in values.items():
        setattr(light, name, value)
    item = bpy.data.objects.new("lamp", light)
    item.location = place[0]
    item.rotation_euler = place[1]
    item.scale = place[2]
    scene.collection.objects.link(item)


ABOVE = ((0.4, -0.3, 1.8), (0.0, 0.0, 0.0), (1.0, 1.0, 1.0))
TILTED = ((0.8, 0.5, 1.5), (0.5, 0.4, 0.3), (1.0, 1.0, 1.0))
SCALED = ((0.8, 0.5, 1.5), (0.3, 0.4, 0.3), (1.7, 0.6, 1.2))

CASES = {
    "point": ("POINT", ABOVE, {}),
    "point soft": ("POINT", ABOVE, {"shadow_soft_size": 0.6}),
    "point sphere": ("POINT", ABOVE, {"shadow_soft_size": 0.6, "use_soft_falloff": False}),
    "point scaled": ("POINT", SCALED, {"shadow_soft_size": 0.6, "use_soft_falloff": False}),
    "point sphere in the plane": (
        "POINT",
        ((0.0, 0.0, 0.3), (0, 0, 0), (1, 1, 1)),
        {"shadow_soft_size": 0.8, "use_soft_falloff": False},
    ),
    "point not normalised": ("POINT", ABOVE, {"shadow_soft_size": 0.6, "normalize": False, "exposure": 1.0}),
    "point warm": ("POINT", ABOVE, {"use_temperature": True, "temperature": 3000.0, "color": (0.8, 0.5, 0.2)}),
    "spot": ("SPOT", TILTED, {"spot_size": 1.2, "spot_blend": 0.3}),
    "spot hard": ("SPOT", TILTED, {"spot_size": 1.0, "spot_blend": 0.0}),
    "spot soft": ("SPOT", TILTED, {"spot_size": 1.2, "spot_blend": 0.8, "shadow_soft_size": 0.4}),
    "spot sphere": (
        "SPOT",
        TILTED,
        {"spot_size": 1.3, "spot_blend": 0.5, "shadow_soft_size": 0.5, "use_soft_falloff": False},
    ),
    "spot scaled": ("SPOT", SCALED, {"spot_size": 1.0, "spot_blend": 0.4, "shadow_soft_size": 0.2}),
    "spot wide": ("SPOT", TILTED, {"spot_size": math.pi, "spot_blend": 0.5, "shadow_soft_size": 0.2}),
    "spot not normalised": ("SPOT", TILTED, {"spot_size": 1.2, "shadow_soft_size": 0.4, "normalize": False}),
    "sun": ("SUN", TILTED, {"angle": 0.3}),
    "sun sharp": ("SUN", TILTED, {"angle": 0.0}),
    "sun wide": ("SUN", TILTED, {"angle": 2.5}),
    "sun not normalised": ("SUN", TILTED, {"angle": 0.3, "normalize": False}),
    "area square": ("AREA", ABOVE, {"size": 1.5}),
    "area rectangle": ("AREA", TILTED, {"shape": "RECTANGLE", "size": 2.0, "size_y": 0.7}),
    "area disk": ("AREA", TILTED, {"shape": "DISK", "size": 1.5}),
    "area ellipse": ("AREA", TILTED, {"shape": "ELLIPSE", "size": 2.0, "size_y": 0.7}),
    "area scaled": ("AREA", SCALED, {"shape": "ELLIPSE", "size": 1.0, "size_y": 0.7}),
    "area not normalised": ("AREA", SCALED, {"shape": "DISK", "size": 1.0, "normalize": False}),
    "area spread": ("AREA", TILTED, {"shape": "RECTANGLE", "size": 1.0, "size_y": 0.5, "spread": 1.2}),
    "area spread disk": ("AREA", TILTED, {"shape": "DISK", "size": 1.2, "spread": 0.8}),
    "area spread ellipse": ("AREA", SCALED, {"shape": "ELLIPSE", "size": 1.2, "size_y": 0.6, "spread": 2.0}),
    "area beam": ("AREA", TILTED, {"shape": "RECTANGLE", "size": 2.1, "size_y": 1.3, "spread": 0.0}),
}


@pytest.mark.parametrize("name", CASES)
def test_irradiance_of(name, stage, tmp_path):
    add_lamp(stage, *CASES[name])
    reference, mine = cycles(tmp_path), ours()
    assert mine.mean() == pytest.approx(reference.mean(), rel=5e-3)
    # The shape of the light, pixel by pixel, within the noise of both (much where a sphere is all around).
    assert np.abs(mine - reference).max() < (0.1 if "in the plane" in name else 0.04) * reference.max()


def test_light_settings(stage):
    add_lamp(stage, "AREA", ABOVE, {"use_shadow": False})
    light = stage.objects["lamp"].data
    light.cycles.max_bounces = 3
    light.cycles.use_multiple_importance_sampling = False
    scene = read_lights(SceneDescription(), 5)
    lamp = scene.lights.lamps[0]
    assert lamp["max_bounces"] == 3
    assert lamp["seen_by"] == 5
    assert lamp["flags"] == 2  # no shadow, not found by rays
    light.cycles.is_portal = True
    light.update_tag()
    read_lights(scene, 5)
    assert len(scene.lights.lamps) == 1
    (portal,) = scene.lights.portals
    for name in ("to_world", "p", "center", "radius"):
        np.testing.assert_array_equal(portal[0][name], lamp[name])
    assert len(scene.warnings) == 0
