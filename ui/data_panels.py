"""Panels of the Object, Light and World tabs, where Blender has none of its own that fits."""

from __future__ import annotations

import bpy

from .shared import RestirPanel


class RESTIR_OBJECT_PT_ray_visibility(RestirPanel, bpy.types.Panel):
    """Which rays see the object"""

    bl_label = "Ray Visibility"
    bl_context = "object"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        kinds = {"MESH", "CURVE", "SURFACE", "FONT", "META", "CURVES", "POINTCLOUD", "LIGHT"}
        return super().poll(context) and context.object is not None and context.object.type in kinds

    def draw(self, context: bpy.types.Context) -> None:
        column, item = self.column(), context.object
        for name in ("camera", "diffuse", "glossy", "transmission"):
            column.prop(item, f"visible_{name}", text=name.title())
        if item.type != "LIGHT":
            column.prop(item, "visible_shadow", text="Shadow")


class RESTIR_LIGHT_PT_beam(RestirPanel, bpy.types.Panel):
    """Where an area light shines; a spot has Blender's own panel"""

    bl_label = "Beam Shape"
    bl_context = "data"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return super().poll(context) and context.light is not None and context.light.type == "AREA"

    def draw(self, context: bpy.types.Context) -> None:
        self.column().prop(context.light, "spread")


class RESTIR_LIGHT_PT_settings(RestirPanel, bpy.types.Panel):
    """How the light is used"""

    bl_label = "Settings"
    bl_context = "data"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return super().poll(context) and context.light is not None

    def draw(self, context: bpy.types.Context) -> None:
        self.column().prop(context.light, "use_shadow", text="Cast Shadow")


class RESTIR_LIGHT_PT_nodes(RestirPanel, bpy.types.Panel):
    """The node tree of the light"""

    bl_label = "Nodes"
    bl_context = "data"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return super().poll(context) and context.light is not None

    def draw(self, context: bpy.types.Context) -> None:
        light, layout = context.light, self.layout
        layout.use_property_split = True
        if not light.use_nodes:
            layout.prop(light, "use_nodes", icon="NODETREE")
            return
        output = light.node_tree.get_output_node("CYCLES")
        if output is None:
            layout.label(text="No output node")
            return
        layout.template_node_view(light.node_tree, output, output.inputs["Surface"])


CLASSES = (
    RESTIR_OBJECT_PT_ray_visibility,
    RESTIR_LIGHT_PT_beam,
    RESTIR_LIGHT_PT_settings,
    RESTIR_LIGHT_PT_nodes,
)
