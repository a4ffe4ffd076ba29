"""The BSSRDF of light that diffuses, S(x₁, x₂): what it depends on of x₁, and its value and sampling for any x₂.

One record is filled in for a point that is seen; from then on S and the density by which probes find x₂ are functions
of x₂ alone. So a path x₁ → x₂ → x₃ can be evaluated for another x₁ (`integrators.techniques.subsurface`).
"""

import math

import numpy as np

from ..core.jit import device, inlined
from ..core.memory import load_f64, load_i64, record_at, store_f64, store_i64
from ..core.records import shared_area
from ..core.vec import dot, load3_f64, mul, put, scale, store3_f64, sub, vec
from .cycles_burley import cycles_kernel
from .method_table import NOTE_HIT, OVERFLOWS
from .probe import (
    H_EVENTS,
    H_NORMAL,
    H_PDF,
    H_POINT,
    H_WEIGHT,
    HIT,
    HITS,
    HITS_END,
    channel_of,
    line_of,
    probe,
    probe_frame,
    probe_pdf,
)
from .profile import REACH, profile
from .scales import multiple_shape

# What S is of: nothing; the whole profile R; Cycles' kernel; R_n, what scatters twice and more; R_n as far as a slab
# of the local thickness returns and lets through.
NONE, WHOLE, CYCLES, MULTIPLE, MULTIPLE_OF_SLAB = range(5)

# What is wanted of a method's exits, see kernels.subsurface.methods; with EXITS alone the BSSRDF may be left out.
BSSRDF_ALONE, EXITS, BSSRDF_AND_EXITS = range(3)

_RGB = (np.float32, (3,))
BSSRDF = np.dtype(
    [
        ("p", np.float64, (3,)),  # x₁
        ("n", np.float64, (3,)),  # its geometric normal, towards who sees it
        ("kind", np.int32),  # NONE …
        ("instance", np.int32),
        ("side", np.float32),  # -1: what the mesh takes for its inside is the outside, else 1
        ("depth", np.float32),  # how far below x₁ the probe's lines meet, scene units
        ("weight", *_RGB),  # ∫ S over a plane
        ("d", *_RGB),  # scale of the profile, scene units
        ("sampled", *_RGB),  # scale by which probes look; S ends at REACH times it
        # Of R_n: the scale of R₁, and its share of R (`profile_scales`).
        ("single", *_RGB),
        ("share", *_RGB),
        # Of a slab: factors of the profile on the near and the far side, of its scale there, of what curves away.
        ("near", *_RGB),
        ("far", *_RGB),
        ("wide_near", *_RGB),
        ("wide_far", *_RGB),
        ("bend", *_RGB),
        ("thickness", np.float32),
        # How the last probe was chosen from x₁: the kind of its line, and its channel.
        ("line", np.int32),
        ("channel", np.int32),
        ("looks", np.float32),  # the chance that exits are looked for by a probe, where they are asked for
    ]
)
bssrdf_at = record_at(BSSRDF)
_WORK = shared_area(HITS_END + BSSRDF.itemsize) + HITS_END

_NEARLY_NONE = 1.0e-7
_DEEP = 3.0  # mean scales of the profile: how far below the point that is seen a probe's lines meet
_SHALLOW = 0.02  # of that: they do at least


@inlined
def bssrdf_in(scratch):
    """The BSSRDF of the point whose exits stand in working memory."""
    return bssrdf_at(scratch + _WORK, 0)


@device
def channel_shares(weight):
    """Probabilities of the channels in proportion to their weight; they add up to 1."""
    s = 1.0 / (weight[0] + weight[1] + weight[2])
    return scale(weight, s)


@device
def start_bssrdf(b, sp, kind, weight, d, sampled, thickness):
    """What all kinds have; thickness: of the object below `sp`, about; in a thin one lines meet half way through."""
    put(b.p, vec(sp.p))
    put(b.n, vec(sp.ng))
    b.kind = kind
    b.instance = sp.instance
    b.side = -1.0 if sp.backfacing else 1.0
    put(b.weight, weight)
    put(b.d, d)
    put(b.sampled, sampled)
    b.thickness = thickness
    b.looks = 1.0
    z = _DEEP * dot(channel_shares(weight), sampled)
    b.depth = min(z, max(0.5 * thickness, _SHALLOW * z))


@inlined
def _unit_profile(r, d):
    return profile(r, d) if r <= REACH * d else 0.0


@inlined
def _turn(offset, r, n, ny):
    """(the far side's share, how far the surface curves away) of a point at `offset`, which is r long; ny: its normal.

    The latter is the sine of the normals' angle on a ball, 0 on both sides of a slab, negative in a hollow.
    """
    half = 0.5 - 0.5 * dot(n, ny)
    return half * half, dot(offset, sub(ny, n)) / max(r, 1.0e-30) * math.sqrt(max(1.0 - half, 0.0))


@inlined
def _multiple(b, c, r, away, turned):
    """R_n by channel, of unit weight."""
    d, single, share = float(b.d[c]), float(b.single[c]), float(b.share[c])
    if b.kind == MULTIPLE:
        return multiple_shape(r, d, single, share)
    wide = float(b.wide_near[c])
    w = (1.0 - away) * float(b.near[c]) * multiple_shape(r, wide * d, wide * single, share)
    if away > _NEARLY_NONE:
        wide = float(b.wide_far[c])
        beyond = max(r, float(b.thickness))
        w += away * float(b.far[c]) * multiple_shape(beyond, wide * d, wide * single, share)
    return w * max(1.0 + float(b.bend[c]) * turned, 0.0)


@device
def diffused(b, offset, ny):
    """S(x₁, x₁ + offset) where the outward normal is ny: rgb, 1/length²."""
    weight = vec(b.weight)
    r = math.sqrt(dot(offset, offset))
    if b.kind == WHOLE:
        return mul(
            weight,
            (
                _unit_profile(r, float(b.d[0])),
                _unit_profile(r, float(b.d[1])),
                _unit_profile(r, float(b.d[2])),
            ),
        )
    if b.kind == CYCLES:
        return mul(weight, cycles_kernel(offset, ny, vec(b.n), vec(b.d)))
    away = turned = 0.0
    if b.kind == MULTIPLE_OF_SLAB:
        away, turned = _turn(offset, r, vec(b.n), ny)
    s0 = s1 = s2 = 0.0
    if weight[0] > 0.0 and r <= REACH * float(b.sampled[0]):
        s0 = weight[0] * _multiple(b, 0, r, away, turned)
    if weight[1] > 0.0 and r <= REACH * float(b.sampled[1]):
        s1 = weight[1] * _multiple(b, 1, r, away, turned)
    if weight[2] > 0.0 and r <= REACH * float(b.sampled[2]):
        s2 = weight[2] * _multiple(b, 2, r, away, turned)
    return (s0, s1, s2)


@inlined
def diffused_pdf(b, offset, ny):
    """The density by area with which `probe_bssrdf` finds x₁ + offset, where the outward normal is ny."""
    n = vec(b.n)
    t, bt = probe_frame(n)
    return probe_pdf(float(b.depth), offset, ny, n, t, bt, channel_shares(vec(b.weight)), vec(b.sampled))


@device
def probe_bssrdf(scene, table, scratch, b, u_line, u_channel, u_radius, u_angle):
    """Probe the surface around x₁: how many hits, with point, outward normal and density. Counts overflows."""
    kept, found = probe(
        scene, scratch, load_i64(table, NOTE_HIT), b.instance, vec(b.p), vec(b.n), float(b.side), float(b.depth),
        channel_shares(vec(b.weight)), vec(b.sampled), u_line, u_channel, u_radius, u_angle,
    )  # fmt: skip
    if found > kept:
        store_i64(table, OVERFLOWS, load_i64(table, OVERFLOWS) + 1)
    return kept


@inlined
def note_choice_of(b, u_line, u_channel):
    """Note which line and channel a probe with these numbers takes."""
    b.line = line_of(u_line)
    b.channel = channel_of(channel_shares(vec(b.weight)), u_channel)


@device
def weigh_hits(scratch, b, n, factor):
    """Make exits of a probe's n hits: weights S / density times a factor."""
    x = vec(b.p)
    for k in range(n):
        hit = scratch + HITS + 8 * HIT * k
        pdf = load_f64(hit, H_PDF)
        s = diffused(b, sub(load3_f64(hit, H_POINT), x), load3_f64(hit, H_NORMAL))
        store3_f64(hit, H_WEIGHT, scale(s, factor / pdf if pdf > 0.0 else 0.0))
        store_f64(hit, H_EVENTS, 2.0)
