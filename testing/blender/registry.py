"""The list of scenes: what each one is rendered with and how close it has to come."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

# Bounds of a group: relative difference of the image means, and FLIP above that between two seeds of Cycles.
BOUNDS = {1: (0.005, 0.01), 2: (0.02, 0.03), 3: (0.01, 0.015), 4: (0.01, 0.015)}  # 4: media that vary


@dataclass(frozen=True)
class Scene:
    """`samples` are those of each of the four images: two seeds for each engine."""

    name: str
    build: Callable[[], None]
    group: int
    samples: int
    size: tuple[int, int]
    settings: dict = field(default_factory=dict)
    deep: bool = False  # rendered with --deep alone
    alike: bool = False  # in all versions of Blender: the older one renders it with --deep alone


SCENES: dict[str, Scene] = {}


def scene(
    group: int,
    samples: int = 96,
    size: tuple[int, int] = (96, 54),
    deep: bool = False,
    alike: bool | None = None,
    **settings,
):
    """Register a function that builds a scene; `settings` replace parity settings by our name, or are ours alone.

    alike: see Scene; None: those of group 3 are, whose renders take longest.
    """

    def register(build: Callable[[], None]) -> Callable[[], None]:
        same = group == 3 if alike is None else alike
        SCENES[build.__name__] = Scene(build.__name__, build, group, samples, size, settings, deep, same)
        return build

    return register
