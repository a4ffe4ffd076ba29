"""Media that vary in space along a ray: tentative collisions by majorants, and what happens at them.

Each medium that varies, and the sum of those that do not, has tentative collisions of its own, a Poisson process of
density μ(t), its majorant; the next one of them all is the nearest (superposition). At a collision of a medium with the
coefficients σ_t and σ_s there, the path scatters with probability P_s or goes on, and its throughput is multiplied by

    scatters: σ_s / (μ P_s)        goes on: (μ - σ_t) / (μ (1 - P_s))

by channel (spectral tracking: Kutz, Habel, Li and Novák 2017), with P_s by what the path carries: Σ_c |w σ_s| against
Σ_c |w (μ - σ_t)|. The expectation is that of the radiative transfer equation whatever μ > 0 is, where it is no bound as
well (weighted tracking: Galtier et al. 2013): weights are then negative in places, and noisier. Emission is added at
every collision by ε / μ.

Where a ray is only attenuated, the transmittance is that of the cells' means m, which is known, times the product of
1 - (σ_t - m) / μ over collisions with a bound μ of |σ_t - m| (residual ratio tracking: Novák, Selle and Jarosz 2014).
"""

import math

from ..core import fastmath, rng
from ..core.jit import device, inlined
from ..core.records import (
    RAY_SHADOW,
    SCENE_HAS_PIVOTS,
    SCRATCH_MEDIA,
    SCRATCH_SHADOW,
    instance_at,
    majorants_at,
    media_at,
    shadow_at,
    shadow_point_in,
)
from ..core.vec import average, is_black, madd, max3, mul, neg, put, scale, sub, transform_point, vec
from ..film.contribute import EMISSION, IN_MEDIUM, contribute, found
from ..geometry.voxels import voxel_at
from ..path.state import inherit
from .majorants import (
    begin_walk,
    control_of,
    inside_cells,
    mean_at,
    mean_depth,
    next_cell,
    next_collision,
    start_cells,
)
from .stack import decay, entry_at, evaluate, innermost, walk_of

_LN_2 = math.log(2.0)
_THIN = 0.1  # what carries less than this share of what it did is subject to roulette


@inlined
def _largest(w):
    return max(abs(w[0]), max(abs(w[1]), abs(w[2])))


@device
def start_point(scratch, path, d, flags):
    """The scratch's second SHADING_POINT, made ready for programs of media along a ray."""
    point = shadow_point_in(scratch)
    inherit(point, path, 0.0)
    point.ray_flags = flags
    point.primitive = -1
    point.backfacing = 0
    point.u = 0.0
    point.v = 0.0
    put(point.dpdu, (0.0, 0.0, 0.0))
    put(point.dpdv, (0.0, 0.0, 0.0))
    wo = neg(d)
    put(point.wo, wo)
    put(point.n, wo)
    put(point.ng, wo)
    return point


@device
def evaluate_at(scene, media, index, point, p, t):
    """Bring the medium `index` of MEDIA up to date for the point p of a ray, t along it."""
    entry = entry_at(media, index)
    majorants = majorants_at(entry.majorants, 0)
    if majorants.voxels != 0:
        q = scale(transform_point(majorants.to_grid, p), float(majorants.size))
        value = max(voxel_at(majorants.voxels, q), 0.0)
        put(entry.sigma_t, scale(vec(majorants.sigma_t), value))
        put(entry.sigma_s, scale(vec(majorants.sigma_s), value))
        put(entry.emission, (0.0, 0.0, 0.0))
        return
    point.instance = entry.instance
    point.material = entry.material
    point.mesh = instance_at(scene.instances, entry.instance).mesh if entry.instance >= 0 else -1
    point.t = t
    put(point.p, p)
    evaluate(scene, entry, point)


@inlined
def _depth(u):
    """An optical depth with the density exp(-τ)."""
    return -fastmath.log(1.0 - u)


@device
def _schedule(media, index, begin, end, u):
    """Draw the next collision behind `begin` of the medium `index`, -1: of the sum of those that do not vary."""
    if index < 0:
        m = media_at(media, 0)
        m.mu = max3(vec(m.sigma_t))
        m.next = begin + _depth(u) / m.mu if m.mu > 0.0 else end
        return
    entry = entry_at(media, index)
    t, mu = next_collision(entry.majorants, walk_of(media, index), _depth(u))
    entry.next = t
    entry.mu = mu


@device
def _schedule_all(media, o, d, end, u, state):
    """Draw the first collision of each medium on a ray, by u and by `state` where there are several; the next state of
    the random numbers."""
    m = media_at(media, 0)
    for i in range(m.count):
        entry = entry_at(media, i)
        if entry.priority == m.top and entry.majorants != 0:
            begin_walk(entry.majorants, walk_of(media, i), o, d, end)
            _schedule(media, i, 0.0, end, u)
            state, u, _ = rng.advance(state)
    _schedule(media, -1, 0.0, end, u)
    return state


@device
def _nearest(media):
    """(medium, t, μ) of the next collision of all; the medium as in `_schedule`."""
    m = media_at(media, 0)
    index, t, mu = -1, m.next, m.mu
    for i in range(m.count):
        entry = entry_at(media, i)
        if entry.priority == m.top and entry.majorants != 0 and entry.next < t:
            index, t, mu = i, entry.next, entry.mu
    return index, t, mu


@device
def coefficients(media, index):
    """(σ_t, σ_s, ε) of a medium, as `evaluate_at` has left them; index as in `_schedule`."""
    if index < 0:
        m = media_at(media, 0)
        return vec(m.sigma_t), vec(m.sigma_s), vec(m.emission)
    entry = entry_at(media, index)
    return vec(entry.sigma_t), vec(entry.sigma_s), vec(entry.emission)


@device
def track(scene, integrator, film, scratch, path, start, s):
    """Follow the path from `start` on its ray through s of media of which some vary: how far it comes before it
    scatters, s if it gets through.

    Its throughput is brought up to date (0: it ends) and what the media emit is contributed. MEDIA.chosen is the one
    that has scattered, with its coefficients at the point.
    """
    media = scratch + SCRATCH_MEDIA
    m = media_at(media, 0)
    d = vec(path.d)
    o = madd(vec(path.o), d, start)
    point = start_point(scratch, path, d, path.flags)
    state = rng.stream(path.key, path.sample, path.dimension)
    w = vec(path.throughput)
    if _only_attenuates(media, path.last):
        path.dimension += 1
        through = attenuation(scene, media, point, o, d, start, s, state)
        put(path.throughput, mul(w, mul(through, decay(vec(m.sigma_t), s))))
        return s
    u, scattering = rng.sample2(path.key, path.sample, path.dimension)
    path.dimension += 1
    state = _schedule_all(media, o, d, s, u, state)
    enough = _THIN * _largest(w)
    m.chosen = -1
    while True:
        index, t, mu = _nearest(media)
        if t >= s:
            break
        if index >= 0:
            evaluate_at(scene, media, index, point, madd(o, d, t), start + t)
        sigma_t, sigma_s, emission = coefficients(media, index)
        if max3(emission) > 0.0:
            put(path.throughput, w)
            c = scale(mul(w, emission), 1.0 / mu)
            contribute(integrator, film, path, c, found(path, EMISSION, IN_MEDIUM, innermost(media), 0.0))
        null = sub((mu, mu, mu), sigma_t)
        scatters = 0.0
        if not path.last:
            scatters = abs(w[0] * sigma_s[0]) + abs(w[1] * sigma_s[1]) + abs(w[2] * sigma_s[2])
        goes_on = abs(w[0] * null[0]) + abs(w[1] * null[1]) + abs(w[2] * null[2])
        if scatters > 0.0 and scattering * (scatters + goes_on) < scatters:
            put(path.throughput, scale(mul(w, sigma_s), (scatters + goes_on) / (mu * scatters)))
            m.chosen = index
            if scene.flags & SCENE_HAS_PIVOTS:
                m.density = distance_density(media, o, d, t)
            return t
        if goes_on <= 0.0:
            w = (0.0, 0.0, 0.0)
            break
        w = scale(mul(w, null), (scatters + goes_on) / (mu * goes_on))
        if _largest(w) < enough:
            state, survives, _ = rng.advance(state)
            if survives >= 0.5:
                w = (0.0, 0.0, 0.0)
                break
            w = scale(w, 2.0)
        state, scattering, u = rng.advance(state)
        _schedule(media, index, t, s, u)
    put(path.throughput, w)
    return s


@device
def varying_transmittance(scene, media, scratch, path):
    """An estimate, rgb, of the transmittance of those media that vary at an address, along the part of the scratch's
    SHADOW."""
    ray = shadow_at(scratch + SCRATCH_SHADOW, 0)
    d = vec(ray.d)
    o = madd(vec(ray.o), d, ray.begin)
    s = ray.end - ray.begin
    if not s > 0.0:
        return (1.0, 1.0, 1.0)
    point = start_point(scratch, path, d, path.flags | RAY_SHADOW)
    state = rng.stream(_key(path.key, d, ray.end), path.sample, path.dimension)
    return attenuation(scene, media, point, o, d, ray.begin, s, state)


@device
def attenuation(scene, media, point, o, d, start, s, state):
    """An estimate, rgb, of the transmittance of those media that vary at an address, for s along the ray o, d.

    point: the SHADING_POINT for their programs; start: what the ray has come already; state: of random numbers.
    """
    m = media_at(media, 0)
    result = (1.0, 1.0, 1.0)
    for i in range(m.count):
        entry = entry_at(media, i)
        if entry.priority == m.top and entry.majorants != 0:
            result, state = _attenuation(scene, media, i, point, o, d, start, s, state, result)
            if is_black(result):
                break
    return result


@device
def _attenuation(scene, media, index, point, o, d, start, s, state, result):
    """(result times an estimate of the transmittance of one medium, next state of the random numbers).

    Cell by cell: the means are gathered and the collisions of the residuals met in one go.
    """
    entry = entry_at(media, index)
    grid = majorants_at(entry.majorants, 0)
    color = vec(grid.color)
    least = min(color[0], min(color[1], color[2]))
    planes, steps, t, last, cell = start_cells(grid, o, d, 0.0, s)
    state, u, survives = rng.advance(state)
    left = _depth(u)
    depth = 0.0
    enough = _THIN * _largest(result)
    thin = -fastmath.log(_THIN)  # where `result` has gone down by that depth it is less than `enough`
    while t < last and inside_cells(grid, cell):
        rate, mean = control_of(grid, cell)
        leave, planes, cell = next_cell(planes, steps, t, last, cell)
        depth += mean * (leave - t)
        while (leave - t) * rate >= left and rate > 0.0:
            t += left / rate
            evaluate_at(scene, media, index, point, madd(o, d, t), start + t)
            residual = sub(vec(entry.sigma_t), scale(color, mean))
            result = mul(result, sub((1.0, 1.0, 1.0), scale(residual, 1.0 / rate)))
            most = _largest(result)
            if not most > 0.0:
                return (0.0, 0.0, 0.0), state
            thin = fastmath.log(most / enough)
            state, u, _ = rng.advance(state)
            left = _depth(u)
        left -= (leave - t) * rate
        t = leave
        if depth * least > thin:
            if survives >= 0.5:
                return (0.0, 0.0, 0.0), state
            result = scale(result, 2.0)
            thin += _LN_2
            state, _, survives = rng.advance(state)
    return mul(result, decay(color, depth)), state


@device
def distance_density(media, o, d, t):
    """About the density with which a path along o, d scatters at t in the media at an address: by their means."""
    m = media_at(media, 0)
    rate = average(vec(m.sigma_t))
    depth = rate * t
    for i in range(m.count):
        entry = entry_at(media, i)
        if entry.priority == m.top and entry.majorants != 0:
            rate += mean_at(entry.majorants, madd(o, d, t))
            depth += mean_depth(entry.majorants, o, d, 0.0, t)
    return rate * math.exp(-depth)


@inlined
def _only_attenuates(media, last):
    """Whether the media at an address neither emit nor scatter; a path that is on its `last` ray does not scatter."""
    m = media_at(media, 0)
    if max3(vec(m.emission)) > 0.0 or (not last and max3(vec(m.sigma_s)) > 0.0):
        return False
    for i in range(m.count):
        entry = entry_at(media, i)
        if entry.priority == m.top and entry.majorants != 0:
            majorants = majorants_at(entry.majorants, 0)
            if majorants.emits or (majorants.scatters and not last):
                return False
    return True


@inlined
def _key(key, d, end):
    """A key of random numbers for a shadow ray of its own: a path has several at a vertex."""
    key = rng.hash_combine(key, int(d[0] * 1.0e9) & 0xFFFFFFFF)
    key = rng.hash_combine(key, int(d[1] * 1.0e9) & 0xFFFFFFFF)
    return rng.hash_combine(key, int(min(end, 1.0e6) * 1.0e6) & 0xFFFFFFFF)
