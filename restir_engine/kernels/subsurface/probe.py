"""Points of one object's surface near a point, with a density by area that is like a diffusion profile.

Most probes are lines through a point below x. A channel's profile gives the distance r from x at which the line meets
the plane that touches x, so that a flat surface is sampled as by disk projection along the normal (King et al. 2013);
but what curves away, and the far side, lie on such lines too. Some are of any direction, and some along the normal and
the tangents, at distance r from x, for faces that are seen edge-on from below x: they bound the weights. All hits
within the channels' balls about x are taken: the density of each is that of the mixture of lines and channels alone,
whatever else its line meets.
"""

import math

from ..core.fastmath import circle
from ..core.jit import device, entry, inlined
from ..core.memory import load_f32, load_f64, load_i64, load_u32, store_f64, store_i64, store_u32
from ..core.records import SCRATCH_RAY, shared_area
from ..core.vec import (
    cross,
    dot,
    is_black,
    length,
    load3_f32,
    load3_f64,
    madd,
    max3,
    neg,
    normalize,
    scale,
    store3_f64,
    sub,
    transform_normal,
)
from ..geometry.intersect import CONTEXT, FIRST_OWN, put_filter, rtc_intersect1
from ..geometry.local import local_ray
from ..geometry.placed import placed_at
from .profile import F_REACH, REACH, profile, profile_radius

# Probabilities of lines through the point below x, towards where they should meet its plane and of any direction, of
# lines along the normal, and along each tangent.
TOWARDS_SHARE, ANY_SHARE, NORMAL_SHARE, TANGENT_SHARE = 0.78, 0.08, 0.08, 0.03
LINES = 5  # kinds of lines, in this order

_STEEPEST = 1.0e-6  # cosine of the lines' angle with the normal that counts as a right one

MAX_HITS = 128
_KEPT = 10  # float64 that note_hit fills, or leaves alone
_FOUND = FIRST_OWN  # int64 index in the context

# float64 index of what a hit holds: barycentrics, position, outward normal, density by area, and what a method makes of
# it, the weight (rgb), how often light was scattered, and whether the irradiance cache has lit it.
H_T, H_PRIMITIVE, H_U, H_V, H_POINT, H_NORMAL, H_PDF, H_WEIGHT, H_EVENTS, H_LIT = 0, 1, 2, 3, 4, 7, 10, 11, 14, 15
HIT = 16

# In the working memory: the arguments of Embree's query, the context that its filter is given (with the number of hits
# so far), and HIT float64 for each of them.
ARGUMENTS = shared_area(128 + 8 * HIT * MAX_HITS)
HITS = ARGUMENTS + 128
HITS_END = 128 + 8 * HIT * MAX_HITS  # of the shared area: what a probe needs


@entry
def note_hit(arguments, _b, _c, _d, _e):
    """Embree's filter (RTCFilterFunctionNArguments, one ray): keep the hit and let the ray go on.

    Embree passes the first argument alone; the others, which every entry has, are not looked at.
    """
    context = load_i64(arguments, 2)
    ray, found = load_i64(arguments, 3), load_i64(arguments, 4)
    n = load_i64(context, _FOUND)
    store_i64(context, _FOUND, n + 1)
    if n < MAX_HITS:
        hit = context + (HITS - ARGUMENTS - CONTEXT) + 8 * HIT * n
        store_f64(hit, H_T, load_f32(ray, 8))
        store_f64(hit, H_PRIMITIVE, float(load_u32(found, 5)))
        store_f64(hit, H_U, load_f32(found, 3))
        store_f64(hit, H_V, load_f32(found, 4))
        store3_f64(hit, H_NORMAL, load3_f32(found, 0))
    store_u32(load_i64(arguments, 0), 0, 0)


@device
def all_hits(scene, scratch, note, instance, o, d, tmax):
    """All meetings of a segment with an instance, in order of (t, primitive), as hits without point and density.

    note: the address of note_hit. The result may exceed MAX_HITS: then only so many, of any order, were kept.
    """
    ray = scratch + SCRATCH_RAY
    structure = local_ray(scene, ray, instance, o, d, 0.0, tmax)
    if structure == 0:
        return 0
    arguments = scratch + ARGUMENTS
    put_filter(arguments, note)
    store_i64(arguments + CONTEXT, _FOUND, 0)
    rtc_intersect1(structure, ray, arguments)
    n = load_i64(arguments + CONTEXT, _FOUND)
    _sort(scratch, min(n, MAX_HITS))
    return n


@device
def _sort(scratch, n):
    """By insertion: there are a handful, nearly always in order."""
    hits = scratch + HITS
    for i in range(1, n):
        j = i
        while j > 0 and _comes_before(hits, j, j - 1):
            for k in range(_KEPT):
                a, b = HIT * j + k, HIT * (j - 1) + k
                x, y = load_f64(hits, a), load_f64(hits, b)
                store_f64(hits, a, y)
                store_f64(hits, b, x)
            j -= 1


@inlined
def _comes_before(hits, i, j):
    t, other = load_f64(hits, HIT * i), load_f64(hits, HIT * j)
    return t < other or (t == other and load_f64(hits, HIT * i + H_PRIMITIVE) < load_f64(hits, HIT * j + H_PRIMITIVE))


@inlined
def probe_frame(n):
    """Tangents of a normal: those of Cycles, on whose directions its own kernel depends."""
    t = cross((1.0, 1.0, 1.0), n)
    if is_black(t):
        t = cross((1.0, -1.0, -1.0), n)
    t = normalize(t)
    return t, cross(n, t)


@inlined
def line_of(u):
    """Which kind of line u in [0, 1) chooses: 0 towards the plane, 1 of any direction, 2 normal, 3 and 4 tangents."""
    if u < TOWARDS_SHARE + ANY_SHARE:
        return 0 if u < TOWARDS_SHARE else 1
    if u < 1.0 - 2.0 * TANGENT_SHARE:
        return 2
    return 3 if u < 1.0 - TANGENT_SHARE else 4


@inlined
def line_middle(line):
    """A number in the middle of those that choose a kind of line."""
    if line == 0:
        return 0.5 * TOWARDS_SHARE
    if line == 1:
        return TOWARDS_SHARE + 0.5 * ANY_SHARE
    if line == 2:
        return 1.0 - 2.0 * TANGENT_SHARE - 0.5 * NORMAL_SHARE
    return 1.0 - (1.5 if line == 3 else 0.5) * TANGENT_SHARE


@inlined
def channel_of(w, u):
    """The channel that u in [0, 1) chooses by probabilities w."""
    if w[2] <= 0.0 or u < w[0] + w[1]:
        return 0 if w[1] <= 0.0 or u < w[0] else 1
    return 2


@inlined
def _density(r, distance, w, d):
    """Σ_c w_c B_c(r) of the channels that reach `distance`, 1/length²; w: weights of the channels, d: scales."""
    total = 0.0
    for c in range(3):
        if w[c] > 0.0 and distance <= REACH * d[c]:
            total += w[c] * profile(r, d[c])
    return total * (1.0 / F_REACH)


@inlined
def _density_below(z, offset, ny, n, w, d):
    """The density by area of a point at x + offset among those on lines through the point z below x."""
    q = madd(offset, n, z)
    square, along = dot(q, q), dot(q, n)
    if not square > 0.0:
        return 0.0
    cosine = max(abs(along) / math.sqrt(square), _STEEPEST)
    r = z * math.sqrt(max(1.0 - cosine * cosine, 0.0)) / cosine
    flat = _density(r, r, w, d) * z * z / (cosine * cosine * cosine)
    by_angle = TOWARDS_SHARE * flat + ANY_SHARE * (0.5 / math.pi)
    return by_angle * abs(dot(ny, q)) / (square * math.sqrt(square))


@inlined
def probe_pdf(z, offset, ny, n, t, b, w, d):
    """The density by area of a point at x + offset with normal ny, under the frame (n, t, b)."""
    square = dot(offset, offset)
    distance = math.sqrt(square)
    x, y, up = dot(offset, t), dot(offset, b), dot(offset, n)
    x, y, up = x * x, y * y, up * up
    pdf = _density_below(z, offset, ny, n, w, d)
    pdf += NORMAL_SHARE * abs(dot(ny, n)) * _density(math.sqrt(x + y), distance, w, d)
    pdf += TANGENT_SHARE * abs(dot(ny, t)) * _density(math.sqrt(y + up), distance, w, d)
    return pdf + TANGENT_SHARE * abs(dot(ny, b)) * _density(math.sqrt(x + up), distance, w, d)


@device
def probe(scene, scratch, note, instance, x, n, side, z, w, d, u_line, u_channel, u_radius, u_angle):
    """Find points of an instance's surface around x; returns how many, with the number found as for all_hits.

    n: unit normal at x; side: 1, or -1 where what the mesh takes for its inside is the outside; z: how far below x the
    lines meet; w: probabilities of the channels (0 for one that has no profile), d: their scales. Hits hold point,
    outward normal and density.
    """
    t, b = probe_frame(n)
    scale_chosen = d[channel_of(w, u_channel)]
    r = profile_radius(u_radius * F_REACH, scale_chosen)
    cosine, sine = circle(u_angle)
    line = line_of(u_line)
    if line < 2:
        reach = REACH * max3((d[0] if w[0] > 0.0 else 0.0, d[1] if w[1] > 0.0 else 0.0, d[2] if w[2] > 0.0 else 0.0))
        up = z / math.sqrt(z * z + r * r) if line == 0 else 1.0 - u_radius
        flat = math.sqrt(max(1.0 - up * up, 0.0))
        axis = madd(madd(scale(n, up), t, cosine * flat), b, sine * flat)
        half = math.sqrt(max(reach * reach - z * z * flat * flat, 0.0))
        o = madd(madd(x, n, -z), axis, z * up + half)
    else:
        axis, right, up = n, t, b
        if line == 4:
            axis, right, up = b, n, t
        elif line == 3:
            axis, right, up = t, b, n
        reach = REACH * scale_chosen
        half = math.sqrt(max(reach * reach - r * r, 0.0))
        o = madd(madd(madd(x, right, r * cosine), up, r * sine), axis, half)
    found = all_hits(scene, scratch, note, instance, o, neg(axis), 2.0 * half)
    kept = min(found, MAX_HITS)
    to_object = placed_at(scene, instance).to_object
    for i in range(kept):
        hit = scratch + HITS + 8 * HIT * i
        p = madd(o, axis, -load_f64(hit, H_T))
        ny = normalize(transform_normal(to_object, load3_f64(hit, H_NORMAL)))
        store3_f64(hit, H_POINT, p)
        store3_f64(hit, H_NORMAL, scale(ny, side))
        store_f64(hit, H_PDF, probe_pdf(z, sub(p, x), ny, n, t, b, w, d))
    return kept, found


@inlined
def hit_distance(hit, x):
    """How far a hit is from x."""
    return length(sub(load3_f64(hit, H_POINT), x))
