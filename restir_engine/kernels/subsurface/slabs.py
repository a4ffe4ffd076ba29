"""How much light slabs of a medium reflect and transmit after two scatterings and more: the tables behind HYBRID.

`python -m restir_engine.kernels.subsurface.slabs` makes them by adding–doubling (van de Hulst 1980; Prahl 1995): a
layer too thin to scatter twice is doubled until nothing comes through it any more. Boundaries are matched, the phase
function is Henyey and Greenstein's. A row of `total` and `single` belongs to a half space, one of `reflected` and
`transmitted` to a slab; all are parts of the light that enters along one direction. Of `transmitted` the logarithm is
kept. `near` and `far` are factors of the profile's scale with which it spreads that light as far to the side as it is
in an isotropic slab, on the side where it entered and on the other. `bend` is how much is added to a factor of 1
between two points of a ball, times the sine of their normals' angle, so that it returns what it does under even light
(diffuse entry, after two isotropic scatterings and more): it is no slab, and no half space either however dense it is.

Axes: s = √(1 - α*), α* = (1 - g) α / (1 - g α) being the albedo of the isotropic medium that is similar; g; the cosine
of the direction of entry; and for slabs the optical thickness σ_t (1 - g α) thickness, in powers of √2.
"""

from functools import cache
from pathlib import Path

import numpy as np

from .profile import SINGLE_ALBEDO, SINGLE_SHAPE
from .van_de_hulst import half_space_albedo

_FILE = Path(__file__).with_name("slabs.npz")
_NODES = 16  # quadrature: half the terms of the phase function that are kept
_THINNEST = 2.0**-22

S = np.linspace(0.0, 1.0, 17)
G = np.linspace(-0.9, 0.9, 13)
MU = np.square(np.linspace(0.0, 1.0, 7))
THICKNESS = 2.0 ** np.arange(-4, 5.25, 0.5)
NAMES = ("total", "single", "reflected", "transmitted", "near", "far", "bend")
_MOST = 64.0  # far light over that of the profile, as HYBRID bounds it


@cache
def slab_tables() -> np.ndarray:
    """All tables behind one another, float32: [S, G, MU], [G, MU], 2 × [S, G, MU, THICKNESS], 3 × [S, THICKNESS]."""
    with np.load(_FILE) as data:
        return np.concatenate([data[name].ravel() for name in NAMES]).astype(np.float32)


def albedo_of(s, g):
    """α of the medium with the anisotropy g that is similar to an isotropic one of α* = 1 - s²."""
    similar = 1.0 - np.square(s)
    return similar / (1.0 - g + g * similar)


def _nodes(mu: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Cosines and weights of Gauss and Legendre over (0, 1), and those of `mu` with a weight of 0 behind."""
    x, w = np.polynomial.legendre.leggauss(_NODES)
    return np.concatenate([0.5 * (x + 1.0), np.maximum(mu, 1e-3)]), np.concatenate([0.5 * w, 0.0 * mu])


def _phase(moments: np.ndarray, mu: np.ndarray, nu: np.ndarray) -> np.ndarray:
    """The phase function averaged over the azimuth, [mu, nu], of mean 1; moments: of Legendre's polynomials."""
    weights = moments * (2.0 * np.arange(len(moments)) + 1.0)
    rows, columns = (np.polynomial.legendre.legvander(x, len(moments) - 1) for x in (mu, nu))
    return (rows * weights) @ columns.T


def slabs(alpha: float, g: float, thickness: np.ndarray, mu: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Reflected and transmitted parts [thickness, mu], straight light included, of the light that enters at mu.

    thickness: ascending σ_t thickness, each a power of two times the first.
    """
    cosine, weight = _nodes(mu)
    # What lies beyond the terms that are kept is taken for light that goes straight on (Wiscombe 1977).
    forward = g ** (2 * _NODES)
    moments = (g ** np.arange(2 * _NODES) - forward) / (1.0 - forward)
    scale = 1.0 - alpha * forward
    alpha = alpha * (1.0 - forward) / scale
    thickness = np.asarray(thickness) * scale
    doublings = int(np.ceil(np.log2(thickness[0] / _THINNEST)))
    b = thickness[0] / 2.0**doublings
    scattered = 0.5 * alpha * b * weight[:, None] / cosine
    r = scattered * _phase(moments, cosine, -cosine)
    t = scattered * _phase(moments, cosine, cosine) + np.diag(
        1.0 - b / cosine
    )  # to first order, as is the rest: energy is kept
    reflected, transmitted = [], []
    while len(reflected) < len(thickness):
        if b >= thickness[len(reflected)] * 0.999:
            reflected.append(r.sum(axis=0)[_NODES:])
            transmitted.append(t.sum(axis=0)[_NODES:])
        through = np.linalg.solve(np.eye(len(r)) - r @ r, t)
        r, t = r + t @ r @ through, t @ through
        b *= 2.0
    return np.array(reflected), np.array(transmitted)


def half_space(alpha: float, g: float, mu: np.ndarray) -> np.ndarray:
    """The part [mu] of the light that comes back from a medium without end."""
    return slabs(alpha, g, np.array([2.0**16]), mu)[0][0]


def single(g: float, mu: np.ndarray, thickness: float = np.inf) -> tuple[np.ndarray, np.ndarray]:
    """Parts reflected and transmitted [mu] after exactly one scattering, for an albedo of 1; `thickness` in σ_t."""
    x, w = np.polynomial.legendre.leggauss(64)
    out, w = 0.5 * (x + 1.0)[:, None], 0.5 * w
    mu = np.maximum(mu, 1e-3)
    azimuth = (np.arange(256) + 0.5) / 256 * 2.0 * np.pi

    def phase(sign):
        sines = np.sqrt((1.0 - out**2) * np.maximum(1.0 - mu**2, 0.0))[..., None]
        cosine = sign * (out * mu)[..., None] + sines * np.cos(azimuth)
        return ((1.0 - g * g) / (1.0 + g * g - 2.0 * g * cosine) ** 1.5).mean(axis=-1)

    if np.isinf(thickness):
        return 0.5 * w @ (phase(-1.0) * out / (out + mu)), 0.0 * mu
    back = out / (out + mu) * -np.expm1(-thickness * (1.0 / out + 1.0 / mu))
    difference = 1.0 / mu - 1.0 / out
    near = np.abs(difference) < 1e-6
    ahead = np.exp(-thickness / out) - np.exp(-thickness / mu)
    ahead = np.where(near, thickness * np.exp(-thickness / mu), ahead / np.where(near, 1.0, difference)) / mu
    return 0.5 * w @ (phase(-1.0) * back), 0.5 * w @ (phase(1.0) * ahead)


def spread(thickness: float, s: np.ndarray, photons: int, seed: int = 1) -> np.ndarray:
    """Mean distance to the side [2, s], in mean free paths, of diffuse light that a slab reflects and transmits.

    After two isotropic scatterings and more, by random walks without absorption, weighted for every albedo at once.
    """
    random = np.random.default_rng(seed)
    alpha = np.minimum(1.0 - np.square(s), 1.0 - 1e-4)
    weight, moment = np.zeros((2, len(s))), np.zeros((2, len(s)))
    x, cosine, events = np.zeros((3, photons)), np.sqrt(random.random(photons)), 0
    while x.shape[1] and events < 4000:
        azimuth, sine = 2.0 * np.pi * random.random(len(cosine)), np.sqrt(1.0 - cosine**2)
        d = np.stack([sine * np.cos(azimuth), sine * np.sin(azimuth), cosine])
        y = x + d * -np.log1p(-random.random(len(cosine)))
        leaves = (y[2] < 0.0, y[2] > thickness)
        for side, (out, plane) in enumerate(zip(leaves, (0.0, thickness), strict=True)):
            if events >= 2 and out.any():
                t = (plane - x[2, out]) / d[2, out]
                weight[side] += alpha**events * out.sum()
                moment[side] += alpha**events * np.hypot(*(x[:2, out] + t * d[:2, out])).sum()
        x = y[:, ~(leaves[0] | leaves[1])]
        cosine, events = 2.0 * random.random(x.shape[1]) - 1.0, events + 1
    return moment / np.maximum(weight, 1e-30)


def _profile_spread(scale: float, s: float, thickness: float) -> float:
    """Mean distance to the side on a plane at `thickness` under the profile R_n, `scale` times as wide."""
    albedo = half_space_albedo(s)
    share = min((1.0 - s * s) * SINGLE_ALBEDO / max(albedo, 1e-9), 0.999)
    r = np.exp(np.linspace(-8.0, 8.0, 300))  # a trapezoidal rule in log r: its ends count for nothing
    d, d0 = scale / (1.9 - albedo + 3.5 * (albedo - 0.8) ** 2), scale / SINGLE_SHAPE
    away = np.hypot(r, thickness)
    density = (np.exp(-away / d) + np.exp(-away / (3 * d))) / d
    density -= share * (np.exp(-away / d0) + np.exp(-away / (3 * d0))) / d0
    density *= r * r / away
    return float((density * r).sum() / max(density.sum(), 1e-300))


def _scale(target: float, s: float, thickness: float) -> float:
    """The scale, 1/8 to 4, with which the profile spreads as far as `target`."""
    low, high = 0.125, 4.0
    for _ in range(20):
        middle = np.sqrt(low * high)
        low, high = (middle, high) if _profile_spread(middle, s, thickness) < target else (low, middle)
    return np.sqrt(low * high)


def ball(diameter: float, s: np.ndarray, photons: int, seed: int = 1) -> np.ndarray:
    """The part [s] of even light that a ball returns after two isotropic scatterings and more; diffuse entry.

    Random walks without absorption, weighted for every albedo at once.
    """
    random = np.random.default_rng(seed)
    alpha, total = 1.0 - np.square(s), np.zeros(len(s))
    x, cosine, events = np.zeros((3, photons)), -np.sqrt(random.random(photons)), 0
    x[2] = 0.5 * diameter
    while x.shape[1]:
        azimuth, sine = 2.0 * np.pi * random.random(len(cosine)), np.sqrt(1.0 - cosine**2)
        d = np.stack([sine * np.cos(azimuth), sine * np.sin(azimuth), cosine])
        y = x + d * -np.log1p(-random.random(len(cosine)))
        inside = np.square(y).sum(axis=0) < 0.25 * diameter**2
        if events >= 2:
            total += alpha**events * (~inside).sum()
        x = y[:, inside]
        cosine, events = 2.0 * random.random(x.shape[1]) - 1.0, events + 1
    return total / photons


def bend(tables: dict[str, np.ndarray], photons: int = 400_000) -> np.ndarray:
    """The table `bend` [S, THICKNESS] from the others; for α = 0, what it is for the smallest α.

    On a ball of diameter b the area within a chord r is π r²; the far side's share of a point is x⁴, x = r / b, and the
    sine of the normals' angle 2 x √(1 - x²).
    """
    mu, weight = (0.5 * (x + 1.0) for x in np.polynomial.legendre.leggauss(24))
    weight = 2.0 * (weight - 0.5) * mu
    isotropic = int(np.argmin(np.abs(G)))

    def entered(table: np.ndarray) -> np.ndarray:
        return np.array([np.interp(np.sqrt(mu), np.sqrt(MU), row) for row in table.reshape(-1, len(MU))])

    result, x = np.zeros((len(S), len(THICKNESS))), (np.arange(8000) + 0.5) / 8000
    once = entered(tables["single"][isotropic])[0]
    for k, b in enumerate(THICKNESS):
        truth = ball(b, S, photons)
        r = x * b
        for i, s in enumerate(S[:-1]):
            albedo = half_space_albedo(s)
            d, share = (
                1.0 / (1.9 - albedo + 3.5 * (albedo - 0.8) ** 2),
                min((1.0 - s * s) * SINGLE_ALBEDO / albedo, 0.999),
            )

            def shape(r, wide, d=d, share=share):
                parts = ((1.0, wide * d), (-share, wide / SINGLE_SHAPE))
                profile = sum(w * (np.exp(-r / scale) + np.exp(-r / (3.0 * scale))) / scale for w, scale in parts)
                return profile / (8.0 * np.pi * r * (1.0 - share))

            def beyond(scale, b=b):
                return 0.25 * np.exp(-b / scale) + 0.75 * np.exp(-b / (3.0 * scale))

            near, far = tables["near"][i, k], tables["far"][i, k]
            multiple = entered(tables["total"][i, isotropic])[0] - (1.0 - s * s) * once
            reflected = entered(tables["reflected"][i, isotropic, :, k])[0]
            transmitted = np.exp(entered(tables["transmitted"][i, isotropic, :, k])[0])
            brought = multiple * (beyond(far * d) - share * beyond(far / SINGLE_SHAPE)) / (1.0 - share)
            factor = np.minimum(transmitted / np.maximum(brought, 1e-30), _MOST)
            close = (reflected + transmitted - factor * brought) @ weight * (1.0 - x**4) * shape(r, near)
            light = (close + multiple * factor @ weight * x**4 * shape(b, far)) * 2.0 * np.pi * r * b
            turned = (light * 2.0 * x * np.sqrt(1.0 - x * x)).mean()
            result[i, k] = (truth[i] - light.mean()) / turned
    result[-1] = result[-2]
    return result


def make() -> None:
    """Compute the tables and store them beside this file."""
    total = np.zeros((len(S), len(G), len(MU)))
    once = np.stack([single(g, MU)[0] for g in G])
    reflected = np.zeros((len(S), len(G), len(MU), len(THICKNESS)))
    transmitted = np.zeros_like(reflected)
    for i, s in enumerate(S):
        for j, g in enumerate(G):
            alpha = albedo_of(s, g)
            total[i, j] = half_space(min(alpha, 1.0 - 1e-9), g, MU)
            b = THICKNESS / (1.0 - g * alpha)
            r, t = np.zeros((2, len(b), len(MU)))
            for half in (slice(0, None, 2), slice(1, None, 2)):
                r[half], t[half] = slabs(alpha, g, b[half], MU)
            for k, thickness in enumerate(b):
                r1, t1 = single(g, MU, thickness)
                reflected[i, j, :, k] = r[k] - alpha * r1
                transmitted[i, j, :, k] = t[k] - np.exp(-thickness / np.maximum(MU, 1e-3)) - alpha * t1
    near, far = np.zeros((2, len(S), len(THICKNESS)))
    for k, b in enumerate(THICKNESS):
        reflection, transmission = spread(b, S, 300_000 if b < 8.0 else 100_000)
        for i, s in enumerate(S):
            near[i, k], far[i, k] = _scale(reflection[i], s, 0.0), _scale(transmission[i], s, b)
    transmitted = np.log(np.maximum(transmitted, 1e-30))
    tables = (total, once, np.maximum(reflected, 0.0), transmitted, near, far)
    tables = dict(zip(NAMES[:-1], tables, strict=True))
    tables["bend"] = bend(tables)
    np.savez_compressed(_FILE, **{name: table.astype(np.float32) for name, table in tables.items()})


if __name__ == "__main__":
    make()
