"""What integrators share on the Python side: how a session drives them, and the INTEGRATOR record."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..context import FrameContext
from ..film import Film
from ..kernels.core.jit import load
from ..kernels.core.memory import address
from ..kernels.core.records import (
    INTEGRATOR,
    MAX_MEDIA,
    RAY_BURLEY_DIFFUSE,
    RAY_NO_REFLECTION,
    RAY_NO_REFRACTION,
    RAY_SUBSURFACE_DIFFUSE,
    SCENE_HAS_SUBSURFACE,
    SCRATCH_BYTES,
)
from ..kernels.subsurface.irradiance_cache import merge
from ..kernels.subsurface.method_table import ANALOG_ESCAPE, CYCLES_BURLEY, EXACT_WALKS, OVERFLOWS, THICKNESS_AWARE
from ..kernels.subsurface.methods import scatter_entries
from ..kernels.subsurface.probe import MAX_HITS
from ..kernels.volume.entries import media_entries
from ..kernels.volume.stack import OVERFLOWS as MEDIA_OVERFLOWS
from ..settings import PASSES, RenderSettings, carries_visibility, filter_table, resamples_below
from .irradiance_cache import IrradianceCache

if TYPE_CHECKING:
    from ..scene.scene import Scene
    from .path.catchers import Catchers
    from .resampling.history import History

Tile = tuple[int, int, int, int]  # x0, y0, x1, y1 in pixels of the film

# What RenderSettings.sss_after_diffuse makes diffuse after a diffuse bounce.
SSS_AFTER_DIFFUSE = {"ALWAYS": 0, "BURLEY_DIFFUSE": RAY_BURLEY_DIFFUSE, "DIFFUSE": RAY_SUBSURFACE_DIFFUSE}


def frame_seed(seed: int, sample: int) -> int:
    """A seed of 31 bits for what all pixels of a frame share."""
    return (seed * 0x9E3779B1 + sample * 0x85EBCA6B + 1) & 0x7FFFFFFF


class Stage(NamedTuple):
    """A step of a batch of samples: `run(item, scratch)` for each item on any thread, in any order; then `finish()`.

    The items are the tiles of the film where none are named. Nothing of the next stage starts before.
    """

    run: Callable[[tuple, np.ndarray], None]
    items: Sequence[tuple] | None = None
    finish: Callable[[], None] = lambda: None


class Integrator:
    """An integrator with a frame's context, settings and a film.

    `kernels()` lists what it calls, `prepare` compiles or loads that; what is called by address (entries) the
    constructor compiles, as far as the scene needs it.

    `stages(first_sample, samples)` are the steps that add these samples to every pixel of the film, of which only the
    last one writes to it; `max_batch` is how many samples they can take at once. `history` is what the integrator of
    the next frame of a sequence may resample, and is given to its constructor; None where nothing is resampled.
    """

    max_batch = 1 << 30

    def __init__(
        self, context: FrameContext, settings: RenderSettings, film: Film, history: History | None = None
    ) -> None:
        scene = context.scene
        film.know_light_groups(scene.light_groups)
        film.load_code()
        self._table = filter_table(settings.pixel_filter, settings.filter_width)
        self.record = integrator_record(settings, self._table)
        self.cache = None
        wanted = settings.sss_irradiance_cache and settings.sss_method == "HYBRID" and not settings.light_groups
        if wanted and scene.record["flags"] & SCENE_HAS_SUBSURFACE:
            self.cache = IrradianceCache(film.pixels)
            self.max_batch = 1
        self._scatter = _scatter_table(scene, settings, self.cache)
        self._media = media_entries(scene.record["flags"])
        self.record[0]["scatter"], self.record[0]["media"] = address(self._scatter), address(self._media)
        self.context, self.settings, self.film, self.history = context, settings, film, None
        self._warnings = scene.warnings
        self._catchers = self._make_catchers() if film.has_catchers and scene.bare else None
        if "Visibility Estimate" in settings.passes and not carries_visibility(settings):
            text = "the pass is empty: it needs the integrator ReSTIR, its shadows reused or estimated"
            scene.warnings.add("Render", "Visibility Estimate", text)
        if "Subsurface Reuse" in settings.passes and not resamples_below(settings):
            text = "the passes are empty: they need the integrator ReSTIR, and a shift as Reuse of subsurface light"
            scene.warnings.add("Render", "Subsurface Reuse", text)

    @property
    def tables(self) -> tuple[np.ndarray, ...]:
        """What the INTEGRATOR record points to; it must outlive copies of the record."""
        return self._table, self._scatter, self._media

    def kernels(self) -> list:
        """The kernels that `stages` run."""
        raise NotImplementedError

    def prepare(self) -> None:
        """Compile the kernels, or load them from the cache, so that the first stage starts at once."""
        more = [*(self._catchers.kernels if self._catchers else []), *([merge] if self.cache else [])]
        load(self.kernels() + more)

    def stages(self, first_sample: int, samples: int) -> list[Stage]:
        """The steps of a batch of samples."""
        raise NotImplementedError

    def add_catchers(self, tile: Tile, scratch: np.ndarray, first_sample: int, samples: int) -> None:
        """Add to a tile of the film what these samples see of shadow catchers, which `stages` see nothing of."""
        if self._catchers:
            self._catchers.render(tile, scratch, first_sample, samples)

    def _make_catchers(self) -> Catchers:
        from .path.catchers import Catchers  # an integrator's kernel, and this is what integrators are made of

        record = self.record.copy()
        if self.cache:
            self._uncached = _scatter_table(self.context.scene, self.settings, None)
            record[0]["scatter"] = address(self._uncached)
        return Catchers(self.context, record, self.film)

    def end_batch(self) -> None:
        """Tell what kernels have noticed, and let them see what they have found."""
        if self.cache:
            self.cache.merge()
        if self._scatter[OVERFLOWS]:
            text = f"more than {MAX_HITS} layers of a surface lie within its scattering length; some are left out"
            self._warnings.add("Render", "Subsurface", text)
        if self._media[MEDIA_OVERFLOWS]:
            text = f"more than {MAX_MEDIA} volumes overlap; some are left out"
            self._warnings.add("Render", "Volume", text)

    @staticmethod
    def scratch() -> np.ndarray:
        """Working memory for one thread."""
        block = np.zeros(SCRATCH_BYTES + 64, np.uint8)
        start = -address(block) % 64
        return block[start : start + SCRATCH_BYTES]


def _scatter_table(scene: Scene, settings: RenderSettings, cache: IrradianceCache | None) -> np.ndarray:
    options = (
        (CYCLES_BURLEY if settings.cycles_burley_kernel else 0)
        | (EXACT_WALKS if settings.exact_walks else 0)
        | (ANALOG_ESCAPE if settings.sss_analog_escape else 0)
        | (THICKNESS_AWARE if settings.sss_thickness_aware else 0)
    )
    return scatter_entries(scene.record["flags"], settings.sss_method, options, cache.address if cache else 0)


def integrator_record(settings: RenderSettings, table: np.ndarray) -> np.ndarray:
    """The INTEGRATOR record (1,) for `settings`; `table` is its pixel filter's table and must outlive the record."""
    record = np.zeros(1, INTEGRATOR)
    r = record[0]
    r["seed"] = settings.seed & 0x7FFFFFFF
    r["filter_table"] = address(table)
    r["first_centered"] = any(item.name in settings.passes for item in PASSES if item.field and not item.averaged)
    r["transparent_film"] = settings.film_transparent
    glass = settings.film_transparent and settings.film_transparent_glass
    r["seen_through"] = settings.film_transparent_roughness**4 if glass else -1.0
    r["pass_alpha_threshold"] = settings.pass_alpha_threshold
    r["graded_features"] = settings.graded_features
    mist = settings.mist
    r["mist_start"], r["mist_density"], r["mist_power"] = mist.start, 1.0 / max(mist.depth, 1e-30), mist.power
    r["occlusion_distance"] = settings.occlusion_distance
    r["after_diffuse"] = (
        (0 if settings.caustics_reflective else RAY_NO_REFLECTION)
        | (0 if settings.caustics_refractive else RAY_NO_REFRACTION)
        | SSS_AFTER_DIFFUSE[settings.sss_after_diffuse]
    )
    r["max_scatters"] = {0: -1, -1: 0}.get(settings.sss_max_scatters, settings.sss_max_scatters)
    # A path of n bounces still finds light by its last ray, which therefore counts.
    kinds = ("max", "diffuse", "glossy", "transmission", "transparent", "volume")
    for name in (f"{kind}_bounces" for kind in kinds):
        r[name] = getattr(settings, name) + 1
    r["min_bounces"] = settings.min_bounces + 1  # the surface after so many is still shaded, as in Cycles
    r["transparent_path"] = settings.transparent_bounces + settings.extra_transparent
    # A clamp is the mean of the channels, of which kernels take the sum.
    r["clamp_direct"] = 3.0 * settings.clamp_direct or math.inf
    r["clamp_indirect"] = 3.0 * settings.clamp_indirect or math.inf
    r["filter_glossy"] = 1.0 / settings.filter_glossy if settings.filter_glossy > 0.0 else math.inf
    return record
