"""Direct light at a second point of a ray through media, chosen by the angle under which a lamp sees it.

A path scatters where its extinction says, which is seldom near a lamp. So on each segment one lamp with a place is
chosen, the pivot, and a point t of the segment with the density (Kulla and Fajardo 2012)

    p_e(t) = D / ((θ_b - θ_a) (D² + (t - Δ)²)),    t = Δ + D tan θ

with D the pivot's distance from the ray, at least its radius, Δ where on the ray it is nearest and θ_a, θ_b the angles
of the segment's ends. There a light is sampled as at any point that scatters. This and the direct light where the path
itself scatters, with the density p_d(t), are two techniques for the same integral over t; both are weighted by the
power heuristic of p_e and p_d, given the pivot. What the path's next ray finds is not concerned: it belongs to the
point where the path has scattered alone.

Where media vary, p_d is not known. The weights need not be made of densities to add up to 1, only be the same function
of t for both: m(t) exp(-∫ m) by the means m of the majorants' cells takes its place.
"""

from ..core import rng
from ..core.jit import device
from ..core.records import SCRATCH_MEDIA, SCRATCH_SHADOW, media_at, path_in, point_in, shadow_at
from ..core.vec import dot, is_black, madd, mul, put, scale, vec
from ..path.state import DIM_DIRECTION, DIM_LOBE, DIM_ROULETTE, mis_weight
from .pivot import choose_pivot, pivot_density, pivot_point
from .segment import channel_weights, direct_light, scattering_point
from .stack import decay, entry_at
from .tracking import attenuation, coefficients, distance_density, evaluate_at, start_point

_KEY = 0x51ED270B  # sets the random numbers apart from the path's own


@device
def add_beside_lamps(scene, integrator, film, scratch):
    """Choose the pivot for the part of the scratch's SHADOW of the path's ray, and add direct light at its point."""
    path = path_in(scratch)
    media = scratch + SCRATCH_MEDIA
    d = vec(path.d)
    ray = shadow_at(scratch + SCRATCH_SHADOW, 0)
    start = ray.begin
    s = ray.end - start
    o = madd(vec(path.o), d, start)
    key = path.key
    path.key = rng.hash_combine(key, _KEY)
    u0 = rng.sample1(path.key, path.sample, path.dimension + DIM_LOBE)
    u1, u2 = rng.sample2(path.key, path.sample, path.dimension + DIM_DIRECTION)
    if choose_pivot(scene, media, o, d, s, u0):
        t = pivot_point(media, u1)
        if 0.0 < t < s:
            _add_at(scene, integrator, film, scratch, path, o, d, start, t, u2)
    path.key = key


@device
def _add_at(scene, integrator, film, scratch, path, o, d, start, t, u):
    """Add direct light at t from `start` on the path's ray o, d; u chooses the medium that scatters there."""
    media = scratch + SCRATCH_MEDIA
    m = media_at(media, 0)
    w = vec(path.throughput)
    sigma_t, sigma_s = vec(m.sigma_t), vec(m.sigma_s)
    through = decay(sigma_t, t)
    density = 0.0
    share = 1.0
    chosen = -1
    if m.varying > 0:
        point = start_point(scratch, path, d, path.flags)
        state = rng.stream(path.key, path.sample, path.dimension + DIM_ROULETTE)
        through = mul(through, attenuation(scene, media, point, o, d, start, t, state))
        density = distance_density(media, o, d, t)
        chosen, share = _choose(scene, media, point, madd(o, d, t), start + t, u)
        _, sigma_s, _ = coefficients(media, chosen)
    else:
        density = dot(channel_weights(w, sigma_t, sigma_s), mul(sigma_t, through))
    if share <= 0.0:
        return
    p = pivot_density(media, t)
    value = scale(mul(w, mul(through, sigma_s)), mis_weight(p, density) / (p * share))
    if is_black(value):
        return
    sp = point_in(scratch)
    flags, receiver, shares, first = sp.ray_flags, vec(sp.receiver), vec(sp.light_shares), path.first_in_medium
    if path.bounce == 0:
        path.first_in_medium = 1
    put(path.throughput, value)
    m.chosen = chosen
    scattering_point(path, sp, start + t)
    direct_light(scene, integrator, film, scratch, path, sp, d, 1.0)
    m.chosen = -1
    put(path.throughput, w)
    path.first_in_medium = first
    sp.ray_flags = flags
    put(sp.receiver, receiver)
    put(sp.light_shares, shares)


@device
def _choose(scene, media, point, p, t, u):
    """(medium, its probability): one of those at p, by how much it scatters there, for which all are evaluated."""
    m = media_at(media, 0)
    s = m.sigma_s
    total = s[0] + s[1] + s[2]
    chosen, weight = -1, total
    for i in range(m.count):
        entry = entry_at(media, i)
        if entry.priority != m.top or entry.majorants == 0:
            continue
        evaluate_at(scene, media, i, point, p, t)
        s = entry.sigma_s
        own = s[0] + s[1] + s[2]
        total += own
        if u * total < own:
            chosen, weight = i, own
            u *= total / own
        elif total > own:
            u = (u * total - own) / (total - own)
    return chosen, weight / total if total > 0.0 else 0.0
