"""Panels: our own, and Blender's own made to show with this engine; the extension's preferences."""

import bpy

from . import bake_panels, data_panels, light_groups, material_panels, preferences, render_panels
from .shared import set_compatible

CLASSES = (
    *render_panels.CLASSES,
    *bake_panels.CLASSES,
    *material_panels.CLASSES,
    *data_panels.CLASSES,
    *light_groups.CLASSES,
)


def register() -> None:
    """Add the panels."""
    for cls in (*preferences.CLASSES, *CLASSES):
        if not cls.is_registered:
            bpy.utils.register_class(cls)
    set_compatible(True)
    preferences.begin()


def unregister() -> None:
    """Take them away."""
    preferences.end()
    set_compatible(False)
    for cls in reversed((*preferences.CLASSES, *CLASSES)):
        if cls.is_registered:
            bpy.utils.unregister_class(cls)
