"""The points through which light leaves: one of them is lit, by resampling, and one is where the path goes on.

Which point a light reaches is not known when its weight is. So a light sample is taken at each of them, without a
shadow ray; one is chosen in proportion to what it would bring, and stands for all if nothing shadows it (resampled
importance sampling, Talbot et al. 2005). The path goes on by one that is chosen by the weight alone. What the
irradiance cache has lit, if there is one, is no candidate.
"""

from ..core import rng
from ..core.jit import device, inlined
from ..core.memory import call_entry, load_f64, load_i64, record_address, store_f64
from ..core.records import film_at, integrator_at, light_sample_in, path_in, point_in, scene_at
from ..core.vec import load3_f64, mul, put, scale, store3_f64
from ..film.contribute import first_scattering, lit_at_exit
from ..lights import light_is_sampled, note_choice
from ..lobes.classes import NO_LOBES
from ..path.direct import add_unless_shadowed, sampled_light
from ..path.state import DIM_LIGHT, DIM_LIGHT_POINT, DIMENSIONS, ENDS, LIT
from .exit import leave
from .method_table import LIGHT_FROM_CACHE
from .probe import H_EVENTS, H_LIT, H_NORMAL, H_PRIMITIVE, H_T, H_U, H_V, H_WEIGHT, HIT, HITS

# An exit whose weight is below this part of the largest one's is a candidate with a probability that falls with it.
_CERTAIN = 0.05

DIM_EXIT, _DIM_CANDIDATE = 2, 3  # random dimensions of the exits' vertex, besides those of light sampling


@inlined
def exit_at(scratch, k):
    """The address of the k-th exit, laid out as a hit of the probe."""
    return scratch + HITS + 8 * HIT * k


@inlined
def amount(weight):
    """What a weight (rgb, possibly negative) counts for where one of several is chosen."""
    return abs(weight[0]) + abs(weight[1]) + abs(weight[2])


@inlined
def exit_weight(scratch, k):
    """The path's throughput (rgb) where light leaves by the k-th exit."""
    return load3_f64(exit_at(scratch, k), H_WEIGHT)


@inlined
def exit_events(scratch, k):
    """How often light has been scattered on its way to the k-th exit."""
    return int(load_f64(exit_at(scratch, k), H_EVENTS))


@device
def put_exit(place, t, primitive, u, v, normal, weight, events):
    """Note an exit where a ray inside hit the surface; normal: anything that points outwards."""
    store_f64(place, H_T, t)
    store_f64(place, H_PRIMITIVE, float(primitive))
    store_f64(place, H_U, u)
    store_f64(place, H_V, v)
    store3_f64(place, H_NORMAL, normal)
    store3_f64(place, H_WEIGHT, weight)
    store_f64(place, H_EVENTS, float(events))


@device
def leave_by(scene, scratch, sp, k):
    """Move `sp` to the k-th exit."""
    place = exit_at(scratch, k)
    primitive, u, v = int(load_f64(place, H_PRIMITIVE)), load_f64(place, H_U), load_f64(place, H_V)
    leave(scene, sp, primitive, u, v, load_f64(place, H_T), load3_f64(place, H_NORMAL))


@device
def light_one(scene, integrator, film, scratch, path, sp, n, most, cached, alone):
    """Add the direct light of n exits by one shadow ray; the exit that `sp` was moved to last, -1: none.

    cached: whether some may be lit already; alone: whether the path's next ray will count no light.
    """
    u0 = rng.sample1(path.key, path.sample, path.dimension + DIM_LIGHT)
    u1, u2 = rng.sample2(path.key, path.sample, path.dimension + DIM_LIGHT_POINT)
    left, dim = rng.sample2(path.key, path.sample, path.dimension + _DIM_CANDIDATE)
    best, best_f = (0.0, 0.0, 0.0), NO_LOBES
    total, chosen, at = 0.0, -1, -1
    for k in range(n):
        if cached and load_f64(exit_at(scratch, k), H_LIT) != 0.0:
            continue
        weight = exit_weight(scratch, k)
        chance = amount(weight) / (_CERTAIN * most)
        if chance < 1.0:
            if dim >= chance:
                dim = (dim - chance) / (1.0 - chance)
                continue
            dim /= chance
            weight = scale(weight, 1.0 / chance)
        leave_by(scene, scratch, sp, k)
        at = k
        c, f = sampled_light(scene, scratch, sp, u0, u1, u2, alone)
        c = mul(c, weight)
        a = amount(c)
        if a > 0.0:
            total += a
            p = a / total
            if left < p:
                left /= p
                chosen, best, best_f = k, c, f
            else:
                left = (left - p) / (1.0 - p)
    if chosen < 0 or not total < 1.0e30:
        return at
    if chosen != at:
        leave_by(scene, scratch, sp, chosen)
        sampled_light(scene, scratch, sp, u0, u1, u2, alone)
    best = scale(best, total / amount(best))
    ls = light_sample_in(scratch)
    what = lit_at_exit(path, best_f, exit_events(scratch, chosen), ls.light, ls.instance)
    add_unless_shadowed(scene, integrator, film, scratch, path, sp, best, what)
    return chosen


@inlined
def exit_amounts(scratch, n):
    """(sum, largest) of what n exits' weights count for."""
    total, most = 0.0, 0.0
    for k in range(n):
        a = amount(exit_weight(scratch, k))
        total += a
        most = max(most, a)
    return total, most


@device
def choose_exit(scratch, n, total, u):
    """An exit chosen by u in proportion to its weight; total: of all n."""
    left = total * u
    chosen = 0
    for k in range(n):
        a = amount(exit_weight(scratch, k))
        if a > 0.0 and left >= 0.0:
            chosen = k
        left -= a
    return chosen


@inlined
def light_found(scene, integrator, film, scratch, n):
    """`light_exits` by addresses: the tile's path and point; the path ends where there are no exits."""
    scene, integrator, film = scene_at(scene, 0), integrator_at(integrator, 0), film_at(film, 0)
    return light_exits(scene, integrator, film, scratch, path_in(scratch), point_in(scratch), n) if n > 0 else ENDS


@device
def light_exits(scene, integrator, film, scratch, path, sp, n):
    """Add the direct light of n exits, and leave by one of them, chosen in proportion to its weight; the next event."""
    total, most = exit_amounts(scratch, n)
    if not 0.0 < total < 1.0e30:
        return ENDS
    at = -1
    if light_is_sampled(scene):
        code = load_i64(integrator.scatter, LIGHT_FROM_CACHE)
        if code != 0:
            call_entry(code, record_address(scene), record_address(integrator), record_address(film), scratch, n)
        at = light_one(scene, integrator, film, scratch, path, sp, n, most, code != 0, False)
    leave_by_one(scene, scratch, path, sp, n, total, at)
    return LIT


@device
def leave_by_one(scene, scratch, path, sp, n, total, at):
    """Move the path and `sp`, which is at exit `at` (-1: at none), to one of n exits, by their weights; which it is."""
    chosen = choose_exit(scratch, n, total, rng.sample1(path.key, path.sample, path.dimension + DIM_EXIT))
    if chosen != at:
        leave_by(scene, scratch, sp, chosen)
        note_choice(scene, sp)  # for the weight of a light that the path's next ray hits
    path.scattering = first_scattering(path, exit_events(scratch, chosen))
    weight = exit_weight(scratch, chosen)
    put(path.throughput, scale(weight, total / amount(weight)))
    path.dimension += DIMENSIONS
    return chosen
