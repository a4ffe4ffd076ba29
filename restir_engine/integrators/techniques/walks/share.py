"""The walks of a block of pixels, shared out among them: see docs/restir-sss.md.

f_j is what would come of the vertex v_i, where walk i is connected, at entrance j, p_j the density with which j finds
it. All walks of a group of entrances, weighed by the balance heuristic, light each of them:
Σ_i l_i (f_j / f_i)(v_i) p_i(v_i) / Σ_k p_k(v_i), l_i being the light that walk i brings to its own.
"""

import math

from ....kernels.core.jit import device, inlined
from ....kernels.core.memory import clear_record
from ....kernels.core.records import mesh_at, path_in
from ....kernels.core.vec import mul, sub, transform_point, vec
from ....kernels.film.contribute import BOUNDARY, contribute, lit_by_several, lit_indirectly
from ....kernels.geometry.placed import placed_at
from ....kernels.geometry.segments import AT_ONCE, begin_segments, is_free, put_segment, trace_segments
from ....kernels.lobes.classes import Lobes
from ....kernels.subsurface.walk import similar
from .begin import begin
from .entrance import LEAVES, NO_WALK, entrance_at, is_alike

_NONE = (0.0, 0.0, 0.0)
# Who finds a vertex with a smaller share of the largest density has no part in it.
FEW = 0.005
NEAR = 1.0e-4  # of a segment, at the surface: what is not looked at for obstacles
_LEAST = 1.0e-280  # what is less than that is no divisor


@device
def group_entrances(block, n):
    """Let each of n entrances share with the first one that it is alike to."""
    for i in range(n):
        e = entrance_at(block, i)
        e.group = i
        if e.opens == 0:
            continue
        for k in range(i):
            other = entrance_at(block, k)
            if other.opens != 0 and other.group == k and is_alike(other, e):
                e.group = k
                break


@device
def share_walks(scene, unclamped, film, scratch, block, n):
    """Light n entrances by all their walks; unclamped: INTEGRATOR without clamps."""
    group_entrances(block, n)
    for i in range(n):
        walk = entrance_at(block, i)
        if walk.walk != NO_WALK:
            _share(scene, scratch, block, n, walk)
    path = path_in(scratch)
    clear_record(path)
    for i in range(n):
        e = entrance_at(block, i)
        if e.opens != 0:
            path.pixel = e.pixel
            _light(unclamped, film, path, e)


@device
def _share(scene, scratch, block, n, walk):
    """Add the light of a walk to all entrances of its group from which its vertex is likely enough to be found."""
    placed = placed_at(scene, walk.instance)
    most = 0.0
    for k in range(n):
        e = entrance_at(block, k)
        e.density = 0.0
        if e.opens != 0 and e.group == walk.group:
            begin(placed, e, walk)
            most = max(most, e.density)
    least = max(FEW * most, _LEAST)
    if not walk.density > least:
        _add(walk, walk, (1.0, 1.0, 1.0))
        return
    structure, time = mesh_at(scene.meshes, placed.mesh).embree, scene.time
    vertex = transform_point(placed.to_object, vec(walk.vertex))
    _keep_free(structure, time, scratch, block, n, walk, least, vertex, False)
    if walk.bent:
        _keep_free(structure, time, scratch, block, n, walk, least, vertex, True)
    total = 0.0
    for k in range(n):
        e = entrance_at(block, k)
        total += e.density if e.density > least else 0.0
    weight = walk.density / total
    own = vec(walk.begun)
    scales = (_ratio(weight, own[0]), _ratio(weight, own[1]), _ratio(weight, own[2]))
    for k in range(n):
        e = entrance_at(block, k)
        if not e.density > least:
            continue
        if e.pixel == walk.pixel:
            _add(e, walk, (weight, weight, weight))
        else:
            _add(e, walk, mul(mul(scales, vec(e.begun)), _behind(e, walk)))


@inlined
def _looks(e, walk, least):
    """Whether an entrance, not the walk's own, has to look whether it sees the walk's vertex."""
    return e.density > least and e.pixel != walk.pixel


@inlined
def _far(error, distance):
    """Up to which share of the way to a surface there may be no obstacles."""
    return 1.0 - NEAR - 4.0 * error / distance


@device
def _keep_free(structure, time, scratch, block, n, walk, least, vertex, again):
    """Take the density from entrances whose way from the vertex (object space) to where it begins is not free.

    again: the way that is looked at is the first segment, which has been done again, in place of that.
    """
    first = 0
    while first < n:
        segments, count, k = begin_segments(scratch), 0, first
        while k < n and count < AT_ONCE:
            e = entrance_at(block, k)
            if _looks(e, walk, least):
                o, end, near, far = vertex, vec(e.bend), NEAR if walk.walk == LEAVES else 0.0, 1.0
                if again:
                    o, end, near, far = end, vec(e.p_object), 0.0, _far(e.error, e.entered)
                elif not walk.bent:
                    far = _far(e.error, e.distance)
                put_segment(segments, count, o, sub(end, o), near, far, time)
                e.segment = count
                count += 1
            k += 1
        _forget_hidden(structure, segments, block, first, k, count, walk, least)
        first = k


@inlined
def _forget_hidden(structure, segments, block, first, last, count, walk, least):
    """Trace so many segments of the entrances from `first` on, and take the density from those that meet something."""
    if count == 0:
        return
    trace_segments(structure, segments)
    for k in range(first, last):
        e = entrance_at(block, k)
        if _looks(e, walk, least) and not is_free(segments, e.segment):
            e.density = 0.0


@inlined
def _ratio(a, b):
    return a / b if b > _LEAST else 0.0


@inlined
def _behind(e, walk):
    """What the rest of a walk lets through of each channel, in the medium of another entrance by its own."""
    if walk.walk == LEAVES:
        return (1.0, 1.0, 1.0)
    return (_behind_of(e, walk, 0), _behind_of(e, walk, 1), _behind_of(e, walk, 2))


@inlined
def _behind_of(e, walk, k):
    s, a = float(e.sigma_t[k]), float(e.albedo[k])
    own_s, own_a = float(walk.sigma_t[k]), float(walk.albedo[k])
    if s == own_s and a == own_a:
        return 1.0
    return _other_medium(e.g, s, a, own_s, own_a, walk)


@device
def _other_medium(g, s, a, own_s, own_a, walk):
    x = walk.scattered * math.log(s * a / (own_s * own_a)) - (s - own_s) * walk.length
    if walk.similar_length > 0.0:
        s, a = similar(s, a, g)
        own_s, own_a = similar(own_s, own_a, g)
        x += walk.similar_scattered * math.log(s * a / (own_s * own_a)) - (s - own_s) * walk.similar_length
    return math.exp(min(x, 600.0))


@inlined
def _add(e, walk, weight):
    direct, indirect = mul(vec(walk.direct), weight), mul(vec(walk.indirect), weight)
    at = 3 * min(walk.events, 2)
    for k in range(3):
        e.lit_directly[at + k] += direct[k]
        e.lit_indirectly[at + k] += indirect[k]


@inlined
def _light(unclamped, film, path, e):
    """Add what walks have brought to an entrance to its pixel, by the class of their scattering."""
    lobes = Lobes((1.0, 1.0, 1.0), _NONE, _NONE)
    for k in range(3):
        path.scattering = BOUNDARY + k
        direct = (e.lit_directly[3 * k], e.lit_directly[3 * k + 1], e.lit_directly[3 * k + 2])
        contribute(unclamped, film, path, direct, lit_by_several(path, lobes))
        indirect = (e.lit_indirectly[3 * k], e.lit_indirectly[3 * k + 1], e.lit_indirectly[3 * k + 2])
        contribute(unclamped, film, path, indirect, lit_indirectly(path, lobes))
