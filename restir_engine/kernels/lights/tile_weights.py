"""How the points of light tiles shine, in groups that a processor weighs several at a time.

A group is float32 [FIELDS, LANES]. All shapes of light share one formula, so that there are no branches in the loop
over a group's lanes: at o, with w = p - near o, d = w / |w| and the cosine c of n and -d,

    irradiance at normal incidence = power min(max(slope max(c, -two_sided c) + base, least), most) / max(w², nearest²)

which need not be exact, as it is only resampled by, but must not be 0 where light arrives.
"""

import math

from ..core.jit import device, inlined
from ..core.memory import load_f32, load_f64, store_f32, store_f64
from ..core.vec import dot
from .emission import luminance

LANES = 32
P, NEAR, N, POWER, NEAREST2 = 0, 3, 4, 7, 10
TWO_SIDED, SLOPE, BASE, LEAST, MOST = 11, 12, 13, 14, 15
LOOSE = 16  # at least what the cosine at the receiver counts as: the point stands for a lamp that has a size
CHANCE = 17  # 1 / density of the point; 0: there is none
FIELDS = 18
GROUP_BYTES = 4 * FIELDS * LANES

# Share of a lamp with a size, which is weighed by its centre, behind the surface or outside its cone.
_BEHIND = 0.02
_BOUNDLESS = 1e30


@inlined
def _put3(group, field, lane, v):
    store_f32(group, LANES * field + lane, v[0])
    store_f32(group, LANES * (field + 1) + lane, v[1])
    store_f32(group, LANES * (field + 2) + lane, v[2])


@inlined
def _load3(group, field, lane):
    x = load_f32(group, LANES * field + lane)
    return x, load_f32(group, LANES * (field + 1) + lane), load_f32(group, LANES * (field + 2) + lane)


@device
def _put(group, lane, p, near, n, nearest, two_sided, slope, base, least, most, loose):
    _put3(group, P, lane, p)
    store_f32(group, LANES * NEAR + lane, near)
    _put3(group, N, lane, n)
    store_f32(group, LANES * NEAREST2 + lane, nearest * nearest)
    store_f32(group, LANES * TWO_SIDED + lane, two_sided)
    store_f32(group, LANES * SLOPE + lane, slope)
    store_f32(group, LANES * BASE + lane, base)
    store_f32(group, LANES * LEAST + lane, least)
    store_f32(group, LANES * MOST + lane, most)
    store_f32(group, LANES * LOOSE + lane, loose)


@inlined
def put_power(group, lane, power):
    """Intensity along n (rgb); of a direction the irradiance at normal incidence."""
    _put3(group, POWER, lane, (abs(power[0]), abs(power[1]), abs(power[2])))


@inlined
def put_chance(group, lane, pdf):
    """The density with which the point was drawn; 0: there is none."""
    store_f32(group, LANES * CHANCE + lane, 1.0 / pdf if pdf > 0.0 else 0.0)


@inlined
def put_direction(group, lane, d):
    """Light from far away."""
    _put(group, lane, d, 0.0, (0.0, 0.0, 0.0), 0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 0.0)


@inlined
def put_ball(group, lane, center, radius):
    """A lamp that shines to all sides."""
    _put(group, lane, center, 1.0, (0.0, 0.0, 0.0), radius, 0.0, 0.0, 1.0, 0.0, 1.0, _BEHIND)


@inlined
def put_cone(group, lane, center, axis, radius, cosine, blend):
    """A lamp that shines within a cone of this cosine about an axis, fully where the cosine is larger by 1 / blend."""
    _put(group, lane, center, 1.0, axis, radius, 0.0, blend, -cosine * blend, _BEHIND, 1.0, _BEHIND)


@inlined
def put_face(group, lane, p, n, two_sided):
    """A point of a face that shines by the cosine to n, to one side (two_sided 0.0) or both (1.0)."""
    _put(group, lane, p, 1.0, n, 0.0, two_sided, 1.0, 0.0, 0.0, _BOUNDLESS, 0.0)


@inlined
def face_of(group, lane):
    """(normal, power) of a point of a face."""
    return _load3(group, N, lane), _load3(group, POWER, lane)


@inlined
def put_grid(group, lane, p, n, tangent, scale):
    """A point of a face behind a grid: cos (tangent - tan θ) scale, here a line between where that is 0 and largest."""
    edge = 1.0 / math.sqrt(1.0 + tangent * tangent)
    slope = tangent * scale / max(1.0 - edge, 1e-6)
    _put(group, lane, p, 1.0, n, 0.0, 0.0, slope, -edge * slope, 0.01 * tangent * scale, _BOUNDLESS, 0.0)


@inlined
def _arrival(group, i, o):
    """(direction to the light, irradiance at normal incidence by its power, its density counted in) of a lane at o."""
    near = load_f32(group, LANES * NEAR + i)
    x = load_f32(group, LANES * P + i) - near * o[0]
    y = load_f32(group, LANES * (P + 1) + i) - near * o[1]
    z = load_f32(group, LANES * (P + 2) + i) - near * o[2]
    d2 = max(x * x + y * y + z * z, 1e-30)
    s = 1.0 / math.sqrt(d2)
    x, y, z = x * s, y * s, z * s
    nx, ny, nz = (
        load_f32(group, LANES * N + i),
        load_f32(group, LANES * (N + 1) + i),
        load_f32(group, LANES * (N + 2) + i),
    )
    c = -(nx * x + ny * y + nz * z)
    c = max(c, -load_f32(group, LANES * TWO_SIDED + i) * c)
    shape = load_f32(group, LANES * SLOPE + i) * c + load_f32(group, LANES * BASE + i)
    shape = min(max(shape, load_f32(group, LANES * LEAST + i)), load_f32(group, LANES * MOST + i))
    nearest = load_f32(group, LANES * NEAREST2 + i)
    return (x, y, z), shape * load_f32(group, LANES * CHANCE + i) / max(d2, nearest)


@inlined
def _cosine(group, i, d, receiver):
    """What the cosine at the receiver counts as."""
    c = dot(receiver.n, d)
    loose = max(load_f32(group, LANES * LOOSE + i), receiver.least)
    return max(max(c, -receiver.both * c), loose)


@inlined
def _put_light(group, i, out, factor, light):
    """Four rows: what a lane sends through the receiver by its density, its luminance."""
    r = load_f32(group, LANES * POWER + i) * light[0] * factor
    g = load_f32(group, LANES * (POWER + 1) + i) * light[1] * factor
    b = load_f32(group, LANES * (POWER + 2) + i) * light[2] * factor
    store_f64(out, i, r)
    store_f64(out, LANES + i, g)
    store_f64(out, 2 * LANES + i, b)
    store_f64(out, 3 * LANES + i, luminance(r, g, b))


@device
def sum_weights(out, n):
    """The sums of the first n lanes: rgb, luminance."""
    r = g = b = y = 0.0
    for i in range(n):
        r += load_f64(out, i)
        g += load_f64(out, LANES + i)
        b += load_f64(out, 2 * LANES + i)
        y += load_f64(out, 3 * LANES + i)
    return (r, g, b), y


@device
def pick_lane(out, n, left):
    """(lane, share in its luminance that is left) where the sum of luminances over lanes passes `left`."""
    last = -1
    for i in range(n):
        w = load_f64(out, 3 * LANES + i)
        if w > 0.0:
            if left < w:
                return i, left / w
            last = i
            left -= w
    return last, 0.5


@device
def weigh_diffuse(group, o, receiver, out):
    """What each lane of a group sends through a receiver without gloss, by its density: float64 [4, LANES] at out, rgb
    and luminance."""
    for i in range(LANES):
        d, arriving = _arrival(group, i, o)
        _put_light(group, i, out, arriving * _cosine(group, i, d, receiver), receiver.diffuse)


@device
def weigh_glossy(group, o, receiver, out):
    """The same with a lobe of GGX beside: D / (4 (h · d)² …), without Fresnel's rise at grazing angles."""
    a2 = receiver.alpha2
    wo, n = receiver.wo, receiver.gloss_n
    for i in range(LANES):
        d, arriving = _arrival(group, i, o)
        h = (wo[0] + d[0], wo[1] + d[1], wo[2] + d[2])
        h2 = max(dot(h, h), 1e-3)
        nh = dot(n, h)
        t = nh * nh / h2 * (a2 - 1.0) + 1.0
        s = receiver.gloss_scale / (t * t * h2)
        g = receiver.gloss
        f = receiver.diffuse
        light = (f[0] + g[0] * s, f[1] + g[1] * s, f[2] + g[2] * s)
        _put_light(group, i, out, arriving * _cosine(group, i, d, receiver), light)
