"""All scenes, in the order of their modules."""

from dataclasses import replace

from ..registry import SCENES, Scene
from . import (
    camera,
    displacement,
    geometry,
    hair,
    light,
    lobes,
    motion,
    smoke,
    strands,
    strangers,
    subsurface,
    texture,
    volume,
)

__all__ = ["SCENES", "scaled"]
MODULES = (
    light,
    geometry,
    displacement,
    camera,
    texture,
    lobes,
    hair,
    subsurface,
    volume,
    smoke,
    motion,
    strands,
    strangers,
)


def scaled(item: Scene, factor: float) -> Scene:
    """A scene with another number of samples."""
    return replace(item, samples=max(1, round(item.samples * factor)))
