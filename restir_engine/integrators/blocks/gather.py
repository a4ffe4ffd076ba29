"""What the samples of a block bring to all its domains: estimates by the balance heuristic.

Every exit x that the block's probes have found is a sample of the integral of each domain j that it may share with,

    f_j = Σ_i S_j(x_i) E_i w_i / p_i(x_i),      w_i = q_i(x_i) / Σ_k m_k q_k(x_i)

with p the density of the probes that have found it, m_k how many probes domain k makes in the mean, and q_k = Σ_c S_k /
∫ S_k, a density that is like p_k and known as soon as the S_k are. Σ_i w_i = 1 at every x for which there is light: no
bias, whatever q is. With q = p this would be the balance heuristic (Veach) itself, for five times the work.
"""

import math

import numpy as np

from ...kernels.core.jit import device, inlined
from ...kernels.core.single import exp_single, load_single, store_single
from ...kernels.subsurface.cycles_burley import CYCLES_REACH
from .block import (
    AXIS,
    BEND,
    CYCLES_TERM,
    CYCLIC,
    DENSITY,
    FACTORS,
    FAR,
    FAR_SHARE,
    KEY,
    LANES,
    LIGHT,
    NEAR,
    NEAR_SHARE,
    NORMAL,
    PLACE,
    PROBES,
    RATES,
    REACHES,
    SHAPE,
    SIDED,
    TANGENT,
    THICKNESS,
    TURN,
    UNIT,
    UNIT_TERM,
    block_at,
    pad_lanes,
    rows_of,
    sample_of,
)

_ZERO, _ONE, _HALF = np.float32(0.0), np.float32(1.0), np.float32(0.5)
_TWO, _LEAST = np.float32(2.0), np.float32(1.0e-30)
_NEAREST = np.float32(1.0e-20)  # length²
_CYCLES_END = np.float32(-CYCLES_REACH / 3.0)
_STEP = 8  # lanes by which the arithmetic goes on


@inlined
def _get(rows, row, lane):
    return load_single(rows, LANES * row + lane)


@inlined
def _set(rows, row, lane, value):
    store_single(rows, LANES * row + lane, value)


@inlined
def _distances(rows, n, p):
    """r and 1 / r of all domains."""
    for j in range(n):
        x, y, z = p[0] - _get(rows, PLACE, j), p[1] - _get(rows, PLACE + 1, j), p[2] - _get(rows, PLACE + 2, j)
        r = math.sqrt(x * x + y * y + z * z + _NEAREST)
        _set(rows, NEAR, j, r)
        _set(rows, NEAR_SHARE, j, _ONE / r)


@inlined
def _sides(rows, n, p, ny):
    """What else a slab's two sides need (see `bssrdf`)."""
    for j in range(n):
        x, y, z = p[0] - _get(rows, PLACE, j), p[1] - _get(rows, PLACE + 1, j), p[2] - _get(rows, PLACE + 2, j)
        a, b, c = _get(rows, NORMAL, j), _get(rows, NORMAL + 1, j), _get(rows, NORMAL + 2, j)
        half = _HALF - _HALF * (a * ny[0] + b * ny[1] + c * ny[2])
        away = half * half * _get(rows, SIDED, j)
        r = _get(rows, NEAR, j)
        turn = (x * (ny[0] - a) + y * (ny[1] - b) + z * (ny[2] - c)) / r
        beyond = max(r, _get(rows, THICKNESS, j))
        _set(rows, TURN, j, turn * math.sqrt(max(_ONE - half, _ZERO)))
        _set(rows, FAR, j, beyond)
        _set(rows, FAR_SHARE, j, away / beyond)
        _set(rows, NEAR_SHARE, j, (_ONE - away) / r)


@inlined
def _add_term(rows, n, term, distance, share):
    for c in range(3):
        for j in range(n):
            e = exp_single(_get(rows, RATES + 3 * term + c, j) * _get(rows, distance, j))
            s = _get(rows, share, j) * _get(rows, FACTORS + 3 * term + c, j) * (e + e * e * e)
            _set(rows, SHAPE + c, j, _get(rows, SHAPE + c, j) + s)


@inlined
def _bend(rows, n):
    for c in range(3):
        for j in range(n):
            s = _get(rows, SHAPE + c, j) * max(_ONE + _get(rows, BEND + c, j) * _get(rows, TURN, j), _ZERO)
            _set(rows, SHAPE + c, j, s)


@inlined
def _on_axis(rows, j, r, w, square):
    """One axis' part in Cycles' kernel (see `cycles_burley`)."""
    ra = max(math.sqrt(square), _get(rows, AXIS, j))
    sampled = cut = _ZERO
    for c in range(3):
        k = _get(rows, RATES + 3 * UNIT_TERM + c, j)
        e = exp_single(k * ra)
        at = _get(rows, FACTORS + 3 * UNIT_TERM + c, j) * (e + e * e * e)
        sampled += at if k * ra >= _CYCLES_END else _ZERO
        cut += at if k * r >= _CYCLES_END else _ZERO
    return w * w * r / ra * cut / max(sampled, _LEAST)


@inlined
def _add_cycles(rows, n, p, ny):
    """Add Cycles' kernel to SHAPE."""
    for j in range(n):
        x, y, z = p[0] - _get(rows, PLACE, j), p[1] - _get(rows, PLACE + 1, j), p[2] - _get(rows, PLACE + 2, j)
        a, b, c = _get(rows, NORMAL, j), _get(rows, NORMAL + 1, j), _get(rows, NORMAL + 2, j)
        ta, tb, tc = _get(rows, TANGENT, j), _get(rows, TANGENT + 1, j), _get(rows, TANGENT + 2, j)
        ba, bb, bc = b * tc - c * tb, c * ta - a * tc, a * tb - b * ta
        along_t, along_b, up = x * ta + y * tb + z * tc, x * ba + y * bb + z * bc, x * a + y * b + z * c
        wn = _TWO * (a * ny[0] + b * ny[1] + c * ny[2])
        wt, wb = ta * ny[0] + tb * ny[1] + tc * ny[2], ba * ny[0] + bb * ny[1] + bc * ny[2]
        along_t, along_b, up = along_t * along_t, along_b * along_b, up * up
        r = _get(rows, NEAR, j)
        total = _on_axis(rows, j, r, wn, along_t + along_b)
        total += _on_axis(rows, j, r, wt, along_b + up)
        total += _on_axis(rows, j, r, wb, along_t + up)
        total *= _get(rows, CYCLIC, j) / (r * max(wn * wn + wt * wt + wb * wb, _LEAST))
        _set(rows, TURN, j, total)
    for c in range(3):
        for j in range(n):
            e = exp_single(_get(rows, RATES + 3 * CYCLES_TERM + c, j) * _get(rows, NEAR, j))
            s = _get(rows, TURN, j) * _get(rows, FACTORS + 3 * CYCLES_TERM + c, j) * (e + e * e * e)
            _set(rows, SHAPE + c, j, _get(rows, SHAPE + c, j) + s)


@inlined
def _cut(rows, n, key):
    """Nothing comes from beyond the profile's end and from other objects."""
    for c in range(3):
        for j in range(n):
            inside = (_get(rows, NEAR, j) <= _get(rows, REACHES + c, j)) & (_get(rows, KEY, j) == key)
            _set(rows, SHAPE + c, j, _get(rows, SHAPE + c, j) if inside else _ZERO)


@inlined
def _densities(rows, n):
    """Fill DENSITY; Σ_k m_k q_k."""
    for j in range(n):
        q = abs(_get(rows, SHAPE, j)) + abs(_get(rows, SHAPE + 1, j)) + abs(_get(rows, SHAPE + 2, j))
        _set(rows, DENSITY, j, q * _get(rows, UNIT, j))
    a = b = c = d = _ZERO
    for j in range(0, n, 4):  # four sums: each waits for itself
        a += _get(rows, DENSITY, j) * _get(rows, PROBES, j)
        b += _get(rows, DENSITY, j + 1) * _get(rows, PROBES, j + 1)
        c += _get(rows, DENSITY, j + 2) * _get(rows, PROBES, j + 2)
        d += _get(rows, DENSITY, j + 3) * _get(rows, PROBES, j + 3)
    return (a + b) + (c + d)


@inlined
def _weigh(rows, n, terms, has_cycles, p, ny, key):
    """Fill SHAPE and DENSITY of a sample; Σ_k m_k q_k."""
    _distances(rows, n, p)
    for c in range(3):
        for j in range(n):
            _set(rows, SHAPE + c, j, _ZERO)
    if terms > 2:
        _sides(rows, n, p, ny)
        _add_term(rows, n, 2, FAR, FAR_SHARE)
        _add_term(rows, n, 3, FAR, FAR_SHARE)
    _add_term(rows, n, 0, NEAR, NEAR_SHARE)
    if terms > 1:
        _add_term(rows, n, 1, NEAR, NEAR_SHARE)
    if terms > 2:
        _bend(rows, n)
    if has_cycles:
        _add_cycles(rows, n, p, ny)
    _cut(rows, n, key)
    return _densities(rows, n)


@inlined
def _add(rows, n, to, e):
    """Add a sample's light times S to three rows."""
    for c in range(3):
        for j in range(n):
            _set(rows, to + c, j, _get(rows, to + c, j) + e[c] * _get(rows, SHAPE + c, j))


@device
def gather(block):
    """Fill the rows from LIGHT on."""
    b = block_at(block, 0)
    rows = rows_of(block)
    n = pad_lanes(block, _STEP)
    for row in range(LIGHT, LIGHT + 3 * (1 + b.groups)):
        for j in range(n):
            _set(rows, row, j, _ZERO)
    for k in range(b.samples):
        s = sample_of(block, k)
        key = _get(rows, KEY, s.lane)
        total = _weigh(rows, n, b.terms, b.has_cycles != 0, (s.p[0], s.p[1], s.p[2]), (s.n[0], s.n[1], s.n[2]), key)
        if total > _ZERO:
            w = _get(rows, DENSITY, s.lane) / total
            e = (w * s.irradiance[0], w * s.irradiance[1], w * s.irradiance[2])
            _add(rows, n, LIGHT + 3 * (1 + s.group), e)
