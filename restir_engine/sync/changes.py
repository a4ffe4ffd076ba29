"""What a depsgraph says has been changed, in terms of what we keep."""

from __future__ import annotations

from typing import NamedTuple

import bpy

# Datablocks whose programs are compiled from them alone.
_COMPILED = (bpy.types.Material, bpy.types.World, bpy.types.Light)


class Changes(NamedTuple):
    """`session_uid`s of the datablocks that were named since the last time.

    shapes: objects and their data whose geometry was evaluated anew. shaders: materials, worlds, lights. places:
    objects that were moved. images: whose pixels or settings have changed. shared: whether something has that any
    program may have been compiled from, as node groups. unnamed: whether programs have changed by something that is
    not named: an image that was loaded again, or one of a sequence at another frame.
    """

    shapes: frozenset[int]
    shaders: frozenset[int]
    places: frozenset[int]
    images: frozenset[int]
    shared: bool
    unnamed: bool


def changes(depsgraph: bpy.types.Depsgraph) -> Changes:
    """What `depsgraph.updates` names. What is changed without being named there has to be read to be noticed."""
    shapes, shaders, places, images = set(), set(), set(), set()
    shared, trees = False, False
    for update in depsgraph.updates:
        item = update.id.original
        uid = item.session_uid
        if update.is_updated_geometry:
            shapes.add(uid)
        if isinstance(item, _COMPILED):
            shaders.add(uid)
        elif isinstance(item, bpy.types.Image):
            images.add(uid)
        elif isinstance(item, bpy.types.NodeTree):
            # The tree of a material is a part of it, which is named as well.
            trees = True
            shared |= not item.is_embedded_data
        elif isinstance(item, bpy.types.Object) and update.is_updated_transform:
            places.add(uid)
    unnamed = depsgraph.id_type_updated("NODETREE") and not trees
    return Changes(*map(frozenset, (shapes, shaders, places, images)), shared, unnamed)
