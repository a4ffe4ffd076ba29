"""Random walk subsurface scattering: a path through a homogeneous medium inside one object, estimated per channel.

The boundary is index-matched: the walk starts in the direction of `entry`, scatters by Henyey and Greenstein's phase
function, and ends where a segment meets the object's surface again. Positions are in object space, where rays are
traced; directions and distances are the world's, so that any transform is right.

Each segment is sampled by one of up to nine techniques, {classic, guided outwards, guided to the far side} × channels,
and weighted by the balance heuristic over all of them (`_segment_weight`). Constants are Cycles' (Chiang, Kutz and
Burley 2016; Wrenninge, Villemin and Hery 2017). So are three approximations, unless EXACT_WALKS is set: after the ninth
scattering the phase function is isotropic with σ_s (1 - g) in the place of σ_s; a walk of more than 256 segments is
lost; an α below 0.2 is taken for 0.2 and dimmed by their ratio.
"""

import math
from typing import NamedTuple

from ..core import rng
from ..core.fastmath import exp, log
from ..core.jit import device, inlined, outcome_entry
from ..core.memory import load_i64
from ..core.records import SCRATCH_RAY, closure_at, integrator_at, mesh_at, path_in, point_in, scene_at
from ..core.vec import dot, madd, max3, mul, put, scale, transform_point, transform_vector, vec
from ..film.contribute import first_scattering
from ..geometry.local import hit_barycentrics, hit_distance, trace
from ..geometry.placed import placed_at
from ..lobes.closure import P_ALBEDO, P_ANISOTROPY, P_COLOR, P_SIGMA_T
from ..path.state import ENDS, FAR, SHADES, next_after
from .dwivedi import backward_fraction, diffusion_length, dwivedi_cosine, dwivedi_norm, dwivedi_pdf
from .entry import enter
from .exit import leave
from .method_table import EXACT_WALKS, FLAGS
from .phase import around, hg, hg_sample
from .walked import note_end, note_segment, note_similar, note_vertex, walked_in

MAX_SEGMENTS = 256
MAX_SEGMENTS_EXACT = 65536  # 0.2 % of the light of a white half space have not come out by then
FAITHFUL_SEGMENTS = 10  # before similarity takes over
GUIDED_LATER = 0.75  # guided fraction from there on
MIN_ALBEDO = 0.2  # below it Dwivedi's distribution is all but singular
STRATIFIED = 4  # segments after the first whose numbers are stratified over the samples of a pixel
WALK_DIMENSIONS = 2 * STRATIFIED + 1
NEGLIGIBLE = 1.0e-6  # throughput
# Share of the throughput after one scattering below which a walk goes on by chance: saves a sixth of the time.
DIM = 0.4
OPPOSITE = 10.0  # mean free paths within which the first ray looks for a far side


class Medium(NamedTuple):
    """What a walk goes through, by channel, and how its segments are guided."""

    sigma_t: tuple[float, float, float]
    alpha: tuple[float, float, float]
    g: float
    guided: float  # share of guided segments
    nu: float  # diffusion length of the brightest channel, in mean free paths
    norm: float  # of Dwivedi's distribution


@inlined
def _medium(throughput, sigma_t, alpha, g, guided):
    nu = diffusion_length(max(_largest(throughput, alpha), MIN_ALBEDO))
    return Medium(sigma_t, alpha, g, guided, nu, dwivedi_norm(nu))


@device
def _guided_fraction(g):
    """Share of guided steps: half of them for isotropic scattering, few for strongly forward scattering."""
    return 0.5 if g == 0.0 else 1.0 - max(0.5, abs(g) ** 0.125)


@device
def _channel(c, throughput, k, floor):
    """(throughput, σ_t, α) of channel k when the walk starts; throughput 0 when nothing can come of it.

    floor: the smallest α that is walked, what is below is dimmed.
    """
    color = c.p[P_COLOR + k]
    sigma_t = c.p[P_SIGMA_T + k]
    alpha = c.p[P_ALBEDO + k]
    weight = throughput / color if color > 0.0 else 0.0
    if not (weight > 0.0 and sigma_t > 0.0 and sigma_t < math.inf and alpha > 0.0):
        return 0.0, 1.0, 1.0
    if alpha < floor:
        return weight * alpha / floor, sigma_t, floor
    return weight, sigma_t, min(alpha, 1.0)


@inlined
def channels(c, throughput, floor):
    """`_channel` of all three: (throughput, σ_t, α)."""
    w0, s0, a0 = _channel(c, throughput[0], 0, floor)
    w1, s1, a1 = _channel(c, throughput[1], 1, floor)
    w2, s2, a2 = _channel(c, throughput[2], 2, floor)
    return (w0, w1, w2), (s0, s1, s2), (a0, a1, a2)


@inlined
def _largest(throughput, values):
    """The largest value of the channels that have any throughput."""
    r, g, b = throughput
    return max(values[0] if r > 0.0 else 0.0, max(values[1] if g > 0.0 else 0.0, values[2] if b > 0.0 else 0.0))


@inlined
def _smallest(throughput, values):
    """The smallest value of the channels that have any throughput."""
    r, g, b = throughput
    return min(values[0] if r > 0.0 else FAR, min(values[1] if g > 0.0 else FAR, values[2] if b > 0.0 else FAR))


@inlined
def probabilities(throughput, alpha):
    """With which probabilities a segment is sampled by each channel's extinction."""
    r, g, b = throughput[0] * alpha[0], throughput[1] * alpha[1], throughput[2] * alpha[2]
    s = 1.0 / (r + g + b)
    return r * s, g * s, b * s


@inlined
def pick(p, values, u):
    """The value of the channel that u in [0, 1) chooses."""
    if u < p[0]:
        return values[0]
    return values[1] if u < p[0] + p[1] or p[2] == 0.0 else values[2]


@inlined
def _length(throughput, medium, stretch, u0, u1):
    """The length of a segment: u0 chooses the channel by whose extinction, times `stretch`, it is drawn."""
    return -log(1.0 - u1) / (pick(probabilities(throughput, medium.alpha), medium.sigma_t, u0) * stretch)


@inlined
def _straight(throughput, medium, t, hit):
    """The throughput after a first segment, whose direction is given: transmittance (times σ_s) over its density."""
    sigma_t = medium.sigma_t
    e = (fall(sigma_t[0] * t), fall(sigma_t[1] * t), fall(sigma_t[2] * t))
    if not hit:
        e = mul(e, sigma_t)
    return _balanced(throughput, medium.alpha, e, e, hit)


@inlined
def _balanced(throughput, alpha, value, density, hit):
    """The throughput times `value` over the density of a channel chosen by throughput times α; α unless light leaves.

    `density` is by channel and may lack the same factor as `value`.
    """
    a = mul(throughput, alpha)
    pdf = dot(a, density)
    if not pdf > 0.0:
        return (0.0, 0.0, 0.0)
    return scale(mul(throughput if hit else a, value), (a[0] + a[1] + a[2]) / pdf)


@inlined
def _segment_weight(throughput, medium, t, hit, k, forward, backward):
    """The throughput after a segment: transmittance (times σ_s) over the density of all techniques.

    k: the cosine with the outward normal by the diffusion length, which stretches the extinction of guided segments to
    1 - k and 1 + k of it; forward, backward: the shares of guided segments of either kind times its density of the
    direction over the phase function's.
    """
    x = scale(medium.sigma_t, t)
    classic = 1.0 - medium.guided
    if not hit:
        forward *= 1.0 - k
        backward *= 1.0 + k
    if max3(x) < 300.0:
        e = (exp(-x[0]), exp(-x[1]), exp(-x[2]))
        q = (exp(x[0] * k), exp(x[1] * k), exp(x[2] * k))
        m = (classic + forward * q[0], classic + forward * q[1], classic + forward * q[2])
        if backward > 0.0:
            m = (m[0] + backward / q[0], m[1] + backward / q[1], m[2] + backward / q[2])
        m = mul(m, e)
    else:
        e = (fall(x[0]), fall(x[1]), fall(x[2]))
        m = scale(e, classic)
        m = madd(m, (fall(x[0] * (1.0 - k)), fall(x[1] * (1.0 - k)), fall(x[2] * (1.0 - k))), forward)
        m = madd(m, (fall(x[0] * (1.0 + k)), fall(x[1] * (1.0 + k)), fall(x[2] * (1.0 + k))), backward)
    if not hit:
        e, m = mul(e, medium.sigma_t), mul(m, medium.sigma_t)
    return _balanced(throughput, medium.alpha, e, m, hit)


@inlined
def fall(x):
    """e^-x for any x that is not negative."""
    return exp(-min(x, 700.0))


@inlined
def similar(sigma_t, alpha, g):
    """(σ_t, α) of the isotropic medium with the same absorption and the same reduced scattering."""
    s = sigma_t * alpha * (1.0 - g)
    t = sigma_t * (1.0 - alpha) + s
    return t, s / t


@inlined
def _isotropic(throughput, medium):
    """The Medium that takes the place of another where walks have forgotten their direction."""
    s0, a0 = similar(medium.sigma_t[0], medium.alpha[0], medium.g)
    s1, a1 = similar(medium.sigma_t[1], medium.alpha[1], medium.g)
    s2, a2 = similar(medium.sigma_t[2], medium.alpha[2], medium.g)
    return _medium(throughput, (s0, s1, s2), (a0, a1, a2), 0.0, GUIDED_LATER)


@device
def first_hit(structure, time, ray, o, d, tmax, start):
    """The primitive that a ray from the triangle `start` meets first, not counting that triangle; -1: none."""
    primitive = trace(structure, time, ray, o, d, 0.0, tmax)
    if primitive == start:
        primitive = trace(structure, time, ray, o, d, next_after(hit_distance(ray)), tmax)
    return -1 if primitive == start else primitive


@inlined
def _first_segment(structure, time, ray, path, sp, o, d, d_object, throughput, medium, thinnest):
    """(primitive that is hit or -1, length, thickness) of the segment from `sp` along d.

    The thickness is the object's along -n, in mean free paths of the extinction `thinnest`; -1: not known.
    """
    u0, u1 = rng.sample2(path.key, path.sample, path.dimension)
    t = _length(throughput, medium, 1.0, u0, u1)
    primitive = first_hit(structure, time, ray, o, d_object, max(t, OPPOSITE / thinnest), sp.primitive)
    if primitive < 0:
        return -1, t, -1.0
    distance = hit_distance(ray)
    thickness = max(-distance * dot(d, vec(sp.n)) * thinnest, 0.0)
    if distance < t:
        return primitive, distance, thickness
    return -1, t, thickness


@inlined
def _numbers(path, state, segment):
    """(state of the stream, six random numbers): stratified over the samples of a pixel in the first segments."""
    state, u0, u1 = rng.advance(state)
    state, u2, u3 = rng.advance(state)
    state, u4, u5 = rng.advance(state)
    if segment <= STRATIFIED:
        u0, u1 = rng.sample2(path.key, path.sample, path.dimension + 2 * segment - 1)
        u3, u4 = rng.sample2(path.key, path.sample, path.dimension + 2 * segment)
    return state, (u0, u1, u2, u3, u4, u5)


@inlined
def _survivor(throughput, dim, u):
    """The throughput of a walk that goes on by chance where it is below `dim`; black: it ends."""
    brightness = max3(throughput)
    if brightness >= dim:
        return throughput
    return scale(throughput, dim / brightness) if u * dim < brightness else (0.0, 0.0, 0.0)


@inlined
def _direction(n, d, medium, share, u0, u1, u2):
    """Sample a segment's direction after one along d: (direction, stretch of the extinction, k, forward, backward).

    share: of guided segments, those to the far side. u0 chooses the technique; k, forward and backward are those of
    `_segment_weight`.
    """
    guided, nu, norm = medium.guided, medium.nu, medium.norm
    stretch = 1.0
    if u0 < guided:
        cosine = dwivedi_cosine(nu, norm, u1)
        stretch = 1.0 - cosine / nu
        if u0 < guided * share:
            cosine = -cosine
        w = around(n, cosine, u2)
        phase = hg(dot(d, w), medium.g)
    else:
        w, phase = hg_sample(d, medium.g, u1, u2)
        cosine = dot(w, n)
    odds = guided / max(phase, 1.0e-30)
    forward = odds * (1.0 - share) * dwivedi_pdf(nu, norm, cosine)
    backward = odds * share * dwivedi_pdf(nu, norm, -cosine) if share > 0.0 else 0.0
    return w, stretch, cosine / nu, forward, backward


@device
def walk(scene, scratch, sp, path, d, segments, exact):
    """Walk from `sp` along d (unit, world space) through the medium of its closure `scatterer`.

    Returns (primitive, d, throughput, events): the triangle where the walk leaves (-1: it does not), the direction of
    the last segment, the path's throughput there, and how often light was scattered. Where the triangle is hit stands
    in the scratch's RTCRayHit, what the walk was like in its WALKED.
    """
    c = closure_at(sp.closures, sp.scatterer)
    placed = placed_at(scene, sp.instance)
    structure, time, ray = mesh_at(scene.meshes, placed.mesh).embree, scene.time, scratch + SCRATCH_RAY
    throughput, sigma_t, alpha = channels(c, vec(path.throughput), 0.0 if exact else MIN_ALBEDO)
    if structure == 0 or not max3(throughput) > 0.0:
        return -1, d, throughput, 0
    g = c.p[P_ANISOTROPY]
    medium = _medium(throughput, sigma_t, alpha, g, _guided_fraction(g))
    thinnest = _smallest(throughput, sigma_t)
    dim = DIM * max3(mul(throughput, alpha))
    n, o, d_object = vec(sp.n), transform_point(placed.to_object, vec(sp.p)), transform_vector(placed.to_object, d)
    primitive, t, thickness = _first_segment(
        structure, time, ray, path, sp, o, d, d_object, throughput, medium, thinnest
    )
    throughput = _straight(throughput, medium, t, primitive >= 0)
    if primitive >= 0:
        return primitive, d, throughput, 0

    walked = walked_in(scratch)
    note_vertex(walked, madd(vec(sp.p), d, t), d, t)
    depth = -t * dot(d, n) * thinnest
    share = 0.0
    length = 0.0
    state = rng.stream(path.key, path.sample, path.dimension)
    for segment in range(1, segments):
        if max3(throughput) < NEGLIGIBLE:
            break
        o = madd(o, d_object, t)
        if segment == FAITHFUL_SEGMENTS and not exact:
            medium = _isotropic(throughput, medium)
            note_similar(walked, length, segment)
            length = 0.0
        if thickness >= 0.0:
            share = backward_fraction(min(max(depth, 0.0), thickness), thickness, medium.nu)
        state, u = _numbers(path, state, segment)
        throughput = _survivor(throughput, dim, u[5])
        if max3(throughput) == 0.0:
            break
        d, stretch, k, forward, backward = _direction(n, d, medium, share, u[2], u[3], u[4])
        d_object = transform_vector(placed.to_object, d)
        t = _length(throughput, medium, stretch, u[0], u[1])
        primitive = trace(structure, time, ray, o, d_object, 0.0, t)
        if primitive >= 0:
            t = min(hit_distance(ray), t)
        if segment <= 2:
            note_segment(walked, segment, d, t)
        length += t
        throughput = _segment_weight(throughput, medium, t, primitive >= 0, k, forward, backward)
        if primitive >= 0:
            note_end(walked, length, segment)
            return primitive, d, throughput, segment
        depth -= t * dot(d, n) * thinnest
    return -1, d, throughput, 0


@outcome_entry
def random_walk(scene, integrator, film, scratch, _):
    """The method of kernels.subsurface.methods for media."""
    scene, integrator = scene_at(scene, 0), integrator_at(integrator, 0)
    exact = load_i64(integrator.scatter, FLAGS) & EXACT_WALKS != 0
    segments = MAX_SEGMENTS_EXACT if exact else MAX_SEGMENTS
    if integrator.max_scatters >= 0:
        segments = min(segments, integrator.max_scatters + 1)
    path, sp = path_in(scratch), point_in(scratch)
    c = closure_at(sp.closures, sp.scatterer)
    enters, d = enter(path, sp, c)
    if not enters:
        return ENDS
    primitive, d, throughput, scattered = walk(scene, scratch, sp, path, d, segments, exact)
    if primitive < 0 or not max3(throughput) > 0.0:
        return ENDS
    ray = scratch + SCRATCH_RAY
    u, v = hit_barycentrics(ray)
    leave(scene, sp, primitive, u, v, hit_distance(ray), d)
    put(path.throughput, throughput)
    path.dimension += WALK_DIMENSIONS
    path.scattering = first_scattering(path, scattered)
    return SHADES
