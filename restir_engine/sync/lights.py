"""Blender's lights → LIGHT records."""

from __future__ import annotations

import numpy as np

from ..kernels.core import records as rec
from ..kernels.core.vec import LARGEST_RADIANCE
from ..scene.lamps import area_lamp, point_lamp, portal, spot_lamp, sun_lamp
from .identity import identity
from .objects import light_group

_DIAMETERS = {"SQUARE": (False, False), "RECTANGLE": (False, True), "DISK": (True, False), "ELLIPSE": (True, True)}


def sync_light(scene, instance, materials, seen_by: int) -> bool:
    """Add the light of an entry of `depsgraph.object_instances` to the scene; False: it sends out nothing.

    seen_by: RAY_* bits of the rays that see the object; materials: compiles the light's node tree.
    """
    item = instance.object
    light = item.data
    settings = getattr(light, "cycles", None)
    matrix = np.array(instance.matrix_world, np.float64)
    area = _area(light, matrix) if light.type == "AREA" else {}
    if area is None:
        return False  # as in Cycles, an area of 0 sends out nothing
    if area and getattr(settings, "is_portal", False):
        scene.lights.portals.append(portal(matrix, **area))
        return False
    strength = np.array(light.color, np.float64) * light.energy * 2.0**light.exposure
    if light.use_temperature:
        strength *= np.array(light.temperature_color)
    strength = np.where(np.abs(strength) <= LARGEST_RADIANCE, strength, 0.0)
    strength, material = _with_program(scene, light, materials, strength)
    common = {
        "material": material,
        "seen_by": seen_by,
        "max_bounces": getattr(settings, "max_bounces", 1024),
        "casts_shadow": light.use_shadow,
        "hittable": getattr(settings, "use_multiple_importance_sampling", True),
        "object_index": item.pass_index,
        "light_group": light_group(scene, instance),
        "key": identity(instance),
        "normalize": light.normalize,
    }
    if light.type == "SUN":
        lamp = sun_lamp(matrix, strength, light.angle, **common)
    elif light.type == "AREA":
        lamp = area_lamp(matrix, strength, spread=light.spread, **area, **common)
    elif light.type == "SPOT":
        lamp = spot_lamp(
            matrix,
            strength,
            light.shadow_soft_size,
            light.spot_size,
            light.spot_blend,
            soft=light.use_soft_falloff,
            **common,
        )
    else:
        lamp = point_lamp(matrix, strength, light.shadow_soft_size, soft=light.use_soft_falloff, **common)
    scene.lights.add(lamp)
    return True


def _area(light, matrix: np.ndarray) -> dict | None:
    """The width, height and shape of an area light; None where it has no area."""
    ellipse, two = _DIAMETERS[light.shape]
    height = light.size_y if two else light.size
    if not np.linalg.norm(matrix[:3, :2], axis=0).astype(np.float32).all() or light.size * height == 0.0:
        return None
    return {"width": light.size, "height": height, "ellipse": ellipse}


def _with_program(scene, light, materials, strength: np.ndarray) -> tuple[np.ndarray, int]:
    """Strength and program of a light; a node tree that emits the same everywhere becomes part of the strength."""
    index = materials.compile_light(light)
    if index < 0:
        return strength, -1
    program = scene.shaders[index]
    if program.flags & rec.MATERIAL_VARYING_EMISSION:
        return strength, index
    emits = program.flags & rec.MATERIAL_EMITS
    return strength * (program.emission_estimate if emits else 0.0), -1
