"""Burley's normalised diffusion profile (Christensen and Burley 2015), its part that scatters once, and the rest.

The unit profile of scale d is B(r) = (e^(-r/d) + e^(-r/3d)) / (8 π d r), by area, ∫ B 2πr dr = 1. A medium of mean free
path ℓ = 1/σ_t, single-scattering albedo α, mean cosine g and albedo A (of many scatterings) has the profile
R = A B with d = ℓ′ / s(A), ℓ′ = ℓ / (1 - g α) being the length after which a walk has forgotten its direction.

What scatters once is R₁ = α ∂R/∂α at α = 0 (Zhang and d'Eon 2025, without the misprints of their slides): only the
factor A has a derivative there, so R₁ = α κ A′(0) B with d₀ = ℓ′ / s(0). The fit of s is that for diffuse
transmission, with which R - R₁ is nowhere negative; with the one for a perpendicular beam it is, near r = 0.
"""

import math

from ..core.fastmath import exp
from ..core.jit import device, inlined

# A′(0) of A(α) = (1 - √(1 - α)) / (1 + 1.554 √(1 - α)); the exact value is (2/3)(1 - ln 2) = 0.2046.
SINGLE_ALBEDO = 0.5 / 2.554
SINGLE_SHAPE = 1.9 + 3.5 * 0.64  # s(0)

# A channel's profile ends at this many d: the light farther away, F_REACH short of 1, is left out.
REACH = 28.0
F_REACH = 1.0 - 0.25 * math.exp(-REACH) - 0.75 * math.exp(-REACH / 3.0)

_TINY = 1e-12  # of d: nearer than this is at this distance


@device
def profile_shape(albedo):
    """s(A), mean free paths by d, for light that enters diffusely (Christensen and Burley 2015, equation 6)."""
    x = albedo - 0.8
    return 1.9 - albedo + 3.5 * x * x


@device
def profile_scale(sigma_t, alpha, albedo, g):
    """d in scene units."""
    return 1.0 / (sigma_t * (1.0 - g * alpha) * profile_shape(albedo))


@inlined
def profile(r, d):
    """B(r), 1/length²."""
    x = max(r / d, _TINY)
    e = exp(min(x, 2000.0) * (-1.0 / 3.0))
    return (e + e * e * e) / (8.0 * math.pi * d * d * x)


@device
def profile_cdf(r, d):
    """The part of the unit profile nearer than r."""
    e = math.exp(r / d * (-1.0 / 3.0))
    return 1.0 - 0.25 * e * e * e - 0.75 * e


@device
def profile_radius(u, d):
    """The r of profile_cdf(r, d) = u, in closed form (Golubev 2019): with e = e^(-r/3d) a cubic equation."""
    v = max(1.0 - u, 1e-12)
    w = 1.0 + 4.0 * v * (2.0 * v + math.sqrt(1.0 + 4.0 * v * v))
    root = w ** (1.0 / 3.0)
    return 3.0 * d * math.log((1.0 + root + 1.0 / root) / (4.0 * v))


@device
def single_factor(alpha, g):
    """κ: the single-scattering albedo of a half space under diffuse light over that of g = 0, bounded for g < 0.

    The medium is similar to one of g = 0 and α* = (1 - g) α / (1 - g α), whose albedo it has: with α κ > α* the rest
    R - R₁ would be negative near r = 0. For g > 0, where the bound does not matter, a fit within 1e-4 of the integral
    over Henyey and Greenstein's phase function.
    """
    if g <= 0.0:
        return (1.0 - g) / (1.0 - g * alpha)
    return (1.0 - g) * (1.0 + g * (-0.13237 + g * (0.03742 - g * 0.00848)))


@device
def single_profile(r, sigma_t, alpha, g):
    """R₁(r), 1/length²."""
    d = 1.0 / (sigma_t * (1.0 - g * alpha) * SINGLE_SHAPE)
    return alpha * single_factor(alpha, g) * SINGLE_ALBEDO * profile(r, d)


@device
def multiple_profile(r, sigma_t, alpha, albedo, g):
    """R_n(r) = R - R₁, 1/length²."""
    return albedo * profile(r, profile_scale(sigma_t, alpha, albedo, g)) - single_profile(r, sigma_t, alpha, g)
