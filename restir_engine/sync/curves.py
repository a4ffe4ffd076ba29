"""Hair curves → `Strands`, at the speed of copying memory."""

from __future__ import annotations

import bpy
import numpy as np

from ..kernels.core.records import DOMAIN_FACE, DOMAIN_POINT, SHAPE_CONES, SHAPE_RIBBONS, SHAPE_TUBES
from ..scene import names
from ..scene.shape import Attribute
from ..scene.strands import Strands
from .mesh import read_values

_SHAPES = {"RIBBONS": SHAPE_RIBBONS, "THICK": SHAPE_TUBES, "THICK_LINEAR": SHAPE_CONES}
_DOMAINS = {"POINT": DOMAIN_POINT, "CURVE": DOMAIN_FACE}
_RADIUS = 0.005  # of curves that tell none


def strand_look(scene: bpy.types.Scene) -> tuple[int, int]:
    """What a scene draws strands as: SHAPE_*, and the flat pieces a segment of a ribbon."""
    settings = scene.cycles_curves
    return _SHAPES[settings.shape], settings.subdivisions + 1


def read_curves(scene, data: bpy.types.Curves, look: tuple[int, int]) -> Strands | None:
    """The `Strands` of evaluated hair curves, with those of `scene.attribute_names` that they have; None without any.

    look: see `strand_look`.
    """
    n_points, n_curves = len(data.points), len(data.curves)
    if n_curves == 0:
        return None
    positions = np.empty((n_points, 3), np.float32)
    data.position_data.foreach_get("vector", positions.reshape(-1))
    offsets = np.empty(n_curves + 1, np.int32)
    data.curve_offset_data.foreach_get("value", offsets)
    found = data.attributes.get("radius")
    if found is None:
        radii = np.full(n_points, _RADIUS, np.float32)
    else:
        radii = np.empty(n_points, np.float32)
        found.data.foreach_get("value", radii)
    shape, pieces = look
    strands = Strands(positions, radii, offsets, shape, pieces, name=data.name)
    if not strands.count:
        return None
    for name, index in scene.attribute_names.items():
        attribute = _attribute(data, name, index)
        if attribute is not None:
            strands.attributes.append(attribute)
    return strands


def _attribute(data: bpy.types.Curves, name: str, index: int) -> Attribute | None:
    if name == names.UV:
        name = "surface_uv_coordinate"
    found = data.attributes.get(name) if not name.startswith("\x00") else None
    values = None if found is None else read_values(found)
    return None if values is None else Attribute(index, _DOMAINS[found.domain], values)
