"""Point clouds → `Spheres`, at the speed of copying memory."""

from __future__ import annotations

import bpy
import numpy as np

from ..kernels.core.records import DOMAIN_POINT
from ..scene.shape import Attribute
from ..scene.spheres import Spheres
from .mesh import read_values

_RADIUS = 0.01  # of points that tell none


def read_points(scene, data: bpy.types.PointCloud) -> Spheres | None:
    """The `Spheres` of an evaluated point cloud, with those of `scene.attribute_names` that it has, or None."""
    count = len(data.points)
    if count == 0:
        return None
    positions = np.empty((count, 3), np.float32)
    data.attributes["position"].data.foreach_get("vector", positions.reshape(-1))
    found = data.attributes.get("radius")
    if found is None:
        radii = np.full(count, _RADIUS, np.float32)
    else:
        radii = np.empty(count, np.float32)
        found.data.foreach_get("value", radii)
    spheres = Spheres(positions, radii, name=data.name)
    for name, index in scene.attribute_names.items():
        found = data.attributes.get(name) if name and not name.startswith("\x00") else None
        values = None if found is None else read_values(found)
        if values is not None:
            spheres.attributes.append(Attribute(index, DOMAIN_POINT, values))
    return spheres
