"""How a frame's subsurface light reaches the film, and how the path of the fresh candidate goes on."""

from ....kernels.core.jit import device, entry, outcome_entry
from ....kernels.core.records import film_at, integrator_at, path_in, point_in, scene_at
from ....kernels.core.vec import mul, put, vec
from ....kernels.film.contribute import NOT_FOUND, contribute, contribute_to_groups, first_scattering, lit_at_exit
from ....kernels.lobes.classes import lobe_sum
from ....kernels.path.state import ENDS, ENTERS
from ....kernels.subsurface.exit import leave
from ...path.bounce import bounce
from ...resampling.frame import frame_at
from ...resampling.inputs import light_by_group, load_light
from .sample import NO_EXIT, NOT_SERVED, exit_of

_EVENTS = 2  # what scatters twice and more is one


@device
def add_from_below(integrator, film, frame, scratch, pixel, events):
    """Add a companion's light of a pixel, which has been scattered so many times below the surface; by addresses."""
    path = path_in(scratch)
    integrator, film, frame = integrator_at(integrator, 0), film_at(film, 0), frame_at(frame, 0)
    f = load_light(frame, pixel)
    value = mul(lobe_sum(f), vec(path.throughput))
    contribute(integrator, film, path, value, lit_at_exit(path, f, events, NOT_FOUND, -1))
    if frame.light_groups != 0:
        contribute_to_groups(integrator, film, path, value, light_by_group(frame, pixel))


@entry
def add_light(integrator, film, frame, scratch, pixel):
    """Add what candidates or reuse have left as a pixel's subsurface light; `frame` is the companion."""
    add_from_below(integrator, film, frame, scratch, pixel, _EVENTS)


@outcome_entry
def go_on(scene, integrator, frame, scratch, pixel):
    """The next event of a path that enters at x₁, behind the exit that the pixel's candidate has chosen."""
    scene, integrator, frame = scene_at(scene, 0), integrator_at(integrator, 0), frame_at(frame, 0)
    path, sp = path_in(scratch), point_in(scratch)
    way = exit_of(frame, pixel)
    if way.primitive == NOT_SERVED:
        return ENTERS
    if way.primitive == NO_EXIT:
        return ENDS
    leave(scene, sp, int(way.primitive), float(way.u), float(way.v), float(way.t), vec(way.normal))
    put(path.throughput, vec(way.weight))
    path.scattering = first_scattering(path, int(way.events))
    path.dimension = int(way.dimension)
    return bounce(scene, integrator, path, sp)
