"""All scenes, in the order of their modules."""

from dataclasses import replace

from . import (
    scenes_camera,
    scenes_geometry,
    scenes_light,
    scenes_lobes,
    scenes_subsurface,
    scenes_texture,
    scenes_volume,
)
from .registry import SCENES, Scene

__all__ = ["SCENES", "scaled"]
MODULES = (
    scenes_light,
    scenes_geometry,
    scenes_camera,
    scenes_texture,
    scenes_lobes,
    scenes_subsurface,
    scenes_volume,
)


def scaled(item: Scene, factor: float) -> Scene:
    """A scene with another number of samples."""
    return replace(item, samples=max(1, round(item.samples * factor)))
