"""The code behind `calls`: compiled when a scene has media."""

import numpy as np

from ..core.jit import Entry, entry, load, outcome_entry
from ..core.records import (
    SCENE_HAS_MEDIA,
    SCRATCH_MEDIA,
    film_at,
    integrator_at,
    path_in,
    point_in,
    scene_at,
    shading_point_at,
)
from ..core.vec import vec
from ..geometry.surface import offset_origin
from .segment import follow_segment
from .stack import cross
from .through import find_media, shadow_through_media


@entry
def _begin(scene, integrator, film, scratch, _):
    path = path_in(scratch)
    find_media(scene_at(scene, 0), integrator_at(integrator, 0), scratch, path, vec(path.o))


@entry
def _around(scene, integrator, film, scratch, sp):
    sp = shading_point_at(sp, 0)
    path = path_in(scratch)
    find_media(scene_at(scene, 0), integrator_at(integrator, 0), scratch, path, offset_origin(sp, vec(sp.wo)))


@outcome_entry
def _segment(scene, integrator, film, scratch, reaches):
    path = path_in(scratch)
    sp = point_in(scratch)
    scene, integrator, film = scene_at(scene, 0), integrator_at(integrator, 0), film_at(film, 0)
    return follow_segment(scene, integrator, film, scratch, path, sp, reaches)


@entry
def _cross(scene, integrator, film, scratch, _):
    path = path_in(scratch)
    sp = point_in(scratch)
    cross(scene_at(scene, 0), integrator_at(integrator, 0), scratch + SCRATCH_MEDIA, sp)
    path.medium_start = sp.t


@entry
def _shadow(scene, integrator, film, scratch, sp):
    path = path_in(scratch)
    shadow_through_media(scene_at(scene, 0), integrator_at(integrator, 0), scratch, path, shading_point_at(sp, 0))


# In the order of calls.BEGIN …
_ENTRIES: tuple[Entry, ...] = (_begin, _around, _segment, _cross, _shadow)


def media_entries(scene_flags: int) -> np.ndarray:
    """The table that INTEGRATOR.media points to: int64 (6,), compiled where it is not yet; 0 without media.

    Behind the code there is room for the count of `stack.OVERFLOWS`.
    """
    needed = scene_flags & SCENE_HAS_MEDIA
    load(_ENTRIES if needed else ())
    return np.array([*(e.address if needed else 0 for e in _ENTRIES), 0], np.int64)
