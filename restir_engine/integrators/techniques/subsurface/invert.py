"""The numbers by which a probe finds a point, computed from the point: paths are replayed with them elsewhere.

A probe's line and channel are chosen, a radius and an angle follow: of lines through the point below x₁ those of the
direction, of the others those about their axis. Given line and channel, both are functions of x₂ that can be inverted;
which line and channel it was, only their posterior tells (paper a, §4.2: probabilistic inversion of a mixture).
"""

import math

from ....kernels.core import rng
from ....kernels.core.jit import device, entry, inlined
from ....kernels.core.records import integrator_at
from ....kernels.core.vec import dot, length, load3_f64, madd, scale, sub, vec
from ....kernels.subsurface.bssrdf import bssrdf_at, channel_shares, probe_bssrdf
from ....kernels.subsurface.exits import exit_at
from ....kernels.subsurface.probe import (
    ANY_SHARE,
    H_POINT,
    LINES,
    NORMAL_SHARE,
    TANGENT_SHARE,
    TOWARDS_SHARE,
    line_middle,
    probe_frame,
)
from ....kernels.subsurface.profile import F_REACH, REACH, profile, profile_cdf
from ...resampling.frame import frame_at
from ...resampling.inputs import scene_of
from ...resampling.options import reuse_at
from ...resampling.technique import SHIFTED_BYTES, domain_at
from .sample import UNKNOWN_HIT, found_by, point_of, sample_at, set_found_by
from .target import place_of

_ANY = 1  # the line of any direction through the point below x₁; those before and behind follow a profile
PAIRS = 3 * LINES  # of line and channel
_SAME = 1.0e-3  # of the profile's scale: a probe's hit so near to x₂ is x₂
_REDRAWN = 0x52454452  # of the key of random numbers
_STEEPEST = 1.0e-6  # as probes have it


@inlined
def _below(b, offset):
    """(unit direction, upwards, from the point below x₁ to x₁ + offset; its cosine with the normal; the distance)."""
    n = vec(b.n)
    q = madd(offset, n, float(b.depth))
    distance = math.sqrt(max(dot(q, q), 1.0e-60))
    along = dot(q, n)
    direction = scale(q, (1.0 if along >= 0.0 else -1.0) / distance)
    return direction, max(abs(along) / distance, _STEEPEST), distance


@inlined
def _axes(n, line):
    """(axis, right, up) of a line along the normal or a tangent."""
    t, bt = probe_frame(n)
    if line == 2:
        return n, t, bt
    if line == 3:
        return t, bt, n
    return bt, n, t


@device
def numbers_of(b, offset, line, channel):
    """(u_radius, u_angle) with which a line of a channel finds x₁ + offset."""
    n = vec(b.n)
    scale_chosen = float(b.sampled[channel])
    if line <= _ANY:
        direction, cosine, _ = _below(b, offset)
        t, bt = probe_frame(n)
        x, y = dot(direction, t), dot(direction, bt)
        r = float(b.depth) * math.sqrt(max(1.0 - cosine * cosine, 0.0)) / cosine
    else:
        _, right, up = _axes(n, line)
        x, y = dot(offset, right), dot(offset, up)
        cosine = 0.0
        r = math.sqrt(x * x + y * y)
    u_radius = 1.0 - cosine if line == _ANY else profile_cdf(r, scale_chosen) / F_REACH
    angle = math.atan2(y, x) / (2.0 * math.pi)
    return min(max(u_radius, 0.0), 1.0), angle - math.floor(angle)


@inlined
def numbers_of_choice(b, line, channel):
    """(u_line, u_channel) in the middle of what chooses a line and a channel."""
    w = channel_shares(vec(b.weight))
    before = 0.0 if channel == 0 else (w[0] if channel == 1 else w[0] + w[1])
    return line_middle(line), before + 0.5 * w[channel]


@device
def choice_density(b, offset, ny, line, channel):
    """The density by area with which a line of a channel finds x₁ + offset, where the outward normal is ny.

    The chance of the choice is part of it: the sum over all pairs is `diffused_pdf`.
    """
    n = vec(b.n)
    share = channel_shares(vec(b.weight))[channel]
    d = float(b.sampled[channel])
    if not share > 0.0:
        return 0.0
    if line <= _ANY:
        direction, cosine, distance = _below(b, offset)
        seen = abs(dot(ny, direction)) / (distance * distance)
        if line == _ANY:
            return ANY_SHARE * share * seen * (0.5 / math.pi)
        z = float(b.depth)
        r = z * math.sqrt(max(1.0 - cosine * cosine, 0.0)) / cosine
        if r > REACH * d:
            return 0.0
        return TOWARDS_SHARE * share * seen * profile(r, d) / F_REACH * z * z / (cosine * cosine * cosine)
    if math.sqrt(dot(offset, offset)) > REACH * d:
        return 0.0
    axis, right, up = _axes(n, line)
    x, y = dot(offset, right), dot(offset, up)
    chance = NORMAL_SHARE if line == 2 else TANGENT_SHARE
    return chance * share * abs(dot(ny, axis)) * profile(math.sqrt(x * x + y * y), d) / F_REACH


@device
def choose_pair(b, offset, ny, u):
    """Line and channel by their posterior, 3 · line + channel: who has found x₁ + offset. u: a random number."""
    total = 0.0
    for pair in range(PAIRS):
        total += choice_density(b, offset, ny, pair // 3, pair % 3)
    left = u * total
    chosen = -1
    for pair in range(PAIRS):
        density = choice_density(b, offset, ny, pair // 3, pair % 3)
        if density > 0.0:
            chosen = pair
            left -= density
            if left < 0.0:
                return chosen
    return chosen


@inlined
def _hit_at(scene, table, scratch, b, offset, x, line, channel):
    """Which hit of its probe x is; UNKNOWN_HIT where Embree's precision loses it."""
    u_radius, u_angle = numbers_of(b, offset, line, channel)
    u_line, u_channel = numbers_of_choice(b, line, channel)
    found = UNKNOWN_HIT
    nearest = _SAME * max(float(b.d[0]), max(float(b.d[1]), float(b.d[2])))
    for k in range(min(probe_bssrdf(scene, table, scratch, b, u_line, u_channel, u_radius, u_angle), UNKNOWN_HIT)):
        off = length(sub(load3_f64(exit_at(scratch, k), H_POINT), x))
        if off < nearest:
            found, nearest = k, off
    return found


@device
def redraw(domain, shifted, chosen, look):
    """Draw line and channel of the sample that a pixel has chosen anew; look: whether to find out which hit it is."""
    d = domain_at(domain, 0)
    scene = scene_of(d)
    b = bssrdf_at(point_of(frame_at(d.frame, 0), d.pixel), 0)
    r = sample_at(shifted + SHIFTED_BYTES * chosen, 0)
    x, n = place_of(scene, r)
    offset = sub(x, vec(b.p))
    key = rng.hash_combine(rng.hash_combine(reuse_at(d.reuse, 0).seed, d.pixel), _REDRAWN)
    pair = max(choose_pair(b, offset, n, rng.sample1(key, 0, 0)), 0)
    hit = UNKNOWN_HIT
    if look:
        table = integrator_at(d.integrator, 0).scatter
        hit = _hit_at(scene, table, d.scratch, b, offset, x, pair // 3, pair % 3)
    set_found_by(r, found_by(pair // 3, pair % 3, hit))


@entry
def redraw_numbers(domain, shifted, table, n, chosen):
    """Line, channel and hit of the sample that a pixel has chosen are drawn anew (see resampling.technique, merge)."""
    redraw(domain, shifted, chosen, True)


@entry
def redraw_line(domain, shifted, table, n, chosen):
    """The same for line and channel alone: the probe that would tell the hit is not traced."""
    redraw(domain, shifted, chosen, False)
