"""Voronoi Texture (Worley 1996) in one to four dimensions: nearest points, smooth minimum, distance to the cell's
edge (https://iquilezles.org/articles/voronoilines), radius of the inscribed sphere, and their fractal sums.

One-dimensional cells lie along x.
"""

import math

from ...core.jit import device, entry
from ...core.memory import load_f64, load_i32, store_f64
from ..operands import fractal_operands, number
from .hashing import cell_color, cell_point, pcg_point
from .rounding import floor, single

F1, F2, SMOOTH_F1, DISTANCE_TO_EDGE, N_SPHERE_RADIUS = 0, 1, 2, 3, 4
EUCLIDEAN, MANHATTAN, CHEBYCHEV, MINKOWSKI = 0, 1, 2, 3
# Flags: dimensions | feature << 4 | metric << 8 | these.
FLAG_NORMALIZE = 4096
FLAG_INTEGER_CELLS = 8192  # cells are hashed by PCG of their integers (Blender 5), not by their floats

RESULTS = 9  # registers: distance, rgb, position, w, radius
WORK = 32  # registers behind the results: the state of a scan, and the sums over octaves
_SUMS = 8 * 20  # their bytes in it

# The state of a scan, in float64 from an address on.
_DISTANCE, _POINT, _COLOR = 0, 1, 5  # a result: distance, point xyzw relative to the scan's cell, rgb
_SECOND, _SECOND_POINT = 8, 9
_ORIGIN = 13  # what distances are measured from, relative to the cell
_EDGE = 17

# What a scan looks for.
_NEAREST, _NEIGHBOUR, _BORDER, _SMOOTH = 0, 1, 2, 3
_HUGE = 3.0e38


@device
def _point(flags, x, y, z, w):
    """The point of a cell, relative to its corner, at randomness 1."""
    dimensions = flags & 15
    if flags & FLAG_INTEGER_CELLS and dimensions > 1:
        return pcg_point(dimensions, int(x), int(y), int(z), int(w))
    return cell_point(dimensions, x, y, z, w)


@device
def _color(flags, x, y, z, w):
    dimensions = flags & 15
    if flags & FLAG_INTEGER_CELLS and dimensions > 1:
        c = pcg_point(max(dimensions, 3), int(x), int(y), int(z), int(w))
        return (c[0], c[1], c[2])
    return cell_color(dimensions, x, y, z, w)


@device
def _bound(metric, exponent, x, y, z, w):
    """The distance before its last root, which grows with it."""
    if metric == EUCLIDEAN:
        return x * x + y * y + z * z + w * w
    x, y, z, w = abs(x), abs(y), abs(z), abs(w)
    if metric == MANHATTAN:
        return x + y + z + w
    if metric == CHEBYCHEV:
        return max(max(x, y), max(z, w))
    return math.pow(x, exponent) + math.pow(y, exponent) + math.pow(z, exponent) + math.pow(w, exponent)


@device
def _root(metric, exponent, bound):
    if metric == EUCLIDEAN:
        return math.sqrt(bound)
    return math.pow(bound, 1.0 / exponent) if metric == MINKOWSKI else bound


@device
def _copy4(state, source, target):
    for n in range(4):
        store_f64(state, target + n, load_f64(state, source + n))


@device
def _store4(state, target, x, y, z, w):
    store_f64(state, target, x)
    store_f64(state, target + 1, y)
    store_f64(state, target + 2, z)
    store_f64(state, target + 3, w)


@device
def _mix(state, index, target, h, correction):
    old = load_f64(state, index)
    store_f64(state, index, old + (target - old) * h - correction)


@device
def _smooth_step(flags, state, exponent, smoothness, first, distance, a, b, c, d, cx, cy, cz, cw):
    """One more point for the smooth minimum (polynomial; the order of points is part of the result)."""
    h = 1.0
    if not first:
        h = min(max(0.5 + 0.5 * (load_f64(state, _DISTANCE) - distance) / smoothness, 0.0), 1.0)
        h = h * h * (3.0 - 2.0 * h)
    if h == 0.0:
        return
    correction = smoothness * h * (1.0 - h)
    _mix(state, _DISTANCE, distance, h, correction)
    correction /= 1.0 + 3.0 * smoothness
    color = _color(flags, cx, cy, cz, cw)
    _mix(state, _COLOR, color[0], h, correction)
    _mix(state, _COLOR + 1, color[1], h, correction)
    _mix(state, _COLOR + 2, color[2], h, correction)
    _mix(state, _POINT, a, h, correction)
    _mix(state, _POINT + 1, b, h, correction)
    _mix(state, _POINT + 2, c, h, correction)
    _mix(state, _POINT + 3, d, h, correction)


@device
def _border_step(state, dimensions, a, b, c, d):
    """One more point for the distance to the border between it and the nearest point, which is in the state."""
    x, y = load_f64(state, _ORIGIN), load_f64(state, _ORIGIN + 1)
    z, w = load_f64(state, _ORIGIN + 2), load_f64(state, _ORIGIN + 3)
    na, nb = load_f64(state, _POINT), load_f64(state, _POINT + 1)
    nc, nd = load_f64(state, _POINT + 2), load_f64(state, _POINT + 3)
    square = (a - na) * (a - na) + (b - nb) * (b - nb) + (c - nc) * (c - nc) + (d - nd) * (d - nd)
    if square <= 0.0001:
        return
    along = (0.5 * (a + na) - x) * (a - na) + (0.5 * (b + nb) - y) * (b - nb)
    along += (0.5 * (c + nc) - z) * (c - nc) + (0.5 * (d + nd) - w) * (d - nd)
    distance = along / math.sqrt(square)
    if dimensions == 1:
        distance = abs(distance)
    store_f64(state, _EDGE, min(load_f64(state, _EDGE), distance))


@device
def _nearest_step(state, bound, a, b, c, d):
    """One more point for the nearest two."""
    if bound < load_f64(state, _DISTANCE):
        store_f64(state, _SECOND, load_f64(state, _DISTANCE))
        _copy4(state, _POINT, _SECOND_POINT)
        store_f64(state, _DISTANCE, bound)
        _store4(state, _POINT, a, b, c, d)
    elif bound < load_f64(state, _SECOND):
        store_f64(state, _SECOND, bound)
        _store4(state, _SECOND_POINT, a, b, c, d)


@device
def _scan(search, flags, randomness, exponent, smoothness, cx, cy, cz, cw, state):
    """Visit the points of the cells around a cell; positions in the state are relative to the cell."""
    dimensions = flags & 15
    metric = (flags >> 8) & 15
    reach = 2 if search == _SMOOTH else 1
    side = 2 * reach + 1
    count = side
    for _ in range(1, dimensions):
        count *= side
    ox, oy = load_f64(state, _ORIGIN), load_f64(state, _ORIGIN + 1)
    oz, ow = load_f64(state, _ORIGIN + 2), load_f64(state, _ORIGIN + 3)
    for n in range(count):
        i = float(n % side - reach)
        j = float(n // side % side - reach) if dimensions > 1 else 0.0
        k = float(n // (side * side) % side - reach) if dimensions > 2 else 0.0
        m = float(n // (side * side * side) - reach) if dimensions > 3 else 0.0
        if search == _NEIGHBOUR and i == 0.0 and j == 0.0 and k == 0.0 and m == 0.0:
            continue
        q = _point(flags, cx + i, cy + j, cz + k, cw + m)
        a, b, c, d = q[0] * randomness + i, q[1] * randomness + j, q[2] * randomness + k, q[3] * randomness + m
        if search == _BORDER:
            _border_step(state, dimensions, a, b, c, d)
            continue
        bound = _bound(metric, exponent, a - ox, b - oy, c - oz, d - ow)
        if search == _SMOOTH:
            distance = _root(metric, exponent, bound)
            _smooth_step(
                flags, state, exponent, smoothness, n == 0, distance, a, b, c, d, cx + i, cy + j, cz + k, cw + m
            )
        else:
            _nearest_step(state, bound, a, b, c, d)


@device
def _sample(flags, randomness, exponent, smoothness, x, y, z, w, state):
    """One octave. The state then holds distance (to a point or an edge) or radius, position xyzw and rgb."""
    feature = (flags >> 4) & 15
    metric = (flags >> 8) & 15
    cx, cy, cz, cw = floor(x), floor(y), floor(z), floor(w)
    for n in range(8):
        store_f64(state, n, 0.0)
    _store4(state, _ORIGIN, x - cx, y - cy, z - cz, w - cw)
    search = _SMOOTH if feature == SMOOTH_F1 and smoothness != 0.0 else _NEAREST
    if search == _NEAREST:
        store_f64(state, _DISTANCE, _HUGE)
        store_f64(state, _SECOND, _HUGE)
        store_f64(state, _EDGE, _HUGE)
    for turn in range(2 if feature >= DISTANCE_TO_EDGE else 1):
        if turn == 1 and feature == DISTANCE_TO_EDGE:
            search = _BORDER
            if flags & 15 == 1:
                # In one dimension the borders are those of the cell's own point.
                store_f64(state, _POINT, _point(flags, cx, 0.0, 0.0, 0.0)[0] * randomness)
        elif turn == 1:
            # From the nearest point, in its own cell, to the point nearest to it.
            search = _NEIGHBOUR
            _copy4(state, _POINT, _ORIGIN)
            store_f64(state, _DISTANCE, _HUGE)
            for n in range(4):
                store_f64(state, _ORIGIN + n, load_f64(state, _POINT + n) - floor(load_f64(state, _POINT + n)))
            cx, cy = cx + floor(load_f64(state, _POINT)), cy + floor(load_f64(state, _POINT + 1))
            cz, cw = cz + floor(load_f64(state, _POINT + 2)), cw + floor(load_f64(state, _POINT + 3))
        _scan(search, flags, randomness, exponent, smoothness, cx, cy, cz, cw, state)
    if feature == DISTANCE_TO_EDGE:
        store_f64(state, _DISTANCE, load_f64(state, _EDGE))
    if feature == F2:
        store_f64(state, _DISTANCE, load_f64(state, _SECOND))
        _copy4(state, _SECOND_POINT, _POINT)
    a, b = cx + load_f64(state, _POINT), cy + load_f64(state, _POINT + 1)
    c, d = cz + load_f64(state, _POINT + 2), cw + load_f64(state, _POINT + 3)
    _store4(state, _POINT, a, b, c, d)
    if search == _NEAREST:
        store_f64(state, _DISTANCE, _root(metric, exponent, load_f64(state, _DISTANCE)))
        # A point lies less than one unit from the corner of its cell.
        color = _color(flags, floor(a), floor(b), floor(c), floor(d))
        store_f64(state, _COLOR, color[0])
        store_f64(state, _COLOR + 1, color[1])
        store_f64(state, _COLOR + 2, color[2])


@device
def _largest(flags, randomness, exponent):
    """The largest distance that there can be."""
    feature, metric, dimensions = (flags >> 4) & 15, (flags >> 8) & 15, flags & 15
    side = 0.5 + 0.5 * randomness
    if feature == DISTANCE_TO_EDGE:
        return side
    y, z, w = side if dimensions > 1 else 0.0, side if dimensions > 2 else 0.0, side if dimensions > 3 else 0.0
    limit = _root(metric, exponent, _bound(metric, exponent, side, y, z, w))
    return 2.0 * limit if feature == F2 else limit


@device
def _fractal(flags, detail, roughness, lacunarity, smoothness, exponent, randomness, x, y, z, w, state):
    """Octaves summed at state + _SUMS, in the layout of one; distances to edges by their minimum instead."""
    edge = (flags >> 4) & 15 == DISTANCE_TO_EDGE
    sums = state + _SUMS
    for n in range(8):
        store_f64(sums, n, 0.0)
    octaves = math.ceil(detail) + 1
    if detail == 0.0 or roughness == 0.0:
        octaves, detail = 1, 0.0
    limit = _largest(flags, randomness, exponent)
    amplitude, scale, reach = 1.0, 1.0, limit if edge else 0.0
    distance = 8.0
    for i in range(octaves):
        share = detail - floor(detail) if i > detail else 1.0
        _sample(flags, randomness, exponent, smoothness, x * scale, y * scale, z * scale, w * scale, state)
        if edge:
            sample = load_f64(state, _DISTANCE) / scale if octaves > 1 else load_f64(state, _DISTANCE)
            lower = distance + amplitude * (min(distance, sample) - distance)
            distance = sample if octaves == 1 else distance + share * (min(distance, lower) - distance)
            reach += share * amplitude * (limit / scale - reach)
            store_f64(sums, _DISTANCE, distance)
        else:
            reach += share * amplitude
            for n in range(8):
                if _POINT <= n < _COLOR:
                    _mix(sums, n, load_f64(state, n) / scale, share * amplitude, 0.0)
                else:
                    store_f64(sums, n, load_f64(sums, n) + share * amplitude * load_f64(state, n))
        scale *= lacunarity
        amplitude *= roughness
    if flags & FLAG_NORMALIZE:
        store_f64(sums, _DISTANCE, load_f64(sums, _DISTANCE) / (reach if edge else reach * limit))
        for n in range(_COLOR, _COLOR + 3):
            store_f64(sums, n, load_f64(sums, n) / (1.0 if edge else reach))


@entry
def voronoi_op(_scene, _sp, registers, code, at):
    """Voronoi Texture: see opcodes.VORONOI."""
    out = load_i32(code, at)
    p, scale, detail, roughness, lacunarity = fractal_operands(registers, code, at)
    roughness = min(roughness, 1.0)
    if abs(lacunarity) < 1e-6:
        lacunarity = 1e-6
    smoothness = min(max(0.5 * number(registers, code, at + 7), 0.0), 0.5)
    exponent = max(number(registers, code, at + 8), 1e-3)
    randomness = min(max(number(registers, code, at + 9), 0.0), 1.0)
    flags = load_i32(code, at + 10)
    dimensions = flags & 15
    x = single((number(registers, code, at + 2) if dimensions == 1 else p[0]) * scale)
    y = single(p[1] * scale) if dimensions > 1 else 0.0
    z = single(p[2] * scale) if dimensions > 2 else 0.0
    w = single(number(registers, code, at + 2) * scale) if dimensions > 3 else 0.0
    state = registers + 8 * (out + RESULTS)
    for n in range(RESULTS):
        store_f64(registers, out + n, 0.0)
    if (flags >> 4) & 15 == N_SPHERE_RADIUS:
        _sample(flags, randomness, exponent, smoothness, x, y, z, w, state)
        store_f64(registers, out + 8, 0.5 * math.sqrt(load_f64(state, _DISTANCE)))
        return
    _fractal(flags, detail, roughness, lacunarity, smoothness, exponent, randomness, x, y, z, w, state)
    sums = state + _SUMS
    store_f64(registers, out, load_f64(sums, _DISTANCE))
    if (flags >> 4) & 15 == DISTANCE_TO_EDGE:
        return
    inverse = 1.0 / scale if scale != 0.0 else 0.0
    for n in range(3):
        store_f64(registers, out + 1 + n, load_f64(sums, _COLOR + n))
    for n in range(4):
        # A position along one dimension is a W.
        target = 3 if dimensions == 1 else n
        if n < dimensions:
            store_f64(registers, out + 4 + target, load_f64(sums, _POINT + n) * inverse)
