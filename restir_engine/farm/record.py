"""What a rendered file says of its samples: text fields `restir.LAYER.NAME`, one for each field of `Record`."""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ..settings import Aov, RenderSettings

if TYPE_CHECKING:
    from ..scene.camera import Camera
    from ..session import Session

PREFIX = "restir."
Ranges = tuple[tuple[int, int], ...]  # each from a sample up to another, which is not in it


@dataclass(frozen=True)
class Record:
    """What is known of the samples of a view layer."""

    samples: int  # of the pixels that have most
    ranges: Ranges  # that these are of, in ascending order
    of: int  # all samples
    render_time: float  # seconds
    scene: str
    frame: int
    seed: int
    settings: str  # a digest of those that the picture depends on
    camera: tuple[float, ...]
    region: tuple[int, ...]  # of the frame that was rendered: x, y, width, height from the lower left; (): all of it
    passes: tuple[str, ...]  # those asked for; what is carried along for merging is not among them
    aovs: tuple[tuple[str, int], ...]
    light_groups: tuple[str, ...]
    exposure: float
    transparent: bool
    denoising: str  # the quality that is asked for, "" for none
    finished: bool  # a picture, which is denoised and shows shadow catchers if it is meant to
    warnings: tuple[tuple[str, str, str], ...]  # kind, name, text

    def fields(self, layer: str) -> dict[str, str]:
        """The text fields of a view layer."""
        return {
            f"{PREFIX}{layer}.{item.name}": json.dumps(getattr(self, item.name), ensure_ascii=False)
            for item in fields(self)
        }

    @property
    def missing(self) -> Ranges:
        """The ranges of samples that nobody has taken."""
        ends = [0, *(last for _, last in self.ranges)]
        starts = [*(first for first, _ in self.ranges), self.of]
        return tuple((end, start) for end, start in zip(ends, starts, strict=True) if end < start)


# What records of one picture have in common, and what is said where they have not.
IN_COMMON = {
    "scene": "scenes",
    "frame": "frames",
    "of": "numbers of samples",
    "seed": "seeds",
    "camera": "cameras",
    "region": "render regions",
    "settings": "render settings",
    "passes": "passes",
    "aovs": "AOVs",
    "light_groups": "light groups",
    "exposure": "exposures",
    "transparent": "backgrounds",
    "denoising": "denoising",
}


def alike(one: Any, other: Any) -> bool:
    """Whether two values of a field are the same, numbers of a camera up to how processors round."""
    if isinstance(one, tuple) and one and all(isinstance(x, float) for x in one):
        return len(one) == len(other) and np.allclose(one, other, rtol=1e-4, atol=1e-5)
    return one == other


def record_of(session: Session, scene: str, frame: int, passes: frozenset[str], seconds: float) -> Record:
    """The record of what a session has rendered. passes: those asked for."""
    settings, film = session.settings, session.film
    taken = settings.sample_range
    return Record(
        samples=film.samples,
        ranges=((taken.start, taken.stop),) if taken else (),
        of=settings.samples,
        render_time=round(seconds, 3),
        scene=scene,
        frame=frame,
        seed=settings.seed,
        settings=_digest(settings),
        camera=_pose(session.camera),
        region=session.camera.region or (),
        passes=tuple(sorted(passes)),
        aovs=tuple(tuple(aov) for aov in settings.aovs),
        light_groups=settings.light_groups,
        exposure=settings.film_exposure,
        transparent=settings.film_transparent,
        denoising=settings.denoising_quality if settings.use_denoising else "",
        finished=not settings.is_part,
        warnings=tuple(session.scene.warnings),
    )


def _digest(settings: RenderSettings) -> str:
    """Eight digits for all settings but those that other fields tell, and who takes which samples how fast."""
    kept = replace(
        settings, sample_offset=0, sample_subset=0, threads=0, time_limit=0.0, use_denoising=False,
        denoising_quality="", passes=frozenset(), aovs=(), light_groups=(), seed=0, samples=1, scene_samples=0,
        film_exposure=1.0, film_transparent=False,
    )  # fmt: skip
    return hashlib.sha256(repr(kept).encode()).hexdigest()[:8]


def _pose(camera: Camera) -> tuple[float, ...]:
    """Where the camera is and what it frames."""
    return tuple(float(x) for x in (*camera.to_world.ravel(), *camera.screen, *camera.longitude, *camera.latitude))


def read_records(texts: dict[str, str]) -> dict[str, Record]:
    """The records in the text fields of a file, by view layer."""
    names = {item.name for item in fields(Record)}
    found: dict[str, dict[str, Any]] = {}
    for key, text in texts.items():
        layer, _, name = key.removeprefix(PREFIX).rpartition(".")
        if key.startswith(PREFIX) and name in names:
            found.setdefault(layer, {})[name] = _tuples(json.loads(text))
    return {layer: Record(**values) for layer, values in found.items() if values.keys() == names}


def aovs_of(record: Record) -> tuple[Aov, ...]:
    """The AOVs of a record."""
    return tuple(Aov(*aov) for aov in record.aovs)


def _tuples(value: Any) -> Any:
    return tuple(map(_tuples, value)) if isinstance(value, list) else value


def joined(ranges: list[tuple[int, int]]) -> Ranges:
    """Ranges in ascending order, those that touch made one."""
    found: list[tuple[int, int]] = []
    for first, last in sorted(ranges):
        if found and found[-1][1] == first:
            found[-1] = found[-1][0], last
        else:
            found.append((first, last))
    return tuple(found)


def merged(records: list[Record]) -> Record:
    """The record of all samples of these, which are of one picture."""
    return replace(
        records[0],
        samples=sum(record.samples for record in records),
        ranges=joined([each for record in records for each in record.ranges]),
        render_time=round(sum(record.render_time for record in records), 3),
        warnings=tuple(dict.fromkeys(warning for record in records for warning in record.warnings)),
    )
