"""From what an artist sets (colour, length, anisotropy) to a medium: extinction σ_t and single-scattering albedo α.

Two maps exist, both index-matched. KULLA_CONTY takes a colour as the albedo of a semi-infinite medium under diffuse
light (`van_de_hulst`) and a length as the mean free path 1/σ_t. LEGACY is the fit of Chiang et al. 2016, "Practical and
Controllable Subsurface Scattering", extended to g by Wrenninge et al. 2017; its length is the *reduced* mean free path.

Functions of colours take and return rgb; lengths are in scene units, σ_t in 1 by scene unit.
"""

import math

from ..core.jit import device, inlined
from .van_de_hulst import similarity

# What artists choose from, as immediates of the instructions that make LOBE_SUBSURFACE.
BURLEY, RANDOM_WALK, RANDOM_WALK_LEGACY, RANDOM_WALK_SKIN = 0, 1, 2, 3
METHODS = {
    "BURLEY": BURLEY,
    "RANDOM_WALK": RANDOM_WALK,
    "RANDOM_WALK_LEGACY": RANDOM_WALK_LEGACY,
    "RANDOM_WALK_SKIN": RANDOM_WALK_SKIN,
}
POSITIVE, ANY_SIGN = 0, 1  # anisotropies that count: those below 0 are 0, or are backward scattering

MAX_ALBEDO = 0.999999
_SHORTEST, _LONGEST = 1e-16, 1e10  # lengths, scene units
_COMPATIBLE = 0.25 / math.pi  # makes the diffusion models of old of the same look

# The coefficients of LEGACY by ascending powers of g; of B and E below the exponent's, which has no constant.
_A = (1.8260523782, -1.28451056436, -1.79904629312, 9.19393289202,
      -22.8215585862, 32.0234874259, -23.6264803333, 7.21067002658)  # fmt: skip
_B = (0.0, 31.1491581433, -201.847017512, 841.576016723, -2018.09288505, 2731.71560286, -1935.41424244, 559.009054474)
_C = (1.09686102424, -0.394704063468, 1.05258115941, -8.83963712726,
      28.8643230661, -46.8802913581, 38.5402837518, -12.7181042538)  # fmt: skip
_D = (0.496310210422, 0.360146581622, -2.15139309747, 17.8896899217,
      -55.2984010333, 82.065982243, -58.5106008578, 15.8478295021)  # fmt: skip
_E = (0.0, 76.7316253952, -594.356773233, 2448.8834203, -5576.68528998, 7116.60171912, -4763.54467887, 1303.5318055)
_F = (2.40602999408, -2.51814844609, 9.18494908356, -79.2191708682,
      259.082868209, -403.613804597, 302.85712436, -87.4370473567)  # fmt: skip


_similarity = inlined(similarity)


@device
def _polynomial(c, x):
    """Σ c_k x^k of eight coefficients."""
    high = c[4] + x * (c[5] + x * (c[6] + x * c[7]))
    return c[0] + x * (c[1] + x * (c[2] + x * (c[3] + x * high)))


@device
def _kulla_conty(color, g):
    s = _similarity(color)
    return min(max((1.0 - s * s) / (1.0 - g * s * s), 0.0), MAX_ALBEDO)


@device
def kulla_conty_albedo(color, g):
    """α (rgb) of the medium that many scatterings make of this colour under diffuse light."""
    return _kulla_conty(color[0], g), _kulla_conty(color[1], g), _kulla_conty(color[2], g)


@device
def _legacy(color, a, b, c, d, e, f):
    blend = math.sqrt(math.sqrt(color))
    alpha = (1.0 - blend) * a * math.atan(b * color) ** c + blend * d * math.atan(e * color) ** f
    return min(max(alpha, 0.0), MAX_ALBEDO)


@device
def legacy_albedo(color, g):
    """α (rgb) by the fit of Cycles before Blender 5.2, for g in [0, 0.9]."""
    a, c, d, f = _polynomial(_A, g), _polynomial(_C, g), _polynomial(_D, g), _polynomial(_F, g)
    b = 4.98511194385 + 0.127355959438 * math.exp(_polynomial(_B, g))
    e = 4.23190299701 + 0.00310603949088 * math.exp(_polynomial(_E, g))
    return (
        _legacy(color[0], a, b, c, d, e, f),
        _legacy(color[1], a, b, c, d, e, f),
        _legacy(color[2], a, b, c, d, e, f),
    )


@device
def _reduced_albedo(color, beta):
    """α′ with R_d(α′) = ½ α′ (1 + e^{-β s}) e^{-s} = color, s = √(3 (1 - α′)), to Cycles' twelve bisections."""
    if color < 1e-4:
        return 0.0
    if color >= 0.995:
        return MAX_ALBEDO
    low, high = 0.0, 1.0
    middle = 0.5
    for _ in range(12):
        middle = 0.5 * (low + high)
        s = math.sqrt(3.0 * (1.0 - middle))
        if 0.5 * middle * (1.0 + math.exp(-beta * s)) * math.exp(-s) < color:
            low = middle
        else:
            high = middle
    return middle


@device
def skin_scale(color, ior):
    """What RANDOM_WALK_SKIN scales lengths by (rgb): √(3 (1 - α′)), α′ of the dipole that has this colour.

    Jensen et al. 2001, "A Practical Model for Subsurface Light Transport", eq. 15, with its fit of F_dr.
    """
    fresnel = -1.44 / (ior * ior) + 0.71 / ior + 0.668 + 0.0636 * ior
    beta = 4.0 / 3.0 * (1.0 + fresnel) / (1.0 - fresnel)
    return (
        math.sqrt(3.0 * (1.0 - _reduced_albedo(color[0], beta))),
        math.sqrt(3.0 * (1.0 - _reduced_albedo(color[1], beta))),
        math.sqrt(3.0 * (1.0 - _reduced_albedo(color[2], beta))),
    )


@device
def clamp_anisotropy(g, method, sign):
    """g in the range that Cycles allows a method; `sign` is POSITIVE or ANY_SIGN."""
    return min(max(g, -0.99 if sign == ANY_SIGN else 0.0), 0.99 if method == RANDOM_WALK else 0.9)


@device
def method_length(radius, color, ior, method):
    """The length (rgb) that a method makes of the artist's radius: what `medium` is to be given."""
    if method == RANDOM_WALK:
        return radius
    if method == RANDOM_WALK_SKIN:
        x, y, z = skin_scale(color, ior)
        return radius[0] * x, radius[1] * y, radius[2] * z
    return radius[0] * _COMPATIBLE, radius[1] * _COMPATIBLE, radius[2] * _COMPATIBLE


@device
def medium(color, length, g, method):
    """(σ_t rgb, α rgb) of a method's medium: KULLA_CONTY for RANDOM_WALK, and for all when g is negative, else LEGACY.

    `color` is rgb ≥ 0, `length` comes from `method_length`, g from `clamp_anisotropy`.
    """
    reduced = 1.0
    if method == RANDOM_WALK or g < 0.0:
        alpha = kulla_conty_albedo(color, g)
    else:
        alpha = legacy_albedo(color, g)
        reduced = 1.0 / (1.0 - g)
    return (
        reduced / min(max(length[0], _SHORTEST), _LONGEST),
        reduced / min(max(length[1], _SHORTEST), _LONGEST),
        reduced / min(max(length[2], _SHORTEST), _LONGEST),
    ), alpha
