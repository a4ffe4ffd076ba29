"""Panels of the object, data, material and world tabs, where Blender has none of its own that fits.

Settings that Cycles keeps in its own property groups (emission sampling, bounces of a light, ray visibility of the
world) are read by this engine too: they show while the Cycles add-on is enabled, as it is by default.
"""

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
        column.prop(item, "visible_volume_scatter", text="Volume Scatter")
        if item.type != "LIGHT":
            column.prop(item, "visible_shadow", text="Shadow")


class RESTIR_OBJECT_PT_motion_blur(RestirPanel, bpy.types.Panel):
    """How the object is blurred where it moves"""

    bl_label = "Motion Blur"
    bl_context = "object"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        kinds = {"MESH", "CURVE", "SURFACE", "FONT", "META", "CURVES", "POINTCLOUD", "CAMERA", "EMPTY"}
        shown = super().poll(context) and context.object is not None and context.object.type in kinds
        return shown and hasattr(context.object, "cycles")

    def draw_header(self, context: bpy.types.Context) -> None:
        self.layout.active = context.scene.render.use_motion_blur
        self.layout.prop(context.object.cycles, "use_motion_blur", text="")

    def draw(self, context: bpy.types.Context) -> None:
        column, settings = self.column(), context.object.cycles
        column.active = context.scene.render.use_motion_blur and settings.use_motion_blur
        column.prop(settings, "motion_steps", text="Steps")
        if context.object.type != "CAMERA":
            column.prop(settings, "use_deform_motion", text="Deformation")


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
        column, cycles = self.column(), getattr(context.light, "cycles", None)
        column.prop(context.light, "use_shadow", text="Cast Shadow")
        if cycles is not None:
            column.prop(cycles, "max_bounces")
            column.prop(cycles, "use_multiple_importance_sampling", text="Multiple Importance")


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
        if bpy.app.version < (5, 0, 0) and not light.use_nodes:
            layout.prop(light, "use_nodes", icon="NODETREE")
            return
        output = light.node_tree.get_output_node("CYCLES")
        if output is None:
            layout.label(text="No output node")
            return
        layout.template_node_view(light.node_tree, output, output.inputs["Surface"])


class RESTIR_CAMERA_PT_panorama(RestirPanel, bpy.types.Panel):
    """What part of the surroundings a panorama shows"""

    bl_label = "Panorama"
    bl_context = "data"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return super().poll(context) and context.camera is not None and context.camera.type == "PANO"

    def draw(self, context: bpy.types.Context) -> None:
        column, camera = self.column(), context.camera
        for angle in ("latitude", "longitude"):
            limits = column.column(align=True)
            limits.prop(camera, f"{angle}_min", text=f"{angle.title()} Min")
            limits.prop(camera, f"{angle}_max", text="Max")


class RESTIR_MATERIAL_PT_settings(RestirPanel, bpy.types.Panel):
    """How the material is used"""

    bl_label = "Settings"
    bl_context = "material"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return super().poll(context) and context.material is not None and not context.material.grease_pencil

    def draw(self, context: bpy.types.Context) -> None:
        column, material = self.column(), context.material
        column.prop(material, "pass_index")
        if hasattr(material, "cycles"):
            column.prop(material.cycles, "emission_sampling")
        column.prop(material, "use_transparent_shadow")
        column.prop(material.restir, "medium_priority")


class RESTIR_WORLD_PT_ray_visibility(RestirPanel, bpy.types.Panel):
    """Which rays see the world"""

    bl_label = "Ray Visibility"
    bl_context = "world"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return super().poll(context) and hasattr(context.world, "cycles_visibility")

    def draw(self, context: bpy.types.Context) -> None:
        column = self.column()
        for name in ("camera", "diffuse", "glossy", "transmission"):
            column.prop(context.world.cycles_visibility, name)
        column.prop(context.world.cycles_visibility, "scatter", text="Volume Scatter")


class RESTIR_WORLD_PT_mist(RestirPanel, bpy.types.Panel):
    """Where the pass Mist begins and ends"""

    bl_label = "Mist Pass"
    bl_context = "world"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        wanted = any(layer.use_pass_mist for layer in context.scene.view_layers)
        return super().poll(context) and context.world is not None and wanted

    def draw(self, context: bpy.types.Context) -> None:
        column, mist = self.column(), context.world.mist_settings
        for name in ("start", "depth", "falloff"):
            column.prop(mist, name)


class RESTIR_WORLD_PT_settings(RestirPanel, bpy.types.Panel):
    """How light from the world is sampled"""

    bl_label = "Settings"
    bl_context = "world"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return super().poll(context) and hasattr(context.world, "cycles")

    def draw(self, context: bpy.types.Context) -> None:
        column, cycles = self.column(), context.world.cycles
        column.prop(cycles, "sampling_method", text="Sampling")
        resolution = column.column()
        resolution.active = cycles.sampling_method == "MANUAL"
        resolution.prop(cycles, "sample_map_resolution")
        column.prop(cycles, "max_bounces")


CLASSES = (
    RESTIR_OBJECT_PT_ray_visibility,
    RESTIR_OBJECT_PT_motion_blur,
    RESTIR_LIGHT_PT_beam,
    RESTIR_LIGHT_PT_settings,
    RESTIR_LIGHT_PT_nodes,
    RESTIR_CAMERA_PT_panorama,
    RESTIR_MATERIAL_PT_settings,
    RESTIR_WORLD_PT_ray_visibility,
    RESTIR_WORLD_PT_mist,
    RESTIR_WORLD_PT_settings,
)
