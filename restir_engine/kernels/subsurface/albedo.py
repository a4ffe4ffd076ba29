"""Albedos of half spaces and slabs, looked up in the tables of `slabs`, for one channel.

`table` is the address of `slabs.slab_tables`. s = √(1 - α*) stands for the albedo, see there; mu is the cosine of the
direction of entry with the inward normal, b = σ_t (1 - g α) thickness.
"""

import math

from ..core.fastmath import exp, log
from ..core.jit import device, inlined
from ..core.memory import load_f32
from .slabs import MU, THICKNESS, G, S

_S, _G, _MU, _B = len(S), len(G), len(MU), len(THICKNESS)
_FIRST_G, _STEP_G = float(G[0]), float(G[1] - G[0])
_THINNEST, _THICKEST = float(THICKNESS[0]), float(THICKNESS[-1])
_BY_ROW = 2.0 / math.log(2.0)  # rows of the tables by unit of log thickness
_SINGLE = _S * _G * _MU
_REFLECTED = _SINGLE + _G * _MU
_TRANSMITTED = _REFLECTED + _S * _G * _MU * _B
_NEAR = _TRANSMITTED + _S * _G * _MU * _B
_FAR = _NEAR + _S * _B
_BEND = _FAR + _S * _B


@inlined
def _cell(x, n):
    """(index, weight of the next entry) for a position in a table of n entries."""
    x = min(max(x, 0.0), n - 1.0)
    i = min(int(x), n - 2)
    return i, x - i


@inlined
def similar(alpha, g):
    """s = √(1 - α*)."""
    return math.sqrt(max((1.0 - alpha) / (1.0 - g * alpha), 0.0))


@inlined
def single_albedo(table, g, mu):
    """The part of the light that comes back from a half space after one scattering, for α = 1."""
    i, fi = _cell((g - _FIRST_G) / _STEP_G, _G)
    j, fj = _cell(math.sqrt(mu) * (_MU - 1), _MU)
    at = _SINGLE + i * _MU + j
    a = load_f32(table, at) * (1.0 - fj) + load_f32(table, at + 1) * fj
    b = load_f32(table, at + _MU) * (1.0 - fj) + load_f32(table, at + _MU + 1) * fj
    return a + (b - a) * fi


@inlined
def total_albedo(table, s, g, mu):
    """The part of the light that comes back from a half space."""
    i, fi = _cell(s * (_S - 1), _S)
    j, fj = _cell((g - _FIRST_G) / _STEP_G, _G)
    k, fk = _cell(math.sqrt(mu) * (_MU - 1), _MU)
    total = 0.0
    for corner in range(8):
        a, c, e = corner >> 2, (corner >> 1) & 1, corner & 1
        w = (fi if a else 1.0 - fi) * (fj if c else 1.0 - fj) * (fk if e else 1.0 - fk)
        total += w * load_f32(table, ((i + a) * _G + j + c) * _MU + k + e)
    return total


@device
def slab_albedos(table, s, g, mu, b):
    """Parts of the light that a slab (reflects, transmits) after two scatterings or more."""
    thickness = min(max(b, _THINNEST), _THICKEST)
    row, _ = _cell(_BY_ROW * log(thickness / _THINNEST), _B)
    low = _THINNEST * exp(row / _BY_ROW)
    f = min(max((thickness / low - 1.0) / (math.sqrt(2.0) - 1.0), 0.0), 1.0)
    i, fi = _cell(s * (_S - 1), _S)
    j, fj = _cell((g - _FIRST_G) / _STEP_G, _G)
    k, fk = _cell(math.sqrt(mu) * (_MU - 1), _MU)
    r = t = 0.0
    for corner in range(8):
        a, c, e = corner >> 2, (corner >> 1) & 1, corner & 1
        w = (fi if a else 1.0 - fi) * (fj if c else 1.0 - fj) * (fk if e else 1.0 - fk)
        if w > 0.0:  # half of them are not where g is 0, which has a row of its own
            at = _B * (((i + a) * _G + j + c) * _MU + k + e) + row
            here, there = w * (1.0 - f), w * f
            r += here * load_f32(table, _REFLECTED + at) + there * load_f32(table, _REFLECTED + at + 1)
            t += here * load_f32(table, _TRANSMITTED + at) + there * load_f32(table, _TRANSMITTED + at + 1)
    thin = min(b / _THINNEST, 1.0)  # both grow with the square of a small thickness
    return r * thin * thin, exp(t) * thin * thin


@inlined
def shape_factors(table, s, b):
    """(near, far, bend): factors of the profile's scale on the two sides of a slab, and what a curved surface adds."""
    i, fi = _cell(s * (_S - 1), _S)
    k, fk = _cell(_BY_ROW * log(max(b, _THINNEST) / _THINNEST), _B)
    near = far = bend = 0.0
    for corner in range(4):
        a, c = corner >> 1, corner & 1
        w = (fi if a else 1.0 - fi) * (fk if c else 1.0 - fk)
        at = (i + a) * _B + k + c
        near += w * load_f32(table, _NEAR + at)
        far += w * load_f32(table, _FAR + at)
        bend += w * load_f32(table, _BEND + at)
    return near, far, bend
