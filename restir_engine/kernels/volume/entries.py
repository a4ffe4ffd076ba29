"""The code behind `calls`: compiled when a scene has media."""

import numpy as np

from ..core.jit import Entry, entry, load, outcome_entry
from ..core.records import (
    SCENE_HAS_MEDIA,
    SCENE_HAS_PIVOTS,
    SCENE_HAS_VARYING_MEDIA,
    SCRATCH_MEDIA,
    SCRATCH_SHADOW,
    camera_at,
    film_at,
    integrator_at,
    path_in,
    point_in,
    scene_at,
    shading_point_at,
    shadow_at,
)
from ..core.vec import put, vec
from ..geometry.surface import offset_origin
from .equiangular import add_beside_lamps
from .segment import follow_segment
from .stack import cross
from .through import find_media, find_media_along, find_world_medium, shadow_through_media
from .tracking import track, varying_transmittance


@entry
def _begin(scene, integrator, film, scratch, _):
    path, scene = path_in(scratch), scene_at(scene, 0)
    if camera_at(scene.camera, 0).texels != 0:  # as in Cycles
        find_world_medium(scene, integrator_at(integrator, 0), scratch, path, vec(path.o))
    else:
        find_media(scene, integrator_at(integrator, 0), scratch, path, vec(path.o))


@entry
def _around(scene, integrator, film, scratch, sp):
    sp = shading_point_at(sp, 0)
    path = path_in(scratch)
    scene, integrator = scene_at(scene, 0), integrator_at(integrator, 0)
    if path.bounce == 0:
        find_media_along(scene, integrator, scratch, path, float(sp.t))
    else:
        find_media(scene, integrator, scratch, path, offset_origin(sp, vec(sp.wo)))


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


@entry
def _track(scene, integrator, film, scratch, _):
    scene, integrator, film = scene_at(scene, 0), integrator_at(integrator, 0), film_at(film, 0)
    ray = shadow_at(scratch + SCRATCH_SHADOW, 0)
    begin = ray.begin
    ray.end = begin + track(scene, integrator, film, scratch, path_in(scratch), begin, ray.end - begin)


@entry
def _through(scene, _integrator, _film, scratch, media):
    through = varying_transmittance(scene_at(scene, 0), media, scratch, path_in(scratch))
    put(shadow_at(scratch + SCRATCH_SHADOW, 0).transmittance, through)


@entry
def _beside_lamps(scene, integrator, film, scratch, _):
    add_beside_lamps(scene_at(scene, 0), integrator_at(integrator, 0), film_at(film, 0), scratch)


# In the order of calls.BEGIN …, with the SCENE_* flag of the scenes that need it.
_ENTRIES: tuple[tuple[Entry, int], ...] = (
    *((each, SCENE_HAS_MEDIA) for each in (_begin, _around, _segment, _cross, _shadow)),
    *((each, SCENE_HAS_VARYING_MEDIA) for each in (_track, _through)),
    (_beside_lamps, SCENE_HAS_PIVOTS),
)


def media_entries(scene_flags: int) -> np.ndarray:
    """The table that INTEGRATOR.media points to: int64 (9,), compiled where it is not yet; 0 for what is not needed.

    Behind the code there is room for the count of `stack.OVERFLOWS`.
    """
    load(each for each, flag in _ENTRIES if scene_flags & flag)
    return np.array([*(each.address if scene_flags & flag else 0 for each, flag in _ENTRIES), 0], np.int64)
