"""The shifts of subsurface paths (paper a, §4; measure: area of x₂, coordinates of x₃).

reconnect    x₂ and x₃ are kept, and no ray is traced. |T'| = 1; between frames, the ratio of its triangle's areas.
replay       the probe's numbers are kept and find y₂, which is connected to x₃ (delayed reconnection). The probe's
             choice of line and channel is part of the sample, so that with p the probe's density and w_c the chance of
             the channel  |T'| = (p_x₁(x₂) / p_y₁(y₂)) (w_c,y₁ / w_c,x₁).  A probe, and a shadow ray for E(y₂, x₃).
hybrid       where (x₁, x₂) is connectable the former, else the latter; where the shifted path is not of the same kind
             the shift fails: both ways, so that it can be inverted.
sequential   a round of reconnect; then what each pixel has chosen gets line, channel and hit anew, by their posterior
             at x₁ (`redraw_numbers`); then a round of replay. The redrawn numbers cancel in the measure of x₂: W stays.

x₃ has the Jacobian 1 in all of them, as its coordinates do not depend on who is lit.
"""

from ....kernels.core import rng
from ....kernels.core.jit import device, entry, inlined
from ....kernels.core.memory import load_f64
from ....kernels.core.records import POINT_ON_LAMP, POINT_ON_WORLD, integrator_at, path_at
from ....kernels.core.vec import dot, length, load3_f64, sub, vec
from ....kernels.geometry.surface import triangle_place
from ....kernels.subsurface.bssrdf import NONE, bssrdf_at, channel_shares, diffused_pdf, probe_bssrdf
from ....kernels.subsurface.exits import exit_at
from ....kernels.subsurface.probe import H_NORMAL, H_PDF, H_POINT, H_PRIMITIVE, H_U, H_V
from ...resampling.frame import frame_at
from ...resampling.inputs import scene_of
from ...resampling.motion import look_up, motion_at
from ...resampling.technique import NOW, domain_at, shifted_at
from .invert import numbers_of, numbers_of_choice
from .sample import NEEDS_LIGHT, TURNED, UNKNOWN_HIT, how_found, point_of, sample_at
from .target import place_of

# When a pair (x₁, x₂) is connectable: normals at least 60° apart, or at least so many scales of the profile away.
_COSINE, _SCALES = 0.5, 2.0


@inlined
def _renamed(a, b, index, before, after):
    """What an index of a's frame is called in b's; -1: it is not there."""
    return look_up(after if b.when == NOW else before, index)


@device
def follow(a, b, r, keeps_exit):
    """Name what a sample consists of as b's frame does; False where it is not there. keeps_exit: x₂ stays."""
    if scene_of(b).shutter != 0:  # x₂ and x₃ are elsewhere at another time
        r.flags |= NEEDS_LIGHT
    if a.when == b.when:
        return True
    motion = motion_at(a.motion, 0)
    if r.light_primitive != POINT_ON_WORLD:
        if r.light_primitive == POINT_ON_LAMP:
            there = _renamed(a, b, int(r.source), motion.lamp_before, motion.lamp_after)
        else:
            there = _renamed(a, b, int(r.source), motion.instance_before, motion.instance_after)
        if there < 0:
            return False
        r.source = there
    if keeps_exit:
        there = _renamed(a, b, int(r.instance), motion.instance_before, motion.instance_after)
        if there < 0:
            return False
        r.instance = there
    if motion.instance_before != 0:  # another scene
        r.flags |= NEEDS_LIGHT
    return True


@inlined
def _bssrdf(d):
    return bssrdf_at(point_of(frame_at(d.frame, 0), d.pixel), 0)


@device
def keep_exit(a, b, r, instance):
    """|T'| of keeping x₂ by its barycentrics, which stretches with its triangle; 0: it is no point of b's instance."""
    before = int(r.instance)
    if not follow(a, b, r, True) or r.instance != instance:
        return 0.0
    # What lights send may depend on the path that asks.
    p, q = path_at(frame_at(a.frame, 0).paths, a.pixel), path_at(frame_at(b.frame, 0).paths, b.pixel)
    if p.bounce != q.bounce or p.flags != q.flags:
        r.flags |= NEEDS_LIGHT
    if a.when == b.when and scene_of(a).shutter == 0:
        return 1.0
    primitive = int(r.primitive)
    _, _, area = triangle_place(scene_of(a), before, primitive, 0.0, 0.0)
    _, _, stretched = triangle_place(scene_of(b), instance, primitive, 0.0, 0.0)
    return stretched / area if area > 0.0 else 0.0


@inlined
def _reconnect(a, b, r):
    """|T'| of keeping x₂; 0: it cannot be kept."""
    bssrdf = _bssrdf(b)
    if bssrdf.kind == NONE or (bssrdf.side < 0.0) != (r.flags & TURNED != 0):
        return 0.0
    return keep_exit(a, b, r, bssrdf.instance)


@device
def _replay(a, b, r, offset, n, guess):
    """|T'| of finding y₂ with the numbers that found x₂ = x₁ + offset, with the normal n; 0: there is none.

    guess: a number in [0, 1) by which one of the probe's hits is taken where it is unknown which one x₂ was; -1: none.
    """
    s, t = _bssrdf(a), _bssrdf(b)
    line, channel, index = how_found(r)
    if t.kind == NONE or (index == UNKNOWN_HIT and guess < 0.0) or not follow(a, b, r, False):
        return 0.0
    share_x, share_y = channel_shares(vec(s.weight))[channel], channel_shares(vec(t.weight))[channel]
    if not (share_x > 0.0 and share_y > 0.0):
        return 0.0
    u_radius, u_angle = numbers_of(s, offset, line, channel)
    u_line, u_channel = numbers_of_choice(t, line, channel)
    scene, integrator = scene_of(b), integrator_at(b.integrator, 0)
    kept = probe_bssrdf(scene, integrator.scatter, b.scratch, t, u_line, u_channel, u_radius, u_angle)
    if index == UNKNOWN_HIT:
        index = int(guess * kept)
    if index >= kept:
        return 0.0
    hit = exit_at(b.scratch, index)
    density = load_f64(hit, H_PDF)
    if not density > 0.0:
        return 0.0
    r.instance = t.instance
    r.primitive = int(load_f64(hit, H_PRIMITIVE))
    r.u = load_f64(hit, H_U)
    r.v = load_f64(hit, H_V)
    r.flags = (r.flags & ~TURNED) | NEEDS_LIGHT | (TURNED if t.side < 0.0 else 0)
    return diffused_pdf(s, offset, n) / density * share_y / share_x


@inlined
def _connectable(b, offset, n):
    """Whether x₁ and x₁ + offset, with the normal n, are so far apart that reconnection changes little."""
    d = max(float(b.d[0]), max(float(b.d[1]), float(b.d[2])))
    return dot(vec(b.n), n) <= _COSINE or length(offset) >= _SCALES * d


@entry
def reconnect(start, to, reservoir, shifted, unused):
    """T(x) that keeps x₂ (see resampling.technique)."""
    shifted_at(shifted, 0).jacobian = _reconnect(domain_at(start, 0), domain_at(to, 0), sample_at(shifted, 0))


@entry
def replay(start, to, reservoir, shifted, unused):
    """T(x) that keeps the probe's numbers (see resampling.technique)."""
    a, b, r = domain_at(start, 0), domain_at(to, 0), sample_at(shifted, 0)
    x, n = place_of(scene_of(a), r)
    shifted_at(shifted, 0).jacobian = _replay(a, b, r, sub(x, vec(_bssrdf(a).p)), n, -1.0)


@entry
def replay_any_hit(start, to, reservoir, shifted, unused):
    """The same where any of the probe's hits is taken for y₂: biased (see resampling.technique)."""
    a, b, r = domain_at(start, 0), domain_at(to, 0), sample_at(shifted, 0)
    x, n = place_of(scene_of(a), r)
    guess = rng.sample1(rng.hash_combine(r.seed, b.pixel), 0, 0)
    shifted_at(shifted, 0).jacobian = _replay(a, b, r, sub(x, vec(_bssrdf(a).p)), n, guess)


@entry
def hybrid(start, to, reservoir, shifted, unused):
    """T(x) that keeps x₂ or the probe's numbers, by what x₁ and x₂ are (see resampling.technique)."""
    a, b, r = domain_at(start, 0), domain_at(to, 0), sample_at(shifted, 0)
    s, t = _bssrdf(a), _bssrdf(b)
    x, n = place_of(scene_of(a), r)
    offset = sub(x, vec(s.p))
    if _connectable(s, offset, n):
        jacobian = _reconnect(a, b, r)
        if jacobian > 0.0:
            x, n = place_of(scene_of(b), r)
            if not _connectable(t, sub(x, vec(t.p)), n):
                jacobian = 0.0
    else:
        jacobian = _replay(a, b, r, offset, n, -1.0)
        if jacobian > 0.0:
            hit = exit_at(b.scratch, how_found(r)[2])
            if _connectable(t, sub(load3_f64(hit, H_POINT), vec(t.p)), load3_f64(hit, H_NORMAL)):
                jacobian = 0.0
    shifted_at(shifted, 0).jacobian = jacobian
