"""The panel of a material's light below the surface."""

from __future__ import annotations

import bpy

from .shared import RestirPanel


class MaterialPanel(RestirPanel):
    """A panel of the Material tab."""

    bl_context = "material"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return super().poll(context) and context.material is not None and not context.material.grease_pencil


class RESTIR_MATERIAL_PT_subsurface(MaterialPanel, bpy.types.Panel):
    """How light scatters below the surface"""

    bl_label = "Subsurface"

    def draw(self, context: bpy.types.Context) -> None:
        column = self.column()
        column.prop(context.material.restir, "entry")
        column.prop(context.material.restir, "scatter_inside")


class RESTIR_MATERIAL_PT_medium(MaterialPanel, bpy.types.Panel):
    """The medium below the surface, in place of what the nodes say"""

    bl_label = "Medium"
    bl_parent_id = "RESTIR_MATERIAL_PT_subsurface"

    def draw_header(self, context: bpy.types.Context) -> None:
        self.layout.prop(context.material.restir, "use_medium", text="")

    def draw(self, context: bpy.types.Context) -> None:
        own, column = context.material.restir, self.column()
        column.operator_menu_enum("restir.medium_preset", "preset", text="Preset")
        column = column.column()
        column.active = own.use_medium
        column.prop(own, "use_color")
        color = column.column()
        color.active = own.use_color
        color.prop(own, "color")
        lengths = column.column(align=True)
        for index, channel in enumerate(("Mean Free Path Red", "Green", "Blue")):
            lengths.prop(own, "mean_free_path", index=index, text=channel)
        column.prop(own, "scale")
        column.prop(own, "anisotropy", slider=True)


CLASSES = (RESTIR_MATERIAL_PT_subsurface, RESTIR_MATERIAL_PT_medium)
