"""Radial Tiling: the sectors of a polygon with rounded corners, each with coordinates of its own.

The formulas were found by measuring Cycles. With 2h the angle of a sector, n = π / h of them need not be whole: the
last sector then is what is left, and its side lies farther out, so that all corners are as far as the others.
"""

import math

from ...core.jit import device, entry
from ...core.memory import load_i32, store_f64
from ...core.vec import store3_f64
from ..operands import number, triple

_SMALL = 1e-9


@device
def _side(apothem, half, other_half, cut):
    """(ℓ, φ₀, H, L, R) of half a side of `apothem` that spans the angle `half` up to its corner.

    The corner to the next half side, which spans `other_half`, is rounded from `cut` before it on. ℓ and φ₀: how far
    the side is straight, as a length and as an angle; H: the angle of the arc; L: in which part of it lengths along the
    side become angles; R: the arc's radius.
    """
    whole = apothem * math.tan(half)
    straight = max(whole - cut, 0.0)
    begins = math.atan(straight / apothem)
    bend = half - begins
    return straight, begins, bend, bend * straight / max(whole, _SMALL), cut / math.tan(0.5 * (half + other_half))


@device
def _along(turned, blend):
    """(share of lengths, share of angles) that an arc adds after the angle `turned`: its integrals of 1 - w and w."""
    if turned >= blend:
        return 0.5 * blend, turned - 0.5 * blend
    angles = 0.5 * turned * turned / max(blend, _SMALL)
    return turned - angles, angles


@device
def _width(apothem, straight, bend, blend, lengths):
    """Half the width of a sector where a side is `lengths` from the middle (1: where the polygon lies)."""
    more, angles = _along(bend, blend)
    return lengths * (straight / apothem + more) + angles / apothem


@entry
def radial_tiling_op(_scene, _sp, registers, code, at):
    """Radial Tiling: see opcodes.RADIAL_TILING."""
    out = load_i32(code, at)
    x, y, _ = triple(registers, code, at + 1)
    sides = max(number(registers, code, at + 2), 2.0)
    roundness = min(max(number(registers, code, at + 3), 0.0), 1.0)
    normalize = load_i32(code, at + 4) != 0
    halves = sides == 2.0 and roundness < 1.0  # of the plane: they have no corners
    roundness = 0.0 if halves else roundness
    r = math.hypot(x, y)
    theta = math.atan2(y, x)
    theta = theta + 2.0 * math.pi if theta < 0.0 else theta
    half = math.pi / sides
    whole_sides = math.floor(sides)
    segment = min(math.floor(theta / (2.0 * half)), math.ceil(sides) - 1.0)
    rest = math.pi - half * whole_sides  # half the angle of the last sector
    irregular = rest > _SMALL
    last = irregular and segment >= whole_sides
    own = rest if last else half
    middle = 2.0 * half * segment + own
    phi = theta - middle
    apothem = math.cos(rest) / math.cos(half) if last else 1.0
    beside_last = irregular and ((segment == 0.0 and phi < 0.0) or (segment == whole_sides - 1.0 and phi > 0.0))
    cut = roundness * math.tan(half)
    other = half
    if last or beside_last:
        cut = roundness * math.sin(rest) / math.cos(half)
        other = half if last else rest
    straight, begins, bend, blend, radius = _side(apothem, own, other, cut)
    turned = abs(phi) - begins
    if turned <= 0.0:
        across, height = r * math.sin(abs(phi)) / apothem, r * math.cos(phi) / apothem
        lengths = height
    else:
        more, angles = _along(turned, blend)
        across = (r * (math.sin(begins) + math.cos(begins) * more) + angles) / apothem
        # The distance of the arc in this direction: of its centre along the ray, and half the chord.
        toward = (apothem - radius) * math.cos(phi) + straight * math.sin(abs(phi))
        beside = (apothem - radius) * math.sin(abs(phi)) - straight * math.cos(phi)
        height = r / (toward + math.sqrt(max(radius * radius - beside * beside, 0.0)))
        lengths = height + (r * math.cos(begins) / apothem - height) * turned / max(bend, _SMALL)
    if normalize:
        wide = 1.0 if halves else _width(apothem, straight, bend, blend, lengths)
        u = 0.5 + math.copysign(0.5 * across / max(wide, _SMALL), phi)
        v = height
    else:
        u, v = math.copysign(across, phi), height - 1.0
    if beside_last:
        straight, _, bend, blend, _ = _side(1.0, half, half, roundness * math.tan(half))
    store3_f64(registers, out, (u, v, 0.0))
    store_f64(registers, out + 3, segment)
    store_f64(registers, out + 4, 0.0 if halves else _width(apothem, straight, bend, blend, 1.0))
    store_f64(registers, out + 5, middle)
