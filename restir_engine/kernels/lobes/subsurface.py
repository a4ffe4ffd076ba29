"""The lobe that scatters below the surface: closures from the inputs of Principled and of the Subsurface node."""

from ..core.jit import device, entry
from ..core.memory import load_i32
from ..core.records import RAY_BURLEY_DIFFUSE, RAY_SUBSURFACE_DIFFUSE, closure_at, shading_point_at
from ..core.vec import average, mul, scale
from ..shading.math_ops import clamp
from ..shading.operands import number, triple
from ..subsurface.parameters import BURLEY, RANDOM_WALK_SKIN, clamp_anisotropy, medium, method_length
from .closure import (
    ENTRY_DIFFUSE,
    ENTRY_REFRACTIVE,
    ENTRY_SKIN,
    LOBE_LAMBERT,
    LOBE_SUBSURFACE,
    P_ALBEDO,
    P_ANISOTROPY,
    P_BURLEY,
    P_COLOR,
    P_ENTRY,
    P_LENGTH,
    P_SIGMA_T,
    WEIGHT_CUTOFF,
    add_closure,
    valid_reflection_normal,
)
from .nodes import ENTRY_OF_METHOD
from .setup import normal_input, positive, put_p

_SMALLEST_RADIUS = 1e-8  # scene units; a channel below is diffuse


@device
def _scatters(radius):
    """1 for a radius that light scatters over, 0 for one that is too small, or no number."""
    return 1.0 if radius >= _SMALLEST_RADIUS else 0.0


@device
def _entry(method, entry):
    """ENTRY_*: the artist's, or the method's own. Christensen and Burley's has no direction; then all are alike."""
    if entry != ENTRY_OF_METHOD:
        return entry
    if method == RANDOM_WALK_SKIN:
        return ENTRY_SKIN
    return ENTRY_DIFFUSE if method == BURLEY else ENTRY_REFRACTIVE


@device
def add_subsurface(sp, weight, n, color, radius, alpha, ior, g, method, entry, sign):
    """Append the lobe, and a Lambert lobe for channels of no radius and for rays that are to see all as diffuse.

    `weight` contains `color`; radius (rgb) in scene units; α of microfacets at the entry; method, entry and sign are
    the instruction's immediates. As in Cycles, the sampling weight counts each channel that scatters.
    """
    if not average(weight) >= WEIGHT_CUTOFF:
        return
    n = valid_reflection_normal(sp, n)
    inside = (_scatters(radius[0]), _scatters(radius[1]), _scatters(radius[2]))
    off = RAY_SUBSURFACE_DIFFUSE | (RAY_BURLEY_DIFFUSE if method == BURLEY else 0)
    if sp.ray_flags & off:
        inside = (0.0, 0.0, 0.0)
    channels = inside[0] + inside[1] + inside[2]
    if channels < 3.0:
        add_closure(sp, LOBE_LAMBERT, mul(weight, (1.0 - inside[0], 1.0 - inside[1], 1.0 - inside[2])), n)
    if channels == 0.0:
        return
    i = add_closure(sp, LOBE_SUBSURFACE, mul(weight, inside), n)
    if i < 0:
        return
    c = closure_at(sp.closures, i)
    c.sample_weight *= channels
    entry = _entry(method, entry)
    rough = 1.0 if method == RANDOM_WALK_SKIN or entry == ENTRY_SKIN else alpha
    c.alpha_x = rough
    c.alpha_y = rough
    c.ior = clamp(ior, 1.01, 3.8)
    g = clamp_anisotropy(g, method, sign)
    length = method_length(radius, color, c.ior, method)
    sigma_t, albedo = medium(color, length, g, method)
    put_p(c, P_SIGMA_T, sigma_t)
    put_p(c, P_ALBEDO, albedo)
    put_p(c, P_COLOR, color)
    put_p(c, P_LENGTH, length)
    c.p[P_ANISOTROPY] = g
    c.p[P_ENTRY] = float(entry)
    c.p[P_BURLEY] = 1.0 if method == BURLEY else 0.0


@device
def radius_input(registers, code, radius_at, scale_at):
    """Radius (rgb) times scale, not below 0."""
    return positive(scale(triple(registers, code, radius_at), number(registers, code, scale_at)))


@entry
def subsurface_op(_scene, sp, registers, code, at):
    """Subsurface Scattering: colour, scale, radius, IOR, roughness (the entry's α itself), anisotropy, normal; method,
    entry, sign."""
    sp = shading_point_at(sp, 0)
    color = positive(triple(registers, code, at + 1))
    radius = radius_input(registers, code, at + 3, at + 2)
    alpha = clamp(number(registers, code, at + 5), 0.0, 1.0)
    n = normal_input(sp, registers, code, at + 7)
    add_subsurface(
        sp, mul(triple(registers, code, at), color), n, color, radius, alpha,
        number(registers, code, at + 4), number(registers, code, at + 6),
        load_i32(code, at + 8), load_i32(code, at + 9), load_i32(code, at + 10),
    )  # fmt: skip
