"""A path between two surfaces in media: emission, extinction, and scattering with its direct light.

Distances are sampled by the extinction of one colour channel, chosen by what the path carries in it, and weighted by
the balance heuristic over the channels (Chiang, Kutz and Burley 2016, "Practical and controllable subsurface
scattering").
"""

import math

from ..core import rng
from ..core.jit import device, inlined
from ..core.memory import call_entry, load_i64, record_address
from ..core.records import (
    PHASE,
    RAY_VOLUME,
    SCENE_HAS_PIVOTS,
    SCRATCH_LIGHT_SAMPLE,
    SCRATCH_MEDIA,
    SCRATCH_SHADOW,
    light_sample_at,
    media_at,
    shadow_at,
)
from ..core.vec import dot, madd, max3, mul, neg, put, scale, vec
from ..film.contribute import EMISSION, IN_MEDIUM, contribute, found
from ..film.surface_passes import medium_passes
from ..lobes.classes import Lobes, share
from ..path.direct import add_light_sample, draw_light
from ..path.state import ARRIVES, DIM_DIRECTION, DIM_LOBE, DIMENSIONS, ENDS, GOES_ON, LAST, next_ray, roulette
from ..subsurface.phase import around
from .calls import BESIDE_LAMPS, TRACK, segment_start
from .phase import phase_cosine, phase_value
from .pivot import own_share
from .stack import decay, entry_at, innermost
from .through import find_world_medium
from .towards_lamps import choose_target, target_angle, target_density
from .tracking import coefficients

# Least share of a channel's albedo in its choice: one that is only absorbed still has its light carried through.
_LEAST_ALBEDO = 0.25


@device
def _emitted(e, sigma, through, s):
    """∫ e exp(-σ x) dx over 0 … s in one channel."""
    if sigma * s > 1.0e-4:
        return e * (1.0 - through) / sigma
    return e * s * (1.0 - 0.5 * sigma * s)


@device
def channel_weights(throughput, sigma_t, sigma_s):
    """Probabilities of the channels that may choose the distance."""
    w = (
        abs(throughput[0]) * ((sigma_s[0] / sigma_t[0] if sigma_t[0] > 0.0 else 1.0) + _LEAST_ALBEDO),
        abs(throughput[1]) * ((sigma_s[1] / sigma_t[1] if sigma_t[1] > 0.0 else 1.0) + _LEAST_ALBEDO),
        abs(throughput[2]) * ((sigma_s[2] / sigma_t[2] if sigma_t[2] > 0.0 else 1.0) + _LEAST_ALBEDO),
    )
    total = w[0] + w[1] + w[2]
    if total <= 0.0:
        return (1.0 / 3.0, 1.0 / 3.0, 1.0 / 3.0)
    return scale(w, 1.0 / total)


@device
def sample_distance(throughput, sigma_t, sigma_s, s, u0, u1):
    """(distance, weight rgb): where the path scatters, or `s` where it gets through; weight: of its throughput."""
    p = channel_weights(throughput, sigma_t, sigma_s)
    sigma = sigma_t[2]
    if u0 < p[0]:
        sigma = sigma_t[0]
    elif u0 < p[0] + p[1]:
        sigma = sigma_t[1]
    x = -math.log(1.0 - u1) / sigma if sigma > 0.0 else s
    if x < s:
        through = decay(sigma_t, x)
        pdf = dot(p, mul(sigma_t, through))
        return x, scale(mul(sigma_s, through), 1.0 / pdf) if pdf > 0.0 else (0.0, 0.0, 0.0)
    through = decay(sigma_t, s)
    pdf = dot(p, through)
    return s, scale(through, 1.0 / pdf) if pdf > 0.0 else (0.0, 0.0, 0.0)


@device
def follow_segment(scene, integrator, film, scratch, path, sp, reaches):
    """Follow the path through its media to path.t, where its ray `reaches` an instance, or -1; its next event."""
    media = media_at(scratch + SCRATCH_MEDIA, 0)
    if reaches < 0:
        # A ray that meets nothing is outside of every closed mesh.
        find_world_medium(scene, integrator, scratch, path, vec(path.o))
        if media.count == 0:
            return ARRIVES
    start = segment_start(path)
    path.medium_start = path.t
    s = path.t - start
    if s <= 0.0:
        return ARRIVES
    if media.varying > 0:
        return _follow_varying(scene, integrator, film, scratch, path, sp, start, s)
    _add_emission(integrator, film, scratch, path, media, s)
    sigma_t = vec(media.sigma_t)
    sigma_s = vec(media.sigma_s)
    throughput = vec(path.throughput)
    lit_twice = scene.flags & SCENE_HAS_PIVOTS and not path.last and max3(sigma_s) > 0.0
    if lit_twice:
        _beside_lamps(scene, integrator, film, scratch, start, s)
    if path.last or max3(sigma_s) <= 0.0:
        x, weight = s, decay(sigma_t, s)
    else:
        u0, u1 = rng.sample2(path.key, path.sample, path.dimension)
        path.dimension += 1
        x, weight = sample_distance(throughput, sigma_t, sigma_s, s, u0, u1)
    put(path.throughput, mul(throughput, weight))
    if max3(vec(path.throughput)) <= 0.0:
        return ENDS
    if x >= s:
        return ARRIVES
    part = 1.0
    if lit_twice:
        p = channel_weights(throughput, sigma_t, sigma_s)
        part = own_share(scratch + SCRATCH_MEDIA, x, dot(p, mul(sigma_t, decay(sigma_t, x))))
    scattering_point(path, sp, start + x)
    return _scatter(scene, integrator, film, scratch, path, sp, sigma_t, sigma_s, part)


@inlined
def _beside_lamps(scene, integrator, film, scratch, start, s):
    """Add direct light at a second point of the path's segment: see `equiangular`."""
    ray = shadow_at(scratch + SCRATCH_SHADOW, 0)
    ray.begin = start
    ray.end = start + s
    addresses = record_address(scene), record_address(integrator), record_address(film)
    call_entry(load_i64(integrator.media, BESIDE_LAMPS), addresses[0], addresses[1], addresses[2], scratch, 0)


@device
def _follow_varying(scene, integrator, film, scratch, path, sp, start, s):
    """`follow_segment` where some of the media vary in space."""
    lit_twice = scene.flags & SCENE_HAS_PIVOTS and not path.last
    if lit_twice:
        _beside_lamps(scene, integrator, film, scratch, start, s)
    addresses = record_address(scene), record_address(integrator), record_address(film)
    ray = shadow_at(scratch + SCRATCH_SHADOW, 0)
    ray.begin = start
    ray.end = start + s
    call_entry(load_i64(integrator.media, TRACK), addresses[0], addresses[1], addresses[2], scratch, 0)
    w = vec(path.throughput)
    if w[0] == 0.0 and w[1] == 0.0 and w[2] == 0.0:
        return ENDS
    media = scratch + SCRATCH_MEDIA
    x = ray.end - start
    if x >= s:
        return ARRIVES
    m = media_at(media, 0)
    sigma_t, sigma_s, _ = coefficients(media, m.chosen)
    part = own_share(media, x, m.density) if lit_twice else 1.0
    scattering_point(path, sp, start + x)
    return _scatter(scene, integrator, film, scratch, path, sp, sigma_t, sigma_s, part)


@device
def _add_emission(integrator, film, scratch, path, media, s):
    """Contribute what the media emit along the first s of the path's way through them."""
    if max3(vec(media.emission)) <= 0.0:
        return
    sigma_t = vec(media.sigma_t)
    through = decay(sigma_t, s)
    e = media.emission
    light = (
        _emitted(e[0], sigma_t[0], through[0], s),
        _emitted(e[1], sigma_t[1], through[1], s),
        _emitted(e[2], sigma_t[2], through[2], s),
    )
    what = found(path, EMISSION, IN_MEDIUM, innermost(scratch + SCRATCH_MEDIA), 0.0)
    contribute(integrator, film, path, mul(vec(path.throughput), light), what)


@device
def scattering_point(path, sp, t):
    """Make sp the point on the path's ray at the distance t: it has no surface."""
    put(sp.p, madd(vec(path.o), vec(path.d), t))
    sp.dp = path.dp + t * path.dd
    sp.t = t
    sp.instance = -1
    sp.light_set = 0
    sp.n_closures = 0
    put(sp.n, (0.0, 0.0, 0.0))
    put(sp.ng, (0.0, 0.0, 0.0))
    put(sp.receiver, (0.0, 0.0, 0.0))
    put(sp.wo, neg(vec(path.d)))


@device
def _scatter(scene, integrator, film, scratch, path, sp, sigma_t, sigma_s, part):
    """Direct light at the scattering point sp, of which a part counts, and the path's next ray from there.

    Returns the path's next event.
    """
    media = scratch + SCRATCH_MEDIA
    albedo = share(sigma_s[0], sigma_t[0]), share(sigma_s[1], sigma_t[1]), share(sigma_s[2], sigma_t[2])
    medium_passes(film, path, albedo)
    weight = roulette(integrator, path)
    if weight == 0.0:
        return ENDS
    put(path.throughput, scale(vec(path.throughput), weight))
    if path.bounce == 0:
        path.first_in_medium = 1
    d = vec(path.d)
    direct_light(scene, integrator, film, scratch, path, sp, d, part)
    u0, _ = rng.sample2(path.key, path.sample, path.dimension + DIM_LOBE)
    u1, u2 = rng.sample2(path.key, path.sample, path.dimension + DIM_DIRECTION)
    share_to = media_at(media, 0).share
    if u0 < share_to:
        wi = around(vec(media_at(media, 0).target), math.cos(target_angle(u1)), u2)
    else:
        wi = around(d, choose_cosine(media, (u0 - share_to) / (1.0 - share_to), u1), u2)
    p = phase_density(media, dot(d, wi))
    pdf = direction_density(media, p, wi)
    if p <= 0.0:
        return ENDS
    put(path.throughput, scale(vec(path.throughput), p / pdf))
    next_ray(path, sp, vec(sp.p), wi)
    path.flags = RAY_VOLUME
    path.background_visible = 0
    path.mis_pdf = pdf
    path.min_pdf = min(path.min_pdf, pdf)
    path.bounce += 1
    path.volume_bounce += 1
    path.dimension += DIMENSIONS
    if path.bounce >= integrator.max_bounces or path.volume_bounce >= integrator.volume_bounces:
        path.last = LAST
    return GOES_ON


@device
def direct_light(scene, integrator, film, scratch, path, sp, d, part):
    """Add a part of one light sample at the scattering point sp, as the phase function scatters it.

    Whose value is its density, and of no class of lobes: that the path is in a medium decides on the passes.
    """
    media = scratch + SCRATCH_MEDIA
    _, u = rng.sample2(path.key, path.sample, path.dimension + DIM_LOBE)
    choose_target(scene, integrator, media, path, vec(sp.p), u)
    if draw_light(scene, scratch, path, sp, path.sample):
        ls = light_sample_at(scratch + SCRATCH_LIGHT_SAMPLE, 0)
        if ls.seen_by & RAY_VOLUME:
            p = phase_density(media, dot(d, vec(ls.wi)))
            f = Lobes((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (p, p, p))
            add_light_sample(
                scene, integrator, film, scratch, path, sp, f, direction_density(media, p, vec(ls.wi)), part
            )


@inlined
def direction_density(media, p, wi):
    """The density by solid angle of the directions in which paths go on, p being that of the phase function."""
    share = media_at(media, 0).share
    return p if share == 0.0 else (1.0 - share) * p + share * target_density(media, wi)


@inlined
def _has_scattered(media, index):
    """Whether the phase function at a scattering point is made of that of a medium."""
    m = media_at(media, 0)
    if m.chosen >= 0:
        return index == m.chosen
    entry = entry_at(media, index)
    return entry.priority == m.top and entry.majorants == 0


@device
def phase_density(media, cosine):
    """The phase function of the media at an address, a mixture by their mean coefficients over the channels.

    Where one that varies has scattered, it is that one's alone.
    """
    total = 0.0
    value = 0.0
    for i in range(media_at(media, 0).count):
        entry = entry_at(media, i)
        if _has_scattered(media, i):
            p = entry.phases
            for k in range(0, PHASE * entry.n_phases, PHASE):
                total += p[k + 1]
                value += p[k + 1] * phase_value(int(p[k]), p[k + 2], p[k + 3], p[k + 4], cosine)
    return value / total if total > 0.0 else 0.0


@device
def choose_cosine(media, u0, u1):
    """A cosine with the density of `phase_density`: u0 chooses the part, u1 the cosine."""
    total = 0.0
    chosen = 0
    at = 0
    for i in range(media_at(media, 0).count):
        entry = entry_at(media, i)
        if _has_scattered(media, i):
            for k in range(0, PHASE * entry.n_phases, PHASE):
                weight = entry.phases[k + 1]
                total += weight
                part = weight / total
                if u0 < part:
                    chosen = i
                    at = k
                    u0 /= part
                else:
                    u0 = (u0 - part) / (1.0 - part)
    p = entry_at(media, chosen).phases
    return phase_cosine(int(p[at]), p[at + 2], p[at + 3], p[at + 4], u1)
