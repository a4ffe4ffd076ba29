"""Which lamp: by about the light that each sends to the point; many lamps are first chosen among as clusters."""

import math

from ..core.jit import device, inlined
from ..core.memory import load_f64, load_i32
from ..core.records import LIGHT_AREA, LIGHT_SPOT, LIGHT_SUN, light_at, light_table_at
from ..core.vec import dot, load3_f64, sub, vec
from ..core.warp import stream_choice
from .linking import reaches
from .sun import sun_direction

# Weight of a lamp whose cone misses the point: the test is by bounds, so the lamp must keep a chance.
_OUTSIDE = 0.01

# The same of a lamp behind the surface: a lobe's normal may differ from the surface's.
_BEHIND = 0.02

# Heights over an area light, by its radius, below which it counts the less: of a wall that it is flush with, points and
# the rays that leave them, a rounding apart, must see it with the same probability, or MIS weights add up to another
# sum than 1.
_FLUSH = 0.01


@inlined
def importance(light, o, n):
    """Roughly the irradiance that a lamp sends to o with normal n (zero: any); 0 only where it sends none."""
    if light.kind == LIGHT_SUN:
        if n[0] == 0.0 and n[1] == 0.0 and n[2] == 0.0:
            return light.importance
        cos = dot(n, sun_direction(light)) + math.sqrt(light.p[3] * (2.0 - light.p[3]))
        return light.importance * max(min(cos, 1.0), _BEHIND)
    w = sub(o, vec(light.center))
    d2 = dot(w, w)
    r = light.radius
    if d2 <= r * r:
        near = 1.0 / (r * r) if r > 0.0 else 0.0
    else:
        near = 1.0 / d2
    if light.kind == LIGHT_AREA:
        h = w[0] * light.p[8] + w[1] * light.p[9] + w[2] * light.p[10]
        if h <= 0.0:
            return 0.0
        distance = math.sqrt(d2)
        if light.p[12] > 0.0 and math.sqrt(max(d2 - h * h, 0.0)) - r > h * light.p[11]:
            near *= _OUTSIDE
        above = min(h / (_FLUSH * r), 1.0)
        near *= min((h + r) / distance, 1.0) * above * above
    elif light.kind == LIGHT_SPOT and d2 > r * r:
        m = light.to_object
        x = m[0] * w[0] + m[1] * w[1] + m[2] * w[2]
        y = m[4] * w[0] + m[5] * w[1] + m[6] * w[2]
        z = m[8] * w[0] + m[9] * w[1] + m[10] * w[2]
        if -z + r * (1.0 + math.sqrt(d2)) / math.sqrt(d2) < light.p[0] * math.sqrt(x * x + y * y + z * z):
            near *= _OUTSIDE
    if d2 > r * r and (n[0] != 0.0 or n[1] != 0.0 or n[2] != 0.0):
        near *= max(min((r - dot(n, w)) / math.sqrt(d2), 1.0), _BEHIND)
    return light.importance * near


@device
def _cluster_importance(table, k, o, n):
    """The same of a cluster of lamps, more than 0."""
    at = 7 * k
    importance = load_f64(table.clusters, at + 4)
    r = load_f64(table.clusters, at + 3)
    if r < 0.0:  # suns
        return importance
    w = sub(o, load3_f64(table.clusters, at))
    d2 = dot(w, w)
    if d2 <= r * r:
        return importance / (r * r) if r > 0.0 else importance
    if n[0] != 0.0 or n[1] != 0.0 or n[2] != 0.0:
        importance *= max(min((r - dot(n, w)) / math.sqrt(d2), 1.0), _BEHIND)
    return importance / d2


@inlined
def _weight(scene, table, clusters, i, o, n, light_set):
    if clusters:
        return _cluster_importance(table, i, o, n)
    light = light_at(scene.lights, i)
    return importance(light, o, n) if reaches(light.links, light_set) else 0.0


@device
def _choose(scene, table, clusters, first, last, o, n, light_set, u):
    """(index, probability, u made uniform again) of a cluster or lamp in [first, last); probability 0: none."""
    chosen = -1
    weight = 0.0
    total = 0.0
    for i in range(first, last):
        w = _weight(scene, table, clusters, i, o, n, light_set)
        if w > 0.0:
            total += w
            taken, u = stream_choice(u, w / total)
            if taken:
                chosen = i
                weight = w
    return chosen, weight / total if total > 0.0 else 0.0, u


@device
def _probability(scene, table, clusters, first, last, o, n, light_set, index):
    """The probability with which `_choose` chooses an index."""
    total = 0.0
    weight = 0.0
    for i in range(first, last):
        w = _weight(scene, table, clusters, i, o, n, light_set)
        total += w
        if i == index:
            weight = w
    return weight / total if total > 0.0 else 0.0


@device
def lamps_bring(scene, table, o, n, light_set):
    """About the irradiance of all lamps at o with normal n (zero: any), in a light set, with nothing in their way."""
    clusters = table.n_clusters > 0
    total = 0.0
    for i in range(table.n_clusters if clusters else scene.n_lights):
        total += _weight(scene, table, clusters, i, o, n, light_set)
    return total


@inlined
def _span(table, k):
    """The lamps [first, last) of a cluster."""
    return int(load_f64(table.clusters, 7 * k + 5)), int(load_f64(table.clusters, 7 * k + 6))


@inlined
def choose_lamp(scene, o, n, light_set, u):
    """(index, probability) of a lamp for o with normal n in a light set; probability 0: none lights it."""
    if scene.n_lights == 1:
        return 0, 1.0
    table = light_table_at(scene.light_table, 0)
    first, last, share = 0, scene.n_lights, 1.0
    if table.n_clusters > 0:
        k, share, u = _choose(scene, table, True, 0, table.n_clusters, o, n, light_set, u)
        if k < 0:
            return -1, 0.0
        first, last = _span(table, k)
    chosen, probability, _ = _choose(scene, table, False, first, last, o, n, light_set, u)
    return chosen, share * probability


@device
def lamp_probability(scene, o, n, light_set, index):
    """The probability with which `choose_lamp` chooses a lamp for o with normal n."""
    if scene.n_lights == 1:
        return 1.0
    table = light_table_at(scene.light_table, 0)
    first, last, share = 0, scene.n_lights, 1.0
    if table.n_clusters > 0:
        k = load_i32(table.cluster_of, index)
        share = _probability(scene, table, True, 0, table.n_clusters, o, n, light_set, k)
        first, last = _span(table, k)
    return share * _probability(scene, table, False, first, last, o, n, light_set, index)


@device
def lamp_share(tiles, index):
    """The probability, among lamps, with which tiles draw one."""
    return load_f64(tiles.lamp_cdf, index + 1) - load_f64(tiles.lamp_cdf, index)
