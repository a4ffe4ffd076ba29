"""What a button does."""

import bpy

from . import commands, cycles_settings, maintenance, medium_presets, merge_ranges

CLASSES = (
    cycles_settings.RESTIR_OT_settings_from_cycles,
    maintenance.RESTIR_OT_clear_kernel_cache,
    maintenance.RESTIR_OT_copy_diagnostics,
    medium_presets.RESTIR_OT_medium_preset,
    merge_ranges.RESTIR_OT_merge_ranges,
)


def register() -> None:
    """Add the operators, the handlers that run the first of them by itself, and the commands."""
    for cls in CLASSES:
        if not cls.is_registered:
            bpy.utils.register_class(cls)
    cycles_settings.watch()
    commands.register()


def unregister() -> None:
    """Take them away."""
    commands.unregister()
    cycles_settings.unwatch()
    for cls in reversed(CLASSES):
        if cls.is_registered:
            bpy.utils.unregister_class(cls)
