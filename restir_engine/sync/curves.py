"""Objects that are no meshes, as the meshes that they evaluate to."""

from contextlib import contextmanager

import bpy


@contextmanager
def mesh_of(item, data, depsgraph, warnings):
    """The evaluated bpy.types.Mesh of an evaluated object, valid inside the `with`; None where it has no surface.

    Blender lists curves, text and surfaces twice: as themselves, and, where they have faces, as an instance with a mesh
    of its own. So only metaballs have to be converted here.
    """
    if isinstance(data, bpy.types.Mesh):
        yield data
    elif item.type == "META":
        try:
            yield item.to_mesh(depsgraph=depsgraph)
        finally:
            item.to_mesh_clear()
    else:
        if item.type not in (
            "CURVE",
            "SURFACE",
            "FONT",
            "LATTICE",
            "ARMATURE",
            "EMPTY",
            "CAMERA",
            "SPEAKER",
            "LIGHT_PROBE",
        ):
            warnings.add("Object", item.name, f"{_KINDS.get(item.type, item.type.lower())} are not rendered")
        yield None


_KINDS = {"CURVES": "hair curves", "POINTCLOUD": "point clouds", "VOLUME": "volumes", "GREASEPENCIL": "grease pencils"}
