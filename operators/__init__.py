"""What a button does."""

import bpy

from . import cycles_settings, farm, maintenance, medium_presets

CLASSES = (
    cycles_settings.RESTIR_OT_settings_from_cycles,
    maintenance.RESTIR_OT_clear_kernel_cache,
    maintenance.RESTIR_OT_copy_diagnostics,
    medium_presets.RESTIR_OT_medium_preset,
)


def register() -> None:
    """Add the operators, and the handlers that run the first of them by itself."""
    for cls in CLASSES:
        if not cls.is_registered:
            bpy.utils.register_class(cls)
    cycles_settings.watch()
    farm.register()


def unregister() -> None:
    """Take them away."""
    farm.unregister()
    cycles_settings.unwatch()
    for cls in reversed(CLASSES):
        if cls.is_registered:
            bpy.utils.unregister_class(cls)
