"""Closures: what kinds there are, what a sampled direction is called, and how the shading point collects them."""

import math

from ..core.jit import device
from ..core.records import MAX_CLOSURES, closure_at
from ..core.vec import add, cross, dot, frame, is_black, madd, neg, normalize, put, scale, vec

# Kinds (CLOSURE.kind). Tens are the light pass that a lobe counts to (`pass_class`), full tens below 40 microfacets.
LOBE_LAMBERT = 1
LOBE_OREN_NAYAR = 2
LOBE_SHEEN = 3
LOBE_TOON_DIFFUSE = 4
LOBE_TRANSLUCENT = 5
LOBE_SUBSURFACE = 6  # leaves the surface elsewhere: sampled by bsdf_sample, followed by kernels.subsurface.methods
LOBE_ROUGH_TRANSLUCENT = 7  # Oren–Nayar about the normal of the far side
LOBE_REFLECTION = 10
LOBE_ASHIKHMIN_SHIRLEY = 11
LOBE_VELVET = 12
LOBE_TOON_GLOSSY = 13
LOBE_FIBRE = 18  # an eight or a nine: a lobe of a fibre, see `fibre`; this one is a whole fibre's
LOBE_FIBRE_REFLECTION = 19
LOBE_REFRACTION = 20
LOBE_THIN_TRANSMISSION = 21
LOBE_FIBRE_TRANSMISSION = 29
LOBE_GLASS = 30
LOBE_TRANSPARENT = 40

CLASS_DIFFUSE, CLASS_GLOSSY, CLASS_TRANSMISSION, CLASS_GLASS = 0, 1, 2, 3

LABEL_TRANSMIT = 1
LABEL_REFLECT = 2
LABEL_DIFFUSE = 4
LABEL_GLOSSY = 8
LABEL_SINGULAR = 16
LABEL_TRANSPARENT = 32
LABEL_SUBSURFACE = 64

# Cycles' constants: what is lighter or smoother than this is dropped or a mirror.
WEIGHT_CUTOFF = 1e-5
SINGULAR_ALPHA_SQUARED = 2e-10

# Where things stand in CLOSURE.p for microfacets.
P_DISTRIBUTION = 0  # 0 GGX, 1 Beckmann
P_FRESNEL = 1  # FRESNEL_* of `fresnel`
P_ENERGY = 2  # scale for what single scattering loses
P_F0 = 3  # rgb: reflectance at normal incidence, or a conductor's n
P_EDGE = 6  # rgb: F82's b, or a conductor's k
P_REFLECTION = 9  # rgb: tints of the two halves of a generalised Schlick dielectric
P_TRANSMISSION = 12

# And for LOBE_SUBSURFACE, whose α (roughness of the entry) and ior stand in the fields of these names. Its weight
# contains the colour. A channel whose mean free path is 0 has no weight here: it is diffuse.
P_SIGMA_T = 0  # rgb: extinction, 1 by scene unit
P_ALBEDO = 3  # rgb: single-scattering albedo α
P_COLOR = 6  # rgb: the artist's colour, the albedo that many scatterings add up to
P_LENGTH = 9  # rgb: BURLEY's length before it is scaled by the colour
P_ANISOTROPY = 12  # mean cosine g of Henyey and Greenstein's phase function
P_ENTRY = 13  # ENTRY_*: how light enters
P_BURLEY = 14  # 1: the artist asked for BURLEY
ENTRY_DIFFUSE, ENTRY_REFRACTIVE, ENTRY_SKIN = 0, 1, 2


@device
def pass_class(kind):
    """CLASS_* of a lobe: the light pass that it counts to (glass counts to two, by side)."""
    return kind // 10


@device
def is_microfacet(kind):
    """Whether a lobe is reflection, refraction or glass made of microfacets."""
    return kind % 10 == 0 and kind < LOBE_TRANSPARENT


@device
def is_fibre(kind):
    """Whether a lobe is that of a fibre, which scatters all around it, without a horizon."""
    return kind % 10 >= 8


@device
def has_reflection(c):
    """Whether a closure of microfacets mirrors."""
    return c.kind != LOBE_REFRACTION


@device
def has_transmission(c):
    """Whether a closure of microfacets refracts."""
    return c.kind == LOBE_REFRACTION or c.kind == LOBE_GLASS


@device
def is_singular(c):
    """Whether a closure of microfacets is so smooth that it can only be sampled."""
    return c.alpha_x * c.alpha_y <= SINGULAR_ALPHA_SQUARED


@device
def add_closure(sp, kind, weight, n):
    """Append a closure with its weight (rgb, negative parts cut) and normal; its index, -1 when it is dropped."""
    r, g, b = max(weight[0], 0.0), max(weight[1], 0.0), max(weight[2], 0.0)
    average = (r + g + b) * (1.0 / 3.0)
    i = sp.n_closures
    if not (average >= WEIGHT_CUTOFF) or average == math.inf or i >= MAX_CLOSURES:
        return -1
    c = closure_at(sp.closures, i)
    sp.n_closures = i + 1
    c.kind = kind
    put(c.weight, (r, g, b))
    c.sample_weight = average
    put(c.n, n)
    c.alpha_x = 1.0
    c.alpha_y = 1.0
    c.ior = 1.0
    return i


@device
def tangent_frame(n, t):
    """Unit tangents (x, y) about n with x as near to t as can be; any when t is no help."""
    y = normalize(cross(n, t))
    if is_black(y):
        return frame(n)
    return cross(y, n), y


@device
def closure_frame(c):
    """The frame (x, y) of a closure around its normal; x is its tangent when it is anisotropic."""
    n = vec(c.n)
    if c.alpha_x == c.alpha_y:
        return frame(n)
    t = vec(c.t)
    return t, cross(n, t)


@device
def rotate(v, axis, angle):
    """v turned by an angle about a unit axis (Rodrigues)."""
    cosine = math.cos(angle)
    turned = madd(scale(v, cosine), cross(axis, v), math.sin(angle))
    return madd(turned, axis, dot(axis, v) * (1.0 - cosine))


@device
def valid_reflection_normal(sp, n):
    """The normal nearest to n, towards `sp.ng`, whose mirror direction stays above the surface (as Cycles does).

    The mirror direction r of wo about n' = x X + z ng (X: n without its part along ng) shall have r · ng = t. With
    wo = (a, c) in that plane, 2 (x a + z c) z - c = t; squared with x² = 1 - z² it is a quadratic in z²:
    4 s z⁴ - 4 (s + c t) z² + (c + t)² = 0, s = a² + c².
    """
    ng, wo = vec(sp.ng), vec(sp.wo)
    if sp.bump_uncorrected:
        return n
    if n[0] == ng[0] and n[1] == ng[1] and n[2] == ng[2]:
        return n
    c = dot(wo, ng)
    t = min(0.9 * c, 0.01)
    mirror = madd(neg(wo), n, 2.0 * dot(n, wo))
    if dot(mirror, ng) >= t:
        return n
    along = normalize(madd(n, ng, -dot(n, ng)))
    if is_black(along):
        return n
    a = dot(wo, along)
    s = a * a + c * c
    if s <= 0.0:
        return n
    half = s + c * t
    root = math.sqrt(max(half * half - s * (c + t) * (c + t), 0.0))
    z2 = 0.5 * (half + root if a < 0.0 else half - root) / s
    z2 = min(max(z2, 0.0), 1.0)
    return add(scale(along, math.sqrt(1.0 - z2)), scale(ng, math.sqrt(z2)))


@device
def bump_shadowing(sp, c, wi, sampled):
    """Factor against light that leaks through bumps, and a soft terminator for diffuse lobes.

    0 where wi lies on different sides of the smooth and the bumped normal (a direction that the lobe itself sampled is
    kept unless it is diffuse); else the GGX shadowing of Conty Estevez et al. 2019, "A Microfacet-Based Shadowing
    Function to Solve the Bump Terminator Problem", for diffuse lobes.
    """
    n, smooth = vec(c.n), vec(sp.n)
    if n[0] == smooth[0] and n[1] == smooth[1] and n[2] == smooth[2]:
        return 1.0
    diffuse = c.kind < LOBE_REFLECTION
    cos_i, cos_n = dot(smooth, wi), dot(smooth, n)
    if cos_i * cos_n * dot(n, wi) < 0.0 and (diffuse or not sampled):
        return 0.0
    if not diffuse or sp.bump_uncorrected:
        return 1.0
    cos_i, cos_n = abs(cos_i), abs(cos_n)
    if cos_n >= 1.0 or cos_i >= 1.0:
        return 1.0
    if cos_i < 1e-6 or cos_n < 1e-6:
        return 0.0
    alpha2 = min(0.125 * (1.0 / (cos_n * cos_n) - 1.0), 1.0)
    tan2 = 1.0 / (cos_i * cos_i) - 1.0
    return 2.0 / (1.0 + math.sqrt(1.0 + alpha2 * tan2))


@device
def terminator_offset(sp, c, wi):
    """Factor that darkens lobes near the terminator of a smooth mesh, as far as the instance asks for: Appleseed's.

    The cosine of wi becomes that of an angle `terminator_frequency` times as large, and 0 beyond a right one.
    """
    frequency = sp.terminator_frequency
    cosine = dot(vec(c.n), wi)
    if not frequency > 1.0 or cosine < 0.0:
        return 1.0
    angle = frequency * math.acos(min(cosine, 1.0))
    return math.cos(angle) / cosine if angle < 0.5 * math.pi else 0.0
