"""Makes the sheen tables: a random walk in a layer of upright fibres, and the transformed cosine that is nearest to it.

After Zeltner, Burley and Chiang 2022: a layer of unit thickness and density, of SGGX microflakes (Heitz et al. 2015)
with the cross section diag(1, 1, σ²), σ = roughness², that reflect all light; coefficients by a fit in the third power.
Runs only when the tables are made.
"""

import math

import numpy as np

from ..core.jit import device, kernel
from ..core.memory import address, load_f64, store_f64
from ..core.rng import hash_u32
from ..core.vec import dot, madd, neg, normalize
from .diffuse import cosine_direction

BINS = 32
_WALKS = 150_000
_SCATTERINGS = 16  # what still goes up inside the layer after these counts as reflected, as in the published tables


@device
def _uniform(seed, counter):
    return hash_u32(hash_u32(seed) + counter) * (1.0 / 4294967296.0)


@device
def _extinction(w, sigma):
    """Projected area of the flakes towards w."""
    return math.sqrt(w[0] * w[0] + w[1] * w[1] + sigma * sigma * w[2] * w[2])


@device
def _scatter(w, sigma, u0, u1):
    """A direction into which the flakes seen from w mirror."""
    n = cosine_direction(normalize((w[0], w[1], sigma * w[2])), u0, u1)
    m = normalize((n[0], n[1], sigma * n[2]))
    return normalize(madd(neg(w), m, 2.0 * dot(m, w)))


@kernel
def _walk(histogram, bins, mu: float, sigma: float, walks, seed):
    """The share of light from cosine mu that comes back up; adds directions to a [theta, phi] histogram over a half
    turn of phi from the direction of incidence."""
    reflected = 0
    for i in range(walks):
        counter = i * 256
        w = (-math.sqrt(max(1.0 - mu * mu, 0.0)), 0.0, -mu)
        depth = 0.0
        for _ in range(_SCATTERINGS):
            sigma_t = _extinction(w, sigma)
            depth += math.log(1.0 - _uniform(seed, counter)) / max(sigma_t, 1e-30) * w[2]
            if depth < 0.0 or depth > 1.0:
                break
            w = _scatter(neg(w), sigma, _uniform(seed, counter + 1), _uniform(seed, counter + 2))
            counter += 3
        if depth <= 1.0 and w[2] > 0.0:
            reflected += 1
            theta = math.acos(min(max(w[2], 0.0), 1.0)) * (2.0 / math.pi)
            phi = abs(math.atan2(w[1], w[0])) / math.pi
            k = min(int(theta * bins), bins - 1) * bins + min(int(phi * bins), bins - 1)
            store_f64(histogram, k, load_f64(histogram, k) + 1.0 / max(math.sin(theta * 0.5 * math.pi), 1e-6))
    return reflected / walks


def walk(mu: float, roughness: float, walks: int = _WALKS, seed: int = 1) -> tuple[float, np.ndarray]:
    """(albedo, density of reflected light per steradian [theta, phi over half a turn])."""
    counts = np.zeros((BINS, BINS))
    albedo = _walk(address(counts), BINS, mu, roughness * roughness, walks, seed)
    density = counts * (BINS * BINS / (np.pi**2 * walks))
    density[0] = density[0].mean()
    return albedo, density


def transformed_cosine(a: float, b: float) -> np.ndarray:
    """The density of a cosine about z after the inverse of [[a, 0, b], [0, a, 0], [0, 0, 1]], at the bins' centres."""
    theta = (np.arange(BINS)[:, None] + 0.5) / BINS * 0.5 * np.pi
    phi = (np.arange(BINS)[None, :] + 0.5) / BINS * np.pi
    x, y, z = np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)
    return z / np.pi * np.square(a / (np.square(a * x + b * z) + np.square(a * y) + np.square(z)))


def fit(density: np.ndarray, albedo: float, start: np.ndarray) -> np.ndarray:
    """(a, b) of the transformed cosine nearest to a density."""
    from scipy.optimize import minimize

    def distance(x):
        return np.sum(np.abs(albedo * transformed_cosine(x[0], x[1]) - density) ** 3)

    x = minimize(distance, start, method="Nelder-Mead", tol=1e-6, options={"maxiter": 2000}).x
    return x if x[0] >= 0.0 else -x  # the same density; entries of one sign can be interpolated


def sheen_tables(n: int) -> np.ndarray:
    """a, b and the albedo, [3, roughness, mu]."""
    positions = np.maximum(np.linspace(0.0, 1.0, n), 0.01)
    result = np.zeros((3, n, n))
    for i, mu in enumerate(positions):
        x = np.array([1.0, 0.0])
        for j in range(n - 1, -1, -1):
            albedo, density = walk(mu, positions[j])
            result[2, j, i] = albedo
            if albedo > 3e-6:
                x = fit(density, albedo, x)
                result[:2, j, i] = x
    return result
