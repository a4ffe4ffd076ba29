"""Evaluated meshes → `Mesh`, at the speed of copying memory.

Only properties that Blender hands out as whole arrays are read (attributes' own values, `loop_triangles.loops`,
`corner_normals`, …): anything behind a getter costs fifty times as much.
"""

import ctypes
from contextlib import contextmanager

import bpy
import numpy as np

from ..kernels.core.records import DOMAIN_CORNER, DOMAIN_FACE, DOMAIN_POINT
from ..scene import names
from ..scene.mesh import Mesh, clean, empty_vertices
from ..scene.shape import Attribute
from .topology import islands, pointiness, tangents
from .working_space import from_rec709

DOMAINS = {"POINT": DOMAIN_POINT, "CORNER": DOMAIN_CORNER, "FACE": DOMAIN_FACE}

# Type of an attribute → name of its values, their type in memory, components. Cycles reads no others.
LAYOUTS = {
    "FLOAT": ("value", np.float32, 1),
    "INT": ("value", np.int32, 1),
    "INT8": ("value", np.int8, 1),
    "BOOLEAN": ("value", bool, 1),
    "FLOAT2": ("vector", np.float32, 2),
    "FLOAT_VECTOR": ("vector", np.float32, 3),
    "FLOAT_COLOR": ("color", np.float32, 4),
    "QUATERNION": ("value", np.float32, 4),
}


def read_mesh(scene, data, deformed: bool = True) -> Mesh | None:
    """The `Mesh` of an evaluated bpy.types.Mesh; None when it has no faces.

    It gets its UV maps and those of `scene.attribute_names` that it has. deformed: whether modifiers or shape keys may
    have moved its vertices away from the shape that generated coordinates belong to.
    """
    count = len(data.loop_triangles)
    if count == 0:
        return None
    n_vertices, n_corners = len(data.vertices), len(data.loops)
    vertices = empty_vertices(n_vertices)
    data.attributes["position"].data.foreach_get("vector", vertices.reshape(-1))
    corners = _read(data.loop_triangles, "loops", (count, 3), np.uint32)
    polygons = _read(data.loop_triangle_polygons, "value", (count,), np.int32)
    corner_vertices = _read(data.attributes[".corner_vert"].data, "value", (n_corners,), np.int32)
    mesh = Mesh(vertices, corner_vertices.view(np.uint32)[corners], name=data.name, corners=corners, polygons=polygons)
    _read_normals(mesh, data, n_corners)
    _read_material_slots(mesh, data)
    _read_texture_space(mesh, data, deformed)
    add_attributes(scene, mesh, data)
    mesh.problem = clean(mesh)
    if mesh.problem:
        scene.warnings.add("Mesh", data.name, mesh.problem)
    return mesh if len(mesh.triangles) else None


def add_attributes(scene, mesh: Mesh, data) -> None:
    """Give `mesh` those of `scene.attribute_names` that `data` has and that it has not yet, and all UV maps."""
    for layer in data.uv_layers:
        index = scene.attribute_name(layer.name)
        if mesh.attribute(index) is None:
            values = _read(layer.uv, "vector", (len(layer.uv), 2), np.float32)
            mesh.attributes.append(Attribute(index, DOMAIN_CORNER, values))
        if layer.active_render and mesh.attribute(scene.attribute_name(names.UV)) is None:
            values = mesh.attribute(index).values
            mesh.attributes.append(Attribute(scene.attribute_name(names.UV), DOMAIN_CORNER, values))
    for name, index in list(scene.attribute_names.items()):
        if mesh.attribute(index) is None:
            attribute = _find_attribute(mesh, data, name, index)
            if attribute is not None:
                mesh.attributes.append(attribute)


# What Attribute nodes may also ask for, whether or not the artist made an attribute of that name.
DERIVED = {
    "uv": names.UV,
    "vertex_color": names.COLOR,
    "tangent": names.tangent(),
    "pointiness": names.POINTINESS,
    "random_per_island": names.ISLAND,
    "generated": names.GENERATED,
}


@contextmanager
def readable(item, data, depsgraph):
    """The mesh `data` of an evaluated object as one that can be read: in edit mode it is empty, and is made anew."""
    if not data.is_editmode:
        yield data
        return
    try:
        yield item.to_mesh(preserve_all_data_layers=True, depsgraph=depsgraph)
    finally:
        item.to_mesh_clear()


def _find_attribute(mesh: Mesh, data, name: str, index: int) -> Attribute | None:
    found = _read_attribute(mesh, data, name, index)
    if found is None and name in DERIVED:
        found = _derived(mesh, data, DERIVED[name], index)
    return found


def _derived(mesh: Mesh, data, name: str, index: int) -> Attribute | None:
    if name == names.UV:
        existing = mesh.attribute(_UV)
        return existing and Attribute(index, existing.domain, existing.values)
    if name == names.GENERATED:
        existing = mesh.attribute(_GENERATED)
        if existing is not None:
            return Attribute(index, existing.domain, existing.values)
        return Attribute(index, DOMAIN_POINT, (mesh.vertices - mesh.generated_offset) * mesh.generated_scale)
    return _read_attribute(mesh, data, name, index)


def _read_attribute(mesh: Mesh, data, name: str, index: int) -> Attribute | None:
    uv_map = names.tangent_uv(name)
    if uv_map is not None:
        return _tangents(mesh, data, uv_map, index)
    if name == names.VERTEX_NORMAL:
        return Attribute(index, DOMAIN_POINT, _vertex_normals(data)) if mesh.normals is None else None
    if name == names.POINTINESS:
        return Attribute(index, DOMAIN_POINT, pointiness(mesh, _edges(data), _vertex_normals(data)))
    if name == names.ISLAND:
        return Attribute(index, DOMAIN_POINT, islands(len(mesh.vertices), _edges(data)))
    if name == names.COLOR:
        name = data.attributes.default_color_name or data.attributes.active_color_name
    found = data.attributes.get(name) if name and not name.startswith("\x00") else None
    if found is None or found.domain not in DOMAINS:
        return None
    values = read_values(found)
    return None if values is None else Attribute(index, DOMAINS[found.domain], values)


def read_values(attribute) -> np.ndarray | None:
    """All values of a bpy attribute as (n, components); colours are linear; None for types that Cycles leaves out.

    Of bytes, Cycles takes those of corners for Rec. 709 from Blender 5 on, all others for what the primaries are.
    """
    if attribute.data_type == "BYTE_COLOR":
        colors = _linear(byte_colors(attribute.data))
        matrix = from_rec709() if attribute.domain == "CORNER" and bpy.app.version >= (5, 0, 0) else None
        return colors if matrix is None else np.column_stack([colors[:, :3] @ matrix.T, colors[:, 3]])
    if attribute.data_type not in LAYOUTS:
        return None
    field, dtype, components = LAYOUTS[attribute.data_type]
    return _read(attribute.data, field, (len(attribute.data), components), dtype)


def _read(collection, field: str, shape: tuple[int, ...], dtype) -> np.ndarray:
    result = np.empty(shape, dtype)
    collection.foreach_get(field, result.reshape(-1))
    return result


def byte_colors(elements) -> np.ndarray:
    """The colours (n, 4) of an attribute of bytes as they lie in memory (sRGB, uint8), else as linear floats."""
    count = len(elements)
    if count == 0:
        return np.zeros((0, 4), np.float32)
    start = elements[0].as_pointer()
    if elements[count - 1].as_pointer() != start + 4 * (count - 1):
        return _read(elements, "color", (count, 4), np.float32)
    return np.ctypeslib.as_array(ctypes.cast(start, ctypes.POINTER(ctypes.c_uint8)), (count, 4))


def _linear(colors: np.ndarray) -> np.ndarray:
    """What `byte_colors` gives as linear floats: Blender would convert one by one."""
    if colors.dtype != np.uint8:
        return colors
    result = _SRGB[colors]
    result[:, 3] = colors[:, 3] * np.float32(1.0 / 255.0)
    return result


def _srgb_table() -> np.ndarray:
    encoded = np.arange(256) / 255.0
    return np.where(encoded < 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4).astype(np.float32)


_SRGB = _srgb_table()


# From 5.0 on Cycles knows normals of corners, and then shades flat faces by them too. Before, flat faces have the
# normals of their triangles unless the mesh has custom ones, and do not split the normals of their neighbours unless
# something else splits normals.
_CORNERS_RULE = bpy.app.version >= (5, 0)


def _read_normals(mesh: Mesh, data, n_corners: int) -> None:
    domain = data.normals_domain
    if domain == "FACE":
        return
    if domain == "CORNER" and (_CORNERS_RULE or data.has_custom_normals or _any(data, "sharp_edge", "EDGE")):
        mesh.normals = _read(data.corner_normals, "vector", (n_corners, 3), np.float32)
        mesh.normals_domain = DOMAIN_CORNER
        if _CORNERS_RULE or data.has_custom_normals:
            return
    else:
        mesh.normals = _vertex_normals(data)
        mesh.normals_domain = DOMAIN_POINT
    sharp = data.attributes.get("sharp_face")
    if sharp is not None and sharp.domain == "FACE":
        flat = _read(sharp.data, "value", (len(sharp.data),), bool)
        if flat.any():
            mesh.smooth = (~flat[mesh.polygons]).astype(np.uint8)


def _any(data, name: str, domain: str) -> bool:
    """Whether a boolean attribute is there and true anywhere."""
    found = data.attributes.get(name)
    if found is None or found.domain != domain or found.data_type != "BOOLEAN":
        return False
    return bool(_read(found.data, "value", (len(found.data),), bool).any())


def _vertex_normals(data) -> np.ndarray:
    return _read(data.vertex_normals, "vector", (len(data.vertices), 3), np.float32)


def _edges(data) -> np.ndarray:
    return _read(data.attributes[".edge_verts"].data, "value", (len(data.edges), 2), np.int32)


def _read_material_slots(mesh: Mesh, data) -> None:
    slots = data.attributes.get("material_index")
    if slots is not None and slots.domain == "FACE" and slots.data_type == "INT":
        values = _read(slots.data, "value", (len(slots.data),), np.int32)
        if values.any():
            mesh.material_slots = values[mesh.polygons]


def _read_texture_space(mesh: Mesh, data, deformed: bool) -> None:
    """generated = (p - offset) * scale is 0 … 1 over the texture space; a direction without extent is 0.5."""
    centre = np.array(data.texspace_location, np.float64)
    size = np.array(data.texspace_size, np.float64)
    scale = np.where(size != 0.0, 0.5 / np.where(size != 0.0, size, 1.0), 1e-12)
    mesh.generated_offset = tuple(centre - 0.5 / scale)
    mesh.generated_scale = tuple(scale)
    if not deformed:
        return
    original = _read(data.vertices, "undeformed_co", (len(data.vertices), 3), np.float32)
    extent = max(float(np.abs(size).max()), 1e-12)
    if not np.allclose(original, mesh.vertices, rtol=0.0, atol=1e-5 * extent, equal_nan=True):
        values = (original - np.array(mesh.generated_offset)) * scale
        mesh.attributes.append(Attribute(_GENERATED, DOMAIN_POINT, values))


_UV, _GENERATED = names.RESERVED.index(names.UV), names.RESERVED.index(names.GENERATED)


def _tangents(mesh: Mesh, data, uv_map: str, index: int) -> Attribute | None:
    layer = data.uv_layers.get(uv_map) if uv_map else next((x for x in data.uv_layers if x.active_render), None)
    if layer is None:
        if uv_map or len(data.uv_layers):
            return None
        return Attribute(index, DOMAIN_CORNER, tangents(mesh, _sphere_map(mesh, len(data.loops))))
    uv = _read(layer.uv, "vector", (len(layer.uv), 2), np.float32)
    return Attribute(index, DOMAIN_CORNER, tangents(mesh, uv))


def _sphere_map(mesh: Mesh, n_corners: int) -> np.ndarray:
    """(n_corners, 2) coordinates on a sphere around the origin, in place of a UV map, of the undeformed shape."""
    generated = mesh.attribute(_GENERATED)
    points = mesh.vertices.astype(np.float64)
    if generated is not None:
        points = generated.values / np.array(mesh.generated_scale) + np.array(mesh.generated_offset)
    x, y, z = points.T
    length = np.linalg.norm(points, axis=1)
    u = np.where((x == 0.0) & (y == 0.0), 0.0, 0.5 - np.arctan2(x, y) / (2.0 * np.pi))
    v = 1.0 - np.arccos(np.clip(z / np.where(length > 0.0, length, 1.0), -1.0, 1.0)) / np.pi
    at_vertices = np.where(length[:, None] > 0.0, np.stack([u, v], 1), 0.0)
    at_corners = at_vertices[mesh.triangles]
    if bpy.app.version >= (5, 0, 0):  # a triangle across the seam goes on beyond it
        wide = np.ptp(at_corners[..., 0], axis=1, keepdims=True) > 0.5
        at_corners[..., 0] += wide & (at_corners[..., 0] < 0.5)
    uv = np.zeros((n_corners, 2), np.float32)
    uv[mesh.corners.ravel()] = at_corners.reshape(-1, 2)
    return uv
