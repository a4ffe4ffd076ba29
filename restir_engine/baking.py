"""What a bake is made of: the passes that are rendered for each kind, and the picture that they add up to."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from .settings import ROUGHNESS, SHADOW_CATCHER, SURROUNDINGS, RenderSettings

if TYPE_CHECKING:
    from .film import Film  # which needs compiled code, and a panel asks here for the parts

Parts = frozenset[str]  # of EMIT, DIRECT, INDIRECT, COLOR, DIFFUSE, GLOSSY, TRANSMISSION
HALVES = ("DIRECT", "INDIRECT")
LOBES = ("DIFFUSE", "GLOSSY", "TRANSMISSION")
ALL_LIGHT = frozenset({"EMIT", *HALVES, *LOBES})


class Bake(NamedTuple):
    """How a kind of bake is rendered; `parts` are those that the artist has chosen."""

    passes: Callable[[Parts], list[str]]
    picture: Callable[[Film, Parts], np.ndarray]  # float32 (height, width, 1 or 3)
    is_light: bool = False  # its noise is that of light, by which adaptive sampling goes


def _described(name: str) -> Bake:
    """One that is a pass, whatever the parts."""
    return Bake(lambda parts: [name], lambda film, parts: film.pass_array(name))


def _halves(lobe: str, parts: Parts) -> list[str]:
    """The light passes of a class of lobes that are asked for."""
    return [f"{lobe.title()} {half.title()}" for half in HALVES if half in parts]


def _lobe_passes(lobe: str) -> Callable[[Parts], list[str]]:
    return lambda parts: _halves(lobe, parts) or [f"{lobe.title()} Color"]


def _lobe_picture(lobe: str) -> Callable[[Film, Parts], np.ndarray]:
    """Light that a class of lobes sends on, with its colour or without; the colour where no light is asked for."""

    def picture(film: Film, parts: Parts) -> np.ndarray:
        names = _halves(lobe, parts)
        if not names:
            return film.pass_array(f"{lobe.title()} Color")
        return sum((film.mean if "COLOR" in parts else film.pass_array)(name) for name in names)

    return picture


def _combined_passes(parts: Parts) -> list[str]:
    """The passes that add up to a part of Combined."""
    if parts >= ALL_LIGHT:
        return []
    names = [name for lobe in LOBES if lobe in parts for name in _halves(lobe, parts)]
    return names + _halves("VOLUME", parts) + (["Emission"] if "EMIT" in parts else [])


def _combined_picture(film: Film, parts: Parts) -> np.ndarray:
    return sum(
        (film.mean(name) for name in _combined_passes(parts)), np.zeros((film.height, film.width, 3), np.float32)
    )


BAKES: dict[str, Bake] = {
    "COMBINED": Bake(_combined_passes, _combined_picture, is_light=True),
    "AO": _described("Ambient Occlusion"),
    "SHADOW": _described(SHADOW_CATCHER)._replace(is_light=True),
    "POSITION": _described("Position"),
    "NORMAL": _described("Normal"),
    "UV": _described("UV"),
    "ROUGHNESS": _described(ROUGHNESS),
    "EMIT": _described("Emission"),
    "ENVIRONMENT": _described(SURROUNDINGS),
    **{lobe: Bake(_lobe_passes(lobe), _lobe_picture(lobe), is_light=True) for lobe in LOBES},
}


def bake_settings(settings: RenderSettings, kind: str, parts: Parts) -> RenderSettings:
    """The settings of a bake where a final render has these: path tracing, of what the kind needs and no more."""
    bake = BAKES[kind]
    lit = bake.is_light and (kind == "SHADOW" or bool(parts & set(HALVES)))
    further = lit and (kind == "SHADOW" or "INDIRECT" in parts)
    return replace(
        settings,
        integrator="PATH",
        sample_offset=0,
        sample_subset=0,
        scene_samples=0,
        passes=frozenset({"Combined", *bake.passes(parts)}),
        aovs=(),
        light_groups=(),
        first_surface_only=not lit,
        max_bounces=settings.max_bounces if further else 0,
        film_transparent=True,
        film_transparent_glass=False,
        pass_alpha_threshold=0.0,
        use_denoising=settings.use_denoising and kind == "COMBINED" and parts >= ALL_LIGHT,
        use_adaptive_sampling=settings.use_adaptive_sampling and lit,
    )


def jitters(kind: str, settings: RenderSettings) -> bool:
    """Whether samples lie all over a texel, and not in its centre."""
    return kind != "POSITION" and settings.samples > 1


def bake_picture(session, kind: str, parts: Parts) -> np.ndarray:
    """What a session that has rendered with `bake_settings` gives the image: float32 (height, width, 4)."""
    film, result = session.film, session.combined()
    if kind != "COMBINED":
        result[..., 3] = 1.0
    elif parts >= ALL_LIGHT:
        return result
    result[..., :3] = BAKES[kind].picture(film, parts)
    return result
