"""Light groups: the list of a view layer, and which of them an object or the world belongs to."""

from __future__ import annotations

import bpy

from .shared import RestirPanel, view_layer_list

_PLACED = {"MESH", "CURVE", "SURFACE", "FONT", "META", "CURVES", "POINTCLOUD", "VOLUME", "LIGHT", "EMPTY"}


class RESTIR_VIEWLAYER_PT_light_groups(RestirPanel, bpy.types.Panel):
    """Passes of the light that began at the members of a group"""

    bl_label = "Light Groups"
    bl_context = "view_layer"
    bl_parent_id = "RESTIR_VIEWLAYER_PT_passes"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        buttons = view_layer_list(self.layout, context.view_layer, "lightgroup", "UI_UL_list")
        buttons.menu("VIEWLAYER_MT_lightgroup_sync", icon="DOWNARROW_HLT", text="")


class RESTIR_OBJECT_PT_light_group(RestirPanel, bpy.types.Panel):
    """The group that the light of the object belongs to, or of its instances where these have none"""

    bl_label = "Light Group"
    bl_context = "object"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return super().poll(context) and context.object is not None and context.object.type in _PLACED

    def draw(self, context: bpy.types.Context) -> None:
        _choose(self.column(), context.object, context.view_layer)


class RESTIR_WORLD_PT_light_group(RestirPanel, bpy.types.Panel):
    """The group that the light of the world belongs to"""

    bl_label = "Light Group"
    bl_context = "world"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return super().poll(context) and context.world is not None

    def draw(self, context: bpy.types.Context) -> None:
        _choose(self.column(), context.world, context.view_layer)


def _choose(column, owner, layer: bpy.types.ViewLayer) -> None:
    """The light group of a datablock, one of the view layer's or any other name."""
    column.prop_search(owner, "lightgroup", layer, "lightgroups", text="Light Group", results_are_suggestions=True)


CLASSES = (RESTIR_VIEWLAYER_PT_light_groups, RESTIR_OBJECT_PT_light_group, RESTIR_WORLD_PT_light_group)
