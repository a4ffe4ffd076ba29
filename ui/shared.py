"""What panels share: when they show, how they are made from a row of a table, which of Blender's own show too."""

from __future__ import annotations

import bpy

from ..restir_engine.engine import RestirEngine

ENGINE = RestirEngine.bl_idname

# Panels that Blender shows for EEVEE only and that set what this engine reads as well.
EEVEE_PANELS = {
    "DATA_PT_EEVEE_light",
    "DATA_PT_camera_dof",
    "DATA_PT_camera_dof_aperture",
    "EEVEE_MATERIAL_PT_context_material",
    "EEVEE_MATERIAL_PT_displacement",
    "EEVEE_MATERIAL_PT_surface",
    "EEVEE_MATERIAL_PT_volume",
    "EEVEE_WORLD_PT_surface",
    "MATERIAL_PT_preview",
}
# Panels for all engines that offer what this engine does not have, or that a panel of ours replaces.
NOT_SHOWN = {
    "DATA_PT_light",
    "DATA_PT_falloff_curve",
    "MATERIAL_PT_context_material",
    "RENDER_PT_freestyle",
    "RENDER_PT_simplify",
    "RENDER_PT_simplify_greasepencil",
    "RENDER_PT_simplify_render",
    "RENDER_PT_simplify_viewport",
    "VIEWLAYER_PT_freestyle",
    "VIEWLAYER_PT_freestyle_edge_detection",
    "VIEWLAYER_PT_freestyle_lineset",
    "VIEWLAYER_PT_freestyle_linestyle",
    "VIEWLAYER_PT_freestyle_style_modules",
}


def blender_panels() -> list[type]:
    """Blender's own panels that show with this engine."""

    def wanted(panel: type) -> bool:
        engines = getattr(panel, "COMPAT_ENGINES", ())
        return panel.__name__ in EEVEE_PANELS or ("BLENDER_RENDER" in engines and panel.__name__ not in NOT_SHOWN)

    return [panel for panel in every_subclass(bpy.types.Panel) if wanted(panel)]


def every_subclass(cls: type) -> set[type]:
    """The subclasses of a class and theirs."""
    direct = set(cls.__subclasses__())
    return direct.union(*(every_subclass(sub) for sub in direct))


def set_compatible(compatible: bool) -> None:
    """Show Blender's own panels with this engine, or no longer."""
    for panel in every_subclass(bpy.types.Panel):
        if not compatible and hasattr(panel, "COMPAT_ENGINES"):
            panel.COMPAT_ENGINES.discard(ENGINE)
    if compatible:
        for panel in blender_panels():
            panel.COMPAT_ENGINES.add(ENGINE)


class RestirPanel:
    """A panel of the Properties editor that shows with this engine."""

    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "render"
    COMPAT_ENGINES = {ENGINE}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return context.engine in cls.COMPAT_ENGINES

    def column(self) -> bpy.types.UILayout:
        """A column of properties, their names on the left."""
        self.layout.use_property_split = True
        self.layout.use_property_decorate = False
        return self.layout.column()


def view_layer_list(layout, layer: bpy.types.ViewLayer, kind: str, ui_list: str) -> bpy.types.UILayout:
    """The list of a view layer's AOVs ("aov") or light groups ("lightgroup"); returns the column of its buttons."""
    row = layout.row()
    row.column().template_list(ui_list, f"{kind}s", layer, f"{kind}s", layer, f"active_{kind}_index", rows=3)
    buttons = row.column(align=True)
    buttons.operator(f"scene.view_layer_add_{kind}", icon="ADD", text="")
    buttons.operator(f"scene.view_layer_remove_{kind}", icon="REMOVE", text="")
    return buttons
