"""Rendering one scene with either engine in this process, at settings that mean the same to both."""

from __future__ import annotations

import atexit
import os
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np

from restir_engine import engine

from ..measures import flip, standard_error
from ..statistics import Sequential, Verdict
from . import kit
from .registry import BOUNDS, Scene

# Settings of both engines: our name, Cycles' name, the value.
SHARED = (
    ("max_bounces", "max_bounces", 8),
    ("diffuse_bounces", "diffuse_bounces", 8),
    ("glossy_bounces", "glossy_bounces", 8),
    ("transmission_bounces", "transmission_bounces", 8),
    ("volume_bounces", "volume_bounces", 0),
    ("transparent_bounces", "transparent_max_bounces", 8),
    ("min_bounces", "min_light_bounces", 0),
    ("clamp_direct", "sample_clamp_direct", 0.0),
    ("clamp_indirect", "sample_clamp_indirect", 0.0),
    ("filter_glossy", "blur_glossy", 0.0),
    ("caustics_reflective", "caustics_reflective", True),
    ("caustics_refractive", "caustics_refractive", True),
    ("film_exposure", "film_exposure", 1.0),
    ("pixel_filter", "pixel_filter_type", "BLACKMAN_HARRIS"),
    ("filter_width", "filter_width", 1.5),
    ("use_denoising", "use_denoising", False),
    ("use_adaptive_sampling", "use_adaptive_sampling", False),
    ("use_animated_seed", "use_animated_seed", False),
)
# What only Cycles has, and has to leave out.
CYCLES = {
    "device": "CPU",
    "use_guiding": False,
    "use_fast_gi": False,
    "texture_limit_render": "OFF",
    "light_sampling_threshold": 0.0,
    "min_transparent_bounces": 0,
    "use_auto_tile": False,
}


def register() -> None:
    """Add the engine; bpy 4.5 can hang at exit while a class is registered."""
    engine.register()
    atexit.register(engine.unregister)


def prepare(item: Scene) -> None:
    """Build the scene in an empty file, with its settings."""
    scene = kit.reset()
    scene.render.resolution_x, scene.render.resolution_y = item.size
    scene.render.resolution_percentage = 100
    exact_files(scene)
    kit.assign(scene.cycles, CYCLES)
    for ours, theirs, value in SHARED:
        value = item.settings.get(ours, value)
        setattr(scene.cycles, theirs, value)
        setattr(scene.restir, ours, value)
    scene.restir.integrator = "PATH"
    kit.assign(scene.restir, {name: value for name, value in item.settings.items() if hasattr(scene.restir, name)})
    scene.restir.is_initialized = True
    item.build()


def exact_files(scene: bpy.types.Scene) -> None:
    """Let a scene's pictures be written as they are."""
    settings = scene.render.image_settings
    if hasattr(settings, "media_type"):
        settings.media_type = "IMAGE"
    settings.file_format, settings.color_mode, settings.color_depth = "OPEN_EXR", "RGBA", "32"
    settings.exr_codec = "NONE"


def exact_layers(scene: bpy.types.Scene) -> None:
    """Let all passes of all layers and views be written as they are, to one file: see `exr.channels`."""
    exact_files(scene)
    settings = scene.render.image_settings
    if hasattr(settings, "media_type"):
        settings.media_type, settings.use_exr_interleave = "MULTI_LAYER_IMAGE", True
    settings.file_format, settings.views_format = "OPEN_EXR_MULTILAYER", "MULTIVIEW"


def render(name: str, samples: int, seed: int) -> np.ndarray:
    """The Combined pass (height, width, 4) of the current scene, rows bottom to top."""
    scene = bpy.context.scene
    scene.render.engine = name
    for settings in (scene.cycles, scene.restir):
        settings.samples, settings.seed = samples, seed
    with tempfile.TemporaryDirectory() as folder:
        scene.render.filepath = str(Path(folder) / "render.exr")
        bpy.ops.render.render(write_still=True)
        return read(scene.render.filepath)


@contextmanager
def quiet() -> Iterator[None]:
    """Keep Blender's progress lines out of the standard output."""
    sys.stdout.flush()
    keep, null = os.dup(1), os.open(os.devnull, os.O_WRONLY)
    os.dup2(null, 1)
    try:
        yield
    finally:
        sys.stdout.flush()
        os.dup2(keep, 1)
        os.close(keep)
        os.close(null)


def read(path: str) -> np.ndarray:
    """Values of an image file without colour management."""
    image = bpy.data.images.load(path)
    image.colorspace_settings.is_data = True
    pixels = np.empty(image.size[0] * image.size[1] * 4, np.float32)
    image.pixels.foreach_get(pixels)
    result = pixels.reshape(image.size[1], image.size[0], 4)
    bpy.data.images.remove(image)
    return result


def save(path: Path, values: np.ndarray) -> None:
    """Write sRGB values (height, width, 3), rows bottom to top, to a PNG."""
    height, width, _ = values.shape
    image = bpy.data.images.new(path.stem, width, height)
    image.pixels.foreach_set(np.dstack([values, np.ones((height, width))]).astype(np.float32).ravel())
    image.file_format, image.filepath_raw = "PNG", str(path)
    image.save()
    bpy.data.images.remove(image)


@dataclass(frozen=True)
class Comparison:
    """Two seeds of Cycles (`reference`) and two of ours (`ours`); seconds for both images of each engine."""

    scene: Scene
    reference: tuple[np.ndarray, np.ndarray]
    ours: tuple[np.ndarray, np.ndarray]
    seconds: tuple[float, float]

    @property
    def difference(self) -> np.ndarray:
        """Relative difference of the means by channel; of alpha, the difference itself."""
        return (self._mean(self.ours) - self._mean(self.reference)) / self._scale

    @property
    def error(self) -> np.ndarray:
        """Standard error of `difference`."""
        return np.hypot(*self.errors)

    @property
    def errors(self) -> list[np.ndarray]:
        """Standard errors of the two means, relative as in `difference`."""
        return [standard_error(*images) / self._scale for images in (self.reference, self.ours)]

    @property
    def flip(self) -> float:
        """FLIP of ours against Cycles, one seed each."""
        return flip(self.ours[0], self.reference[0])

    @property
    def flip_noise(self) -> float:
        """FLIP between two seeds of Cycles."""
        return flip(self.reference[1], self.reference[0])

    @property
    def _scale(self) -> np.ndarray:
        return np.append(np.maximum(self._mean(self.reference)[:3], 1e-6), 1.0)

    @staticmethod
    def _mean(images: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
        return np.mean(images, (0, 1, 2), dtype=np.float64)

    def told(self) -> bool:
        """Whether fewer than all samples tell: the means within their bounds or beyond, and FLIP within its bound.

        One difference of a bound in a hundred passes, one within it in a thousand is taken for one beyond. Noise hides
        a part of what FLIP sees with all samples.
        """
        mean_bound, flip_bound = BOUNDS[self.scene.group]
        test = Sequential(mean_bound, mean_bound, false_alarm=0.001, miss=0.01, looks=len(SHARES))
        verdict = test.look(self.difference, self.error)
        alike = verdict is Verdict.SAME and self.flip <= self.flip_noise + flip_bound
        return alike or verdict is Verdict.DIFFERENT

    def failures(self) -> list[str]:
        """What is out of bounds, and what was measured too coarsely to tell."""
        mean_bound, flip_bound = BOUNDS[self.scene.group]
        lines = []
        if not all(np.isfinite(image).all() for image in (*self.reference, *self.ours)):
            lines.append("pixels that are not finite")
        for channel, off, error in zip("RGBA", self.difference, self.error, strict=True):
            if not abs(off) <= mean_bound:
                lines.append(f"{channel}: {off:+.2%} ± {error:.2%} of the mean, bound {mean_bound:.1%}")
            if not error <= mean_bound / 2:
                lines.append(f"{channel}: standard error {error:.2%} is too large for a bound of {mean_bound:.1%}")
        if not self.flip <= self.flip_noise + flip_bound:
            lines.append(f"FLIP {self.flip:.4f}, between two seeds {self.flip_noise:.4f}, bound +{flip_bound}")
        return lines


# Of a scene's samples, what each look adds; in all a quarter more than at once, as parts are less well stratified.
SHARES = (0.125, 0.125, 0.25, 0.75)


def compare(item: Scene, ours: str = "RESTIR") -> Comparison:
    """Render a scene twice with Cycles and twice with `ours`."""
    return next(comparisons(item, ours, (1.0,)))


def compare_until_told(item: Scene, ours: str = "RESTIR") -> Comparison:
    """The first comparison that tells, or that of all samples."""
    for comparison in comparisons(item, ours, SHARES):
        if comparison.told():
            break
    return comparison


def comparisons(item: Scene, ours: str, shares: Sequence[float]) -> Iterator[Comparison]:
    """Comparisons of ever more samples, each with all of those before; each share has seeds of its own."""
    prepare(item)
    kinds = (("CYCLES", (1, 2)), (ours, (3, 4)))
    done, images, seconds = 0, [[0.0, 0.0], [0.0, 0.0]], [0.0, 0.0]
    for number, share in enumerate(shares):
        samples = max(1, round(share * item.samples))
        for kind, (name, seeds) in enumerate(kinds):
            start = time.perf_counter()
            for i, seed in enumerate(seeds):
                new = render(name, samples, seed + 4 * number)
                images[kind][i] = (done * images[kind][i] + samples * new) / (done + samples)
            seconds[kind] += time.perf_counter() - start
        done += samples
        yield Comparison(item, *(tuple(pair) for pair in images), tuple(seconds))
