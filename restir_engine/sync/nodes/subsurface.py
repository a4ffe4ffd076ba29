"""What the running Blender's Cycles, and the material, make of a node's subsurface scattering."""

from __future__ import annotations

import bpy

from ...kernels import records as rec

# From 5.2 on Random Walk takes a radius as the mean free path and light may scatter backwards; what Random Walk was
# before has a name of its own.
_HAS_LEGACY = bpy.app.version >= (5, 2, 0)
_METHODS = ("subsurface_method", "falloff")


def choice(c, node, attribute: str) -> str:
    """The identifier of an immediate: a choice of the node, of the material, or one that Blender's version decides."""
    if attribute == "entry":
        return c.entry
    if attribute == "sign":
        return "ANY" if _HAS_LEGACY else "POSITIVE"
    value = getattr(node, attribute)
    if attribute in _METHODS and value == "RANDOM_WALK" and not _HAS_LEGACY:
        return "RANDOM_WALK_LEGACY"
    return value


def note_subsurface(c, node, weight: int | None) -> None:
    """Set the material's flags where a node scatters below the surface; `weight` is the register of its share."""
    if weight is not None and c.constant_value(weight) == (0.0,):
        return
    c.flags |= rec.MATERIAL_SUBSURFACE
    if c.is_linked(node, "Normal"):
        c.flags |= rec.MATERIAL_BUMPED_EXIT
