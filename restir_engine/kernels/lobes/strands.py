"""What the hair nodes' instructions do: lobes of fibres from artists' inputs.

Pigments: Chiang et al. 2016, eq. 9 (colour) and §6.1 (melanin, with Bitterli's remapping of its two kinds).
"""

import math

from ..core.jit import device, entry
from ..core.memory import load_i32
from ..core.records import RAY_NO_REFLECTION, RAY_NO_REFRACTION, SHAPE_STRANDS, closure_at, scene_at, shading_point_at
from ..core.vec import mul, put, vec
from ..shading.math_ops import clamp
from ..shading.operands import number, triple
from .chiang import albedo_roughness_factor, chiang_albedo, logistic_scale, longitudinal_variance
from .closure import LOBE_FIBRE, LOBE_FIBRE_REFLECTION, LOBE_FIBRE_TRANSMISSION
from .fibre import P_SIGMA, P_TILT, P_WIDTH_R, add_fibre
from .hair import P_SIDE
from .huang import P_R, P_SPAN, huang_albedo, set_seed
from .nodes import CHIANG_LOBE, HAIR_COLOR, HAIR_LOBE, HAIR_MELANIN, HUANG_LOBE

_NARROWEST = 0.001
_NEAR = 0.01  # half of the part of a strand's width that Huang's lobe is the mean over; meshes have no width: all of it
# Absorption of eumelanin and pheomelanin in red, green, blue, by the strand's radius at a concentration of 1.
_EUMELANIN, _PHEOMELANIN = (0.506, 0.841, 1.653), (0.343, 0.733, 1.924)


@device
def _sigma_of_color(color, beta):
    """Absorption by which a mass of hair has a colour, eq. 9."""
    k = 1.0 / albedo_roughness_factor(beta)
    r, g, b = (
        math.log(clamp(color[0], 1e-5, 1.0)),
        math.log(clamp(color[1], 1e-5, 1.0)),
        math.log(clamp(color[2], 1e-5, 1.0)),
    )
    return (r * k) ** 2, (g * k) ** 2, (b * k) ** 2


@device
def _absorption(registers, code, at, parametrization, beta, spread):
    """Absorption by the operands colour, melanin, redness, tint, coefficient, random colour; spread: -1 … 1."""
    if parametrization == HAIR_COLOR:
        return _sigma_of_color(triple(registers, code, at), beta)
    if parametrization != HAIR_MELANIN:
        a = triple(registers, code, at + 4)
        return max(a[0], 0.0), max(a[1], 0.0), max(a[2], 0.0)
    amount = number(registers, code, at + 1) * (1.0 + spread * clamp(number(registers, code, at + 5), 0.0, 1.0))
    amount = -math.log(max(1.0 - max(amount, 0.0), 1e-4))
    red = clamp(number(registers, code, at + 2), 0.0, 1.0)
    tint = _sigma_of_color(triple(registers, code, at + 3), beta)
    dark, red = amount * (1.0 - red), amount * red
    return (
        tint[0] + dark * _EUMELANIN[0] + red * _PHEOMELANIN[0],
        tint[1] + dark * _EUMELANIN[1] + red * _PHEOMELANIN[1],
        tint[2] + dark * _EUMELANIN[2] + red * _PHEOMELANIN[2],
    )


@device
def _put_pigment(c, sigma, tilt, ior):
    for k in range(3):
        c.p[P_SIGMA + k] = sigma[k]
    c.p[P_TILT] = tilt
    c.ior = max(ior, 1e-5)


@entry
def chiang_op(scene, sp, registers, code, at):
    """Principled Hair by Chiang: colour, melanin, redness, tint, coefficient, random colour, random, random roughness,
    roughness, IOR, offset, radial roughness, coat; parametrization.
    """
    scene, sp = scene_at(scene, 0), shading_point_at(sp, 0)
    weight = triple(registers, code, at)
    spread = 2.0 * (number(registers, code, at + 7) - 0.5)
    factor = 1.0 + spread * clamp(number(registers, code, at + 8), 0.0, 1.0)
    along, radial = number(registers, code, at + 9) * factor, number(registers, code, at + 12) * factor
    i = add_fibre(scene, sp, LOBE_FIBRE, weight, vec(sp.dpdu), CHIANG_LOBE)
    if i < 0:
        return
    c = closure_at(sp.closures, i)
    sigma = _absorption(registers, code, at + 1, load_i32(code, at + 14), radial, spread)
    _put_pigment(c, sigma, number(registers, code, at + 11), number(registers, code, at + 10))
    along, radial = clamp(along, _NARROWEST, 1.0), clamp(radial, _NARROWEST, 1.0)
    first = clamp((1.0 - clamp(number(registers, code, at + 13), 0.0, 1.0)) * along, _NARROWEST, 1.0)
    c.alpha_x = longitudinal_variance(along)
    c.alpha_y = logistic_scale(radial)
    c.p[P_WIDTH_R] = longitudinal_variance(first)
    put(c.albedo, chiang_albedo(c, c.alpha_x))


@entry
def huang_op(scene, sp, registers, code, at):
    """Principled Hair by Huang: as Chiang's up to the offset, then scales of R, TT, TRT; parametrization."""
    scene, sp = scene_at(scene, 0), shading_point_at(sp, 0)
    if (
        max(number(registers, code, at + 12), max(number(registers, code, at + 13), number(registers, code, at + 14)))
        <= 0.0
    ):
        return
    spread = 2.0 * (number(registers, code, at + 7) - 0.5)
    roughness = number(registers, code, at + 9) * (1.0 + spread * clamp(number(registers, code, at + 8), 0.0, 1.0))
    i = add_fibre(scene, sp, LOBE_FIBRE, triple(registers, code, at), vec(sp.dpdu), HUANG_LOBE)
    if i < 0:
        return
    c = closure_at(sp.closures, i)
    sigma = _absorption(registers, code, at + 1, load_i32(code, at + 15), roughness, spread)
    _put_pigment(c, sigma, -number(registers, code, at + 11), number(registers, code, at + 10))
    c.alpha_x = c.alpha_y = clamp(roughness, _NARROWEST, 1.0)
    for k in range(3):
        c.p[P_R + k] = max(number(registers, code, at + 12 + k), 0.0)
    c.p[P_SPAN] = _NEAR if sp.shape >= SHAPE_STRANDS else 1.0
    c.film_table = scene.lobe_tables
    set_seed(c, sp)
    put(c.albedo, huang_albedo(c, c.alpha_x))


@entry
def hair_op(scene, sp, registers, code, at):
    """Hair BSDF: colour, offset, roughness along and around, tangent; component."""
    scene, sp = scene_at(scene, 0), shading_point_at(sp, 0)
    reflects = load_i32(code, at + 6) == 0
    if sp.ray_flags & (RAY_NO_REFLECTION if reflects else RAY_NO_REFRACTION):
        return
    tangent, offset = vec(sp.dpdu), -number(registers, code, at + 2)
    if load_i32(code, at + 5) >= 0:
        tangent = triple(registers, code, at + 5)
    elif sp.shape < SHAPE_STRANDS:  # as Cycles has it
        tangent, offset = vec(sp.dpdv), 0.0
    weight = mul(triple(registers, code, at), triple(registers, code, at + 1))
    kind = LOBE_FIBRE_REFLECTION if reflects else LOBE_FIBRE_TRANSMISSION
    i = add_fibre(scene, sp, kind, weight, tangent, HAIR_LOBE)
    if i < 0:
        return
    c = closure_at(sp.closures, i)
    c.alpha_x = clamp(number(registers, code, at + 3), _NARROWEST, 1.0)
    c.alpha_y = clamp(number(registers, code, at + 4), _NARROWEST, 1.0)
    c.p[P_TILT] = offset
    for k in range(3):
        c.p[P_SIDE + k] = sp.ng[k]
