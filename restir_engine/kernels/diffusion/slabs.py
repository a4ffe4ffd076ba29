"""How much light slabs of a medium reflect and transmit after two scatterings and more: the tables behind HYBRID.

`python -m restir_engine.kernels.diffusion.slabs` makes them by adding–doubling (van de Hulst 1980; Prahl 1995): a layer
too thin to scatter twice is doubled until nothing comes through it any more. Boundaries are matched, the phase function
is Henyey and Greenstein's. A row of `total` and `single` belongs to a half space, one of `reflected` and `transmitted`
to a slab; all are parts of the light that enters along one direction. Of `transmitted` the logarithm is kept.

Axes: s = √(1 - α*), α* = (1 - g) α / (1 - g α) being the albedo of the isotropic medium that is similar; g; the cosine
of the direction of entry; and for slabs the optical thickness σ_t (1 - g α) thickness, in powers of √2.
"""

from functools import cache
from pathlib import Path

import numpy as np

_FILE = Path(__file__).with_name("slabs.npz")
_NODES = 16  # quadrature: half the terms of the phase function that are kept
_THINNEST = 2.0**-22

S = np.linspace(0.0, 1.0, 17)
G = np.linspace(-0.9, 0.9, 13)
MU = np.square(np.linspace(0.0, 1.0, 7))
THICKNESS = 2.0 ** np.arange(-4, 5.25, 0.5)
NAMES = ("total", "single", "reflected", "transmitted")


@cache
def slab_tables() -> np.ndarray:
    """All tables behind one another, float32: [S, G, MU], [G, MU], [S, G, MU, THICKNESS] twice."""
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
    transmitted = np.log(np.maximum(transmitted, 1e-30))
    tables = (total, once, np.maximum(reflected, 0.0), transmitted)
    np.savez_compressed(_FILE, **{n: table.astype(np.float32) for n, table in zip(NAMES, tables, strict=True)})


if __name__ == "__main__":
    make()
