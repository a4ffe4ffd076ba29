"""What the artist sets: `scene.restir`, and the one place that turns it into RenderSettings."""

from __future__ import annotations

from dataclasses import replace

import bpy
from bpy.props import (
    BoolProperty,
    EnumProperty,
    FloatProperty,
    FloatVectorProperty,
    IntProperty,
    PointerProperty,
    StringProperty,
)

from .denoise import find_library
from .options import MATERIAL_OPTIONS, SCENE_OPTIONS, VIEW_LAYER_OPTIONS, Option
from .reuse_settings import OPTIONS, ReuseSettings
from .scene.cryptomatte import KINDS
from .settings import (
    DENOISING_ROUGHNESS,
    MAX_CRYPTOMATTES,
    MOST_LIGHT_GROUPS,
    NOISY_IMAGE,
    PASSES,
    SPECULAR_ALBEDO,
    Aov,
    Mist,
    RenderSettings,
    carried_passes,
    cryptomatte,
)

GRADED = bpy.app.version >= (5, 2, 0)  # RenderSettings.graded_features
MIST_POWERS = {"LINEAR": 1.0, "QUADRATIC": 2.0, "INVERSE_QUADRATIC": 0.5}

# What Blender is told of an Option's unit.
_UNITS = {
    "": {},
    "PIXEL": {"subtype": "PIXEL"},
    "TIME": {"subtype": "TIME_ABSOLUTE", "unit": "TIME_ABSOLUTE", "step": 100.0},
    "LENGTH": {"unit": "LENGTH", "precision": 5},
    "COLOR": {"subtype": "COLOR"},
}


def _property(option: Option, default):
    """The property of an Option, of the kind of its default."""
    texts = {"name": option.label, "description": option.text, "default": default}
    if option.choices:
        return EnumProperty(items=option.choices, **texts)
    if isinstance(default, bool):
        return BoolProperty(**texts)
    number = int if isinstance(default, int) else float
    limits = {name: getattr(option, name) for name in ("min", "soft_min", "soft_max", "max")}
    limits = {name: number(value) for name, value in limits.items() if value is not None}
    if number is int:
        return IntProperty(**texts, **limits)
    if isinstance(default, tuple):
        return FloatVectorProperty(**texts, **limits, **_UNITS[option.unit], size=len(default))
    return FloatProperty(**texts, **limits, **_UNITS[option.unit])


def _properties(options: dict[str, Option], defaults=None) -> dict:
    """The properties of a table by name; `defaults` has those that options do not tell."""
    return {
        name: _property(option, getattr(defaults, name) if option.default is None else option.default)
        for name, option in options.items()
    }


class RestirReuseSettings(bpy.types.PropertyGroup):
    """Which light samples the integrator ReSTIR draws, and how it reuses them."""

    __annotations__ = _properties(OPTIONS, ReuseSettings())


class RestirSceneSettings(bpy.types.PropertyGroup):
    """Render settings of a scene."""

    __annotations__ = _properties(SCENE_OPTIONS, RenderSettings()) | {
        "reuse": PointerProperty(type=RestirReuseSettings, name="Reuse", description=RestirReuseSettings.__doc__),
        "film_from": StringProperty(
            name="Film From",
            description="For scripts: a merged multilayer OpenEXR file, which renders deliver instead of sampling",
            subtype="FILE_PATH",
        ),
        # Whether the Cycles settings of this scene were looked at once.
        "is_initialized": BoolProperty(default=False, options={"HIDDEN"}),
    }


class RestirViewLayerSettings(bpy.types.PropertyGroup):
    """Passes of a view layer for which Blender has no switch of its own."""

    __annotations__ = _properties(VIEW_LAYER_OPTIONS)


class RestirMaterialSettings(bpy.types.PropertyGroup):
    """How light scatters below the surface of a material."""

    __annotations__ = _properties(MATERIAL_OPTIONS)


def _sss_after_diffuse(choice: str) -> str:
    """RenderSettings' value of `sss_after_diffuse`: AS_CYCLES by the running Blender's version."""
    if choice != "AS_CYCLES":
        return choice
    return "DIFFUSE" if bpy.app.version < (5, 0, 0) else "BURLEY_DIFFUSE"


def enabled_passes(scene: bpy.types.Scene, view_layer: bpy.types.ViewLayer) -> frozenset[str]:
    """Names of the passes that a scene's view layer asks for; Combined is always one of them."""
    unknown = set() if GRADED else {DENOISING_ROUGHNESS, SPECULAR_ALBEDO}
    if not scene.restir.use_denoising:
        unknown.add(NOISY_IMAGE)
    depth = (view_layer.pass_cryptomatte_depth + 1) // 2
    too_deep = {cryptomatte(kind, i) for kind in KINDS for i in range(depth, MAX_CRYPTOMATTES)}
    return frozenset(
        item.name
        for item in PASSES
        if item.name == "Combined"
        or (
            item.name not in too_deep | unknown
            and (item.view_layer or item.own)
            and getattr(view_layer if item.view_layer else view_layer.restir, item.view_layer or item.own)
        )
    )


def sample_range(own: RestirSceneSettings) -> dict[str, int]:
    """Those RenderSettings that choose samples; a film from a file is of all of them."""
    return {name: 0 if own.film_from else getattr(own, name) for name in ("sample_offset", "sample_subset")}


def delivered_passes(scene: bpy.types.Scene, view_layer: bpy.types.ViewLayer) -> frozenset[str]:
    """Names of the passes that a final render of a view layer delivers."""
    own, names = scene.restir, enabled_passes(scene, view_layer)
    if RenderSettings(samples=own.samples, **sample_range(own)).is_part:
        # The lamp of Blender's first scene is marked as one.
        catchers = any(item.is_shadow_catcher and item.type != "LIGHT" for item in bpy.data.objects)
        names = carried_passes(names, own.use_denoising, own.use_adaptive_sampling, catchers)
    return names


def is_blurred(scene: bpy.types.Scene, view_layer: bpy.types.ViewLayer) -> bool:
    """Whether final renders have motion blur; they have no pass Vector then, as in Cycles."""
    return scene.render.use_motion_blur and view_layer.use_motion_blur


def enabled_aovs(view_layer: bpy.types.ViewLayer) -> tuple[Aov, ...]:
    """The AOVs of a view layer; Blender marks those invalid whose names stand for something else."""
    return tuple(Aov(aov.name, 1 if aov.type == "VALUE" else 4) for aov in view_layer.aovs if aov.is_valid)


def enabled_light_groups(view_layer: bpy.types.ViewLayer) -> tuple[str, ...]:
    """The names of the light groups of a view layer that have passes."""
    return tuple(group.name for group in view_layer.lightgroups)[:MOST_LIGHT_GROUPS]


def mist(world: bpy.types.World | None) -> Mist:
    """What a world says of the pass Mist."""
    if world is None:
        return Mist()
    settings = world.mist_settings
    return Mist(settings.start, settings.depth, MIST_POWERS[settings.falloff])


def render_settings(scene: bpy.types.Scene, view_layer: bpy.types.ViewLayer) -> RenderSettings:
    """The settings of a final render of `view_layer` at the scene's current frame."""
    own, cycles = scene.restir, getattr(scene, "cycles", None)
    same_name = {
        name: getattr(own, name)
        for name in RenderSettings.__dataclass_fields__
        if name in RestirSceneSettings.__annotations__ and name != "reuse"
    }
    seed = own.seed + (scene.frame_current if own.use_animated_seed else 0)
    return RenderSettings(
        **same_name
        | {
            "seed": seed,
            "reuse": ReuseSettings(**{name: getattr(own.reuse, name) for name in OPTIONS}),
            "samples": view_layer.samples or own.samples,
            "scene_samples": own.samples,
            **sample_range(own),
            "threads": scene.render.threads
            if scene.render.threads_mode == "FIXED" and not own.threads
            else own.threads,
            "film_transparent": scene.render.film_transparent,
            "film_transparent_glass": getattr(cycles, "film_transparent_glass", False),
            "film_transparent_roughness": getattr(cycles, "film_transparent_roughness", 0.1),
            "sss_after_diffuse": _sss_after_diffuse(own.sss_after_diffuse),
            "extra_transparent": bpy.app.version < (5, 0, 0),
            "graded_features": GRADED,
            "pass_alpha_threshold": view_layer.pass_alpha_threshold,
            "mist": mist(scene.world),
            "occlusion_distance": scene.world.light_settings.distance if scene.world else 10.0,
            "sss_irradiance_cache": own.sss_irradiance_cache and not is_blurred(scene, view_layer),
            "passes": delivered_passes(scene, view_layer)
            - ({"Vector", "Vector Weight"} if is_blurred(scene, view_layer) else set()),
            "aovs": enabled_aovs(view_layer),
            "light_groups": enabled_light_groups(view_layer),
        }
    )


def viewport_settings(scene: bpy.types.Scene, view_layer: bpy.types.ViewLayer) -> RenderSettings:
    """The RenderSettings of the 3D view: those of final frames, with samples and method for previews, in one seed."""
    return replace(
        preview_settings(scene, view_layer, scene),
        seed=scene.restir.seed,
        time_limit=0.0,
        use_denoising=scene.restir.use_preview_denoising and find_library() is not None,
        denoising_quality="FAST",
    )


def preview_settings(scene: bpy.types.Scene, view_layer: bpy.types.ViewLayer, artist: bpy.types.Scene):
    """The RenderSettings of a material's preview: those of the artist's scene, with samples and method for previews.

    `scene` and `view_layer` are Blender's own, in which the preview is made.
    """
    own = artist.restir
    final = render_settings(artist, view_layer)
    method = final.sss_method if own.preview_sss_method == "FINAL" else own.preview_sss_method
    return replace(
        final,
        samples=own.preview_samples,
        sample_offset=0,
        sample_subset=0,
        scene_samples=0,
        sss_method=method,
        film_transparent=scene.render.film_transparent,
        passes=frozenset({"Combined"}),
        aovs=(),
    )


CLASSES = {
    bpy.types.Scene: RestirSceneSettings,
    bpy.types.ViewLayer: RestirViewLayerSettings,
    bpy.types.Material: RestirMaterialSettings,
}


def register() -> None:
    """Add `restir` to scenes, view layers and materials."""
    if not RestirReuseSettings.is_registered:
        bpy.utils.register_class(RestirReuseSettings)
    for owner, group in CLASSES.items():
        if not group.is_registered:
            bpy.utils.register_class(group)
            owner.restir = PointerProperty(type=group, name="ReSTIR", description=group.__doc__)


def unregister() -> None:
    """Take them away again."""
    for owner, group in CLASSES.items():
        if group.is_registered:
            del owner.restir
            bpy.utils.unregister_class(group)
    if RestirReuseSettings.is_registered:
        bpy.utils.unregister_class(RestirReuseSettings)
