"""Settings from Cycles: a button, and by itself when a scene is first switched to the engine."""

from __future__ import annotations

import bpy
from bpy.app.handlers import persistent
from bpy.props import BoolProperty

from ..restir_engine import warning_log
from ..restir_engine.engine import RestirEngine
from ..restir_engine.sync.left_out import scene_lines

# Cycles' name of a setting and ours.
COPIED = {
    "seed": "seed",
    "time_limit": "time_limit",
    "use_adaptive_sampling": "use_adaptive_sampling",
    "adaptive_threshold": "adaptive_threshold",
    "adaptive_min_samples": "adaptive_min_samples",
    "use_denoising": "use_denoising",
    "denoising_quality": "denoising_quality",
    "max_bounces": "max_bounces",
    "diffuse_bounces": "diffuse_bounces",
    "glossy_bounces": "glossy_bounces",
    "transmission_bounces": "transmission_bounces",
    "volume_bounces": "volume_bounces",
    "transparent_max_bounces": "transparent_bounces",
    "min_light_bounces": "min_bounces",
    "sample_clamp_direct": "clamp_direct",
    "sample_clamp_indirect": "clamp_indirect",
    "blur_glossy": "filter_glossy",
    "caustics_reflective": "caustics_reflective",
    "caustics_refractive": "caustics_refractive",
    "film_exposure": "film_exposure",
    "pixel_filter_type": "pixel_filter",
    "filter_width": "filter_width",
    "bake_type": "bake_type",
}
# Copied only when the artist has set them, since Cycles' defaults mean something else: its 4096 samples are a bound
# that its threshold seldom lets it reach.
COPIED_WHEN_SET = {"samples": "samples", "use_animated_seed": "use_animated_seed"}

# These count where Cycles' switch for both is on.
COPIED_OF_SUBSETS = {"sample_offset": "sample_offset", "sample_subset_length": "sample_subset"}


def copy_settings(scene: bpy.types.Scene, keep_changed: bool) -> list[str]:
    """Copy what Cycles and we both have; returns a sentence for everything that has no counterpart.

    With `keep_changed`, settings of ours that have been set already stay as they are.
    """
    own, cycles = scene.restir, getattr(scene, "cycles", None)
    own.is_initialized = True
    if cycles is None:  # the Cycles add-on is disabled
        return []
    when_set = {theirs: ours for theirs, ours in COPIED_WHEN_SET.items() if cycles.is_property_set(theirs)}
    for theirs, ours in (COPIED | when_set).items():
        if not (keep_changed and own.is_property_set(ours)) and hasattr(cycles, theirs):
            setattr(own, ours, getattr(cycles, theirs))
    for theirs, ours in COPIED_OF_SUBSETS.items():
        if not (keep_changed and own.is_property_set(ours)) and hasattr(cycles, theirs):
            setattr(own, ours, getattr(cycles, theirs) if cycles.use_sample_subset else 0)
    return [f"{kind} “{name}”: {text}" for kind, name, text in scene_lines(scene, scene.view_layers)]


def initialize(scene: bpy.types.Scene) -> None:
    """Copy Cycles' settings once, the first time that a scene uses this engine."""
    if scene.render.engine == RestirEngine.bl_idname and not scene.restir.is_initialized and scene.is_editable:
        warning_log.add(scene.name, copy_settings(scene, keep_changed=True))


class RESTIR_OT_settings_from_cycles(bpy.types.Operator):
    """Copy samples, bounces, clamps, filter and film settings from Cycles and list what has no counterpart"""

    bl_idname = "restir.settings_from_cycles"
    bl_label = "Settings from Cycles"
    bl_options = {"REGISTER", "UNDO"}

    keep_changed: BoolProperty(
        name="Keep Changed",
        description="Leave settings that have been set here as they are",
        default=False,
        options={"HIDDEN", "SKIP_SAVE"},
    )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return hasattr(context.scene, "cycles")

    def execute(self, context: bpy.types.Context) -> set[str]:
        lines = copy_settings(context.scene, self.keep_changed)
        warning_log.add(context.scene.name, lines)
        for line in lines:
            self.report({"WARNING"}, line)
        return {"FINISHED"}


# The window tells of a changed engine through the message bus, which forgets its subscribers when a file is opened; a
# render without a window tells nothing before it begins.
_SUBSCRIBER = object()


def _engine_changed() -> None:
    for scene in bpy.data.scenes:
        initialize(scene)


def _subscribe() -> None:
    key = (bpy.types.RenderSettings, "engine")
    bpy.msgbus.clear_by_owner(_SUBSCRIBER)
    bpy.msgbus.subscribe_rna(key=key, owner=_SUBSCRIBER, args=(), notify=_engine_changed)


@persistent
def restir_file_opened(*_args) -> None:
    """After a file was opened."""
    warning_log.clear()
    _subscribe()


@persistent
def restir_render_starts(scene: bpy.types.Scene, *_args) -> None:
    """Before a render."""
    initialize(scene)


HANDLERS = {"load_post": restir_file_opened, "render_init": restir_render_starts}


def watch() -> None:
    """Initialize scenes that are switched to the engine from now on."""
    _subscribe()
    for name, handler in HANDLERS.items():
        handlers = getattr(bpy.app.handlers, name)
        if handler not in handlers:
            handlers.append(handler)


def unwatch() -> None:
    """Stop that."""
    bpy.msgbus.clear_by_owner(_SUBSCRIBER)
    for name, handler in HANDLERS.items():
        handlers = getattr(bpy.app.handlers, name)
        if handler in handlers:
            handlers.remove(handler)
