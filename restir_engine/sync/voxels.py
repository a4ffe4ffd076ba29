"""The voxels of a grid of a Volume datablock as an array.

By the `openvdb` module where Blender brings it; else by Blender's own nodes: the grids are saved to a temporary file,
which a Volume of our own shows, and geometry nodes on a helper object make a point a voxel with its value, which is
read as a whole. Nothing of that is left behind.
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager

import bpy
import numpy as np

try:
    import openvdb
except ImportError:
    openvdb = None

# Types of grids that are read: that of the nodes' sockets, that of the attribute, its field and components.
KINDS = {
    **dict.fromkeys(("FLOAT", "DOUBLE"), ("FLOAT", "FLOAT", "value", 1)),
    **dict.fromkeys(("INT", "INT64"), ("INT", "FLOAT", "value", 1)),
    **dict.fromkeys(("BOOLEAN", "MASK"), ("BOOLEAN", "FLOAT", "value", 1)),
    **dict.fromkeys(("VECTOR_FLOAT", "VECTOR_DOUBLE", "VECTOR_INT"), ("VECTOR", "FLOAT_VECTOR", "vector", 3)),
}

MOST_VOXELS = 1 << 29  # of a box: more than that is not read


class Unreadable(Exception):
    """A grid that cannot be read, in a sentence's end: "its voxels are …"."""


def read_voxels(path: str, grid: bpy.types.VolumeGrid, low: np.ndarray, shape: np.ndarray) -> np.ndarray:
    """The values of a grid of the file at `path`, float32 (*shape, components), from the index `low` on.

    Raises Unreadable.
    """
    if grid.data_type not in KINDS:
        raise Unreadable(f"its voxels are of a type that is not rendered ({grid.data_type.lower()})")
    if np.prod(shape, dtype=np.float64) > MOST_VOXELS:
        raise Unreadable(f"its box has more than {MOST_VOXELS >> 20} million voxels")
    components = KINDS[grid.data_type][3]
    if openvdb is not None:
        values = np.empty(tuple(shape) + ((components,) if components > 1 else ()), np.float32)
        openvdb.read(path, grid.name).copyToArray(values, ijk=tuple(int(x) for x in low))
        return values.reshape(*shape, components)
    return _by_nodes(path, grid, low, shape)


@contextmanager
def saved(volume: bpy.types.Volume) -> Iterator[str]:
    """A path at which the grids of an evaluated Volume are found as a file while the context lasts."""
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "grids.vdb")
        if not volume.grids.save(filepath=path):
            raise Unreadable("its grids cannot be saved")
        yield path


def _by_nodes(path: str, grid: bpy.types.VolumeGrid, low: np.ndarray, shape: np.ndarray) -> np.ndarray:
    made: list[tuple] = []

    def new(owner, *arguments):
        made.append((owner, owner.new("restir voxels", *arguments)))
        return made[-1][1]

    try:
        volume = new(bpy.data.volumes)
        volume.filepath = path
        source = new(bpy.data.objects, volume)
        tree = new(bpy.data.node_groups, "GeometryNodeTree")
        _build(tree, grid, source, low, shape)
        helper = new(bpy.data.objects, new(bpy.data.meshes))
        helper.modifiers.new("voxels", "NODES").node_group = tree
        scene = new(bpy.data.scenes)
        scene.collection.objects.link(helper)
        layer = scene.view_layers[0]
        layer.update()
        geometry = helper.evaluated_get(layer.depsgraph).evaluated_geometry()
        _, _, field, components = KINDS[grid.data_type]
        values = np.empty(int(np.prod(shape)) * components, np.float32)
        attribute = geometry.pointcloud.attributes.get("v") if geometry.pointcloud else None
        if attribute is None or len(attribute.data) * components != len(values):
            raise Unreadable("its voxels cannot be read")
        attribute.data.foreach_get(field, values)
        return values.reshape(*shape, components)
    finally:
        for owner, item in reversed(made):
            owner.remove(item)


def _build(tree, grid: bpy.types.VolumeGrid, source: bpy.types.Object, low: np.ndarray, shape: np.ndarray) -> None:
    """Nodes whose points, one a voxel of the box in C order, have the grid's values as attribute "v"."""
    kind, stored, _, _ = KINDS[grid.data_type]
    tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    node, link = tree.nodes.new, tree.links.new

    def whole(operation: str, a, b: int):
        result = node("FunctionNodeIntegerMath")  # floats are exact to 2²⁴ only
        result.operation = operation
        link(a, result.inputs[0])
        result.inputs[1].default_value = int(b)
        return result.outputs[0]

    info, named = node("GeometryNodeObjectInfo"), node("GeometryNodeGetNamedGrid")
    sample, points = node("GeometryNodeSampleGridIndex"), node("GeometryNodePoints")
    store, output = node("GeometryNodeStoreNamedAttribute"), node("NodeGroupOutput")
    named.data_type = sample.data_type = kind
    store.data_type = stored
    info.inputs["Object"].default_value = source
    named.inputs["Name"].default_value = grid.name
    points.inputs["Count"].default_value = int(np.prod(shape))
    store.inputs["Name"].default_value = "v"
    index = node("GeometryNodeInputIndex").outputs[0]
    row = whole("DIVIDE", index, shape[2])
    places = (whole("DIVIDE", row, shape[1]), whole("MODULO", row, shape[1]), whole("MODULO", index, shape[2]))
    link(info.outputs["Geometry"], named.inputs[0])
    link(_enabled(named.outputs, "Grid"), _enabled(sample.inputs, "Grid"))
    for axis, place, start in zip("XYZ", places, low, strict=True):
        link(whole("ADD", place, start), sample.inputs[axis])
    link(points.outputs[0], store.inputs[0])
    link(_enabled(sample.outputs, "Value"), _enabled(store.inputs, "Value"))
    link(store.outputs[0], output.inputs[0])


def _enabled(sockets, name: str):
    return next(socket for socket in sockets if socket.name == name and socket.enabled)
