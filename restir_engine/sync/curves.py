"""Objects whose data is no mesh.

Blender lists curves, text, surfaces and metaballs twice: as themselves, and, where they have faces, as an instance with
a mesh of its own. What is left has no triangles.
"""

NOT_RENDERED = {
    "CURVES": "hair curves",
    "POINTCLOUD": "point clouds",
    "VOLUME": "volumes",
    "GREASEPENCIL": "grease pencil strokes",
}


def note_unsupported(item, warnings) -> None:
    """Warn of an object that the artist would expect to see."""
    kind = NOT_RENDERED.get(item.type)
    if kind is not None:
        warnings.add("Object", item.name, f"{kind} are not rendered; convert them to a mesh to see them")
