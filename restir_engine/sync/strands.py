"""Hair curves and particle hair → `Strands`, with the attributes that programs ask for."""

from __future__ import annotations

from collections.abc import Callable

import bpy
import numpy as np

from ..kernels.core.digest import digest
from ..kernels.core.records import DOMAIN_FACE, DOMAIN_POINT, SHAPE_CONES, SHAPE_RIBBONS, SHAPE_TUBES
from ..scene import names
from ..scene.description import SceneDescription
from ..scene.shape import Attribute
from ..scene.strands import Strands
from .hashing import hash_uint2, to_unit
from .mesh import read_values
from .mesh_cache import MeshCache
from .particle_hair import Hair

_SHAPES = {"RIBBONS": SHAPE_RIBBONS, "THICK": SHAPE_TUBES, "THICK_LINEAR": SHAPE_CONES}
_DOMAINS = {"POINT": DOMAIN_POINT, "CURVE": DOMAIN_FACE}
_RADIUS = 0.005  # of curves that tell none
_MOST_PIECES = 16  # that Embree makes of a segment
_POLY = 1  # a value of the attribute "curve_type"
# From then on Cycles draws curves as straight cones where a datablock's first one is of that type.
_KNOWS_POLY = bpy.app.version >= (5, 2, 0)

# Generated coordinates of what Cycles knows no others of.
OBJECT_SPACE = {"generated_offset": (0.0, 0.0, 0.0), "generated_scale": (1.0, 1.0, 1.0)}

# An attribute's domain and values by its name, None for what there is not.
_Find = Callable[[str], tuple[int, np.ndarray] | None]


def strand_look(scene: bpy.types.Scene) -> tuple[int, int]:
    """What a scene draws strands as: SHAPE_*, and the flat pieces of which a segment of a ribbon is made."""
    settings = scene.cycles_curves
    return _SHAPES[settings.shape], min(2**settings.subdivisions + 1, _MOST_PIECES)


def read_curves(
    scene: SceneDescription, data: bpy.types.Curves, look: tuple[int, int], cache: MeshCache
) -> Strands | None:
    """The `Strands` of evaluated hair curves; None where there are none. look: see `strand_look`."""
    n_points, n_curves = len(data.points), len(data.curves)
    if n_curves == 0:
        return None
    positions = np.empty((n_points, 3), np.float32)
    data.position_data.foreach_get("vector", positions.reshape(-1))
    offsets = np.empty(n_curves + 1, np.int32)
    data.curve_offset_data.foreach_get("value", offsets)
    radii = read_radii(data, n_points, _RADIUS)
    if _KNOWS_POLY and _first_type(data) == _POLY:
        look = SHAPE_CONES, look[1]
    key = "curves", look, digest(positions), digest(offsets), digest(radii)
    strands = cache.form(key, lambda: Strands(positions, radii, offsets, *look, name=data.name, **OBJECT_SPACE))

    def find(name: str) -> tuple[int, np.ndarray] | None:
        if name == names.UV:
            name = "surface_uv_coordinate"
        found = data.attributes.get(name) if not name.startswith("\x00") else None
        values = None if found is None else read_values(found)
        return None if values is None else (_DOMAINS[found.domain], values)

    return _with_attributes(scene, strands, find)


def read_hair(
    scene: SceneDescription, owner: bpy.types.Object, look: tuple[int, int], is_render: bool, cache: MeshCache
) -> Strands | None:
    """The `Strands` of an evaluated object's particle hair; None where there is none."""
    hair, strands = hair_form(owner, look, is_render, cache, scene.time)
    if strands is None:
        return None
    data = owner.data
    maps = [layer.name for layer in data.uv_layers]
    colors = [attribute.name for attribute in data.color_attributes]

    def find(name: str) -> tuple[int, np.ndarray] | None:
        if name == names.UV:
            name = next((layer.name for layer in data.uv_layers if layer.active_render), "")
        if name == names.COLOR:
            name = data.attributes.default_color_name or data.attributes.active_color_name
        if name == names.GENERATED:
            centre, size = np.array(data.texspace_location), np.array(data.texspace_size)
            return DOMAIN_FACE, (strands.roots() - centre) / (2.0 * np.where(size != 0.0, size, 0.5)) + 0.5
        if name in maps:
            return DOMAIN_FACE, hair.uv(maps.index(name))
        return (DOMAIN_FACE, hair.color(colors.index(name))) if name in colors else None

    return _with_attributes(scene, strands, find)


def hair_form(
    owner: bpy.types.Object, look: tuple[int, int], is_render: bool, cache: MeshCache, time: float
) -> tuple[Hair, Strands | None]:
    """An evaluated object's particle hair as it is at a time, and its `Strands` without attributes, if it has any."""
    hair = Hair(owner, is_render)
    if not len(hair):
        return hair, None
    return hair, cache.form(("particle hair", look, hair.key(time)), lambda: hair.strands(look))


def read_radii(data, count: int, default: float) -> np.ndarray:
    """The radii of the points of curves or a point cloud, float32 (count,)."""
    radii = np.full(count, default, np.float32)
    found = data.attributes.get("radius")
    if found is not None and found.data_type == "FLOAT" and found.domain == "POINT":
        found.data.foreach_get("value", radii)
    return radii


def _with_attributes(scene: SceneDescription, strands: Strands, find: _Find) -> Strands | None:
    """Give strands those of `scene.attribute_names` that they have; None where nothing is to be seen of them."""
    if not strands.count:
        return None
    lengths = None
    for name, index in scene.attribute_names.items():
        if name in (names.INTERCEPT, names.LENGTH):
            lengths = lengths or strands.lengths()
            found = (DOMAIN_POINT, lengths[0]) if name == names.INTERCEPT else (DOMAIN_FACE, lengths[1])
        elif name == names.STRAND_RANDOM:
            found = DOMAIN_FACE, to_unit(hash_uint2(np.arange(len(strands)), 0))
        else:
            found = find(name)
        if found is not None:
            strands.attributes.append(Attribute(index, *found))
    return strands


def _first_type(data: bpy.types.Curves) -> int:
    found = data.attributes.get("curve_type")
    return 0 if found is None else found.data[0].value
