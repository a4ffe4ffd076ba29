"""What shapes other than triangles are made of: entries by shape, compiled when a scene first has such a shape.

SHAPE_HIT (scene, ray) brings u and v of an RTCRayHit into the form that MESH's shape has; SHAPE_SURFACE (scene, sp)
fills the place, the normals and the tangents of a shading point; SHAPE_CENTRE (scene, sp, mesh, out) gives the place in
object space of a shading point of another frame.
"""

import numpy as np

from ..core.jit import load
from ..core.records import (
    SHAPE_CONES,
    SHAPE_ENTRIES,
    SHAPE_RIBBONS,
    SHAPE_SPHERES,
    SHAPE_TRIANGLES,
    SHAPE_TUBES,
)
from . import spheres, strands
from .closed import outside_filter

# By shape: SHAPE_HIT, SHAPE_SURFACE, SHAPE_CENTRE.
_ENTRIES = {
    SHAPE_SPHERES: (spheres.sphere_hit, spheres.sphere_surface, spheres.sphere_centre),
    SHAPE_RIBBONS: (strands.ribbon_hit, strands.ribbon_surface, strands.curve_centre),
    SHAPE_TUBES: (strands.tube_hit, strands.tube_surface, strands.curve_centre),
    SHAPE_CONES: (strands.cone_hit, strands.cone_surface, strands.cone_centre),
}


# Filters (scene.strands, scene.spheres), given RTCFilterFunctionNArguments.
FILTERS = {
    SHAPE_SPHERES: outside_filter,
    SHAPE_TUBES: strands.tube_filter,
    SHAPE_CONES: outside_filter,
}


def shape_entries(shapes: np.ndarray) -> np.ndarray:
    """Addresses, int64, by SHAPE_ENTRIES * shape + SHAPE_*, of what these shapes need; 0 for others."""
    table = np.zeros(SHAPE_ENTRIES * (max(_ENTRIES) + 1), np.int64)
    found = sorted(set(shapes.tolist()) - {SHAPE_TRIANGLES})
    load(entry for shape in found for entry in _ENTRIES[shape])
    for shape in found:
        table[SHAPE_ENTRIES * shape : SHAPE_ENTRIES * (shape + 1)] = [entry.address for entry in _ENTRIES[shape]]
    return table
