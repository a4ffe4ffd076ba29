"""The kernel that Cycles integrates where a material asks for Christensen and Burley's profile."""

import math

from ..core.jit import device, inlined
from ..core.vec import dot, max3
from .probe import probe_frame
from .profile import profile

# Cycles' profile ends here, in d, and is scaled to hold everything within.
CYCLES_REACH = 16.0
CYCLES_F = 0.9963790093708328

# Of the largest d. Nearer to an axis than this is at this distance from it: a hit of the point itself is off by the
# error of its ray, often along the normal, and r / r_a is then anything.
NEAREST = 1.0e-5


@inlined
def _cut(r, distance, d):
    """Σ_c B_c(r) of the channels whose profile, as Cycles ends it, reaches `distance`."""
    total = 0.0
    for c in range(3):
        if distance <= CYCLES_REACH * d[c]:
            total += profile(r, d[c])
    return total


@device
def cycles_kernel(offset, ny, n, d):
    """rgb: the kernel whose integral over the surface is the mean of Cycles' estimator, 1/length².

    Its weights lack the factor from the distance on the disk to that in space, and weigh the three axes without their
    densities: B(r) / F(16) Σ_a ω_a r / r_a, with ω_a ∝ (w_a |n_y · a|)², r_a the distance from the axis. A channel's
    line ends within its own ball, which the density that the weights are divided by does not know: the last factor.
    """
    t, b = probe_frame(n)
    r = math.sqrt(dot(offset, offset))
    x, y, z = dot(offset, t), dot(offset, b), dot(offset, n)
    wn, wt, wb = 2.0 * dot(ny, n), dot(ny, t), dot(ny, b)  # Cycles takes the normal twice as often as a tangent
    total = wn * wn + wt * wt + wb * wb
    if not total > 0.0:
        return (0.0, 0.0, 0.0)
    factor = 0.0
    nearest = NEAREST * max3(d)
    for axis in range(3):
        w = wn if axis == 0 else (wt if axis == 1 else wb)
        square = x * x + y * y if axis == 0 else (y * y + z * z if axis == 1 else x * x + z * z)
        ra = max(math.sqrt(square), nearest)
        sampled = _cut(ra, ra, d)
        if sampled > 0.0:
            factor += w * w * r / ra * _cut(ra, r, d) / sampled
    factor /= total * CYCLES_F
    return (
        factor * profile(r, d[0]) if r <= CYCLES_REACH * d[0] else 0.0,
        factor * profile(r, d[1]) if r <= CYCLES_REACH * d[1] else 0.0,
        factor * profile(r, d[2]) if r <= CYCLES_REACH * d[2] else 0.0,
    )
