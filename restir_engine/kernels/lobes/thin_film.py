"""Interference in a thin film that lies on microfacets.

Belcour and Barla 2017, "A Practical Extension to Microfacet Theory for the Modeling of Varying Iridescence". Light of
wavelength λ that goes m times through a film of thickness d and index n runs m times OPD = 2 n d cos θ₂ further. With
the amplitudes r₁₂ of the film's upper side, r₂₁ = -r₁₂ and r₂₃ of its lower side, q = r₂₁ r₂₃ and T = 1 - r₁₂²,

    r = r₁₂ + T r₂₃ e^{iφ} / (1 - q e^{iφ}),  φ = 2π OPD / λ,
    |r|² = R₁₂ + S + 2 (S - T) Σ_{m ≥ 1} Re(q^m e^{imφ}),  S = T² R₂₃ / (1 - R₁₂ R₂₃).

The mean over the wavelengths of a colour channel puts the Fourier transform of its sensitivity at m OPD in the place of
e^{imφ}. A table holds that transform (`sync.nodes.thin_film`). As in Cycles the sum ends at m = 3.
"""

import cmath
import math

from ..core.jit import device, entry
from ..core.memory import load_f32, load_i32, load_i64
from ..core.records import closure_at
from ..core.vec import put, store3_f64
from ..shading.operands import number, triple
from .closure import P_EDGE, P_F0, P_FRESNEL
from .fresnel import FRESNEL_CONDUCTOR, FRESNEL_F82, FRESNEL_SCHLICK, f0_from_ior, f82, f82_from_edge
from .nodes import FILM_REFLECTANCE

# A table: below which thickness (nm) the film fades away, entries, nm between them, then for each entry the real parts
# of the transform in red, green and blue and the imaginary ones.
TABLE_HEAD, TABLE_ROW = 3, 6

_THINNEST = 0.1  # nm; what is thinner is no film to Cycles
_TERMS = 3


@entry
def thin_film_op(_scene, _sp, registers, code, at):
    """Out (3: thickness, 0 where there is no film, IOR, table), thickness in nm, IOR, table."""
    thickness = number(registers, code, at + 1)
    thickness = thickness if thickness > _THINNEST else 0.0
    ior = max(number(registers, code, at + 2), 1e-5)
    store3_f64(registers, load_i32(code, at), (thickness, ior, float(load_i32(code, at + 3))))


@device
def has_film(registers, code, at):
    """Whether the operand names a film."""
    return load_i32(code, at) >= 0 and number(registers, code, at) > 0.0


@device
def put_film(scene, c, registers, code, at, outside):
    """Lay the film that an operand names on microfacets that are seen from a medium of the index `outside`.

    Call before their Fresnel model is set. As in Cycles the path in the film is taken for that in a film whose index
    is divided by `outside`.
    """
    if not has_film(registers, code, at):
        return
    thickness, ior, table = triple(registers, code, at)
    c.film = load_i64(scene.shader_entries, FILM_REFLECTANCE)
    c.film_table = scene.tables + 4 * int(table)
    c.film_thickness = thickness
    c.film_ior = ior / outside


@entry
def film_reflectance(closure, _a, _b, _c, _d):
    """Put the reflectance (rgb) of microfacets under a film, at the angle of `film_cosine`, into the closure."""
    c = closure_at(closure, 0)
    cosine, n = c.film_cosine, _faded(c)
    cos_2 = 1.0 - (1.0 - cosine * cosine) / (n * n)
    if cos_2 <= 0.0:  # total reflection on the film
        put(c.film_reflectance, (1.0, 1.0, 1.0))
        return
    cos_2 = math.sqrt(cos_2)
    path = 2.0 * n * c.film_thickness * cos_2
    upper_s, upper_p = _amplitudes(1.0, cosine, complex(n, 0.0))
    kind = c.p[P_FRESNEL]
    for k in range(3):
        below = _below(c, k)
        lower_s, lower_p = _amplitudes(n, cos_2, below)
        squared_s, squared_p = _squared(lower_s), _squared(lower_p)
        if kind == FRESNEL_F82:
            # Phases are those of the metal; the reflectance is the artist's curve, which ends at the same edge.
            f0 = _squared(_amplitudes(n, 1.0, below)[0])
            squared_s = f82(cos_2, f0, f82_from_edge(f0, f82(1.0 / 7.0, c.p[P_F0 + k], c.p[P_EDGE + k])))
            squared_p = squared_s
        value = 0.5 * _mean(c, k, path, upper_s.real, lower_s, squared_s)
        value += 0.5 * _mean(c, k, path, upper_p.real, lower_p, squared_p)
        value = min(max(value, 0.0), 1.0)
        if kind == FRESNEL_SCHLICK:
            value = _tinted(value, c.p[P_F0 + k], f0_from_ior(c.ior))
        c.film_reflectance[k] = value


@device
def _faded(c):
    """The film's index, which becomes that of the outside where the film is too thin to be one."""
    thinnest = load_f32(c.film_table, 0)
    t = min(c.film_thickness / thinnest, 1.0)
    return 1.0 + (c.film_ior - 1.0) * t * t * (3.0 - 2.0 * t)


@device
def _below(c, k):
    """The index of refraction n + ik under the film in a channel.

    A metal given by its colours has that of Gulbrandsen 2014, "Artist Friendly Metallic Fresnel", for the reflectance
    at normal incidence r and the one at cosine 1/7 as edge tint.
    """
    kind = c.p[P_FRESNEL]
    if kind == FRESNEL_CONDUCTOR:
        return complex(c.p[P_F0 + k], c.p[P_EDGE + k])
    if kind != FRESNEL_F82:
        return complex(c.ior, 0.0)
    r = min(c.p[P_F0 + k], 0.999)
    edge = f82(1.0 / 7.0, c.p[P_F0 + k], c.p[P_EDGE + k])
    root = math.sqrt(r)
    n = (1.0 - edge) * (1.0 + root) / (1.0 - root) + edge * (1.0 - r) / (1.0 + r)
    return complex(n, math.sqrt(max((r * (n + 1.0) * (n + 1.0) - (n - 1.0) * (n - 1.0)) / (1.0 - r), 0.0)))


@device
def _amplitudes(n, cosine, below):
    """Reflected amplitudes of light (s, p) that comes through a medium of index n upon one of complex index."""
    q = cmath.sqrt(below * below - n * n * (1.0 - cosine * cosine))
    a, b = n * cosine, below * below * cosine
    return (a - q) / (a + q), (b - n * q) / (b + n * q)


@device
def _squared(z):
    return z.real * z.real + z.imag * z.imag


@device
def _mean(c, k, path, upper, lower, squared):
    """The mean reflectance over channel k: amplitude of the upper side, phase and squared amplitude of the lower."""
    r12 = upper * upper
    through = 1.0 - r12
    shown = through * through * squared / max(1.0 - r12 * squared, 1e-12)
    phase = lower if upper < 0.0 else -lower
    size = abs(phase)
    phase = phase / size if size > 0.0 else complex(1.0, 0.0)
    total = r12 + shown
    power = complex(2.0 * (shown - through), 0.0)
    step = phase * math.sqrt(r12 * squared)
    for m in range(_TERMS):
        power *= step
        re, im = _transform(c.film_table, k, (m + 1.0) * path)
        total += power.real * re - power.imag * im
    return total


@device
def _transform(table, k, path):
    """(real, imaginary part) of the Fourier transform of channel k's sensitivity at a path difference in nm."""
    count = int(load_f32(table, 1))
    x = min(path / load_f32(table, 2), count - 1.0)
    i = min(int(x), count - 2)
    x -= i
    at = TABLE_HEAD + TABLE_ROW * i + k
    re, im = load_f32(table, at), load_f32(table, at + 3)
    re += (load_f32(table, at + TABLE_ROW) - re) * x
    return re, im + (load_f32(table, at + TABLE_ROW + 3) - im) * x


@device
def _tinted(value, f0, real):
    """A dielectric's reflectance scaled as the artist scales it at normal incidence, by less the nearer it is to 1."""
    if real <= 1e-5 or value >= 1.0:
        return value
    t = min(max((1.0 - value) / (1.0 - real), 0.0), 1.0)
    return value * (1.0 + (f0 / real - 1.0) * t)
