"""Which lamp: by its unshadowed light at the point where lamps are few, by power from a table where they are many."""

import math

from ..jit import device
from ..memory import load_f64
from ..records import LIGHT_AREA, LIGHT_SPOT, LIGHT_SUN, light_at, light_table_at
from ..vec import dot, sub, vec
from ..warp import alias_pick

# Weight of a lamp whose cone misses the point: the test is by bounds, so the lamp must keep a chance.
_OUTSIDE = 0.01


@device
def _importance(light, o):
    """Roughly the irradiance that a lamp sends to o; 0 only where it sends none."""
    if light.kind == LIGHT_SUN:
        return light.importance
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
        near *= min((h + r) / distance, 1.0)
    elif light.kind == LIGHT_SPOT and d2 > r * r:
        m = light.to_object
        x = m[0] * w[0] + m[1] * w[1] + m[2] * w[2]
        y = m[4] * w[0] + m[5] * w[1] + m[6] * w[2]
        z = m[8] * w[0] + m[9] * w[1] + m[10] * w[2]
        if -z + r * (1.0 + math.sqrt(d2)) / math.sqrt(d2) < light.p[0] * math.sqrt(x * x + y * y + z * z):
            near *= _OUTSIDE
    return light.importance * near


@device
def choose_lamp(scene, o, u):
    """(index, probability) of a lamp for o; probability 0: none lights it."""
    table = light_table_at(scene.light_table, 0)
    n = scene.n_lights
    if not table.by_importance:
        i, u = alias_pick(table.lamp_alias, n, u)
        return i, load_f64(table.lamp_probabilities, i)
    chosen = -1
    weight = 0.0
    total = 0.0
    for i in range(n):
        w = _importance(light_at(scene.lights, i), o)
        if w > 0.0:
            total += w
            p = w / total
            if u < p:
                chosen = i
                weight = w
                u /= p
            else:
                u = min((u - p) / (1.0 - p), 0.99999999)
    return chosen, weight / total if total > 0.0 else 0.0


@device
def lamp_probability(scene, o, index):
    """The probability with which `choose_lamp` chooses a lamp for o."""
    table = light_table_at(scene.light_table, 0)
    if not table.by_importance:
        return load_f64(table.lamp_probabilities, index)
    total = 0.0
    weight = 0.0
    for i in range(scene.n_lights):
        w = _importance(light_at(scene.lights, i), o)
        total += w
        if i == index:
            weight = w
    return weight / total if total > 0.0 else 0.0
