"""What artists can set and what is said about it: the tables of which the properties are made.

Names are those of RenderSettings for a scene, of Blender's property groups for view layers and materials.
"""

from __future__ import annotations

from typing import Any, NamedTuple


class Option(NamedTuple):
    """What is said about a setting: a number, a switch, a vector of three numbers or one of several names.

    Its kind is that of the default. Limits are of numbers; None: there is none.
    """

    label: str
    text: str  # the tooltip
    min: float | None = 0.0
    soft_max: float | None = None
    max: float | None = None
    unit: str = ""  # PIXEL, TIME, LENGTH or COLOR
    choices: tuple[tuple[str, str, str], ...] = ()  # (name, label, text)
    panel: bool = False  # of ReuseSettings: whether artists see it; what they do not is for scripts and comparisons
    default: Any = None  # None: that of RenderSettings
    soft_min: float | None = None


_SSS_METHODS = (
    (
        "FROM_MATERIAL",
        "From Material",
        "Diffusion for Christensen–Burley, random walks for all others: what Cycles shows",
    ),
    ("RANDOM_WALK", "Random Walk", "Correct for every shape and length, and the slowest"),
    (
        "HYBRID",
        "Hybrid",
        "Traces light that passes straight through or scatters once; what scatters more often is diffusion that knows "
        "how thick the object is. Within 2 % of random walks on average, up to 24 % too dark where a lamp shines "
        "through a dense body from behind",
    ),
    (
        "DIFFUSION",
        "Diffusion",
        "Only the distance between two surface points counts. Under even light thin bodies are too dark: those of 20 "
        "mean free paths by 20 %, those of 5 by 50 %",
    ),
)


def _bounces(label: str, text: str) -> Option:
    return Option(label, text, soft_max=32, max=1024)


SCENE_OPTIONS: dict[str, Option] = {
    "integrator": Option(
        "Integrator",
        "How light is found. Both give the same picture; in the same time their noise differs",
        choices=(
            ("PATH", "Path Tracing", "Each path from the camera on its own: the reference"),
            (
                "RESTIR",
                "ReSTIR",
                "Light samples are chosen from many points on all lights, where that is better; a short trial at the "
                "start of the render tells",
            ),
        ),
        default="RESTIR",
    ),
    "samples": Option(
        "Samples",
        "Paths traced for each pixel of a final render. Four times as many have half the noise",
        min=1,
        soft_max=4096,
        max=1 << 24,
    ),
    "sample_offset": Option(
        "Sample Offset",
        "Leave out so many of the samples, which another render takes. A view layer with samples of its own leaves out "
        "the same share of them",
        max=(1 << 24) - 1,
    ),
    "sample_subset": Option(
        "Sample Subset",
        "Take so many samples from the offset on, and no others: renders of all ranges, saved as multilayer OpenEXR, "
        "merge to the picture of all samples. 0 takes all that follow",
        max=1 << 24,
    ),
    "preview_samples": Option(
        "Preview Samples",
        "Paths for each pixel of the 3D view and of material previews",
        min=1,
        soft_max=128,
        max=4096,
        default=32,
    ),
    "use_adaptive_sampling": Option(
        "Noise Threshold",
        "Stop sampling pixels whose noise is small enough. Such pixels are darker on average, by less than 0.1 % at "
        "the usual threshold, because some stop before they have seen something rare and bright",
    ),
    "adaptive_threshold": Option(
        "Noise Threshold",
        "How much noise may remain, as Cycles measures it. Half of it takes about four times as long",
        min=1e-4,
        soft_max=0.5,
        max=1.0,
    ),
    "adaptive_min_samples": Option(
        "Min Samples",
        "Paths that each pixel gets in any case. 0 chooses by the noise threshold",
        soft_max=1024,
        max=4096,
    ),
    "time_limit": Option(
        "Time Limit", "Stop rendering after this time, with the samples taken so far. 0 is no limit", unit="TIME"
    ),
    "seed": Option("Seed", "Changes the noise. The same seed gives the same noise on any number of threads"),
    "use_animated_seed": Option("Animate Seed", "Different noise on each frame of an animation", default=True),
    "use_denoising": Option("Denoise", "Remove remaining noise with Open Image Denoise, which comes with Blender"),
    "denoising_quality": Option(
        "Quality",
        "How much time the denoiser takes",
        choices=(
            ("HIGH", "High", "Best picture"),
            ("BALANCED", "Balanced", "A little faster than High"),
            ("FAST", "Fast", "About twice as fast as High"),
        ),
    ),
    "use_preview_denoising": Option(
        "Denoise 3D View",
        "Remove noise in the 3D view with Open Image Denoise at its fast quality, each time at most a quarter of the "
        "time has gone into it",
        default=False,
    ),
    "max_bounces": _bounces("Total", "Most times that light is scattered. 0 is direct light only"),
    "diffuse_bounces": _bounces("Diffuse", "Most times that light is scattered diffusely"),
    "glossy_bounces": _bounces("Glossy", "Most times that light is reflected by glossy surfaces"),
    "transmission_bounces": _bounces("Transmission", "Most times that light passes through glass"),
    "volume_bounces": _bounces(
        "Volume",
        "Most times that light is scattered inside volumes, seen directly or through glass. 0: it scatters once, lit "
        "directly",
    ),
    "transparent_bounces": _bounces("Transparent", "Most transparent surfaces that a ray passes through"),
    "min_bounces": _bounces(
        "Minimum", "Bounces before dim paths may end early. More is slower and less noisy; the brightness is the same"
    ),
    "clamp_direct": Option(
        "Clamp Direct",
        "Most that direct light may add to a sample. Removes bright dots, and the light in them. 0 is off",
        soft_max=100.0,
    ),
    "clamp_indirect": Option(
        "Clamp Indirect",
        "Most that bounced light may add to a sample. Removes bright dots, and the light in them. 0 is off",
        soft_max=100.0,
    ),
    "filter_glossy": Option(
        "Filter Glossy",
        "Blur sharp reflections that are seen after a rough bounce: less noise, softer caustics. 0 is off",
        soft_max=4.0,
        max=100.0,
    ),
    "caustics_reflective": Option(
        "Reflective Caustics", "Light that glossy surfaces cast on diffuse ones. Off is less noisy and darker"
    ),
    "caustics_refractive": Option(
        "Refractive Caustics",
        "Light that glass casts on diffuse surfaces. Off is less noisy and darkens the shadows of glass",
    ),
    "sss_method": Option(
        "Method", "How light below surfaces is computed. What the material is stays the same", choices=_SSS_METHODS
    ),
    "preview_sss_method": Option(
        "Preview",
        "How the 3D view and material previews compute light below surfaces",
        choices=(("FINAL", "As Final", "As in final renders"), *_SSS_METHODS),
        default="FINAL",
    ),
    "cycles_burley_kernel": Option(
        "Cycles' Christensen–Burley",
        "Weigh distances as Cycles does. That makes curved surfaces too bright: a sphere whose radius is 20 scattering "
        "lengths by 2 %, one of 5 by 12 %",
    ),
    "exact_walks": Option(
        "Exact Walks",
        "Leave out three approximations of Cycles' random walks: ending after 256 steps (3 % darker at an albedo of "
        "0.93), scattering evenly from the tenth on (up to 3 % brighter at an anisotropy of 0.8), simpler colors below "
        "0.05 (7 % brighter at 0.02). Slower where colors are almost white",
    ),
    "sss_thickness_aware": Option(
        "Thickness",
        "Let Hybrid's diffusion know how thick the object is. Off is the published method, which makes plates half a "
        "mean free path thick 38 % too bright under even light",
    ),
    "sss_analog_escape": Option(
        "Short Rays",
        "Hybrid: light that scattered once leaves at random. Shorter rays, more noise, the same brightness",
    ),
    "sss_irradiance_cache": Option(
        "Irradiance Cache",
        "Let Hybrid remember the light on the far sides of objects in a grid about as fine as a mean free path. With "
        "many lamps it leaves 0.25 to 0.8 of the variance; with one lamp it only costs a tenth of the speed. Biased: "
        "averages by up to 0.4 %, blocks of 8 × 8 pixels by about 1 %",
    ),
    "sss_walks": Option(
        "Random Walks",
        "ReSTIR: whether the pixels of a block share their random walks, where nothing else is reused. Not with motion "
        "blur, volumes, or passes of light groups",
        choices=(
            (
                "AUTO",
                "Automatic",
                "Shared in long renders that are not denoised, where a trial at the start shows that it pays",
            ),
            ("OWN", "Own", "Each pixel has its own"),
            (
                "SHARED",
                "Shared",
                "Blocks of 4 × 4 pixels. Measured: 0.25 of the error in the same time where the mean free path of red "
                "light is 100 pixels, 0.45 where it is 30, 0.66 to 0.85 where it is 10; nothing is gained below 3. "
                "Noise is coarser: not for pictures that are denoised",
            ),
        ),
    ),
    "sss_shift": Option(
        "Reuse",
        "ReSTIR: pixels share where light leaves the objects they show, of Hybrid and Diffusion",
        choices=(
            ("NONE", "None", "Each pixel on its own"),
            ("AUTO", "Automatic", "What measures best: Blocks, or Hybrid with Reuse in Time"),
            (
                "BLOCKS",
                "Blocks",
                "All that the pixels of a block have found lights each of them: no rays. Measured in close-ups, in "
                "the same time: 0.06 to 0.14 of path tracing's error, of Hybrid 0.3 to 0.6. Not with motion blur, nor "
                "with reuse of direct light",
            ),
            (
                "RECONNECTION",
                "Reconnection",
                "Samples of neighbors are resampled. The exit is kept: no rays. Measured in close-ups: 0.4 to 0.65 of "
                "the error of as many samples, about that of path tracing in the same time. Not with Reuse in Time: "
                "bright dots stay",
            ),
            ("DELAYED", "Delayed Reconnection", "The exit is looked for again, the light is kept: two rays a path"),
            ("HYBRID", "Hybrid", "Reconnection for exits that are far away, else Delayed Reconnection"),
            ("SEQUENTIAL", "Sequential", "A round of Reconnection, then one of Delayed Reconnection"),
            (
                "SEQUENTIAL_FAST",
                "Sequential, Fast (biased)",
                "Sequential with a ray less for each pixel. Its bias was measured to be below 0.5 %",
            ),
        ),
    ),
    "sss_neighbours": Option(
        "Reuse Neighbors",
        "Pixels that each pixel takes subsurface light from, within two to three scattering lengths and 5 to 30 "
        "pixels, or refraction from, in blocks of 4 × 4 pixels",
        min=1,
        max=15,
    ),
    "sss_temporal": Option(
        "Reuse in Time",
        "Each sample takes subsurface light also from the one before. It raises the noise of final renders, because "
        "samples become copies of each other",
    ),
    "sss_refraction": Option(
        "Refraction Reuse",
        "ReSTIR, Hybrid: pixels share the directions in which light crosses objects straight, by what they find on the "
        "far side. That light alone is resampled, with a shadow ray of its own. Not with an irradiance cache; in place "
        "of Blocks",
        choices=(
            ("NONE", "None", "One direction a sample, which shares a shadow ray with all other exits"),
            (
                "SPATIAL",
                "Spatial",
                "Between neighbors. Measured: 0.04 to 0.2 of that light's error with as many samples, 0.1 to 0.6 of "
                "path tracing's at equal time. Of all light from below, at equal time, 0.8 to 0.95 of ReSTIR's error "
                "without it in dark, clear bodies, else 1.2 to 1.6: what scatters is as noisy as before",
            ),
            (
                "TEMPORAL",
                "Spatial and Temporal",
                "Also with the sample before, for the 3D view. It raises the noise of final renders, because samples "
                "become copies of each other",
            ),
        ),
    ),
    "sss_refraction_samples": Option(
        "Refraction Samples",
        "Directions that each sample of a pixel chooses from before it shares: a ray for each, one shadow ray for all",
        min=1,
        soft_max=8,
        max=64,
    ),
    "sss_after_diffuse": Option(
        "After Diffuse",
        "How subsurface materials look after a diffuse bounce",
        choices=(
            (
                "AS_CYCLES",
                "As Cycles",
                "Like Cycles in this Blender: diffuse for Christensen–Burley; before Blender 5.0 for all methods",
            ),
            ("ALWAYS", "Scatter", "Light scatters below the surface on every bounce: slower, and correct"),
            (
                "DIFFUSE",
                "Diffuse",
                "A diffuse surface of the same color: faster, but other surfaces lose the light that passed through an "
                "object (4 % of the red light in a white room with a wax ball, 40 % in the ball's shadow)",
            ),
        ),
        default="AS_CYCLES",
    ),
    "sss_max_scatters": Option(
        "Max Scatters",
        "For comparisons: most times that light scatters inside a random walk. Light that would scatter more often is "
        "lost. 0 is unlimited, -1 is only light that passes straight through",
        min=-1,
        soft_max=256,
        max=1 << 20,
    ),
    "film_exposure": Option(
        "Exposure", "Multiplies the brightness of all passes of light, before color management", soft_max=10.0
    ),
    "pixel_filter": Option(
        "Filter",
        "How the samples around a pixel's center are weighed",
        choices=(
            ("BLACKMAN_HARRIS", "Blackman–Harris", "Sharp and without steps at edges"),
            ("GAUSSIAN", "Gaussian", "Softer"),
            ("BOX", "Box", "The pixel's own square"),
        ),
    ),
    "filter_width": Option(
        "Width", "Width of the pixel filter. A larger one is softer", min=0.01, soft_max=4.0, max=10.0, unit="PIXEL"
    ),
    "bake_type": Option(
        "Bake Type",
        "What the Bake button renders into the images or color attributes of objects",
        choices=(
            ("COMBINED", "Combined", "All light that the surface sends on, or chosen parts of it"),
            (
                "AO",
                "Ambient Occlusion",
                "How open the surroundings are, up to the world's distance of ambient occlusion",
            ),
            ("SHADOW", "Shadow", "The factor by which other objects darken or brighten the surface"),
            ("POSITION", "Position", "Where the surface is in the world"),
            ("NORMAL", "Normal", "Where the surface looks, bumps included"),
            ("UV", "UV", "Coordinates of the UV map for rendering"),
            ("ROUGHNESS", "Roughness", "Roughness of what reflects or refracts"),
            ("EMIT", "Emission", "Light that the surface gives off itself"),
            ("ENVIRONMENT", "Environment", "The world in the direction from the origin to each point of the surface"),
            ("DIFFUSE", "Diffuse", "Light that is reflected diffusely, its color, or both"),
            ("GLOSSY", "Glossy", "Light that is reflected by glossy surfaces, its color, or both"),
            ("TRANSMISSION", "Transmission", "Light that is let through, its color, or both"),
        ),
        default="COMBINED",
    ),
    "threads": Option(
        "Threads",
        "Processor threads that a render uses. 0: all that the machine has, or as many as Blender is set to",
        max=1024,
    ),
}

VIEW_LAYER_OPTIONS: dict[str, Option] = {
    "use_pass_volume": Option(
        "Volume",
        "Deliver light that scattered inside a volume first: once (Direct) and more often (Indirect)",
        default=False,
    ),
    "use_pass_subsurface": Option(
        "Subsurface",
        "Deliver the light that scattered below surfaces, and its parts that scattered there not at all (Boundary), "
        "once (Single) and more often (Multiple)",
        default=False,
    ),
    "use_pass_visibility": Option(
        "Visibility Estimate",
        "Deliver how much of the light samples at the first surfaces is visible, from 0 (in shadow) to 1, by color "
        "channel. Alpha is the share of samples that found a light. Needs the integrator ReSTIR and "
        "scene.restir.reuse.visibility = REUSED or ESTIMATED, which scripts can set",
        default=False,
    ),
    "use_pass_subsurface_reuse": Option(
        "Subsurface Reuse",
        "Deliver what reuse of subsurface light does. Subsurface Shift: the shares of samples that were found in the "
        "pixel (red), that came with their exit (green), and whose exit was found again (blue). Subsurface Reuse: "
        "confidence, the share of shifts that succeed, and the radius in which neighbors are looked for, in pixels. "
        "Needs the integrator ReSTIR and Reuse by a shift, not Blocks",
        default=False,
    ),
    "use_pass_shadow_catcher": Option(
        "Shadow Catcher",
        "Deliver the factor by which objects darken or brighten shadow catchers, to multiply footage with. Combined "
        "then shows the objects alone",
        default=False,
    ),
    "use_pass_sample_count": Option(
        "Sample Count",
        "Deliver how many samples each pixel got: with a noise threshold noisy pixels get more",
        default=False,
    ),
    "use_pass_denoising": Option(
        "Denoising Data",
        "Deliver what guides a denoiser, for the compositor's Denoise node: albedo, normal, depth, and the picture "
        "before it is denoised",
        default=False,
    ),
}

MATERIAL_OPTIONS: dict[str, Option] = {
    "entry": Option(
        "Entry",
        "How light enters the material. With diffuse entry the color that was set is the color that is seen; with "
        "refraction it is darker: 0.5 looks like 0.45",
        choices=(
            (
                "METHOD",
                "By Method",
                "As Cycles: refracted for Random Walk, half and half for Random Walk (Skin); "
                "diffuse for Christensen–Burley and for a medium of this panel",
            ),
            ("DIFFUSE", "Diffuse", "In all directions evenly. The color that is set is the color that is seen"),
            ("REFRACTIVE", "Refracted", "Refracted by the surface's roughness and IOR"),
            ("SKIN", "Skin", "One half diffuse, one half refracted by a rough surface"),
        ),
        default="METHOD",
    ),
    "use_medium": Option(
        "Medium",
        "Use the medium of this panel for Principled and Subsurface Scattering nodes (a Subsurface Weight of 0 then "
        "counts as 1). A material without such a node becomes the medium. Other engines ignore it",
        default=False,
    ),
    "use_color": Option(
        "Own Color", "Use the color of this panel. Off uses the node's color, with its textures", default=True
    ),
    "color": Option(
        "Color",
        "Color that a thick piece of the material has under even light",
        max=1.0,
        unit="COLOR",
        default=(0.8, 0.8, 0.8),
    ),
    "mean_free_path": Option(
        "Mean Free Path",
        "How far light of each color goes inside the material on average before it hits something. A channel of 0 is "
        "an ordinary diffuse surface",
        soft_max=10.0,
        unit="LENGTH",
        default=(0.01, 0.005, 0.0025),
    ),
    "scale": Option("Scale", "Multiplies all mean free paths", soft_max=100.0, default=1.0),
    "anisotropy": Option(
        "Anisotropy",
        "Where light goes when it scatters: 0 is in all directions evenly, above 0 forwards, below 0 backwards",
        min=-0.99,
        max=0.99,
        default=0.0,
    ),
    "scatter_inside": Option(
        "Scatter Inside",
        "Light that enters by Principled's Transmission scatters by its Subsurface inputs, like candy or jade. Needs "
        "Volume bounces under Light Paths. Cycles renders clear glass there",
        default=False,
    ),
    "medium_priority": Option(
        "Volume Priority",
        "Where volumes overlap, only those of the highest priority count, and the boundaries of others are not seen "
        "inside them. Volumes of the same priority add up, as in Cycles",
        min=None,
        soft_min=-10,
        soft_max=10,
        default=0,
    ),
}
