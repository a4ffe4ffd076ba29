"""The Bake panel: Blender's own settings of bakes, and which kind of them this engine renders."""

from __future__ import annotations

import bpy

from ..restir_engine.baking import HALVES, LOBES
from .shared import RestirPanel

# The kinds that are parts of light, and which parts the artist chooses among.
PARTS = {
    "COMBINED": {"Lighting": HALVES, "Contributions": (*LOBES, "EMIT")},
    **{lobe: {"Contributions": (*HALVES, "COLOR")} for lobe in LOBES},
}


class RESTIR_RENDER_PT_bake(RestirPanel, bpy.types.Panel):
    """What surfaces look like, or are made of, into images or color attributes"""

    bl_label = "Bake"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        own, column = context.scene.restir, self.column()
        column.operator("object.bake", icon="RENDER_STILL").type = own.bake_type
        column.prop(own, "bake_type")
        column.prop(context.scene.render.bake, "view_from")


class _BakePart(RestirPanel):
    """A panel below that."""

    bl_parent_id = "RESTIR_RENDER_PT_bake"


class RESTIR_RENDER_PT_bake_influence(_BakePart, bpy.types.Panel):
    """Which light counts, or how normals become colors"""

    bl_label = "Influence"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return super().poll(context) and context.scene.restir.bake_type in {"NORMAL", *PARTS}

    def draw(self, context: bpy.types.Context) -> None:
        bake, column, kind = context.scene.render.bake, self.column(), context.scene.restir.bake_type
        if kind == "NORMAL":
            column.prop(bake, "normal_space", text="Space")
            swizzle = column.column(align=True)
            for name in "rgb":
                swizzle.prop(bake, f"normal_{name}", text="Swizzle R" if name == "r" else name.upper())
            return
        for title, parts in PARTS[kind].items():
            group = column.column(heading=title, align=True)
            for part in parts:
                group.prop(bake, f"use_pass_{part.lower()}")


class RESTIR_RENDER_PT_bake_selected_to_active(_BakePart, bpy.types.Panel):
    """Surfaces of the selected objects, as the active one sees them"""

    bl_label = "Selected to Active"
    bl_options = {"DEFAULT_CLOSED"}

    def draw_header(self, context: bpy.types.Context) -> None:
        self.layout.prop(context.scene.render.bake, "use_selected_to_active", text="")

    def draw(self, context: bpy.types.Context) -> None:
        bake, column = context.scene.render.bake, self.column()
        column.active = bake.use_selected_to_active
        column.prop(bake, "use_cage", text="Cage")
        if bake.use_cage:
            column.prop(bake, "cage_object")
        distances = column.column()
        distances.prop(bake, "cage_extrusion", text="Extrusion")
        if not bake.use_cage:
            distances.prop(bake, "max_ray_distance")


class RESTIR_RENDER_PT_bake_output(_BakePart, bpy.types.Panel):
    """Where the result goes"""

    bl_label = "Output"

    def draw(self, context: bpy.types.Context) -> None:
        bake, column = context.scene.render.bake, self.column()
        column.prop(bake, "target")
        if bake.target == "IMAGE_TEXTURES":
            column.prop(bake, "use_clear", text="Clear Image")


class RESTIR_RENDER_PT_bake_margin(_BakePart, bpy.types.Panel):
    """What lies beside the surface in the image, so that filters find no seams"""

    bl_label = "Margin"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return super().poll(context) and context.scene.render.bake.target == "IMAGE_TEXTURES"

    def draw(self, context: bpy.types.Context) -> None:
        bake, column = context.scene.render.bake, self.column()
        column.prop(bake, "margin_type", text="Type")
        column.prop(bake, "margin", text="Size")


CLASSES = (
    RESTIR_RENDER_PT_bake,
    RESTIR_RENDER_PT_bake_influence,
    RESTIR_RENDER_PT_bake_selected_to_active,
    RESTIR_RENDER_PT_bake_output,
    RESTIR_RENDER_PT_bake_margin,
)
