"""Data passes that few ask for, called by address: ambient occlusion, roughness, and what bakes ask of the world."""

import math

from ..core import rng
from ..core.jit import device, entry
from ..core.records import (
    film_at,
    integrator_at,
    light_sample_in,
    path_in,
    point_in,
    scene_at,
)
from ..core.vec import average, frame, is_black, madd, mul, normalize, to_world, vec
from ..core.warp import disk
from ..lights.linking import EVERYTHING
from ..lights.world import world_radiance
from ..lobes import bsdf_normal, bsdf_roughness
from ..path.shadow import transmittance
from ..path.state import DIM_DATA
from .contribute import add1, add3


@entry
def more_data(scene, integrator, film, scratch, _):
    """Describe the surface at the tile's point, which the path has been the first to meet but for transparency."""
    scene, integrator, film = scene_at(scene, 0), integrator_at(integrator, 0), film_at(film, 0)
    path, sp = path_in(scratch), point_in(scratch)
    t = vec(sp.transparent)
    opacity = mul(vec(path.throughput), (1.0 - t[0], 1.0 - t[1], 1.0 - t[2]))
    if film.ambient_occlusion >= 0 and not is_black(opacity):
        add3(path.pixel, film.ambient_occlusion, mul(opacity, _free(scene, integrator, scratch, path, sp)))
    if film.roughness >= 0 and average(t) < 1.0:
        add1(path.pixel, film.roughness, bsdf_roughness(sp))
    if film.surroundings >= 0:
        d = normalize(vec(sp.p))
        d = (0.0, 0.0, 1.0) if is_black(d) else d
        add3(path.pixel, film.surroundings, world_radiance(scene, scratch, sp, vec(path.o), d))


@device
def _free(scene, integrator, scratch, path, sp):
    """What gets through within the distance of ambient occlusion along one direction, by its cosine to the normal."""
    n = bsdf_normal(sp)
    light_sample_in(scratch).blockers = EVERYTHING
    x, y = disk(*rng.sample2(path.key, path.sample, DIM_DATA))
    tangent, bitangent = frame(n)
    d = to_world((x, y, math.sqrt(max(1.0 - x * x - y * y, 0.0))), tangent, bitangent, n)
    reach = integrator.occlusion_distance
    return transmittance(scene, integrator, scratch, path, sp, d, reach, madd(vec(sp.p), d, reach))
