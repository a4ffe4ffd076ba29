"""The irradiance cache: a hash grid of what light sampling finds at the back of objects, in place of a light sample.

A cell is an object, a cube of space and an octant of normals. It holds the running mean of E / π, with E the irradiance
that light sampling estimates there, MIS included: so what the path's own rays find goes on as it is. Points whose
normal faces away from that of the point that is seen take their direct light from a cell that has enough samples. It is
biased, as it takes E for constant in a cell. A cell is a power of two wide, at most the shortest mean free path of the
channels and a part of the way that light has come: what scatters blurs more than that.

Kernels only read the grid. What they see they note in the pixel's own place, one observation a sample, and `merge`
takes these in between two batches, in the order of the pixels: a picture does not depend on threads and tiles.
"""

import math

import numpy as np

from ..core import rng
from ..core.jit import device, entry, inlined, kernel
from ..core.memory import load_f32, load_i32, load_i64, store_f32, store_f64, store_i32, store_i64
from ..core.records import closure_at, film_at, integrator_at, path_in, point_in, scene_at
from ..core.vec import dot, is_black, length, load3_f64, mul, sub, vec
from ..film.contribute import NOT_FOUND, contribute, lit_at_exit
from ..lobes.classes import Lobes
from ..path.direct import sampled_light
from ..path.shadow import light_visibility
from .exits import amount, exit_at, exit_events, exit_weight, leave_by
from .method_table import CACHE
from .probe import H_LIT, H_NORMAL, H_POINT
from .scales import channels

# Header: int64 by these indices. Cells and observations; pixels whose paths observe, and what of a picture one takes.
CELLS, MASK, SEEN, N_SEEN, PIXELS, PIXEL_BYTES, BATCH, SIZE = 0, 1, 2, 3, 4, 5, 6, 7

# key 0: none; batch: the last one that observed it.
CELL = np.dtype([("key", np.int64), ("count", np.int32), ("batch", np.int32), ("mean", np.float32, 4)])
OBSERVATION = np.dtype([("key", np.int64), ("value", np.float32, 4)])
_CELL, _OBSERVATION = CELL.itemsize, OBSERVATION.itemsize
_COUNT, _BATCH, _MEAN, _VALUE = 2, 3, 4, 2  # as int32 or float32 of a cell, of an observation

ENOUGH = 16  # samples, from which on a cell is used: until then points take a light sample of their own
CAP = 512  # samples that a mean counts for at most
AGE = 256  # batches after which a cell that nobody observes is not used, begins anew, or gives way to another
PLACES = 8  # where a key may be

_PART = 0.25  # of the way that light has come
_STREAM = 0x51ED270B  # of random numbers


@device
def _half_key(seed, instance, octant, exponent, x, y, z):
    """32 bits of what names a cell."""
    a = rng.hash_combine(rng.hash_combine(seed, instance), (octant << 16) | exponent & 0xFFFF)
    return rng.hash_combine(rng.hash_combine(rng.hash_combine(a, x & 0xFFFFFFFF), y & 0xFFFFFFFF), z & 0xFFFFFFFF)


@device
def cell_key(instance, p, n, size):
    """The key of a point p with normal n of an instance, in cells of at most that size; positive.

    63 bits, which cells keep and lookups compare: two of a million cells share them with a probability of 5e-8.
    """
    exponent = math.floor(math.log2(size))
    per_cell = 2.0 ** float(-exponent)
    x, y, z = math.floor(p[0] * per_cell), math.floor(p[1] * per_cell), math.floor(p[2] * per_cell)
    octant = (1 if n[0] < 0.0 else 0) | (2 if n[1] < 0.0 else 0) | (4 if n[2] < 0.0 else 0)
    upper = _half_key(0x2545F491, instance, octant, exponent, x, y, z)
    lower = _half_key(0x1B873593, instance, octant, exponent, x, y, z)
    return max((upper << 31) | (lower & 0x7FFFFFFF), 1)


@inlined
def _place(cache, key, i):
    return load_i64(cache, CELLS) + _CELL * (((key >> 31) + i) & load_i64(cache, MASK))


@device
def find(cache, key):
    """The address of a key's cell, 0: none."""
    for i in range(PLACES):
        cell = _place(cache, key, i)
        found = load_i64(cell, 0)
        if found == key:
            return cell
        if found == 0:
            return 0
    return 0


@inlined
def _mean(cell):
    return (load_f32(cell, _MEAN), load_f32(cell, _MEAN + 1), load_f32(cell, _MEAN + 2))


@inlined
def _samples(cell, batch):
    """How many samples a cell's mean stands for; 0 where it is old."""
    return load_i32(cell, _COUNT) if batch - load_i32(cell, _BATCH) <= AGE else 0


@device
def _make(cache, key, batch):
    """A new cell for a key: an empty one, or the oldest, if it is old; 0: none."""
    oldest, chosen = batch - AGE, 0
    for i in range(PLACES):
        cell = _place(cache, key, i)
        seen = -1 if load_i64(cell, 0) == 0 else load_i32(cell, _BATCH)
        if seen < oldest or seen < 0:
            oldest, chosen = seen, cell
        if seen < 0:
            break
    if chosen != 0:
        store_i64(chosen, 0, key)
        store_i32(chosen, _COUNT, 0)
    return chosen


@kernel
def merge(cache):
    """Take the observations into the grid, and forget them."""
    batch = load_i64(cache, BATCH) + 1
    store_i64(cache, BATCH, batch)
    for i in range(load_i64(cache, N_SEEN)):
        seen = load_i64(cache, SEEN) + _OBSERVATION * i
        key = load_i64(seen, 0)
        if key != 0:
            store_i64(seen, 0, 0)
            cell = find(cache, key)
            if cell == 0:
                cell = _make(cache, key, batch)
            if cell != 0:
                count = min(_samples(cell, batch) + 1, CAP)
                store_i32(cell, _COUNT, count)
                store_i32(cell, _BATCH, batch)
                for k in range(3):
                    mean = load_f32(cell, _MEAN + k) if count > 1 else 0.0
                    store_f32(cell, _MEAN + k, mean + (load_f32(seen, _VALUE + k) - mean) / count)


@device
def note(seen, key, value):
    """Note an observation where `merge` finds it."""
    if amount(value) < 1.0e30:
        store_i64(seen, 0, key)
        for k in range(3):
            store_f32(seen, _VALUE + k, value[k])


@inlined
def _finest(c, throughput):
    """The shortest mean free path of the channels of the closure c."""
    weight, sigma_t, _ = channels(c, throughput)
    most = 0.0
    for k in range(3):
        if weight[k] > 0.0:
            most = max(most, sigma_t[k])
    return 1.0 / max(most, 1.0e-30)


@device
def _observe(scene, integrator, scratch, path, sp, key):
    """What a light sample brings to a white surface at `sp`."""
    u0 = rng.sample1(key, path.sample, 1)
    u1, u2 = rng.sample2(key, path.sample, 2)
    c, _ = sampled_light(scene, scratch, sp, u0, u1, u2, False)
    return c if is_black(c) else mul(c, light_visibility(scene, integrator, scratch, path, sp))


@entry
def light_from_cache(scene, integrator, film, scratch, n):
    """Light those of n exits that the cache knows, mark them H_LIT, and observe one: often where little is known."""
    scene, integrator, film = scene_at(scene, 0), integrator_at(integrator, 0), film_at(film, 0)
    path = path_in(scratch)
    sp = point_in(scratch)
    cache = load_i64(integrator.scatter, CACHE)
    batch = load_i64(cache, BATCH)
    x, nx = vec(sp.p), vec(sp.ng)
    finest = _finest(closure_at(sp.closures, sp.scatterer), vec(path.throughput))
    most = 0.0
    for k in range(n):
        most = max(most, amount(exit_weight(scratch, k)))
    random = rng.hash_combine(path.key, path.dimension ^ _STREAM)
    u = rng.sample1(random, path.sample, 0)
    index = (path.pixel - load_i64(cache, PIXELS)) // load_i64(cache, PIXEL_BYTES)
    seen = load_i64(cache, SEEN) + _OBSERVATION * index
    diffuse = Lobes((1.0, 1.0, 1.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    chosen, chosen_key = -1, 0
    for k in range(n):
        place = exit_at(scratch, k)
        store_f64(place, H_LIT, 0.0)
        weight, events = exit_weight(scratch, k), exit_events(scratch, k)
        if is_black(weight):
            continue
        p, ny = load3_f64(place, H_POINT), load3_f64(place, H_NORMAL)
        if events < 2:  # the normal is where light goes: good enough to tell what faces away
            if dot(nx, ny) >= 0.0:
                continue
            leave_by(scene, scratch, sp, k)
            p, ny = vec(sp.p), vec(sp.ng)
        size = min(finest, _PART * length(sub(p, x)))
        if dot(nx, ny) >= 0.0 or not size > 1.0e-9:
            continue
        key = cell_key(sp.instance, p, ny, size)
        cell = find(cache, key)
        count = _samples(cell, batch) if cell != 0 else 0
        if count >= ENOUGH:
            store_f64(place, H_LIT, 1.0)
            c = mul(weight, _mean(cell))
            contribute(integrator, film, path, c, lit_at_exit(path, diffuse, events, NOT_FOUND, -1))
        if chosen < 0 and u * most * max(count, ENOUGH) < amount(weight) * ENOUGH:
            chosen, chosen_key = k, key
    if chosen >= 0 and load_i64(seen, 0) == 0:
        leave_by(scene, scratch, sp, chosen)
        note(seen, chosen_key, _observe(scene, integrator, scratch, path, sp, random))
