"""A medium from the table of presets into a material."""

from __future__ import annotations

import bpy
from bpy.props import EnumProperty

from ..restir_engine.presets import MEDIA


class RESTIR_OT_medium_preset(bpy.types.Operator):
    """Set the material's medium to a measured one, in real units by the unit scale of the scene"""

    bl_idname = "restir.medium_preset"
    bl_label = "Medium Preset"
    bl_options = {"REGISTER", "UNDO"}

    preset: EnumProperty(
        name="Medium",
        items=[(key, medium.name, medium.source) for key, medium in MEDIA.items()],
    )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        material = getattr(context, "material", None)
        return material is not None and material.is_editable

    def execute(self, context: bpy.types.Context) -> set[str]:
        medium, own = MEDIA[self.preset], context.material.restir
        unit = context.scene.unit_settings.scale_length  # metres
        own.use_medium = own.use_color = True
        own.color = medium.color
        own.mean_free_path = [length / unit for length in medium.mean_free_path]
        own.scale, own.anisotropy = 1.0, 0.0
        return {"FINISHED"}
