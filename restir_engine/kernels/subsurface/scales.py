"""One channel of a medium as a lobe describes it, and its diffusion profile."""

import math

from ..core.fastmath import exp
from ..core.jit import device, inlined
from ..lobes.closure import P_ALBEDO, P_COLOR, P_SIGMA_T
from .albedo import similar
from .profile import SINGLE_ALBEDO, SINGLE_SHAPE, profile, profile_shape, single_factor
from .van_de_hulst import half_space_albedo


@inlined
def channel(c, throughput, k):
    """(weight, σ_t, α) of channel k of the closure c: weight is the path's throughput without the colour, or 0."""
    color, sigma_t, alpha = c.p[P_COLOR + k], c.p[P_SIGMA_T + k], c.p[P_ALBEDO + k]
    if not (throughput[k] > 0.0 and color > 0.0 and 0.0 < sigma_t < math.inf and alpha > 0.0):
        return 0.0, 1.0, 0.0
    return throughput[k] / color, float(sigma_t), min(float(alpha), 1.0)


@device
def channels(c, throughput):
    """(weights, σ_t, α), rgb each."""
    w0, s0, a0 = channel(c, throughput, 0)
    w1, s1, a1 = channel(c, throughput, 1)
    w2, s2, a2 = channel(c, throughput, 2)
    return (w0, w1, w2), (s0, s1, s2), (a0, a1, a2)


diffuse_albedo = inlined(half_space_albedo)


@inlined
def profile_scales(sigma_t, alpha, g):
    """(d, d₀, share): scales of the whole profile and of its part R₁, and that part's share, ∫R₁ / ∫R."""
    albedo = diffuse_albedo(similar(alpha, g))
    length = 1.0 / (sigma_t * (1.0 - g * alpha))
    share = alpha * single_factor(alpha, g) * SINGLE_ALBEDO / albedo if albedo > 0.0 else 1.0
    return length / profile_shape(albedo), length / SINGLE_SHAPE, min(share, 0.999)


@inlined
def multiple_shape(r, d, d0, share):
    """R_n scaled to integrate to 1 over a plane, 1/length²."""
    return (profile(r, d) - share * profile(r, d0)) / (1.0 - share)


@inlined
def _beyond(b, d):
    """∫ B(√(r² + b²)) 2πr dr."""
    e = exp(min(b / d, 2000.0) * (-1.0 / 3.0))
    return 0.25 * e * e * e + 0.75 * e


@device
def far_share(b, d, d0, share):
    """∫ R_n of a plane at the distance b, over that of the plane itself."""
    return (_beyond(b, d) - share * _beyond(b, d0)) / (1.0 - share)
