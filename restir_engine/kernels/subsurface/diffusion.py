"""DIFFUSION: light that enters anywhere on an object leaves by a profile of the distance alone.

Of the medium at the point that is seen the surface around only shares its shape; what lies between counts for nothing.
The integral over the surface is estimated by one probe (`probe`), whose every hit is an exit.
"""

import math

from ..core import rng
from ..core.jit import device, inlined, outcome_entry
from ..core.memory import load_f64, load_i64, store_f64, store_i64
from ..core.records import closure_at, film_at, integrator_at, path_in, point_in, scene_at
from ..core.vec import dot, load3_f64, mul, scale, store3_f64, sub, vec
from ..lobes.closure import P_ANISOTROPY, P_BURLEY, P_LENGTH
from ..path.state import DIMENSIONS, ENDS, FAR
from .albedo import similar, total_albedo
from .entry import enter
from .exits import amount, exit_at, light_exits
from .method_table import ALBEDOS, CYCLES_BURLEY, FLAGS, NOTE_HIT, OVERFLOWS
from .probe import H_EVENTS, H_NORMAL, H_PDF, H_POINT, H_WEIGHT, hit_distance, probe, probe_frame
from .profile import REACH, profile
from .scales import channels, profile_scales

# Cycles' profile ends here, in d, and is scaled to hold everything within.
_CYCLES_REACH = 16.0
_CYCLES_F = 0.9963790093708328

_DEEP = 3.0  # mean scales of the profile: how far below the point that is seen a probe's lines meet
_SHALLOW = 0.02  # of that: they do at least

# Random dimensions of a probe's vertex: with the line the radius, with the channel the angle.
DIM_LINE, DIM_CHANNEL = 0, 1


@device
def channel_shares(weight):
    """Probabilities of the channels in proportion to their weight; they add up to 1."""
    s = 1.0 / (weight[0] + weight[1] + weight[2])
    return scale(weight, s)


@device
def probe_around(scene, table, scratch, path, sp, weight, d, thickness, u_line, u_radius):
    """Probe the surface around `sp` with the scales d of the channels: how many hits. Counts overflows.

    thickness: of the object below `sp`, about; in one that is thin lines meet half way to its other side.
    """
    u_channel, u_angle = rng.sample2(path.key, path.sample, path.dimension + DIM_CHANNEL)
    side = -1.0 if sp.backfacing else 1.0
    note = load_i64(table, NOTE_HIT)
    shares = channel_shares(weight)
    z = _DEEP * dot(shares, d)
    z = min(z, max(0.5 * thickness, _SHALLOW * z))
    kept, found = probe(
        scene, scratch, note, sp.instance, vec(sp.p), vec(sp.ng), side, z, shares, d,
        u_line, u_channel, u_radius, u_angle,
    )  # fmt: skip
    if found > kept:
        store_i64(table, OVERFLOWS, load_i64(table, OVERFLOWS) + 1)
    return kept


@inlined
def _cut(r, distance, d):
    """Σ_c B_c(r) of the channels whose profile, as Cycles ends it, reaches `distance`."""
    total = 0.0
    for c in range(3):
        if distance <= _CYCLES_REACH * d[c]:
            total += profile(r, d[c])
    return total


@device
def cycles_kernel(offset, ny, n, d):
    """rgb: the kernel whose integral over the surface is the mean of Cycles' estimator, 1/length².

    Its weights lack the factor from the distance on the disk to that in space, and weigh the three axes without their
    densities: B(r) / F(16) Σ_a ω_a r / r_a, with ω_a ∝ (w_a |n_y · a|)², r_a the distance from the axis. A channel's
    line ends within its own ball, which the density that the weights are divided by does not know: the last factor.
    """
    t, b = probe_frame(n)
    r = math.sqrt(dot(offset, offset))
    x, y, z = dot(offset, t), dot(offset, b), dot(offset, n)
    wn, wt, wb = 2.0 * dot(ny, n), dot(ny, t), dot(ny, b)  # Cycles takes the normal twice as often as a tangent
    total = wn * wn + wt * wt + wb * wb
    if not total > 0.0:
        return (0.0, 0.0, 0.0)
    factor = 0.0
    for axis in range(3):
        w = wn if axis == 0 else (wt if axis == 1 else wb)
        square = x * x + y * y if axis == 0 else (y * y + z * z if axis == 1 else x * x + z * z)
        ra = max(math.sqrt(square), 1.0e-9 * r)
        sampled = _cut(ra, ra, d)
        if sampled > 0.0:
            factor += w * w * r / ra * _cut(ra, r, d) / sampled
    factor /= total * _CYCLES_F
    return (
        factor * profile(r, d[0]) if r <= _CYCLES_REACH * d[0] else 0.0,
        factor * profile(r, d[1]) if r <= _CYCLES_REACH * d[1] else 0.0,
        factor * profile(r, d[2]) if r <= _CYCLES_REACH * d[2] else 0.0,
    )


@device
def _burley(c, throughput):
    """(weight, d), rgb each, of a closure that asks for BURLEY: the length is its own, and there is no entry."""
    d = (float(c.p[P_LENGTH]), float(c.p[P_LENGTH + 1]), float(c.p[P_LENGTH + 2]))
    return mul(throughput, (_is_length(d[0]), _is_length(d[1]), _is_length(d[2]))), d


@inlined
def _is_length(d):
    return 1.0 if 0.0 < d < math.inf else 0.0


@device
def _medium(c, table, throughput, mu):
    """(weight, d), rgb each, of a medium that light enters with the cosine mu: it returns what a half space does."""
    weight, sigma_t, alpha = channels(c, throughput)
    g = float(c.p[P_ANISOTROPY])
    d0, _, _ = profile_scales(sigma_t[0], alpha[0], g)
    d1, _, _ = profile_scales(sigma_t[1], alpha[1], g)
    d2, _, _ = profile_scales(sigma_t[2], alpha[2], g)
    a0 = total_albedo(table, similar(alpha[0], g), g, mu)
    a1 = total_albedo(table, similar(alpha[1], g), g, mu)
    a2 = total_albedo(table, similar(alpha[2], g), g, mu)
    return mul(weight, (a0, a1, a2)), (d0, d1, d2)


@inlined
def _unit_profile(r, d):
    return profile(r, d) if r <= REACH * d else 0.0


@outcome_entry
def diffusion(scene, integrator, film, scratch, _):
    """The method of kernels.subsurface.methods."""
    scene, integrator, film = scene_at(scene, 0), integrator_at(integrator, 0), film_at(film, 0)
    path, sp = path_in(scratch), point_in(scratch)
    x, n = vec(sp.p), vec(sp.ng)
    c = closure_at(sp.closures, sp.scatterer)
    table = integrator.scatter
    burley = c.p[P_BURLEY] != 0.0
    if burley:
        path.dimension += DIMENSIONS
        weight, d = _burley(c, vec(path.throughput))
    else:
        enters, inwards = enter(path, sp, c)
        if not enters:
            return ENDS
        weight, d = _medium(c, load_i64(table, ALBEDOS), vec(path.throughput), -dot(inwards, n))
    if not amount(weight) > 0.0:
        return ENDS
    as_cycles = burley and load_i64(table, FLAGS) & CYCLES_BURLEY != 0
    u_line, u_radius = rng.sample2(path.key, path.sample, path.dimension + DIM_LINE)
    found = probe_around(scene, table, scratch, path, sp, weight, d, FAR, u_line, u_radius)
    for k in range(found):
        hit = exit_at(scratch, k)
        pdf = load_f64(hit, H_PDF)
        r = hit_distance(hit, x)
        if as_cycles:
            b = cycles_kernel(sub(load3_f64(hit, H_POINT), x), load3_f64(hit, H_NORMAL), n, d)
        else:
            b = (_unit_profile(r, d[0]), _unit_profile(r, d[1]), _unit_profile(r, d[2]))
        store3_f64(hit, H_WEIGHT, scale(mul(weight, b), 1.0 / pdf if pdf > 0.0 else 0.0))
        store_f64(hit, H_EVENTS, 2.0)
    path.dimension += DIMENSIONS
    return light_exits(scene, integrator, film, scratch, path, sp, found)
