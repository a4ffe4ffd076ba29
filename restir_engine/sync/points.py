"""Point clouds → `Spheres`, at the speed of copying memory."""

from __future__ import annotations

import bpy
import numpy as np

from ..kernels.core.digest import digest
from ..kernels.core.records import DOMAIN_POINT
from ..scene import names
from ..scene.description import SceneDescription
from ..scene.shape import Attribute
from ..scene.spheres import Spheres
from .hashing import hash_uint2, to_unit
from .mesh import read_values
from .mesh_cache import MeshCache
from .strands import OBJECT_SPACE, read_radii

_RADIUS = 0.01  # of points that tell none


def read_points(scene: SceneDescription, data: bpy.types.PointCloud, cache: MeshCache) -> Spheres | None:
    """The `Spheres` of an evaluated point cloud, with those of `scene.attribute_names` that it has, or None."""
    count = len(data.points)
    if count == 0:
        return None
    positions = np.empty((count, 3), np.float32)
    data.attributes["position"].data.foreach_get("vector", positions.reshape(-1))
    radii = read_radii(data, count, _RADIUS)
    key = "points", digest(positions), digest(radii)
    spheres = cache.form(key, lambda: Spheres(positions, radii, name=data.name, **OBJECT_SPACE))
    for name, index in scene.attribute_names.items():
        values = _values(data, name, count)
        if values is not None:
            spheres.attributes.append(Attribute(index, DOMAIN_POINT, values))
    return spheres


def _values(data: bpy.types.PointCloud, name: str, count: int) -> np.ndarray | None:
    if name == names.POINT_RANDOM:
        return to_unit(hash_uint2(np.arange(count), 0))
    found = data.attributes.get(name) if name and not name.startswith("\x00") else None
    return None if found is None else read_values(found)
