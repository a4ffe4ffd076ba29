"""Panels of the Render, Output and View Layer tabs."""

from __future__ import annotations

import textwrap

import bpy

from ..restir_engine import denoise, warning_log
from ..restir_engine.reuse_settings import OPTIONS
from ..restir_engine.scene.cryptomatte import KINDS
from ..restir_engine.settings import PASSES, carries_visibility, resampled_shift, resamples_below
from .shared import RestirPanel, view_layer_list


class RESTIR_RENDER_PT_sampling(RestirPanel, bpy.types.Panel):
    """How many paths, and from which random numbers"""

    bl_label = "Sampling"

    def draw(self, context: bpy.types.Context) -> None:
        own, column = context.scene.restir, self.column()
        column.prop(own, "integrator")
        column.prop(own, "samples")
        column.prop(own, "preview_samples")
        column.prop(own, "time_limit")
        row = column.row(align=True)
        row.prop(own, "seed")
        row.prop(own, "use_animated_seed", text="", icon="TIME")
        column.separator()
        column.operator("restir.settings_from_cycles", icon="IMPORT")


class RESTIR_RENDER_PT_adaptive(RestirPanel, bpy.types.Panel):
    """Stopping where the picture is smooth enough"""

    bl_label = "Noise Threshold"
    bl_parent_id = "RESTIR_RENDER_PT_sampling"

    def draw_header(self, context: bpy.types.Context) -> None:
        self.layout.prop(context.scene.restir, "use_adaptive_sampling", text="")

    def draw(self, context: bpy.types.Context) -> None:
        own, column = context.scene.restir, self.column()
        column.active = own.use_adaptive_sampling
        column.prop(own, "adaptive_threshold", text="Threshold")
        column.prop(own, "adaptive_min_samples")


class RESTIR_RENDER_PT_denoising(RestirPanel, bpy.types.Panel):
    """Removing what noise remains"""

    bl_label = "Denoise"
    bl_parent_id = "RESTIR_RENDER_PT_sampling"

    def draw_header(self, context: bpy.types.Context) -> None:
        self.layout.active = denoise.find_library() is not None
        self.layout.prop(context.scene.restir, "use_denoising", text="")

    def draw(self, context: bpy.types.Context) -> None:
        column = self.column()
        available = denoise.find_library() is not None
        if not available:
            draw_sentence(column, context, "This Blender was built without Open Image Denoise", "INFO")
        quality = column.column()
        quality.active = available and context.scene.restir.use_denoising
        quality.prop(context.scene.restir, "denoising_quality")
        preview = column.column()
        preview.active = available
        preview.prop(context.scene.restir, "use_preview_denoising")


class RESTIR_RENDER_PT_sample_range(RestirPanel, bpy.types.Panel):
    """Some of the samples alone, to be merged with those that other machines render"""

    bl_label = "Sample Range"
    bl_parent_id = "RESTIR_RENDER_PT_sampling"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        column = self.column()
        column.prop(context.scene.restir, "sample_offset", text="Offset")
        column.prop(context.scene.restir, "sample_subset", text="Subset")
        column.operator("restir.merge_ranges", icon="IMAGE_DATA")


class RESTIR_RENDER_PT_resampling(RestirPanel, bpy.types.Panel):
    """Light samples of the integrator ReSTIR. What is for comparisons is at scene.restir.reuse for scripts"""

    bl_label = "Resampling"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        own, column = context.scene.restir, self.column()
        column.active = own.integrator == "RESTIR"
        for name, option in OPTIONS.items():
            if option.panel:
                column.prop(own.reuse, name)


class RESTIR_RENDER_PT_light_paths(RestirPanel, bpy.types.Panel):
    """Which light paths are traced"""

    bl_label = "Light Paths"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        own, column = context.scene.restir, self.column()
        column.prop(own, "max_bounces", text="Max Bounces")
        bounces = column.column(align=True)
        for name in ("diffuse", "glossy", "transmission", "volume", "transparent"):
            bounces.prop(own, f"{name}_bounces")
        column.prop(own, "min_bounces", text="Min Bounces")
        clamps = column.column(align=True)
        clamps.prop(own, "clamp_direct", text="Clamp Direct")
        clamps.prop(own, "clamp_indirect", text="Indirect")
        column.prop(own, "filter_glossy")
        caustics = column.column(heading="Caustics", align=True)
        caustics.prop(own, "caustics_reflective", text="Reflective")
        caustics.prop(own, "caustics_refractive", text="Refractive")


class RESTIR_RENDER_PT_subsurface(RestirPanel, bpy.types.Panel):
    """Light that scatters below surfaces"""

    bl_label = "Subsurface"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        own, column = context.scene.restir, self.column()
        column.prop(own, "sss_method")
        column.prop(own, "preview_sss_method")
        hybrid = column.column()
        hybrid.active = "HYBRID" in (own.sss_method, own.preview_sss_method)
        hybrid.prop(own, "sss_irradiance_cache")
        reuse = column.column()
        reuse.active = own.integrator == "RESTIR"
        reuse.prop(own, "sss_walks")
        reuse.prop(own, "sss_shift")
        in_time = reuse.column()
        in_time.active = own.sss_shift not in ("NONE", "BLOCKS")
        in_time.prop(own, "sss_temporal")
        crossing = reuse.column()
        crossing.active = hybrid.active and not own.sss_irradiance_cache
        crossing.prop(own, "sss_refraction")
        samples = crossing.column()
        samples.active = own.sss_refraction != "NONE"
        samples.prop(own, "sss_refraction_samples")
        several = reuse.column()
        several.active = resampled_shift(own) != "NONE" or (crossing.active and samples.active)
        several.prop(own, "sss_neighbours")
        column.prop(own, "cycles_burley_kernel")
        column.prop(own, "sss_after_diffuse")


class RESTIR_RENDER_PT_film(RestirPanel, bpy.types.Panel):
    """From light to pixels"""

    bl_label = "Film"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        own, column = context.scene.restir, self.column()
        column.prop(own, "film_exposure")
        column.prop(own, "pixel_filter")
        width = column.column()
        width.active = own.pixel_filter != "BOX"
        width.prop(own, "filter_width")
        column.prop(context.scene.render, "film_transparent", text="Transparent")


class RESTIR_RENDER_PT_simplify(RestirPanel, bpy.types.Panel):
    """Less detail for all objects; Blender's own panel would stand above all of ours"""

    bl_label = "Simplify"
    bl_options = {"DEFAULT_CLOSED"}

    def draw_header(self, context: bpy.types.Context) -> None:
        self.layout.prop(context.scene.render, "use_simplify", text="")

    def draw(self, context: bpy.types.Context) -> None:
        render, column = context.scene.render, self.column()
        column.active = render.use_simplify
        for title, suffix in (("Viewport", ""), ("Render", "_render")):
            column.label(text=title)
            column.prop(render, f"simplify_subdivision{suffix}", text="Max Subdivision")
            column.prop(render, f"simplify_child_particles{suffix}", text="Max Child Particles")


class RESTIR_RENDER_PT_performance(RestirPanel, bpy.types.Panel):
    """Use of the machine"""

    bl_label = "Performance"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        column = self.column()
        column.prop(context.scene.restir, "threads")
        column.prop(context.scene.render, "preview_pixel_size", text="Pixel Size")
        column.operator("restir.clear_kernel_cache", icon="TRASH")
        column.operator("restir.copy_diagnostics", icon="COPYDOWN")


class RESTIR_RENDER_PT_warnings(RestirPanel, bpy.types.Panel):
    """What the last render could not show as it is meant"""

    bl_label = "Warnings"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return super().poll(context) and bool(warning_log.lines(context.scene.name))

    def draw(self, context: bpy.types.Context) -> None:
        for line in warning_log.lines(context.scene.name):
            draw_sentence(self.layout.column(align=True), context, line, "ERROR")


def draw_sentence(column: bpy.types.UILayout, context: bpy.types.Context, text: str, icon: str) -> None:
    """A sentence on as many lines as the width of the editor asks for, the icon before the first."""
    width = max(24, int(context.region.width / (8.0 * context.preferences.system.ui_scale)))
    for i, line in enumerate(textwrap.wrap(text, width)):
        column.label(text=line, icon=icon if i == 0 else "BLANK1")


class RESTIR_VIEWLAYER_PT_passes(RestirPanel, bpy.types.Panel):
    """Render passes of this view layer"""

    bl_label = "Passes"
    bl_context = "view_layer"

    def draw(self, context: bpy.types.Context) -> None:
        column, layer = self.column(), context.view_layer
        column.prop(layer, "pass_alpha_threshold")
        for title, names in pass_groups().items():
            group = column.column(heading=title, align=True)
            for prop, name in names:
                group.prop(layer, prop, text=name)
        column.prop(layer.restir, "use_pass_volume")
        column.prop(layer.restir, "use_pass_subsurface")
        column.prop(layer.restir, "use_pass_shadow_catcher")
        column.prop(layer.restir, "use_pass_denoising")
        column.prop(layer.restir, "use_pass_sample_count")
        reuse = column.column()
        reuse.active = resamples_below(context.scene.restir)
        reuse.prop(layer.restir, "use_pass_subsurface_reuse")
        visibility = column.column()
        visibility.active = carries_visibility(context.scene.restir)
        visibility.prop(layer.restir, "use_pass_visibility")


def pass_groups() -> dict[str, list[tuple[str, str]]]:
    """The pass table for the panel: heading → (view layer property, label). Combined is always rendered."""
    groups: dict[str, list[tuple[str, str]]] = {
        "Data": [],
        "Diffuse": [],
        "Glossy": [],
        "Transmission": [],
        "Light": [],
    }
    for item in PASSES:
        lobe, _, half = item.name.partition(" ")
        if not item.view_layer or item.name == "Combined" or item.slots:
            continue
        if lobe in groups:
            groups[lobe].append((item.view_layer, half))
        else:
            groups["Light" if item.kind == "COLOR" else "Data"].append((item.view_layer, item.name))
    return groups


class RESTIR_VIEWLAYER_PT_cryptomatte(RestirPanel, bpy.types.Panel):
    """Masks by object, material and asset for the compositor"""

    bl_label = "Cryptomatte"
    bl_context = "view_layer"
    bl_parent_id = "RESTIR_VIEWLAYER_PT_passes"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        column, layer = self.column(), context.view_layer
        for kind in KINDS:
            column.prop(layer, f"use_pass_cryptomatte_{kind.lower()}", text=kind)
        levels = column.column()
        levels.active = any(getattr(layer, f"use_pass_cryptomatte_{kind.lower()}") for kind in KINDS)
        levels.prop(layer, "pass_cryptomatte_depth", text="Levels")


class RESTIR_VIEWLAYER_PT_aovs(RestirPanel, bpy.types.Panel):
    """Passes that AOV Output nodes of materials and the world write to"""

    bl_label = "Shader AOV"
    bl_context = "view_layer"
    bl_parent_id = "RESTIR_VIEWLAYER_PT_passes"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        layer = context.view_layer
        view_layer_list(self.layout, layer, "aov", "VIEWLAYER_UL_aov")
        if layer.active_aov is not None and not layer.active_aov.is_valid:
            self.layout.label(text="Another pass has this name: it is left out", icon="ERROR")


class RESTIR_VIEWLAYER_PT_override(RestirPanel, bpy.types.Panel):
    """What this view layer has of its own"""

    bl_label = "Override"
    bl_context = "view_layer"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        column = self.column()
        column.prop(context.view_layer, "samples")


class RESTIR_RENDER_PT_motion_blur(RestirPanel, bpy.types.Panel):
    """What moves while the shutter is open"""

    bl_label = "Motion Blur"
    bl_options = {"DEFAULT_CLOSED"}

    def draw_header(self, context: bpy.types.Context) -> None:
        self.layout.prop(context.scene.render, "use_motion_blur", text="")

    def draw(self, context: bpy.types.Context) -> None:
        render, cycles, column = context.scene.render, getattr(context.scene, "cycles", None), self.column()
        column.active = render.use_motion_blur
        column.prop(render, "motion_blur_position", text="Position")
        column.prop(render, "motion_blur_shutter")
        if cycles is not None:
            column.prop(cycles, "rolling_shutter_type", text="Rolling Shutter")
            duration = column.column()
            duration.active = cycles.rolling_shutter_type != "NONE"
            duration.prop(cycles, "rolling_shutter_duration", text="Line Duration")
        column.separator()
        column.template_curve_mapping(render, "motion_blur_shutter_curve")


CLASSES = (
    RESTIR_RENDER_PT_sampling,
    RESTIR_RENDER_PT_adaptive,
    RESTIR_RENDER_PT_denoising,
    RESTIR_RENDER_PT_sample_range,
    RESTIR_RENDER_PT_resampling,
    RESTIR_RENDER_PT_light_paths,
    RESTIR_RENDER_PT_subsurface,
    RESTIR_RENDER_PT_motion_blur,
    RESTIR_RENDER_PT_film,
    RESTIR_RENDER_PT_simplify,
    RESTIR_RENDER_PT_performance,
    RESTIR_RENDER_PT_warnings,
    RESTIR_VIEWLAYER_PT_passes,
    RESTIR_VIEWLAYER_PT_cryptomatte,
    RESTIR_VIEWLAYER_PT_aovs,
    RESTIR_VIEWLAYER_PT_override,
)
