"""HYBRID: light that goes straight through or scatters once is traced, the rest is diffusion (Zhang and d'Eon 2025).

One direction of entry serves all three. The boundary exit lies where it meets the object again, the single one where a
scattered ray does; the probe's hits are the exits of what scatters more often, by the profile R_n, scaled so that a
half space returns what it does for that direction of entry.

The profile knows nothing of the object's thickness, which is not in the paper. Where that is asked for, its parts on
the near and on the far side are scaled by what a slab of the local thickness reflects and transmits, and are as wide as
what it spreads. A point that faces the same way lies on the near side, one that faces the opposite way on the far one,
and the share of the latter in between is the square of half of one less the normals' cosine. Where the surface curves
away between two points there is more, or in thin objects less light, so that a ball returns what it has to. The
thickness is found by the boundary's ray.
"""

import math

from ..core import rng
from ..core.fastmath import exp, log
from ..core.jit import device, inlined, outcome_entry
from ..core.memory import load_i64
from ..core.records import closure_at, integrator_at, path_in, point_in, scene_at
from ..core.vec import dot, madd, max3, mul, neg, put, scale, vec
from ..geometry.local import hit_normal, local_intersect
from ..lobes.closure import P_ANISOTROPY
from ..path.state import FAR, next_after
from .albedo import shape_factors, similar, single_albedo, slab_albedos, total_albedo
from .bssrdf import (
    BSSRDF_ALONE,
    EXITS,
    MULTIPLE,
    MULTIPLE_OF_SLAB,
    NONE,
    bssrdf_in,
    channel_shares,
    note_choice_of,
    probe_bssrdf,
    start_bssrdf,
    weigh_hits,
)
from .diffusion import DIM_CHANNEL, DIM_LINE
from .entry import enter
from .exits import exit_at, light_found, put_exit
from .method_table import ALBEDOS, ANALOG_ESCAPE, FLAGS, THICKNESS_AWARE
from .phase import around, hg, hg_sample
from .scales import channels, far_share, profile_scales

# The far side of a slab that is thick against its profile gets at most so many times what the profile has there.
_MOST = 64.0

# Single and multiple scattering are each followed with a probability of their share of the light times this.
_TRIES = 2.0

_OUT = 0.6  # how often a half space's single scattering is looked for from outside, at g = 0
_GRAZING = 1.0e-4  # cosine

_DIM_DISTANCE, _DIM_PHASE, _DIM_ESCAPE, _DIMENSIONS = 2, 3, 4, 5  # random dimensions, besides the probe's


@device
def first_hit(scene, scratch, sp, o, d):
    """(t, primitive, u, v) where a ray from `sp` meets its own object again, its own triangle left out.

    What is nearer than positions are right is the triangle itself, nearly always: it is not even looked for.
    """
    t, primitive, u, v = local_intersect(scene, scratch, sp.instance, o, d, float(sp.error), FAR)
    if primitive == sp.primitive:
        t, primitive, u, v = local_intersect(scene, scratch, sp.instance, o, d, next_after(t), FAR)
        if primitive == sp.primitive:
            return FAR, -1, u, v
    return t, primitive, u, v


@device
def _thickness(scene, scratch, sp, d, mu, t, primitive):
    """How thick the object is below `sp`: exactly that of a slab and of a ball, whatever the boundary's ray along d.

    The ray, the last of the scratch's, has met the triangle at t. Between parallel faces the thickness is t mu; in a
    ball it is t / mu, and the normals' angle tells the two apart: half of one less their cosine is 1 between parallel
    faces, mu² in a ball.
    """
    if primitive < 0:
        return FAR
    n = hit_normal(scene, scratch, sp.instance)
    if dot(n, d) < 0.0:
        n = neg(n)
    return t * mu / max(0.5 - 0.5 * dot(n, vec(sp.ng)), 1.0e-6)


@inlined
def _fall(x):
    """e^-x for any x that is not negative."""
    return exp(-min(x, 700.0))


@inlined
def attenuation(sigma_t, t):
    return (_fall(sigma_t[0] * t), _fall(sigma_t[1] * t), _fall(sigma_t[2] * t))


@inlined
def _single_share(alpha, back, through):
    """About what part of a channel's light leaves after one scattering.

    back: what a half space of α = 1 returns; through: the part that goes straight on. Right for half spaces; in a thin
    object all that scatters leaves. It is what the term is chosen by, no more.
    """
    return alpha * (1.0 - through) * (back + (1.0 - back) * through)


@device
def _single(scene, scratch, path, sp, o, d, mu, thickness, through, weight, sigma_t, alpha, g, analog, place):
    """Put the exit of light that scatters once, on the ray from o along d; 1, or 0 where there is none.

    Distance and direction are sampled in two ways, of one channel by chance; their density is that of both and of all
    channels. One way is that of light: an exponential up to the far side, and the phase function. The other looks for
    a way out: a direction in proportion to its cosine ν with the normal, then a distance t as if the surface were flat,
    with transmittance over t (1 + μ/ν). analog: beyond the point of scattering light of a channel gets as far as a
    random number says, which needs no longer ray; else it is weakened by what lies on its way.
    """
    inside = (max(1.0 - through[0], 0.0), max(1.0 - through[1], 0.0), max(1.0 - through[2], 0.0))
    share = mul(mul(weight, alpha), inside)
    if not max3(share) > 0.0:
        return 0
    share = channel_shares(share)
    out = _OUT * (1.0 - abs(g)) * dot(share, inside)
    u0, u1 = rng.sample2(path.key, path.sample, path.dimension + _DIM_DISTANCE)
    u2, u3 = rng.sample2(path.key, path.sample, path.dimension + _DIM_PHASE)
    outwards = u2 < out
    chosen = sigma_t[_channel_of(share, u0)]
    n = vec(sp.ng)
    if outwards:
        w = around(n, math.sqrt(u2 / out), u3)
    else:
        w, _ = hg_sample(d, g, (u2 - out) / (1.0 - out), u3)
    nu = dot(w, n)
    slant = 1.0 + mu / max(nu, _GRAZING)
    rate = chosen * slant if outwards else chosen
    t = min(max(-log(1.0 - u1 * (1.0 - _fall(rate * thickness))) / rate, 0.0), thickness)
    before = attenuation(sigma_t, t)
    phase = hg(dot(d, w), g)
    ahead = back = 0.0
    for k in range(3):
        if share[k] > 0.0:
            ahead += share[k] * sigma_t[k] * before[k] / inside[k]
            if nu > 0.0 and out > 0.0:
                rate = sigma_t[k] * slant
                back += share[k] * rate * _fall(rate * t) / (1.0 - _fall(rate * thickness))
    pdf = (1.0 - out) * phase * ahead + out * max(nu, 0.0) * (1.0 / math.pi) * back
    if not pdf > 0.0:
        return 0
    escape = (FAR, FAR, FAR)  # how far light of each channel gets
    reach = FAR
    if analog:
        length = -math.log(1.0 - rng.sample1(path.key, path.sample, path.dimension + _DIM_ESCAPE))
        escape = (length / sigma_t[0], length / sigma_t[1], length / sigma_t[2])
        reach = max3(escape)
    t, primitive, u, v = local_intersect(scene, scratch, sp.instance, madd(o, d, t), w, 0.0, reach)
    if primitive < 0:
        return 0
    after = attenuation(sigma_t, t)
    if analog:
        after = (
            1.0 if t <= escape[0] else 0.0,
            1.0 if t <= escape[1] else 0.0,
            1.0 if t <= escape[2] else 0.0,
        )
    value = mul(mul(mul(weight, before), mul(sigma_t, alpha)), after)
    put_exit(place, t, primitive, u, v, w, scale(value, phase / pdf), 1)
    return 1


@inlined
def _channel_of(share, u):
    """The channel that u in [0, 1) chooses."""
    if share[0] > 0.0 and u < share[0]:
        return 0
    return 1 if share[2] <= 0.0 or u < share[0] + share[1] else 2


@device
def _sides(table, multiple, d, d0, share, sigma_t, alpha, g, mu, thickness, aware):
    """One channel's (near, far, wide near, wide far, bend): factors of the profile, and of its scale, on either side.

    bend: what a surface that curves away adds; multiple: the part of the light that a half space returns after two
    scatterings and more; d, d0, share: see profile_scales.
    """
    if not aware or thickness >= FAR or not multiple > 0.0:
        return 1.0, 1.0, 1.0, 1.0, 0.0
    s = similar(alpha, g)
    b = sigma_t * (1.0 - g * alpha) * thickness
    reflected, transmitted = slab_albedos(table, s, g, mu, b)
    wide_near, wide_far, bend = shape_factors(table, s, b)
    beyond = multiple * far_share(thickness, wide_far * d, wide_far * d0, share)
    far = min(transmitted / max(beyond, 1.0e-30), _MOST)
    # What the profile cannot bring to the far side stays on the near one: a thick slab is a half space.
    return (reflected + transmitted - far * beyond) / multiple, far, wide_near, wide_far, bend


@inlined
def _sampled(near, far):
    """The factor of the scale with which the probe looks for both sides."""
    return 0.5 * (near + min(far, 1.0))


@device
def _fill(scene, table, scratch, sp, weight, part, sigma_t, alpha, g, mu, thickness):
    """Fill the scratch's BSSRDF with what scatters twice and more.

    part: by channel, what a half space returns of it.
    """
    albedos, aware = load_i64(table, ALBEDOS), load_i64(table, FLAGS) & THICKNESS_AWARE != 0
    d0, s0, p0 = profile_scales(sigma_t[0], alpha[0], g)
    d1, s1, p1 = profile_scales(sigma_t[1], alpha[1], g)
    d2, s2, p2 = profile_scales(sigma_t[2], alpha[2], g)
    n0, f0, a0, b0, c0 = _sides(albedos, part[0], d0, s0, p0, sigma_t[0], alpha[0], g, mu, thickness, aware)
    n1, f1, a1, b1, c1 = _sides(albedos, part[1], d1, s1, p1, sigma_t[1], alpha[1], g, mu, thickness, aware)
    n2, f2, a2, b2, c2 = _sides(albedos, part[2], d2, s2, p2, sigma_t[2], alpha[2], g, mu, thickness, aware)
    sampled = (d0 * _sampled(a0, b0), d1 * _sampled(a1, b1), d2 * _sampled(a2, b2))
    b = bssrdf_in(scratch)
    start_bssrdf(b, sp, MULTIPLE_OF_SLAB if aware else MULTIPLE, mul(weight, part), (d0, d1, d2), sampled, thickness)
    put(b.single, (s0, s1, s2))
    put(b.share, (p0, p1, p2))
    put(b.near, (n0, n1, n2))
    put(b.far, (f0, f1, f2))
    put(b.wide_near, (a0, a1, a2))
    put(b.wide_far, (b0, b1, b2))
    put(b.bend, (c0, c1, c2))


@device
def traced_exits(scene, integrator, scratch, wanted):
    """Fill the scratch's BSSRDF and exits, as `wanted`: first those of the probe; how many, -1: no light enters.

    The exits' weights contain path.throughput.
    """
    scene, integrator, path, sp = scene_at(scene, 0), integrator_at(integrator, 0), path_in(scratch), point_in(scratch)
    c = closure_at(sp.closures, sp.scatterer)
    table = integrator.scatter
    weight, sigma_t, alpha = channels(c, vec(path.throughput))
    enters, d = enter(path, sp, c)
    if not enters or not max3(weight) > 0.0:
        return -1
    g = float(c.p[P_ANISOTROPY])
    mu = -dot(d, vec(sp.ng))
    o = vec(sp.p)
    t, primitive, u, v = first_hit(scene, scratch, sp, o, d)
    thickness = _thickness(scene, scratch, sp, d, mu, t, primitive)
    through = attenuation(sigma_t, t)
    albedos = load_i64(table, ALBEDOS)
    back = single_albedo(albedos, g, mu)
    multiple = (
        max(total_albedo(albedos, similar(alpha[0], g), g, mu) - alpha[0] * back, 0.0),
        max(total_albedo(albedos, similar(alpha[1], g), g, mu) - alpha[1] * back, 0.0),
        max(total_albedo(albedos, similar(alpha[2], g), g, mu) - alpha[2] * back, 0.0),
    )
    single = (
        _single_share(alpha[0], back, through[0]),
        _single_share(alpha[1], back, through[1]),
        _single_share(alpha[2], back, through[2]),
    )
    often, once = dot(weight, multiple), dot(weight, single)
    u_term, u_radius = rng.sample2(path.key, path.sample, path.dimension + DIM_LINE)
    n, scattered = 0, max(often + once, 1.0e-30)
    p_often, p_once = min(_TRIES * often / scattered, 1.0), min(_TRIES * once / scattered, 1.0)
    looks = u_term >= 1.0 - p_often
    b = bssrdf_in(scratch)
    b.kind = NONE
    if often > 0.0 and (looks or wanted != EXITS):
        _fill(scene, table, scratch, sp, weight, multiple, sigma_t, alpha, g, mu, thickness)
        b.looks = p_often
    if wanted != BSSRDF_ALONE:
        if looks and often > 0.0:
            u_line = min((u_term - (1.0 - p_often)) / p_often, 1.0)
            u_channel, u_angle = rng.sample2(path.key, path.sample, path.dimension + DIM_CHANNEL)
            note_choice_of(b, u_line, u_channel)
            n = probe_bssrdf(scene, table, scratch, b, u_line, u_channel, u_radius, u_angle)
            weigh_hits(scratch, b, n, 1.0 / p_often)
        if u_term < p_once:
            analog = load_i64(table, FLAGS) & ANALOG_ESCAPE != 0
            w, place = scale(weight, 1.0 / p_once), exit_at(scratch, n)
            n += _single(scene, scratch, path, sp, o, d, mu, t, through, w, sigma_t, alpha, g, analog, place)
        if primitive >= 0:
            put_exit(exit_at(scratch, n), t, primitive, u, v, d, mul(weight, through), 0)
            n += 1
    path.dimension += _DIMENSIONS
    return n


@outcome_entry
def hybrid_exits(scene, integrator, film, scratch, wanted):
    """The method's exits, for who lights them himself (see kernels.subsurface.methods)."""
    return traced_exits(scene, integrator, scratch, wanted)


@outcome_entry
def hybrid(scene, integrator, film, scratch, _):
    """The method of kernels.subsurface.methods."""
    return light_found(scene, integrator, film, scratch, traced_exits(scene, integrator, scratch, EXITS))
