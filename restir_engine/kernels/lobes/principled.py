"""The Principled BSDF: layers from the top down, each leaving to the next what it does not reflect.

Alpha, sheen, coat (with its tint), emission, metal, transmission, dielectric reflection, subsurface scattering and
diffuse.
"""

import math

from ..core.jit import device, entry
from ..core.memory import load_i32
from ..core.records import (
    RAY_NO_LOBES,
    RAY_NO_REFLECTION,
    RAY_NO_REFRACTION,
    RAY_SHADOW,
    closure_at,
    scene_at,
    shading_point_at,
)
from ..core.vec import add, dot, is_black, lerp, mul, normalize, put, scale, vec
from ..shading.math_ops import clamp
from ..shading.operands import number, triple
from ..subsurface.parameters import RANDOM_WALK_SKIN
from .albedo import cover, layer_under, microfacet_albedo, preserve_energy
from .closure import LOBE_GLASS, LOBE_REFLECTION, P_FRESNEL, WEIGHT_CUTOFF, valid_reflection_normal
from .diffuse import add_diffuse
from .fresnel import FRESNEL_DIELECTRIC, dielectric_average, f0_from_ior, ior_from_f0
from .nodes import BSDF_NODES, GGX, MULTI_GGX
from .setup import (
    add_microfacets,
    add_transparent,
    lower,
    normal_input,
    positive,
    principled_alpha,
    set_f82,
    set_schlick,
    tangent_input,
)
from .sheen import add_sheen
from .subsurface import add_subsurface, radius_input
from .thin import add_thin_glass, add_thin_subsurface
from .thin_film import has_film, put_film

_NODE = BSDF_NODES["ShaderNodeBsdfPrincipled"]
_BASE_COLOR, _METALLIC, _ROUGHNESS = _NODE.operand("Base Color"), _NODE.operand("Metallic"), _NODE.operand("Roughness")
_IOR, _ALPHA, _NORMAL = _NODE.operand("IOR"), _NODE.operand("Alpha"), _NODE.operand("Normal")
_DIFFUSE_ROUGHNESS = _NODE.operand("Diffuse Roughness")
_SPECULAR_LEVEL, _SPECULAR_TINT = _NODE.operand("Specular IOR Level"), _NODE.operand("Specular Tint")
_ANISOTROPIC, _ROTATION = _NODE.operand("Anisotropic"), _NODE.operand("Anisotropic Rotation")
_TANGENT, _TRANSMISSION = _NODE.operand("Tangent"), _NODE.operand("Transmission Weight")
_COAT, _COAT_ROUGHNESS = _NODE.operand("Coat Weight"), _NODE.operand("Coat Roughness")
_COAT_IOR, _COAT_TINT, _COAT_NORMAL = (
    _NODE.operand("Coat IOR"),
    _NODE.operand("Coat Tint"),
    _NODE.operand("Coat Normal"),
)
_SHEEN, _SHEEN_ROUGHNESS = _NODE.operand("Sheen Weight"), _NODE.operand("Sheen Roughness")
_SHEEN_TINT = _NODE.operand("Sheen Tint")
_EMISSION, _EMISSION_STRENGTH = _NODE.operand("Emission Color"), _NODE.operand("Emission Strength")
_THIN_WALL = _NODE.operand("Thin Wall")
_SUBSURFACE, _RADIUS = _NODE.operand("Subsurface Weight"), _NODE.operand("Subsurface Radius")
_SCALE, _SUBSURFACE_IOR = _NODE.operand("Subsurface Scale"), _NODE.operand("Subsurface IOR")
_SUBSURFACE_ANISOTROPY = _NODE.operand("Subsurface Anisotropy")
_FILM = _NODE.operand("Thin Film")
_DISTRIBUTION = 1 + len(_NODE.inputs)
_METHOD, _ENTRY, _SIGN = _DISTRIBUTION + 1, _DISTRIBUTION + 2, _DISTRIBUTION + 3
_FILM_ON_METAL = _DISTRIBUTION + 4


@entry
def principled_op(scene, sp, registers, code, at):
    """Closures, transparency and emission of a Principled BSDF."""
    scene = scene_at(scene, 0)
    sp = shading_point_at(sp, 0)
    weight = triple(registers, code, at)
    alpha = clamp(number(registers, code, at + _ALPHA), 0.0, 1.0)
    if alpha < 1.0:
        add_transparent(sp, scale(weight, 1.0 - alpha))
        weight = scale(weight, alpha)
    thin = number(registers, code, at + _THIN_WALL) != 0.0
    flags = sp.ray_flags
    if flags & RAY_SHADOW and not thin:
        return
    first = sp.n_closures
    n = normal_input(sp, registers, code, at + _NORMAL)
    if not (flags & RAY_NO_LOBES and is_black(triple(registers, code, at + _EMISSION)) and not thin):
        weight = _coverings(scene, sp, registers, code, at, n, weight)
        color, strength = triple(registers, code, at + _EMISSION), number(registers, code, at + _EMISSION_STRENGTH)
        put(sp.emission, add(vec(sp.emission), mul(scale(color, strength), weight)))
    if not flags & RAY_NO_LOBES or thin:
        _body(scene, sp, registers, code, at, n, weight, thin)
    if flags & RAY_NO_LOBES:
        sp.n_closures = first


@device
def _coverings(scene, sp, registers, code, at, n, weight):
    """Sheen and coat; the weight that is left under them."""
    coat = max(number(registers, code, at + _COAT), 0.0)
    sheen = max(number(registers, code, at + _SHEEN), 0.0)
    if coat <= WEIGHT_CUTOFF and sheen <= WEIGHT_CUTOFF:
        return weight
    coat_normal = normal_input(sp, registers, code, at + _COAT_NORMAL)
    if sheen > WEIGHT_CUTOFF:
        tint = positive(triple(registers, code, at + _SHEEN_TINT))
        middle = normalize(lerp(n, coat_normal, min(coat, 1.0)))
        roughness = clamp(number(registers, code, at + _SHEEN_ROUGHNESS), 0.0, 1.0)
        i = add_sheen(sp, scene.lobe_tables, mul(scale(tint, sheen), weight), middle, roughness)
        if i >= 0:
            weight = cover(weight, vec(closure_at(sp.closures, i).weight))
    if coat > WEIGHT_CUTOFF:
        weight = _coat(scene, sp, registers, code, at, coat, valid_reflection_normal(sp, coat_normal), weight)
    return weight


@device
def _coat(scene, sp, registers, code, at, coat, n, weight):
    """A clear dielectric that absorbs: its tint to the power of the refracted ray's length in a layer of unit depth."""
    wo, tables = vec(sp.wo), scene.lobe_tables
    ior = max(number(registers, code, at + _COAT_IOR), 1.0)
    roughness = clamp(number(registers, code, at + _COAT_ROUGHNESS), 0.0, 1.0)
    alpha = roughness * roughness
    i = -1
    if sp.ray_flags & RAY_NO_REFLECTION == 0:
        i = add_microfacets(sp, LOBE_REFLECTION, scale(weight, coat), n, n, alpha, alpha, ior, GGX)
    if i >= 0:
        c = closure_at(sp.closures, i)
        c.p[P_FRESNEL] = FRESNEL_DIELECTRIC
        r, _g, _b, _t0, _t1, _t2 = microfacet_albedo(tables, c, wo)
        c.sample_weight *= r
        fss = dielectric_average(ior)
        preserve_energy(tables, c, wo, (fss, fss, fss))
        weight = layer_under(tables, c, wo, weight)
    tint = positive(triple(registers, code, at + _COAT_TINT))
    if tint[0] == 1.0 and tint[1] == 1.0 and tint[2] == 1.0:
        return weight
    cosine = dot(wo, n)
    depth = 1.0 / math.sqrt(max(1.0 - (1.0 - cosine * cosine) / (ior * ior), 1e-12))
    absorbed = (tint[0] ** depth, tint[1] ** depth, tint[2] ** depth)
    return mul(weight, lerp((1.0, 1.0, 1.0), absorbed, coat))


@device
def _body(scene, sp, registers, code, at, n, weight, thin):
    """Metal, transmission, dielectric reflection, subsurface scattering and diffuse."""
    wo, tables = vec(sp.wo), scene.lobe_tables
    base = positive(triple(registers, code, at + _BASE_COLOR))
    clamped = lower(base, 1.0)
    tint = positive(triple(registers, code, at + _SPECULAR_TINT))
    roughness = clamp(number(registers, code, at + _ROUGHNESS), 0.0, 1.0)
    anisotropy = clamp(number(registers, code, at + _ANISOTROPIC), 0.0, 1.0)
    anisotropy = anisotropy if load_i32(code, at + _TANGENT) >= 0 else 0.0
    alpha_x, alpha_y = principled_alpha(roughness, anisotropy)
    t = tangent_input(registers, code, at + _TANGENT, n, number(registers, code, at + _ROTATION))
    valid = valid_reflection_normal(sp, n)
    multiple = load_i32(code, at + _DISTRIBUTION) == MULTI_GGX

    metallic = clamp(number(registers, code, at + _METALLIC), 0.0, 1.0)
    if metallic > WEIGHT_CUTOFF:
        i = -1
        if sp.ray_flags & RAY_NO_REFLECTION == 0:
            metal = scale(weight, metallic)
            i = add_microfacets(sp, LOBE_REFLECTION, metal, valid, t, alpha_x, alpha_y, 1.0, GGX)
        if i >= 0:
            c = closure_at(sp.closures, i)
            if load_i32(code, at + _FILM_ON_METAL) == 1:
                put_film(scene, c, registers, code, at + _FILM, 1.0)
            set_f82(tables, c, wo, clamped, lower(tint, 1.0), multiple)
        weight = scale(weight, 1.0 - metallic)

    ior = max(number(registers, code, at + _IOR), 1e-5)
    transmission = clamp(number(registers, code, at + _TRANSMISSION), 0.0, 1.0)
    if transmission > WEIGHT_CUTOFF:
        glass = scale(weight, transmission)
        _transmission(scene, sp, registers, code, at, glass, valid, roughness, ior, tint, clamped, multiple, thin)
        weight = scale(weight, 1.0 - transmission)

    f0, eta = _leveled(ior, max(number(registers, code, at + _SPECULAR_LEVEL), 0.0))
    i = -1
    if (eta != 1.0 or has_film(registers, code, at + _FILM)) and not sp.ray_flags & RAY_NO_REFLECTION:
        i = add_microfacets(sp, LOBE_REFLECTION, weight, valid, t, alpha_x, alpha_y, eta, GGX)
    if i >= 0:
        c = closure_at(sp.closures, i)
        put_film(scene, c, registers, code, at + _FILM, 1.0)
        set_schlick(tables, c, wo, scale(tint, f0), (1.0, 1.0, 1.0), (0.0, 0.0, 0.0), multiple)
        weight = layer_under(tables, c, wo, weight)

    diffuse_roughness = clamp(number(registers, code, at + _DIFFUSE_ROUGHNESS), 0.0, 1.0)
    inside = clamp(number(registers, code, at + _SUBSURFACE), 0.0, 1.0)
    if inside > WEIGHT_CUTOFF:
        below = mul(clamped, scale(weight, inside))
        if thin:
            g = number(registers, code, at + _SUBSURFACE_ANISOTROPY)
            add_thin_subsurface(sp, below, n, g, diffuse_roughness, clamped)
        else:
            _subsurface(sp, registers, code, at, below, n, clamped, roughness, eta)
        weight = scale(weight, 1.0 - inside)
    add_diffuse(sp, mul(base, weight), n, diffuse_roughness, base)


@device
def _transmission(scene, sp, registers, code, at, weight, n, roughness, ior, tint, color, multiple, thin):
    """Glass, solid or as a thin sheet; the colour counts once for the way in and out of a solid."""
    tables = scene.lobe_tables
    mirrored, half = (1.0, 1.0, 1.0), (math.sqrt(color[0]), math.sqrt(color[1]), math.sqrt(color[2]))
    if sp.ray_flags & RAY_NO_REFLECTION:
        mirrored = (0.0, 0.0, 0.0)
    if sp.ray_flags & RAY_NO_REFRACTION:
        half = (0.0, 0.0, 0.0)
        if is_black(mirrored):
            return
    alpha = roughness * roughness
    if thin:
        add_thin_glass(scene, sp, registers, code, at + _FILM, weight, n, alpha, ior, tint, color)
        return
    eta = 1.0 / ior if sp.backfacing else ior
    i = add_microfacets(sp, LOBE_GLASS, weight, n, n, alpha, alpha, eta, GGX)
    if i >= 0:
        c = closure_at(sp.closures, i)
        put_film(scene, c, registers, code, at + _FILM, ior if sp.backfacing else 1.0)
        set_schlick(tables, c, vec(sp.wo), scale(tint, f0_from_ior(ior)), mirrored, half, multiple)


@device
def _leveled(ior, level):
    """(F0, IOR) of the dielectric, whose F0 is scaled by twice Specular IOR Level."""
    f0 = f0_from_ior(ior)
    if level == 0.5:
        return f0, ior
    f0 *= 2.0 * level
    eta = ior_from_f0(f0)
    return f0, 1.0 / eta if ior < 1.0 else eta


@device
def _subsurface(sp, registers, code, at, weight, n, color, roughness, eta):
    """What scatters below: under the dielectric's own IOR, or for skin the one that its lengths are made for."""
    radius = radius_input(registers, code, at + _RADIUS, at + _SCALE)
    method = load_i32(code, at + _METHOD)
    ior = number(registers, code, at + _SUBSURFACE_IOR) if method == RANDOM_WALK_SKIN else eta
    g = number(registers, code, at + _SUBSURFACE_ANISOTROPY)
    entry, sign = load_i32(code, at + _ENTRY), load_i32(code, at + _SIGN)
    add_subsurface(sp, weight, n, color, radius, roughness * roughness, ior, g, method, entry, sign)
