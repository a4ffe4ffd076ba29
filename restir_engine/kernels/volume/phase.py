"""Phase functions of the Volume Scatter node, by the cosine between the directions of light before and after.

All are densities by steradian that integrate to 1 and are sampled exactly, so that value and density are the same.

* Henyey and Greenstein: `kernels.subsurface.phase`.
* Rayleigh: (1 + μ²) 3 / 16π; sampled by Frisvad 2011, "Importance sampling the Rayleigh phase function".
* Draine 2003, "Scattering by interstellar dust grains": Henyey and Greenstein's times (1 + α μ²).
* Fournier and Forand 1994, in the form of Mobley 2002, "Phase function effects on oceanic light fields".
* Mie: the mixture of Henyey–Greenstein and Draine that Jendersie and d'Eon 2023, "An approximate Mie scattering
  function for fog and cloud rendering", fit to droplets of water.
"""

import math

from ..core.jit import device, inlined
from ..subsurface.phase import hg, hg_cosine

# Kinds and their parameters: g; none; g and α; ν, 4 / (3 (n - 1)²) and the factor of the last term.
PHASE_HG, PHASE_RAYLEIGH, PHASE_DRAINE, PHASE_FOURNIER_FORAND, PHASE_MIE = range(5)

_INV_FOUR_PI = 0.25 / math.pi
MOST_ANISOTROPIC = 1.0 - 1.0e-3  # Cycles' limit of |g|


@device
def phase_value(kind, a, b, c, cosine):
    """The density by steradian at a cosine."""
    if kind == PHASE_HG:
        return hg(cosine, a)
    if kind == PHASE_RAYLEIGH:
        return 0.75 * _INV_FOUR_PI * (1.0 + cosine * cosine)
    if kind == PHASE_DRAINE:
        return hg(cosine, a) * (1.0 + b * cosine * cosine) / (1.0 + b * (1.0 + 2.0 * a * a) * (1.0 / 3.0))
    return _fournier_forand(a, b, c, cosine)


@device
def phase_cosine(kind, a, b, c, u):
    """The cosine at u of the cumulative distribution (of its complement for some)."""
    if kind == PHASE_HG:
        return hg_cosine(a, u)
    if kind == PHASE_RAYLEIGH:
        s = 4.0 * u - 2.0
        x = (s + math.sqrt(1.0 + s * s)) ** (1.0 / 3.0)
        return min(max(x - 1.0 / x, -1.0), 1.0)
    if kind == PHASE_DRAINE:
        return _draine_cosine(a, b, u)
    return _fournier_forand_cosine(a, b, c, u)


@inlined
def _draine_integral(w, g, alpha):
    """Antiderivative of (1 + α μ²) w⁻³ by μ, less constants, where w² = 1 + g² - 2 g μ."""
    k = 1.0 + g * g
    q = 0.25 * alpha / (g * g)
    return ((1.0 + q * k * k) / w + 2.0 * q * k * w - q * w * w * w * (1.0 / 3.0)) / g


@device
def _draine_cosine(g, alpha, u):
    """Draine's cumulative distribution inverted by bisection in w = √(1 + g² - 2 g μ), for small g in μ."""
    if abs(g) < 1.0e-3:
        low = -1.0
        high = 1.0
        target = (2.0 * u - 1.0) * (1.0 + alpha * (1.0 / 3.0))
        for _ in range(48):
            middle = 0.5 * (low + high)
            if middle * (1.0 + alpha * middle * middle * (1.0 / 3.0)) < target:
                low = middle
            else:
                high = middle
        return 0.5 * (low + high)
    back = _draine_integral(1.0 + abs(g), abs(g), alpha)
    front = _draine_integral(1.0 - abs(g), abs(g), alpha)
    target = back + (front - back) * u
    near = 1.0 - abs(g)
    far = 1.0 + abs(g)
    for _ in range(48):
        middle = 0.5 * (near + far)
        if _draine_integral(middle, abs(g), alpha) < target:
            far = middle
        else:
            near = middle
    w = 0.5 * (near + far)
    cosine = (1.0 + g * g - w * w) / (2.0 * abs(g))
    return min(max(cosine if g > 0.0 else -cosine, -1.0), 1.0)


@device
def fournier_forand_parameters(backscatter, ior):
    """(ν, 4 / (3 (n - 1)²), factor of 3 μ² - 1 times 4) for a share of light scattered backwards and an index n > 1.

    ν follows from the cumulative distribution at 90°: δ⁻ᵛ = 1 + 2 B (δ - 1).
    """
    backscatter = min(abs(backscatter), 0.499)
    n = max(ior, 1.001) - 1.0
    per_sine = 4.0 / (3.0 * n * n)
    half = 0.5 * per_sine
    nu = -math.log(2.0 * backscatter * (half - 1.0) + 1.0) / math.log(half)
    return nu, per_sine, _INV_FOUR_PI * (per_sine**-nu - 1.0) / (per_sine - 1.0)


@device
def _fournier_forand(nu, per_sine, last, cosine):
    s = max(0.5 * (1.0 - cosine), 1.0e-12)  # sin² of half the angle
    delta = per_sine * s
    power = delta**nu
    x = 1.0 - delta
    if abs(x) < 1.0e-4:
        value = 0.5 * nu * ((nu - 1.0) - (nu + 1.0) / s)
        value += nu * (nu + 1.0) * x * (2.0 * (nu - 1.0) - (2.0 * nu + 1.0) / s) * (1.0 / 6.0)
    else:
        value = (nu * x - (1.0 - power) + (delta * (1.0 - power) - nu * x) / s) / (x * x * power)
    return max(_INV_FOUR_PI * value + 0.25 * last * (3.0 * cosine * cosine - 1.0), 0.0)


@device
def _fournier_forand_below(nu, per_sine, last, s):
    """Share of light that is scattered by less than the angle whose half has the sine² s."""
    delta = per_sine * s
    power = delta**nu
    x = 1.0 - delta
    if abs(x) < 1.0e-4:
        share = 1.0 + nu * (1.0 - s) * (1.0 - 0.5 * (nu + 1.0) * x)
    else:
        share = (1.0 - power * delta - (1.0 - power) * s) / (x * power)
    cosine = 1.0 - 2.0 * s
    return share + 0.5 * math.pi * last * cosine * (1.0 - cosine * cosine)


@device
def _fournier_forand_cosine(nu, per_sine, last, u):
    """Bisection in the logarithm of sin² of half the angle: most light goes almost straight on."""
    low = -28.0
    high = 0.0
    for _ in range(44):
        middle = 0.5 * (low + high)
        if _fournier_forand_below(nu, per_sine, last, math.exp(middle)) < u:
            low = middle
        else:
            high = middle
    return 1.0 - 2.0 * math.exp(0.5 * (low + high))


@device
def mie_mixture(diameter):
    """(g of Henyey–Greenstein, g and α of Draine, weight of Draine) for droplets of a diameter in micrometres."""
    d = max(diameter, 0.0)
    if d <= 0.1:
        return 13.8 * d * d, 1.1456 * d * math.sin(9.29044 * d), 250.0, 0.252977 - 312.983 * d**4.3
    x = math.log(d)
    if d < 1.5:
        a = (x - 0.238604) * (x + 1.00667)
        b = 0.507522 - 0.15677 * x
        g = 0.379685 * math.cos(1.19692 * math.cos(a / b) + 1.37932 * x + 0.0625835) + 0.344213
        weight = 0.146209 * math.cos(3.38707 * x + 2.11193) + 0.316072 + 0.0778917 * x
        return 0.862 - 0.143 * x * x, g, 250.0, weight
    if d < 5.0:
        y = math.log(x)
        g = 0.500411 - 0.081287 / (math.tan(x) - 2.0 * x + 1.27551)
        weight = 0.026914 * (x - math.cos(5.68947 * (y - 0.0292149))) + 0.3764
        return 0.0604931 * y + 0.940256, g, 7.30354 * x + 6.31675, weight
    return (
        math.exp(-0.0990567 / (d - 1.67154)),
        math.exp(-2.20679 / (d + 3.91029) - 0.428934),
        math.exp(3.62489 - 8.29288 / (d + 5.52825)),
        math.exp(-0.599085 / (d - 0.641583) - 0.665888),
    )
