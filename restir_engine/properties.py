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
)

from .reuse_settings import OPTIONS, Option, ReuseSettings
from .settings import PASSES, RenderSettings

DEFAULTS = RenderSettings()


SSS_METHODS = (
    (
        "FROM_MATERIAL",
        "From Material",
        "Diffusion for Christensen–Burley, random walks for all others: what Cycles shows",
    ),
    ("RANDOM_WALK", "Random Walk", "Right for every shape and length, and the slowest"),
    (
        "HYBRID",
        "Hybrid",
        "Light that passes straight through or scatters once is traced, what scatters more often is diffusion "
        "that knows how thick the object is: within 2 % of random walks in the mean, up to 18 % too dark where "
        "a lamp shines from behind through a dense body",
    ),
    (
        "DIFFUSION",
        "Diffusion",
        "By the distance of two surface points alone: 20 % too dark on bodies of 20 mean free paths under "
        "even light, 50 % on those of five; thick ones are right",
    ),
)


def _bounces(name: str, default: int, description: str):
    return IntProperty(name=name, description=description, default=default, min=0, soft_max=32, max=1024)


def _property(name: str, option: Option):
    """The property of a field of ReuseSettings."""
    default = getattr(DEFAULTS.reuse, name)
    texts = {"name": option.label, "description": option.text, "default": default}
    if option.choices:
        return EnumProperty(items=option.choices, **texts)
    if isinstance(default, bool):
        return BoolProperty(**texts)
    limits = {"min": option.min, "max": option.max, "soft_max": option.soft_max or option.max}
    limits = {limit: type(default)(value) for limit, value in limits.items() if value is not None}
    if isinstance(default, int):
        return IntProperty(**texts, **limits)
    return FloatProperty(**texts, **limits, subtype=option.unit or "NONE")


class RestirReuseSettings(bpy.types.PropertyGroup):
    """Which light samples the integrator ReSTIR draws, and how it reuses them."""

    __annotations__ = {name: _property(name, option) for name, option in OPTIONS.items()}


class RestirSceneSettings(bpy.types.PropertyGroup):
    """Render settings of a scene."""

    integrator: EnumProperty(
        name="Integrator",
        description="How light is found. Both give the same picture, with other noise at the same time",
        items=(
            ("PATH", "Path Tracing", "Paths from the camera, each on its own: the reference"),
            ("RESTIR", "ReSTIR", "The first surfaces take their direct light from many resampled light samples"),
        ),
        default=DEFAULTS.integrator,
    )
    reuse: PointerProperty(type=RestirReuseSettings, name="Reuse", description=RestirReuseSettings.__doc__)
    samples: IntProperty(
        name="Samples",
        description="Paths traced for each pixel of a final render. Twice the noise-free look costs four times as many",
        default=DEFAULTS.samples,
        min=1,
        soft_max=4096,
        max=1 << 24,
    )
    preview_samples: IntProperty(
        name="Preview Samples",
        description="Paths for each pixel of the 3D view and of a material's preview",
        default=32,
        min=1,
        soft_max=128,
        max=4096,
    )
    time_limit: FloatProperty(
        name="Time Limit",
        description="End the render after this time with the samples that it has by then. 0 is no limit",
        default=DEFAULTS.time_limit,
        min=0.0,
        subtype="TIME_ABSOLUTE",
        unit="TIME_ABSOLUTE",
        step=100.0,
    )
    seed: IntProperty(
        name="Seed",
        description="Where the random numbers start: the same seed gives the same noise, on any number of threads",
        default=DEFAULTS.seed,
        min=0,
    )
    use_animated_seed: BoolProperty(
        name="Animate Seed",
        description="Another noise pattern on each frame of an animation",
        default=True,
    )
    use_denoising: BoolProperty(
        name="Denoise",
        description="Remove what noise remains with Open Image Denoise, which Blender brings along",
        default=DEFAULTS.use_denoising,
    )
    denoising_quality: EnumProperty(
        name="Quality",
        description="What the denoiser spends its time on",
        items=(
            ("HIGH", "High", "Best picture"),
            ("BALANCED", "Balanced", "A little faster than High"),
            ("FAST", "Fast", "About twice as fast as High"),
        ),
        default=DEFAULTS.denoising_quality,
    )
    max_bounces: _bounces("Total", DEFAULTS.max_bounces, "How often light is scattered at most. 0: direct light only")
    diffuse_bounces: _bounces("Diffuse", DEFAULTS.diffuse_bounces, "How often light is scattered diffusely at most")
    glossy_bounces: _bounces("Glossy", DEFAULTS.glossy_bounces, "How often light is reflected glossily at most")
    transmission_bounces: _bounces(
        "Transmission", DEFAULTS.transmission_bounces, "How often light passes through glass at most"
    )
    volume_bounces: _bounces(
        "Volume",
        DEFAULTS.volume_bounces,
        "How often light is scattered at most inside media that are seen through glass or by themselves. 0: once, by "
        "direct light only",
    )
    transparent_bounces: _bounces(
        "Transparent", DEFAULTS.transparent_bounces, "How many transparent surfaces a ray passes through at most"
    )
    min_bounces: _bounces(
        "Minimum",
        DEFAULTS.min_bounces,
        "Bounces before dim paths may end early. More is slower and less noisy; the mean is the same",
    )
    clamp_direct: FloatProperty(
        name="Clamp Direct",
        description="Most that direct light may add to a sample. Removes bright dots and the light in them; 0 is off",
        default=DEFAULTS.clamp_direct,
        min=0.0,
        soft_max=100.0,
    )
    clamp_indirect: FloatProperty(
        name="Clamp Indirect",
        description="Most that light from bounces may add to a sample. Removes bright dots and their light; 0 is off",
        default=DEFAULTS.clamp_indirect,
        min=0.0,
        soft_max=100.0,
    )
    filter_glossy: FloatProperty(
        name="Filter Glossy",
        description="Blur sharp reflections seen by way of a rough bounce: less noise, softer caustics. 0 is off",
        default=DEFAULTS.filter_glossy,
        min=0.0,
        soft_max=4.0,
        max=100.0,
    )
    caustics_reflective: BoolProperty(
        name="Reflective Caustics",
        description="Light that a glossy surface casts on a diffuse one. Off is less noisy and darker",
        default=DEFAULTS.caustics_reflective,
    )
    caustics_refractive: BoolProperty(
        name="Refractive Caustics",
        description="Light that glass casts on a diffuse surface. Off is less noisy and darkens the shadow of glass",
        default=DEFAULTS.caustics_refractive,
    )
    sss_method: EnumProperty(
        name="Method",
        description="How light below surfaces is followed; what the material is stays the same",
        items=SSS_METHODS,
        default=DEFAULTS.sss_method,
    )
    preview_sss_method: EnumProperty(
        name="Preview",
        description="How the 3D view and previews of materials follow light below surfaces",
        items=(("FINAL", "As Final", "As in final renders"), *SSS_METHODS),
        default="FINAL",
    )
    cycles_burley_kernel: BoolProperty(
        name="Cycles' Christensen–Burley",
        description="Weigh distances as Cycles does, whose sum over a curved surface is too large: by 2 % on a sphere "
        "of 20 times the scattering length, by 12 % of 5 times",
        default=DEFAULTS.cycles_burley_kernel,
    )
    exact_walks: BoolProperty(
        name="Exact Walks",
        description="Random walks without the approximations that Cycles makes: that they end after 256 steps (3 % "
        "darker at an albedo of 0.93), that they scatter evenly after the ninth (up to 3.5 % brighter at an anisotropy "
        "of 0.8), and those for colors below 0.05 (7 % brighter at 0.02). Slower where colors are almost white",
        default=DEFAULTS.exact_walks,
    )
    sss_thickness_aware: BoolProperty(
        name="Thickness",
        description="Hybrid's diffusion knows how thick the object is. Off is the published method, by which plates "
        "half a mean free path thick are 38 % too bright under even light",
        default=DEFAULTS.sss_thickness_aware,
    )
    sss_analog_escape: BoolProperty(
        name="Short Rays",
        description="Hybrid lets light that scattered once get out by chance, which takes shorter rays and is noisier; "
        "the mean is the same",
        default=DEFAULTS.sss_analog_escape,
    )
    sss_irradiance_cache: BoolProperty(
        name="Irradiance Cache",
        description="Hybrid keeps the light that its samples find on the far sides of objects, in a grid about as fine "
        "as a mean free path, instead of lighting each point anew: with many lamps 0.25 to 0.8 of the variance, with "
        "one about a tenth slower for nothing. Biased: means by up to 0.4 %, blocks of 8 × 8 pixels by about 1 %",
        default=DEFAULTS.sss_irradiance_cache,
    )
    sss_after_diffuse: EnumProperty(
        name="After Diffuse",
        description="What becomes of subsurface scattering that is seen by way of a diffuse bounce",
        items=(
            (
                "AS_CYCLES",
                "As Cycles",
                "As Cycles of this Blender has it: diffuse for Christensen–Burley, before Blender 5.0 for all methods",
            ),
            ("ALWAYS", "Scatter", "Light scatters below the surface on every bounce: slower, and right"),
            (
                "DIFFUSE",
                "Diffuse",
                "A diffuse surface of the same colour: faster, but other surfaces no longer get light that passed "
                "through a thing (4 % of the red light in a white room with a waxen ball, 40 % in the ball's shadow)",
            ),
        ),
        default="AS_CYCLES",
    )
    sss_max_scatters: IntProperty(
        name="Max Scatters",
        description="Scattering events that light may have inside a random walk, for comparisons: with one more it "
        "counts as absorbed, so that the picture gets darker. 0 is unlimited, -1 is none: only light that gets "
        "straight through",
        default=DEFAULTS.sss_max_scatters,
        min=-1,
        soft_max=256,
        max=1 << 20,
    )
    film_exposure: FloatProperty(
        name="Exposure",
        description="Factor on the brightness of the passes that hold light, before colour management",
        default=DEFAULTS.film_exposure,
        min=0.0,
        soft_max=10.0,
    )
    pixel_filter: EnumProperty(
        name="Filter",
        description="How the samples around a pixel's centre are weighed",
        items=(
            ("BLACKMAN_HARRIS", "Blackman–Harris", "Sharp and without steps at edges"),
            ("GAUSSIAN", "Gaussian", "Softer"),
            ("BOX", "Box", "The pixel's own square"),
        ),
        default=DEFAULTS.pixel_filter,
    )
    filter_width: FloatProperty(
        name="Width",
        description="Width of the pixel filter; a larger one is softer",
        default=DEFAULTS.filter_width,
        min=0.01,
        soft_max=4.0,
        max=10.0,
        subtype="PIXEL",
    )
    threads: IntProperty(
        name="Threads",
        description="Processor threads that a render uses. 0 is one for each that the machine has",
        default=DEFAULTS.threads,
        min=0,
        max=1024,
    )
    # Whether the Cycles settings of this scene were looked at once.
    is_initialized: BoolProperty(default=False, options={"HIDDEN"})


def _sss_after_diffuse(choice: str) -> str:
    """RenderSettings' value of `sss_after_diffuse`: AS_CYCLES by the running Blender's version."""
    if choice != "AS_CYCLES":
        return choice
    return "DIFFUSE" if bpy.app.version < (5, 0, 0) else "BURLEY_DIFFUSE"


class RestirViewLayerSettings(bpy.types.PropertyGroup):
    """Passes of a view layer for which Blender has no switch of its own."""

    use_pass_volume: BoolProperty(
        name="Volume",
        description="Deliver light that was scattered first inside a volume, after one scattering and after more",
        default=False,
    )
    use_pass_subsurface: BoolProperty(
        name="Subsurface",
        description="Deliver the light that was scattered below surfaces, and its parts that were scattered there not "
        "at all (Boundary), once (Single) and more often (Multiple)",
        default=False,
    )
    use_pass_visibility: BoolProperty(
        name="Visibility Estimate",
        description="Deliver the visibility of lights that ReSTIR estimates at the first surfaces, from 0 (in shadow) "
        "to 1 by colour channel; alpha is the share of samples that found a light. Needs the integrator ReSTIR, its "
        "shadows reused or estimated",
        default=False,
    )
    use_pass_denoising: BoolProperty(
        name="Denoising Data",
        description="Deliver the albedo and the normal that guide a denoiser, for the compositor's Denoise node",
        default=False,
    )


class RestirMaterialSettings(bpy.types.PropertyGroup):
    """How light scatters below the surface of a material."""

    entry: EnumProperty(
        name="Entry",
        description="Which way light takes into the material. The colour that was set comes out under diffuse entry; "
        "by refraction it is darker, dark channels by a fifth",
        items=(
            (
                "METHOD",
                "By Method",
                "As Cycles: refracted for Random Walk, half and half for Random Walk (Skin); "
                "diffuse for Christensen–Burley and for a medium of this panel",
            ),
            ("DIFFUSE", "Diffuse", "In all directions evenly. The colour that is set is the colour that is seen"),
            ("REFRACTIVE", "Refracted", "Refracted by the surface's roughness and IOR"),
            ("SKIN", "Skin", "One half diffuse, one half refracted by a rough surface"),
        ),
        default="METHOD",
    )
    use_medium: BoolProperty(
        name="Medium",
        description="Use the medium of this panel for Principled and Subsurface Scattering nodes (a Subsurface Weight "
        "of 0 counts as 1 then); a material without such a node becomes the medium. This engine alone does so",
        default=False,
    )
    use_color: BoolProperty(
        name="Own Color",
        description="Use the colour of this panel, else that of the node with its textures",
        default=True,
    )
    color: FloatVectorProperty(
        name="Color",
        description="Colour that a thick piece of the material has under even light",
        subtype="COLOR",
        size=3,
        default=(0.8, 0.8, 0.8),
        min=0.0,
        max=1.0,
    )
    mean_free_path: FloatVectorProperty(
        name="Mean Free Path",
        description="How far light of a colour goes in the material on average until it meets something. A channel of "
        "0 is diffuse",
        subtype="NONE",
        unit="LENGTH",
        size=3,
        default=(0.01, 0.005, 0.0025),
        min=0.0,
        soft_max=10.0,
        precision=5,
    )
    scale: FloatProperty(
        name="Scale",
        description="Factor on all mean free paths",
        default=1.0,
        min=0.0,
        soft_max=100.0,
    )
    anisotropy: FloatProperty(
        name="Anisotropy",
        description="Mean cosine of a scattering event: 0 in all directions evenly, above 0 forwards, below backwards",
        default=0.0,
        min=-0.99,
        max=0.99,
    )
    scatter_inside: BoolProperty(
        name="Scatter Inside",
        description="Light that Principled's Transmission lets in scatters by its Subsurface inputs, like candy or "
        "jade. It needs Volume bounces under Light Paths. Cycles renders clear glass there",
        default=False,
    )
    medium_priority: IntProperty(
        name="Volume Priority",
        description="Where volumes overlap, those of the highest priority count alone, and boundaries of others are "
        "not seen inside them; volumes of the same priority add up, as in Cycles",
        default=0,
        soft_min=-10,
        soft_max=10,
    )


def enabled_passes(view_layer: bpy.types.ViewLayer) -> frozenset[str]:
    """Names of the passes that a view layer asks for; Combined is always one of them."""
    return frozenset(
        item.name
        for item in PASSES
        if item.name == "Combined"
        or getattr(view_layer if item.view_layer else view_layer.restir, item.view_layer or item.own)
    )


def render_settings(scene: bpy.types.Scene, view_layer: bpy.types.ViewLayer) -> RenderSettings:
    """The settings of a final render of `view_layer` at the scene's current frame."""
    own = scene.restir
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
            "threads": scene.render.threads
            if scene.render.threads_mode == "FIXED" and not own.threads
            else own.threads,
            "film_transparent": scene.render.film_transparent,
            "sss_after_diffuse": _sss_after_diffuse(own.sss_after_diffuse),
            "extra_transparent": bpy.app.version < (5, 0, 0),
            "pass_alpha_threshold": view_layer.pass_alpha_threshold,
            "passes": enabled_passes(view_layer),
        }
    )


def viewport_settings(scene: bpy.types.Scene, view_layer: bpy.types.ViewLayer) -> RenderSettings:
    """The RenderSettings of the 3D view: those of final frames, with samples and method for previews, in one seed."""
    return replace(
        preview_settings(scene, view_layer, scene), seed=scene.restir.seed, time_limit=0.0, use_denoising=False
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
        sss_method=method,
        film_transparent=scene.render.film_transparent,
        passes=frozenset({"Combined"}),
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
