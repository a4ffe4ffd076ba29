"""Settings of a render as one frozen dataclass, and the table of render passes."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from .reuse_settings import ReuseSettings
from .scene.cryptomatte import KINDS
from .scene.errors import SceneError


class Aov(NamedTuple):
    """A pass that AOV Output nodes of its name write to: 1 channel (Value) or 4 (Color)."""

    name: str
    channels: int


class Mist(NamedTuple):
    """The pass Mist: 0 up to the start (m), 1 from start + depth on, the distance between to the power in between."""

    start: float = 5.0
    depth: float = 25.0
    power: float = 2.0


@dataclass(frozen=True)
class RenderSettings:
    """What the artist asked for. Clamps and thresholds of 0 are off; a time limit of 0 is none."""

    integrator: str = "PATH"  # PATH, RESTIR: what a scene has unless it is changed
    samples: int = 128
    sample_offset: int = 0  # of the scene's samples: those from this one on,
    sample_subset: int = 0  # so many; 0: all that follow
    scene_samples: int = 0  # that those two count, where a view layer has samples of its own; 0: samples
    seed: int = 0
    time_limit: float = 0.0  # seconds
    threads: int = 0  # 0: all
    max_bounces: int = 12
    diffuse_bounces: int = 4
    glossy_bounces: int = 4
    transmission_bounces: int = 12
    volume_bounces: int = 0
    transparent_bounces: int = 8
    extra_transparent: bool = False  # paths, but not shadows, may cross one more: Cycles before Blender 5
    graded_features: bool = True  # of the denoiser: Cycles from Blender 5.2 on, see kernels.lobes.passes
    min_bounces: int = 0  # bounces before Russian roulette starts
    clamp_direct: float = 0.0
    clamp_indirect: float = 0.0
    filter_glossy: float = 0.0
    caustics_reflective: bool = True
    caustics_refractive: bool = True
    sss_method: str = "FROM_MATERIAL"  # FROM_MATERIAL, RANDOM_WALK, HYBRID, DIFFUSION
    sss_thickness_aware: bool = True  # HYBRID
    sss_analog_escape: bool = False  # HYBRID
    sss_irradiance_cache: bool = False  # HYBRID
    cycles_burley_kernel: bool = False
    exact_walks: bool = False
    sss_shift: str = "AUTO"  # RESTIR: NONE, AUTO, BLOCKS, RECONNECTION, DELAYED, HYBRID, SEQUENTIAL, SEQUENTIAL_FAST
    sss_walks: str = "AUTO"  # RESTIR: AUTO, OWN, SHARED: whether pixels share random walks
    sss_neighbours: int = 8  # pixels that each takes subsurface light from
    sss_temporal: bool = False  # and from the frame before
    sss_refraction: str = "NONE"  # RESTIR, HYBRID, what crosses straight: NONE, SPATIAL, TEMPORAL (and spatial)
    sss_refraction_samples: int = 2  # directions in which it is looked for
    sss_max_scatters: int = 0  # scattering events that a random walk may have; 0: unlimited, -1: none
    sss_after_diffuse: str = "BURLEY_DIFFUSE"  # ALWAYS, BURLEY_DIFFUSE, DIFFUSE: which methods are diffuse from then on
    pixel_filter: str = "BLACKMAN_HARRIS"  # BOX, GAUSSIAN, BLACKMAN_HARRIS
    filter_width: float = 1.5  # pixels
    film_transparent: bool = False
    film_transparent_glass: bool = False  # what refracts shows that as well, as long as it is not rougher than this:
    film_transparent_roughness: float = 0.1
    film_exposure: float = 1.0
    pass_alpha_threshold: float = 0.5
    mist: Mist = field(default_factory=Mist)
    occlusion_distance: float = 10.0  # m, how far the pass Ambient Occlusion looks
    use_denoising: bool = False
    denoising_quality: str = "HIGH"  # FAST, BALANCED, HIGH
    use_adaptive_sampling: bool = False
    adaptive_threshold: float = 0.01  # of the noise, as Cycles measures it
    adaptive_min_samples: int = 0  # 0: by the threshold
    reuse: ReuseSettings = field(default_factory=ReuseSettings)  # RESTIR
    passes: frozenset[str] = frozenset({"Combined"})
    aovs: tuple[Aov, ...] = ()
    first_surface_only: bool = False  # nothing is asked for but what the first surface is, and gives off itself
    light_groups: tuple[str, ...] = ()  # of the view layer, at most MOST_LIGHT_GROUPS

    @property
    def sample_range(self) -> range:
        """The samples that are taken, out of range(samples); a view layer's are the share that is the scene's."""
        whole, first = self.total_samples, self.sample_offset
        last = min(first + self.sample_subset, whole) if self.sample_subset else whole
        return range(first * self.samples // whole, last * self.samples // whole)

    @property
    def total_samples(self) -> int:
        """What sample ranges are of."""
        return self.scene_samples or self.samples

    def require_samples(self) -> None:
        """Raise SceneError where the range begins behind the last sample."""
        if self.sample_offset >= self.total_samples:
            raise SceneError(
                f"The range of samples begins after {self.sample_offset}, but there are {self.total_samples}: lower "
                "Offset or raise Samples in Render Properties > Sampling."
            )

    @property
    def is_part(self) -> bool:
        """Whether the render is of some samples alone, to be merged with the others."""
        return self.sample_offset > 0 or 0 < self.sample_subset < self.total_samples

    @property
    def share(self) -> float:
        """What is taken of all samples: from 0 to 1."""
        return len(self.sample_range) / self.samples


def is_denoised(settings: RenderSettings) -> bool:
    """Whether the picture is to be denoised, here or by who asks for what denoisers need."""
    return settings.use_denoising or any(name.startswith("Denoising") for name in settings.passes)


def resampled_shift(settings: RenderSettings) -> str:
    """How samples of subsurface light are shifted that are resampled; NONE: they are not (blocks share all of theirs).

    What is best in time is told by docs/results/restir-sss.md.
    """
    if settings.sss_shift == "AUTO":
        return "HYBRID" if settings.sss_temporal else "NONE"
    return "NONE" if settings.sss_shift == "BLOCKS" else settings.sss_shift


def resamples_below(settings) -> bool:
    """Whether samples of subsurface light are resampled where there are any; `settings`: as for carries_visibility."""
    return settings.integrator == "RESTIR" and resampled_shift(settings) != "NONE"


def carries_visibility(settings) -> bool:
    """Whether samples keep a visibility V̄ of their own; `settings`: RenderSettings, or properties of those names."""
    return settings.integrator == "RESTIR" and settings.reuse.visibility in ("REUSED", "ESTIMATED")


@dataclass(frozen=True)
class Pass:
    """A render pass.

    `field` names its offset in the kernels' FILM record ("": no kernel writes it, the integrator does), `divide` the
    pass that its sum is divided by.
    """

    name: str  # Blender 5.0 and later
    name_4: str  # Blender 4.5
    field: str
    channels: str  # as RenderEngine.register_pass wants it; its length is the number of channels
    kind: str  # VALUE, VECTOR, COLOR
    view_layer: str  # the ViewLayer property that switches it on; "" where none does
    own: str = ""  # then the property of view_layer.restir that does; "": it is there for another to be divided by
    divide: str = ""
    averaged: bool = True  # False: the first sample's value
    slots: str = ""  # the kind of Cryptomatte whose slots it holds two of
    light: bool = False  # sums of light, by kernels.film.contribute; else it describes the first surface
    light_group: bool = False  # the light that began at members of one group
    aov: bool = False  # shader programs write it, see kernels.film.surface_passes.write_aovs


def _light(name: str, short: str, prefix: str, prop: str) -> list[Pass]:
    """The direct, indirect and colour passes of a class of lobes."""
    color = Pass(f"{name} Color", f"{short}Col", f"{prefix}_color", "RGB", "COLOR", f"use_pass_{prop}_color")
    return [
        Pass(f"{name} {half}", f"{short}{half[:3]}", f"{prefix}_{half.lower()}", "RGB", "COLOR",
             f"use_pass_{prop}_{half.lower()}", divide=color.name, light=True)
        for half in ("Direct", "Indirect")
    ] + [color]  # fmt: skip


def _subsurface(part: str) -> Pass:
    """Light that was scattered below a surface: all of it, or a part by the number of scattering events."""
    name, field = f"Subsurface {part}".strip(), f"subsurface_{part.lower()}".strip("_")
    return Pass(name, f"SSS{part}", field, "RGB", "COLOR", "", own="use_pass_subsurface", light=True)


MAX_CRYPTOMATTES = 8  # passes a kind, of two slots each


def cryptomatte(kind: str, number: int) -> str:
    """The name of a pass of Cryptomatte."""
    return f"Crypto{kind}{number:02d}"


def _cryptomattes(kind: str) -> list[Pass]:
    """The passes of one kind of Cryptomatte, by coverage; kernels write to all by the first one's field.

    Blender saves what has small letters for channels in full precision, also in a file of half floats.
    """
    names = [cryptomatte(kind, number) for number in range(MAX_CRYPTOMATTES)]
    fields = [f"crypto_{kind.lower()}", *[""] * (MAX_CRYPTOMATTES - 1)]
    return [
        Pass(name, name, field, "rgba", "COLOR", f"use_pass_cryptomatte_{kind.lower()}", slots=kind)
        for name, field in zip(names, fields, strict=True)
    ]


SAMPLE_COUNT = "Debug Sample Count"  # as Cycles names it
NOISY_IMAGE = "Noisy Image"  # Combined before it is denoised
# There where `graded_features` is: both or neither.
SPECULAR_ALBEDO, DENOISING_ROUGHNESS = "Denoising Specular Albedo", "Denoising Roughness"
ROUGHNESS, SURROUNDINGS = "Roughness", "Surroundings"
# Light on shadow catchers; without what is no catcher; and the world behind them, by which Combined shows them.
SHADOW_CATCHER, BARE_CATCHER, CATCHER_BACKDROP = "Shadow Catcher", "Bare Catcher", "Catcher Backdrop"

PASSES: tuple[Pass, ...] = (
    Pass("Combined", "Combined", "combined", "RGBA", "COLOR", "use_pass_combined", light=True),
    Pass("Depth", "Depth", "depth", "Z", "VALUE", "use_pass_z", averaged=False),
    Pass("Normal", "Normal", "normal", "XYZ", "VECTOR", "use_pass_normal"),
    Pass("Position", "Position", "position", "XYZ", "VECTOR", "use_pass_position", averaged=False),
    Pass("UV", "UV", "uv", "UVA", "VECTOR", "use_pass_uv"),
    Pass("Object Index", "IndexOB", "object_index", "X", "VALUE", "use_pass_object_index", averaged=False),
    Pass("Material Index", "IndexMA", "material_index", "X", "VALUE", "use_pass_material_index", averaged=False),
    Pass("Mist", "Mist", "mist", "Z", "VALUE", "use_pass_mist"),
    Pass("Vector", "Vector", "vector", "XYZW", "VECTOR", "use_pass_vector", divide="Vector Weight"),
    Pass("Vector Weight", "Vector Weight", "vector_weight", "X", "VALUE", ""),  # samples that have one
    *_light("Diffuse", "Diff", "diffuse", "diffuse"),
    *_light("Glossy", "Gloss", "glossy", "glossy"),
    *_light("Transmission", "Trans", "transmission", "transmission"),
    Pass("Volume Direct", "VolumeDir", "volume_direct", "RGB", "COLOR", "", own="use_pass_volume", light=True),
    Pass("Volume Indirect", "VolumeInd", "volume_indirect", "RGB", "COLOR", "", own="use_pass_volume", light=True),
    Pass("Emission", "Emit", "emission", "RGB", "COLOR", "use_pass_emit", light=True),
    Pass("Environment", "Env", "environment", "RGB", "COLOR", "use_pass_environment", light=True),
    Pass("Ambient Occlusion", "AO", "ambient_occlusion", "RGB", "COLOR", "use_pass_ambient_occlusion"),
    # Of bakes: the roughness of what is opaque; the world in the direction of the surface's place from the origin.
    Pass(ROUGHNESS, ROUGHNESS, "roughness", "X", "VALUE", ""),
    Pass(SURROUNDINGS, SURROUNDINGS, "surroundings", "RGB", "COLOR", ""),
    # Light that was scattered below a surface; by what happened there at the first time, however the path went on.
    *(_subsurface(part) for part in ("", "Boundary", "Single", "Multiple")),
    # V̄ by channel, and the share of the samples that have one; both by all samples (associated alpha).
    Pass("Visibility Estimate", "Visibility", "", "RGBA", "COLOR", "", own="use_pass_visibility"),
    # How samples of subsurface light got to a pixel: shares of those found there, kept, found again, and of all there
    # are. Confidence, share of the shifts that succeed, radius of the search in pixels.
    Pass("Subsurface Shift", "SSSShift", "", "RGBA", "COLOR", "", own="use_pass_subsurface_reuse"),
    Pass("Subsurface Reuse", "SSSReuse", "", "XYZ", "VECTOR", "", own="use_pass_subsurface_reuse"),
    Pass(SAMPLE_COUNT, SAMPLE_COUNT, "", "X", "VALUE", "", own="use_pass_sample_count", averaged=False),
    Pass(
        SHADOW_CATCHER,
        SHADOW_CATCHER,
        "",
        "RGB",
        "COLOR",
        "",
        own="use_pass_shadow_catcher",
        divide=BARE_CATCHER,
    ),
    Pass(BARE_CATCHER, BARE_CATCHER, "", "RGBA", "COLOR", ""),
    Pass(CATCHER_BACKDROP, CATCHER_BACKDROP, "", "RGB", "COLOR", ""),
    Pass("Denoising Albedo", "Denoising Albedo", "denoising_albedo", "RGB", "COLOR", "", own="use_pass_denoising"),
    Pass("Denoising Normal", "Denoising Normal", "denoising_normal", "XYZ", "VECTOR", "", own="use_pass_denoising"),
    Pass("Denoising Depth", "Denoising Depth", "denoising_depth", "Z", "VALUE", "", own="use_pass_denoising"),
    Pass(SPECULAR_ALBEDO, SPECULAR_ALBEDO, "denoising_specular", "RGB", "COLOR", "", own="use_pass_denoising"),
    Pass(DENOISING_ROUGHNESS, DENOISING_ROUGHNESS, "denoising_roughness", "X", "VALUE", "", own="use_pass_denoising"),
    Pass(NOISY_IMAGE, NOISY_IMAGE, "", "RGBA", "COLOR", "", own="use_pass_denoising"),
    # Last, since they are no sums.
    *(item for kind in KINDS for item in _cryptomattes(kind)),
)
PASS_BY_NAME = {p.name: p for p in PASSES}
DENOISING_PASSES = frozenset({"Denoising Albedo", "Denoising Normal"})


def aov_passes(aovs: tuple[Aov, ...]) -> list[Pass]:
    """The passes of AOVs, whose channels follow one another in the film."""
    return [
        Pass(aov.name, aov.name, "", *(("X", "VALUE") if aov.channels == 1 else ("RGBA", "COLOR")), "", aov=True)
        for aov in aovs
    ]


def aov_channels(aovs: tuple[Aov, ...]) -> dict[str, tuple[int, int]]:
    """(first channel among those of all AOVs, number of channels) by name."""
    starts = np.cumsum([0, *(aov.channels for aov in aovs)])
    return {aov.name: (int(start), aov.channels) for aov, start in zip(aovs, starts, strict=False)}


MOST_LIGHT_GROUPS = 127  # a reservoir keeps the number of one in 8 bits


def light_group_passes(names: tuple[str, ...]) -> list[Pass]:
    """The passes of light groups, as Cycles names them; their channels follow one another in the film."""
    found = [f"Combined_{name}" for name in names]
    return [Pass(name, name, "", "RGB", "COLOR", "", light=True, light_group=True) for name in found]


def shown_passes(names: frozenset[str], aovs: tuple[Aov, ...], light_groups: tuple[str, ...] = ()) -> list[Pass]:
    """The passes that Blender is given, in table order."""
    return [item for item in PASSES if item.name in names] + aov_passes(aovs) + light_group_passes(light_groups)


def required_passes(
    names: frozenset[str],
    denoising: bool,
    aovs: tuple[Aov, ...] = (),
    light_groups: tuple[str, ...] = (),
    catchers: bool = False,
) -> list[Pass]:
    """The passes to accumulate, in table order: those asked for, those they are divided by, and the denoiser's.

    catchers: there are shadow catchers, which Combined shows unless their pass is asked for, as in Cycles.
    """
    wanted = {"Combined", *names}
    if catchers and SHADOW_CATCHER not in names:
        wanted |= {SHADOW_CATCHER, BARE_CATCHER, CATCHER_BACKDROP}
    wanted |= {PASS_BY_NAME[name].divide for name in names if PASS_BY_NAME[name].divide}
    if denoising:
        wanted |= DENOISING_PASSES
    found = [p for p in PASSES if p.name in wanted]
    first_slots = next((k for k, item in enumerate(found) if item.slots), len(found))
    return found[:first_slots] + aov_passes(aovs) + light_group_passes(light_groups) + found[first_slots:]


def carried_passes(names: frozenset[str], denoising: bool, adaptive: bool, catchers: bool) -> frozenset[str]:
    """The passes that a render of some of the samples delivers, so that nothing is lost when it is merged.

    They are those asked for, what these are divided by, what the denoiser and what shadow catchers need, and the
    samples of each pixel where pixels differ.
    """
    carried = {item.name for item in required_passes(names, denoising, catchers=catchers)}
    return frozenset(carried | ({SAMPLE_COUNT} if adaptive else set()))


def _blackman_harris(x: np.ndarray) -> np.ndarray:
    v = 2.0 * np.pi * (x + 0.5)
    return 0.35875 - 0.48829 * np.cos(v) + 0.14128 * np.cos(2 * v) - 0.01168 * np.cos(3 * v)


# Density over [-1/2, 1/2] of the filter's extent, and the extent in units of the width that the artist sets.
_FILTERS = {
    "BOX": (np.ones_like, 1.0),
    "GAUSSIAN": (lambda x: np.exp(-2.0 * (6.0 * x) ** 2), 3.0),
    "BLACKMAN_HARRIS": (_blackman_harris, 2.0),
}


def filter_table(kind: str, width: float, size: int = 1025) -> np.ndarray:
    """Inverse cumulative distribution of a pixel filter: float32 (size,), offsets in pixels from the pixel's centre."""
    if kind == "BOX":
        width = 1.0
    x = np.linspace(-0.5, 0.5, 4097)
    function, extent = _FILTERS[kind]
    density = function(x)
    cdf = np.concatenate([[0.0], np.cumsum(0.5 * (density[1:] + density[:-1]))])
    offsets = np.interp(np.linspace(0.0, 1.0, size), cdf / cdf[-1], x)
    return np.ascontiguousarray(offsets * width * extent, np.float32)
