"""The shifts of light that crosses straight (measure: solid angle of ω, coordinates of x₃).

reconnect    x₂ and x₃ are kept, and E with them.  |T'| = (cos θ₂′ / cos θ₂) (r² / r′²), and between frames the ratio of
             its triangle's areas. x₂ has to be the first point that is met from the other x₁: a ray inside the object.
turn         ω is kept and leads to another x₂, which is connected to x₃.  |T'| = 1. A ray inside, and a shadow ray.

x₃ has the Jacobian 1 in both, as its coordinates do not depend on who is lit.
"""

from ....kernels.core.jit import device, entry, inlined
from ....kernels.core.vec import dot, length, normalize, scale, sub, vec
from ....kernels.geometry.local import local_intersect
from ....kernels.path.state import next_after
from ....kernels.subsurface.hybrid import first_hit
from ...resampling.frame import frame_at
from ...resampling.inputs import point_at, scene_of
from ...resampling.technique import domain_at, shifted_at
from ..subsurface.sample import NEEDS_LIGHT, TURNED, sample_at
from ..subsurface.shift import follow, keep_exit
from ..subsurface.target import place_of
from .sample import NOT_SERVED, entry_of
from .target import density_of

_BEFORE = 1.0 - 1.0e-4  # of the way to x₂: what is met up to there hides it


@inlined
def _point(d):
    return point_at(frame_at(d.frame, 0), d.pixel)


@device
def _sees(scene, scratch, sp, o, d, distance):
    """Whether a ray from `sp` meets nothing of its own object up to a point so far away."""
    reach = distance * _BEFORE
    t, primitive, _, _ = local_intersect(scene, scratch, sp.instance, o, d, float(sp.error), reach)
    if primitive >= 0 and primitive == sp.primitive:
        _, primitive, _, _ = local_intersect(scene, scratch, sp.instance, o, d, next_after(t), reach)
    return primitive < 0


@inlined
def _enters(d, direction):
    """Whether light enters along a direction at a domain's pixel."""
    frame = frame_at(d.frame, 0)
    if entry_of(frame, d.pixel).closure == NOT_SERVED:
        return False
    return density_of(frame, d.pixel, direction) > 0.0


@device
def _reconnect(a, b, before, r):
    """|T'| of keeping x₂; 0: it cannot be kept."""
    sp, op = _point(a), _point(b)
    x, n = place_of(scene_of(a), before)
    stretched = keep_exit(a, b, r, op.instance)
    if not stretched > 0.0:
        return 0.0
    offset = sub(x, vec(sp.p))
    scene = scene_of(b)
    y, m = place_of(scene, r)
    there = sub(y, vec(op.p))
    distance = length(there)
    seen, seen_there = dot(offset, n), dot(there, m)  # cosines by the distances
    if not (seen > 0.0 and seen_there > 0.0 and distance > 0.0):
        return 0.0
    direction = scale(there, 1.0 / distance)
    if not (_enters(b, direction) and _sees(scene, b.scratch, op, vec(op.p), direction, distance)):
        return 0.0
    way = length(offset) / distance
    return stretched * seen_there / seen * way * way * way


@entry
def reconnect(start, to, reservoir, shifted, unused):
    """T(x) that keeps x₂ (see resampling.technique)."""
    a, b = domain_at(start, 0), domain_at(to, 0)
    shifted_at(shifted, 0).jacobian = _reconnect(a, b, sample_at(reservoir, 0), sample_at(shifted, 0))


@device
def _turn(a, b, before, r):
    """|T'| of keeping ω; 0: it leads nowhere."""
    sp, op = _point(a), _point(b)
    x, _ = place_of(scene_of(a), before)
    direction = normalize(sub(x, vec(sp.p)))
    if not (_enters(b, direction) and follow(a, b, r, False)):
        return 0.0
    scene = scene_of(b)
    _, primitive, u, v = first_hit(scene, b.scratch, op, vec(op.p), direction)
    if primitive < 0:
        return 0.0
    r.instance = op.instance
    r.primitive = primitive
    r.u = u
    r.v = v
    r.flags = (r.flags & ~TURNED) | NEEDS_LIGHT
    _, n = place_of(scene, r)
    if dot(n, direction) < 0.0:
        r.flags |= TURNED
    return 1.0


@entry
def turn(start, to, reservoir, shifted, unused):
    """T(x) that keeps ω (see resampling.technique)."""
    a, b = domain_at(start, 0), domain_at(to, 0)
    shifted_at(shifted, 0).jacobian = _turn(a, b, sample_at(reservoir, 0), sample_at(shifted, 0))
