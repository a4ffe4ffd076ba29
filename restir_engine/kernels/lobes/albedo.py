"""Directional albedos from tables: what a microfacet closure reflects, and what single scattering loses.

The tables (`tables.py` makes them) stand one after the other in the float32 array at SCENE.lobe_tables. `rough` is
the square root of α, `mu` the cosine to the normal and `z` the fourth root of the reflectance at normal incidence,
which covers indices of refraction from 1 to infinity.
"""

import math

from ..core.jit import device
from ..core.memory import load_f32
from ..core.vec import average, dot, put, vec
from .closure import LOBE_GLASS, P_ENERGY, P_F0, P_FRESNEL, P_REFLECTION, has_reflection, has_transmission
from .fresnel import FRESNEL_DIELECTRIC, FRESNEL_F82, FRESNEL_SCHLICK, f0_from_ior, microfacet_fresnel

GGX_SIZE = 32
GLASS_SIZE = 16
SHEEN_SIZE = 32

GGX_E = 0  # [mu, rough] what GGX reflects without Fresnel
GGX_AVERAGE = GGX_E + GGX_SIZE**2  # [rough] its average over cosine-weighted directions
GLASS_E = GGX_AVERAGE + GGX_SIZE  # [z, mu, rough] reflection and refraction into a denser medium
GLASS_AVERAGE = GLASS_E + GLASS_SIZE**3  # [z, rough]
GLASS_OUT_E = GLASS_AVERAGE + GLASS_SIZE**2  # [z, mu, rough] out of the denser medium
GLASS_OUT_AVERAGE = GLASS_OUT_E + GLASS_SIZE**3  # [z, rough]
DIELECTRIC_S = GLASS_OUT_AVERAGE + GLASS_SIZE**2  # [z, mu, rough] where the reflectance stands between F0 and 1
SCHLICK_S = DIELECTRIC_S + GLASS_SIZE**3  # [mu, rough] the same for Schlick's curve
SHEEN_A = SCHLICK_S + GLASS_SIZE**2  # [roughness, mu] coefficients of the transformed cosine
SHEEN_B = SHEEN_A + SHEEN_SIZE**2
SHEEN_ALBEDO = SHEEN_B + SHEEN_SIZE**2
TABLES_SIZE = SHEEN_ALBEDO + SHEEN_SIZE**2


@device
def lookup1(tables, offset, n, x):
    """Linear interpolation in a table of n values over 0 … 1."""
    x = min(max(x, 0.0), 1.0) * (n - 1)
    i = min(int(x), n - 2)
    a = load_f32(tables, offset + i)
    return a + (load_f32(tables, offset + i + 1) - a) * (x - i)


@device
def lookup2(tables, offset, n, x, y):
    """Bilinear interpolation in an n × n table, x running fastest."""
    y = min(max(y, 0.0), 1.0) * (n - 1)
    i = min(int(y), n - 2)
    a = lookup1(tables, offset + n * i, n, x)
    return a + (lookup1(tables, offset + n * i + n, n, x) - a) * (y - i)


@device
def lookup3(tables, offset, n, x, y, z):
    """Trilinear interpolation in an n × n × n table, x running fastest."""
    z = min(max(z, 0.0), 1.0) * (n - 1)
    i = min(int(z), n - 2)
    a = lookup2(tables, offset + n * n * i, n, x, y)
    return a + (lookup2(tables, offset + n * n * (i + 1), n, x, y) - a) * (z - i)


@device
def _rough(c):
    return math.sqrt(math.sqrt(c.alpha_x * c.alpha_y))


@device
def _z(ior):
    return math.sqrt(abs((ior - 1.0) / (ior + 1.0)))


@device
def microfacet_albedo(tables, c, wo):
    """(reflected rgb, transmitted rgb): albedos by the Fresnel model of a closure of microfacets, without the weight.

    As in Cycles the distribution itself is taken to keep all energy, metals other than F82, all transmission and what
    lies under a thin film to be smooth.
    """
    mu = dot(vec(c.n), wo)
    r0, r1, r2, t0, t1, t2, _cos_t = microfacet_fresnel(c, mu, has_reflection(c), has_transmission(c))
    kind = c.p[P_FRESNEL]
    if r0 + r1 + r2 > 0.0 and c.film == 0:
        if kind == FRESNEL_SCHLICK:
            s = lookup3(tables, DIELECTRIC_S, GLASS_SIZE, _rough(c), mu, _z(c.ior))
            r0 = (c.p[P_F0] * (1.0 - s) + s) * c.p[P_REFLECTION]
            r1 = (c.p[P_F0 + 1] * (1.0 - s) + s) * c.p[P_REFLECTION + 1]
            r2 = (c.p[P_F0 + 2] * (1.0 - s) + s) * c.p[P_REFLECTION + 2]
        elif kind == FRESNEL_F82:
            s = lookup2(tables, SCHLICK_S, GLASS_SIZE, _rough(c), mu)
            r0, r1, r2 = c.p[P_F0] * (1.0 - s) + s, c.p[P_F0 + 1] * (1.0 - s) + s, c.p[P_F0 + 2] * (1.0 - s) + s
        elif kind == FRESNEL_DIELECTRIC and c.ior > 1.0:
            s = lookup3(tables, DIELECTRIC_S, GLASS_SIZE, _rough(c), mu, _z(c.ior))
            r0 = f0_from_ior(c.ior) * (1.0 - s) + s
            r1 = r2 = r0
    return r0, r1, r2, t0, t1, t2


@device
def preserve_energy(tables, c, wo, fss):
    """Scale a GGX closure so that it keeps the energy that single scattering loses.

    `fss` (rgb) is the average reflectance of a microfacet: light that bounces between microfacets is coloured by it
    (Kulla and Conty 2017). The grey part goes to the energy scale, the colour to the weight.
    """
    mu, rough = dot(vec(c.n), wo), _rough(c)
    if c.kind == LOBE_GLASS:
        z = _z(c.ior)
        if c.ior < 1.0:
            e = lookup3(tables, GLASS_OUT_E, GLASS_SIZE, rough, mu, z)
            average_e = lookup2(tables, GLASS_OUT_AVERAGE, GLASS_SIZE, rough, z)
        else:
            e = lookup3(tables, GLASS_E, GLASS_SIZE, rough, mu, z)
            average_e = lookup2(tables, GLASS_AVERAGE, GLASS_SIZE, rough, z)
    else:
        e = lookup2(tables, GGX_E, GGX_SIZE, rough, mu)
        average_e = lookup1(tables, GGX_AVERAGE, GGX_SIZE, rough)
    e = max(e, 1e-6)
    c.p[P_ENERGY] = 1.0 / e
    if fss[0] == 1.0 and fss[1] == 1.0 and fss[2] == 1.0:
        return
    w = vec(c.weight)
    d0, d1, d2 = _darkening(fss[0], e, average_e), _darkening(fss[1], e, average_e), _darkening(fss[2], e, average_e)
    put(c.weight, (w[0] * d0, w[1] * d1, w[2] * d2))
    c.sample_weight *= average((d0, d1, d2))


@device
def interface_energy(tables, mu, rough, ior):
    """What a rough interface reflects and lets through together, of light that scatters once between microfacets."""
    offset = GLASS_OUT_E if ior < 1.0 else GLASS_E
    return max(lookup3(tables, offset, GLASS_SIZE, rough, mu, _z(ior)), 1e-6)


@device
def _darkening(fss, e, average_e):
    """What one channel loses between microfacets, relative to a white surface."""
    fms = fss * average_e / max(1.0 - fss * (1.0 - average_e), 1e-9)
    return (1.0 + fms * (1.0 - e) / e) * e


@device
def layer_under(tables, c, wo, weight):
    """The weight (rgb) that a reflecting closure on top leaves to what lies under it."""
    albedo = vec(c.weight)
    r0, r1, r2, _t0, _t1, _t2 = microfacet_albedo(tables, c, wo)
    return cover(weight, (albedo[0] * r0, albedo[1] * r1, albedo[2] * r2))


@device
def cover(weight, albedo):
    """weight times one minus the greatest ratio of albedo to weight over the channels (grey, so colours stay)."""
    ratio = 0.0
    for k in range(3):
        if weight[k] != 0.0:
            ratio = max(ratio, albedo[k] / weight[k])
    keep = min(max(1.0 - ratio, 0.0), 1.0)
    return (weight[0] * keep, weight[1] * keep, weight[2] * keep)
