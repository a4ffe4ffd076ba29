"""What the BSDF nodes' instructions do: closures from their inputs. Principled has its own module."""

from ..core.jit import device, entry
from ..core.memory import load_i32
from ..core.records import RAY_NO_LOBES, RAY_NO_REFLECTION, RAY_NO_REFRACTION, closure_at, scene_at, shading_point_at
from ..core.vec import add, average, is_black, mul, normalize, put, vec
from ..shading.math_ops import clamp
from ..shading.operands import number, triple
from .albedo import microfacet_albedo, preserve_energy
from .closure import (
    LOBE_ASHIKHMIN_SHIRLEY,
    LOBE_GLASS,
    LOBE_REFLECTION,
    LOBE_REFRACTION,
    LOBE_TRANSLUCENT,
    LOBE_TRANSPARENT,
    P_DISTRIBUTION,
    P_EDGE,
    P_ENERGY,
    P_F0,
    P_FRESNEL,
    P_REFLECTION,
    P_TRANSMISSION,
    WEIGHT_CUTOFF,
    add_closure,
    rotate,
    tangent_frame,
    valid_reflection_normal,
)
from .diffuse import add_diffuse
from .fresnel import (
    FRESNEL_CONDUCTOR,
    FRESNEL_F82,
    FRESNEL_NONE,
    FRESNEL_SCHLICK,
    conductor_average,
    dielectric_average,
    f0_from_ior,
    f82_average,
    f82_from_tint,
)
from .nodes import ASHIKHMIN_SHIRLEY, BECKMANN, MULTI_GGX
from .sheen import add_sheen, add_velvet
from .thin_film import put_film
from .toon import add_toon

_TWO_PI = 6.283185307179586


@device
def normal_input(sp, registers, code, at):
    """The unit normal that an operand names; the smooth normal when it is -1 or of no length."""
    if load_i32(code, at) < 0:
        return vec(sp.n)
    n = normalize(triple(registers, code, at))
    return vec(sp.n) if is_black(n) else n


@device
def tangent_input(registers, code, at, axis, turns):
    """The tangent that an operand names, turned about an axis; zero when it is -1."""
    if load_i32(code, at) < 0:
        return (0.0, 0.0, 0.0)
    t = triple(registers, code, at)
    return t if turns == 0.0 else rotate(t, axis, turns * _TWO_PI)


@device
def put_p(c, at, v):
    """Store a colour among the closure's parameters."""
    c.p[at] = v[0]
    c.p[at + 1] = v[1]
    c.p[at + 2] = v[2]


@device
def add_microfacets(sp, kind, weight, n, t, alpha_x, alpha_y, ior, distribution):
    """Append microfacets without Fresnel; the closure's index or -1."""
    i = add_closure(sp, kind, weight, n)
    if i < 0:
        return -1
    c = closure_at(sp.closures, i)
    c.alpha_x = clamp(alpha_x, 0.0, 1.0)
    c.alpha_y = clamp(alpha_y, 0.0, 1.0)
    c.ior = ior
    if c.alpha_x != c.alpha_y:
        x, _y = tangent_frame(n, t)
        put(c.t, x)
    c.p[P_DISTRIBUTION] = 1.0 if distribution == BECKMANN else 0.0
    c.p[P_FRESNEL] = FRESNEL_NONE
    c.p[P_ENERGY] = 1.0
    c.film = 0
    return i


@device
def _finish(tables, c, wo, multiple, fss):
    """What a Fresnel model makes of the sampling weight, and energy compensation for multi-scattering GGX."""
    r0, r1, r2, t0, t1, t2 = microfacet_albedo(tables, c, wo)
    c.sample_weight *= average((r0 + t0, r1 + t1, r2 + t2))
    if multiple:
        preserve_energy(tables, c, wo, fss)


@device
def set_f82(tables, c, wo, f0, tint, multiple):
    """Make microfacets a metal of a colour and a tint at the edge."""
    b = (f82_from_tint(f0[0], tint[0]), f82_from_tint(f0[1], tint[1]), f82_from_tint(f0[2], tint[2]))
    c.p[P_FRESNEL] = FRESNEL_F82
    put_p(c, P_F0, f0)
    put_p(c, P_EDGE, b)
    _finish(tables, c, wo, multiple, (f82_average(f0[0], b[0]), f82_average(f0[1], b[1]), f82_average(f0[2], b[2])))


@device
def set_conductor(tables, c, wo, n, k, multiple):
    """Make microfacets a metal with an index of refraction n + ik."""
    c.p[P_FRESNEL] = FRESNEL_CONDUCTOR
    put_p(c, P_F0, n)
    put_p(c, P_EDGE, k)
    fss = (conductor_average(n[0], k[0]), conductor_average(n[1], k[1]), conductor_average(n[2], k[2]))
    _finish(tables, c, wo, multiple, fss)


@device
def set_schlick(tables, c, wo, f0, reflection, transmission, multiple):
    """Make microfacets a dielectric whose reflectance runs from f0 to 1, with tints of both sides."""
    f0 = (clamp(f0[0], 0.0, 1.0), clamp(f0[1], 0.0, 1.0), clamp(f0[2], 0.0, 1.0))
    c.p[P_FRESNEL] = FRESNEL_SCHLICK
    put_p(c, P_F0, f0)
    put_p(c, P_REFLECTION, reflection)
    put_p(c, P_TRANSMISSION, transmission)
    fss = transmission
    if is_black(transmission):
        real = f0_from_ior(c.ior)
        s = clamp((dielectric_average(c.ior) - real) / max(1.0 - real, 1e-30), 0.0, 1.0)
        fss = mul(reflection, (f0[0] + (1.0 - f0[0]) * s, f0[1] + (1.0 - f0[1]) * s, f0[2] + (1.0 - f0[2]) * s))
    _finish(tables, c, wo, multiple, fss)


@device
def principled_alpha(roughness, anisotropy):
    """(α along the tangent, α across) as Principled and Metallic nodes stretch them."""
    alpha = roughness * roughness
    if anisotropy <= 0.0:
        return alpha, alpha
    aspect = (1.0 - 0.9 * anisotropy) ** 0.5
    return alpha / aspect, alpha * aspect


@device
def lower(a, b):
    """A colour with no channel above b."""
    return (min(a[0], b), min(a[1], b), min(a[2], b))


@device
def positive(a):
    """A colour without negative channels."""
    return (max(a[0], 0.0), max(a[1], 0.0), max(a[2], 0.0))


@device
def add_transparent(sp, weight):
    """Let light straight through: to `sp.transparent`, and one closure for all of it."""
    mean = abs(average(weight))
    if not mean >= WEIGHT_CUTOFF:
        return
    put(sp.transparent, add(vec(sp.transparent), weight))
    if sp.ray_flags & RAY_NO_LOBES:
        return
    for i in range(sp.n_closures):
        c = closure_at(sp.closures, i)
        if c.kind == LOBE_TRANSPARENT:
            put(c.weight, add(vec(c.weight), weight))
            c.sample_weight += mean
            return
    add_closure(sp, LOBE_TRANSPARENT, weight, vec(sp.n))


@entry
def transparent_op(_scene, sp, registers, code, at):
    """Transparent BSDF: colour."""
    add_transparent(shading_point_at(sp, 0), mul(triple(registers, code, at), triple(registers, code, at + 1)))


@entry
def glossy_op(scene, sp, registers, code, at):
    """Glossy BSDF: colour, roughness, anisotropy, rotation, normal, tangent; distribution."""
    scene = scene_at(scene, 0)
    sp = shading_point_at(sp, 0)
    color = triple(registers, code, at + 1)
    alpha = clamp(number(registers, code, at + 2), 0.0, 1.0)
    alpha *= alpha
    anisotropy = clamp(number(registers, code, at + 3), -0.99, 0.99)
    n = valid_reflection_normal(sp, normal_input(sp, registers, code, at + 5))
    alpha_x = alpha_y = alpha
    if abs(anisotropy) > 1e-4 and load_i32(code, at + 6) >= 0:
        stretch = 1.0 - abs(anisotropy)
        alpha_x, alpha_y = (
            (alpha / stretch, alpha * stretch) if anisotropy < 0.0 else (alpha * stretch, alpha / stretch)
        )
    t = tangent_input(registers, code, at + 6, n, number(registers, code, at + 4))
    distribution = load_i32(code, at + 7)
    kind = LOBE_ASHIKHMIN_SHIRLEY if distribution == ASHIKHMIN_SHIRLEY else LOBE_REFLECTION
    weight = mul(triple(registers, code, at), color)
    i = add_microfacets(sp, kind, weight, n, t, alpha_x, alpha_y, 1.0, distribution)
    if i >= 0 and distribution == MULTI_GGX:
        preserve_energy(scene.lobe_tables, closure_at(sp.closures, i), vec(sp.wo), positive(color))


@entry
def metallic_op(scene, sp, registers, code, at):
    """Metallic BSDF: colour, edge tint, n, k, roughness, anisotropy, rotation, normal, tangent, film; distribution,
    model.
    """
    scene = scene_at(scene, 0)
    sp = shading_point_at(sp, 0)
    roughness = clamp(number(registers, code, at + 5), 0.0, 1.0)
    alpha_x, alpha_y = principled_alpha(roughness, clamp(number(registers, code, at + 6), 0.0, 1.0))
    bumped = normal_input(sp, registers, code, at + 8)
    t = tangent_input(registers, code, at + 9, bumped, number(registers, code, at + 7))
    n = valid_reflection_normal(sp, bumped)
    distribution = load_i32(code, at + 11)
    weight = triple(registers, code, at)
    i = add_microfacets(sp, LOBE_REFLECTION, weight, n, t, alpha_x, alpha_y, 1.0, distribution)
    if i < 0:
        return
    c = closure_at(sp.closures, i)
    put_film(scene, c, registers, code, at + 10, 1.0)
    if load_i32(code, at + 12) == 1:
        f0 = lower(positive(triple(registers, code, at + 1)), 1.0)
        tint = lower(positive(triple(registers, code, at + 2)), 1.0)
        set_f82(scene.lobe_tables, c, vec(sp.wo), f0, tint, distribution == MULTI_GGX)
    else:
        ior = positive(triple(registers, code, at + 3))
        extinction = positive(triple(registers, code, at + 4))
        set_conductor(scene.lobe_tables, c, vec(sp.wo), ior, extinction, distribution == MULTI_GGX)


@device
def _interface(sp, kind, weight, registers, code, at, ior, distribution):
    """Microfacets of a Glass or Refraction BSDF between a medium of `ior` and air, whichever side is seen."""
    alpha = clamp(number(registers, code, at + 2), 0.0, 1.0)
    alpha *= alpha
    n = valid_reflection_normal(sp, normal_input(sp, registers, code, at + 4))
    eta = 1.0 / ior if sp.backfacing else ior
    return add_microfacets(sp, kind, weight, n, n, alpha, alpha, eta, distribution)


@entry
def glass_op(scene, sp, registers, code, at):
    """Glass BSDF: colour, roughness, IOR, normal, film; distribution."""
    scene = scene_at(scene, 0)
    sp = shading_point_at(sp, 0)
    mirrored = refracted = positive(triple(registers, code, at + 1))
    if sp.ray_flags & RAY_NO_REFLECTION:
        mirrored = (0.0, 0.0, 0.0)
    if sp.ray_flags & RAY_NO_REFRACTION:
        refracted = (0.0, 0.0, 0.0)
    if is_black(mirrored) and is_black(refracted):
        return
    ior = max(number(registers, code, at + 3), 1e-5)
    distribution = load_i32(code, at + 6)
    i = _interface(sp, LOBE_GLASS, triple(registers, code, at), registers, code, at, ior, distribution)
    if i >= 0:
        f0 = f0_from_ior(ior)
        c = closure_at(sp.closures, i)
        put_film(scene, c, registers, code, at + 5, ior if sp.backfacing else 1.0)
        set_schlick(scene.lobe_tables, c, vec(sp.wo), (f0, f0, f0), mirrored, refracted, distribution == MULTI_GGX)


@entry
def refraction_op(_scene, sp, registers, code, at):
    """Refraction BSDF: colour, roughness, IOR, normal; distribution."""
    sp = shading_point_at(sp, 0)
    weight = mul(triple(registers, code, at), triple(registers, code, at + 1))
    ior = max(number(registers, code, at + 3), 1e-5)
    _interface(sp, LOBE_REFRACTION, weight, registers, code, at, ior, load_i32(code, at + 5))


@entry
def diffuse_op(_scene, sp, registers, code, at):
    """Diffuse BSDF: colour, roughness, normal."""
    sp = shading_point_at(sp, 0)
    color = triple(registers, code, at + 1)
    n = normal_input(sp, registers, code, at + 3)
    add_diffuse(sp, mul(triple(registers, code, at), color), n, number(registers, code, at + 2), color)


@entry
def translucent_op(_scene, sp, registers, code, at):
    """Translucent BSDF: colour, normal."""
    sp = shading_point_at(sp, 0)
    n = valid_reflection_normal(sp, normal_input(sp, registers, code, at + 2))
    add_closure(sp, LOBE_TRANSLUCENT, mul(triple(registers, code, at), triple(registers, code, at + 1)), n)


@entry
def sheen_op(scene, sp, registers, code, at):
    """Sheen BSDF: colour, roughness, normal; distribution."""
    scene = scene_at(scene, 0)
    sp = shading_point_at(sp, 0)
    weight = mul(triple(registers, code, at), triple(registers, code, at + 1))
    roughness = clamp(number(registers, code, at + 2), 0.0, 1.0)
    n = normal_input(sp, registers, code, at + 3)
    if load_i32(code, at + 4) == 1:
        add_sheen(sp, scene.lobe_tables, weight, n, roughness)
    else:
        add_velvet(sp, weight, n, roughness)


@entry
def toon_op(_scene, sp, registers, code, at):
    """Toon BSDF: colour, size, smooth, normal; component."""
    sp = shading_point_at(sp, 0)
    glossy = load_i32(code, at + 5) == 1
    if glossy and sp.ray_flags & RAY_NO_REFLECTION:
        return
    weight = mul(triple(registers, code, at), triple(registers, code, at + 1))
    n = normal_input(sp, registers, code, at + 4)
    size, smooth = number(registers, code, at + 2), number(registers, code, at + 3)
    add_toon(sp, weight, n, size, smooth, glossy)
