"""The points through which light leaves: direct light at every one of them, and one by which the path goes on."""

from ..direct import direct_light
from ..jit import device, inlined
from ..medium.exit import leave
from ..memory import load_f64, store_f64
from ..path_state import DIMENSIONS, LIT, mark_scattered
from ..rng import sample1
from ..vec import load3_f64, put, scale, store3_f64
from .probe import H_EVENTS, H_NORMAL, H_PRIMITIVE, H_T, H_U, H_V, H_WEIGHT, HIT, HITS

# An exit whose weight is below this part of the light that enters is lit with a probability that falls with its weight.
FULLY_LIT = 0.25

DIM_CHOICE = 2  # random dimensions of a method's vertex and of an exit's, besides those of light sampling
_DIM_LIT = 2


@inlined
def exit_at(scratch, k):
    """The address of the k-th exit, laid out as a hit of the probe."""
    return scratch + HITS + 8 * HIT * k


@inlined
def amount(weight):
    """What a weight (rgb, possibly negative) counts for where one of several is chosen."""
    return abs(weight[0]) + abs(weight[1]) + abs(weight[2])


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
def light_exits(scene, integrator, film, scratch, path, sp, n, full):
    """Add the direct light of n exits, and leave by one of them, chosen in proportion to its weight.

    An exit's weight is the path's throughput when light leaves there; `full` is the amount with which light entered.
    """
    total = 0.0
    for k in range(n):
        total += amount(load3_f64(exit_at(scratch, k), H_WEIGHT))
    if not 0.0 < total < 1.0e30:
        return
    left = total * sample1(path.key, path.sample, path.dimension + DIM_CHOICE)
    chosen = 0
    for k in range(n):
        a = amount(load3_f64(exit_at(scratch, k), H_WEIGHT))
        if a > 0.0 and left >= 0.0:
            chosen = k
        left -= a
    marked = path.scatter_pass
    for i in range(n):
        k = i if i < chosen else i + 1  # the chosen one last: `sp` shall be left there
        if i == n - 1:
            k = chosen
        place = exit_at(scratch, k)
        weight = load3_f64(place, H_WEIGHT)
        chance = min(1.0, amount(weight) / (FULLY_LIT * full))
        path.dimension += DIMENSIONS
        lit = chance >= 1.0 or sample1(path.key, path.sample, path.dimension + _DIM_LIT) < chance
        if not lit and k != chosen:
            continue
        primitive, u, v = int(load_f64(place, H_PRIMITIVE)), load_f64(place, H_U), load_f64(place, H_V)
        leave(scene, sp, primitive, u, v, load_f64(place, H_T), load3_f64(place, H_NORMAL))
        path.scatter_pass = marked
        mark_scattered(film, path, int(load_f64(place, H_EVENTS)))
        if lit:
            put(path.throughput, scale(weight, 1.0 / chance))
            direct_light(scene, integrator, film, scratch, path, sp)
    weight = load3_f64(exit_at(scratch, chosen), H_WEIGHT)
    put(path.throughput, scale(weight, total / amount(weight)))
    path.scattered = LIT
