"""Dwivedi's sampling of random walks below a plane surface: directions and distances that lead out of the medium.

A walk deep in a half space has an angular distribution ∝ 1 / (ν - μ), μ the cosine with the surface's normal n, and
thins out as exp(-depth σ_t / ν). Directions are sampled so, and distances with an extinction stretched by 1 - μ / ν:
long ways towards the surface, short ways into the depth (Křivánek and d'Eon 2014, "A zero-variance-based sampling
scheme for Monte Carlo subsurface scattering"). Where the far side of a slab is near, the mirrored distribution leads to
that side; the share of walks that are led there grows with the depth (d'Eon and Křivánek 2020, "Zero-variance theory
for efficient subsurface scattering"). All of it is importance sampling: it changes the noise, not the mean.
"""

import math

from ..core.fastmath import exp
from ..core.jit import device, inlined


@device
def diffusion_length(alpha):
    """ν > 1, in mean free paths, of a medium with the single-scattering albedo `alpha` in (0, 1).

    Equation 67 of d'Eon and Křivánek 2020, a fit of the largest discrete eigenvalue of isotropic transport.
    """
    a = min(alpha, 0.999999)
    return 1.0 / math.sqrt(1.0 - a ** (2.44294 - 0.0215813 * a + 0.578637 / a))


@inlined
def dwivedi_norm(nu):
    """∫ dμ / (ν - μ) over [-1, 1]."""
    return math.log((nu + 1.0) / (nu - 1.0))


@inlined
def dwivedi_cosine(nu, norm, u):
    """A cosine with n, with the density 1 / (norm (ν - μ))."""
    return max(nu - (nu + 1.0) * exp(-norm * u), -1.0)


@inlined
def dwivedi_pdf(nu, norm, cosine):
    """Density by steradian of a direction with that cosine and a uniform azimuth."""
    return 0.5 / (math.pi * norm * (nu - cosine))


@inlined
def backward_fraction(depth, thickness, nu):
    """Share of guided steps that are led to the far side; depth and thickness in mean free paths."""
    return 1.0 / (1.0 + exp(min((thickness - 2.0 * depth) / nu, 700.0)))
