"""Makes the albedo tables by numerical integration, and hands them out.

`python -m restir_engine.kernels.lobes.tables [name …]` makes those of `MAKERS` (all) and stores them beside this file.
Grids, clamps and what is tabulated are those of Cycles, so that layering and energy compensation agree with it. The
directional integrals run over the unit square of a visible normal's random numbers, on a Fibonacci lattice; there the
albedo is the average of masking ratios and needs no weights. The sheen is a fit of two coefficients to a random
walk in a layer of fibres.
"""

import sys
from pathlib import Path

import numpy as np

from . import albedo as layout

_FILE = Path(__file__).with_name("tables.npz")
_POINTS, _GENERATOR = 6765, 4181


def lobe_tables() -> np.ndarray:
    """All tables as one float32 array, as SCENE.lobe_tables expects it."""
    with np.load(_FILE) as data:
        return np.concatenate([data[name].ravel() for name in MAKERS]).astype(np.float32)


def axis(n: int, top: float = 1.0) -> np.ndarray:
    """Positions of n entries over 0 … top; the ends are kept off the singular values."""
    return np.clip(np.linspace(0.0, 1.0, n), 1e-4, top)


def ior_of(z: np.ndarray | float) -> np.ndarray | float:
    """The index of refraction above 1 whose reflectance at normal incidence is z⁴."""
    r = np.square(z)
    return (1.0 + r) / (1.0 - r)


def visible_normals(alpha: float, mu: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """GGX normals seen at cosine mu, equally probable: (wo, normals [n, 3], 1 + Λ(wo)) with wo in the xz plane."""
    i = np.arange(_POINTS)
    u, v = (i + 0.5) / _POINTS, np.mod(i * (_GENERATOR / _POINTS), 1.0)
    wo = np.array([np.sqrt(max(1.0 - mu * mu, 0.0)), 0.0, mu])
    s = wo * [alpha, alpha, 1.0]
    s /= np.linalg.norm(s)
    z = (1.0 - u) * (1.0 + s[2]) - s[2]
    r, phi = np.sqrt(np.maximum(1.0 - z * z, 0.0)), 2.0 * np.pi * v
    h = np.stack([r * np.cos(phi), r * np.sin(phi), z], axis=1) + s
    h = h * [alpha, alpha, 1.0]
    h[:, 2] = np.maximum(h[:, 2], 0.0)
    h /= np.maximum(np.linalg.norm(h, axis=1, keepdims=True), 1e-30)
    return wo, h, 1.0 + _smith(alpha, mu)


def _smith(alpha: float, cosine):
    with np.errstate(divide="ignore"):
        tangent2 = np.maximum(1.0 / np.square(cosine) - 1.0, 0.0)
    return 0.5 * (np.sqrt(1.0 + alpha * alpha * tangent2) - 1.0)


def _fresnel(cosine: np.ndarray, eta: float) -> tuple[np.ndarray, np.ndarray]:
    """(reflectance, eta times the refracted cosine) of a dielectric; total reflection gives 1."""
    g2 = eta * eta - 1.0 + cosine * cosine
    g = np.sqrt(np.maximum(g2, 0.0))
    s = (cosine - g) / (cosine + g)
    p = (eta * eta * cosine - g) / (eta * eta * cosine + g)
    return np.where(g2 <= 0.0, 1.0, 0.5 * (s * s + p * p)), g


def reflected(rough: float, mu: float) -> tuple[np.ndarray, np.ndarray]:
    """(cosine between wo and each normal, G2/G1 of the mirror direction or 0 below the horizon)."""
    alpha = rough * rough
    wo, h, one_plus_lambda = visible_normals(alpha, mu)
    cos_ho = h @ wo
    cos_i = 2.0 * cos_ho * h[:, 2] - mu
    above = cos_i > 0.0
    ratio = one_plus_lambda / (one_plus_lambda + _smith(alpha, np.where(above, cos_i, 1.0)))
    return cos_ho, np.where(above, ratio, 0.0)


def ggx_albedo(rough: float, mu: float) -> float:
    """What GGX without Fresnel reflects of light from everywhere towards a direction of cosine mu."""
    return float(reflected(rough, mu)[1].mean())


def glass_albedo(rough: float, mu: float, eta: np.ndarray) -> np.ndarray:
    """What GGX glass of relative indices eta [n] reflects and lets through, [n]."""
    alpha = rough * rough
    _wo, h, one_plus_lambda = visible_normals(alpha, mu)
    cos_ho, mirror = reflected(rough, mu)
    eta = np.asarray(eta)[:, None]
    f, g = _fresnel(cos_ho, eta)
    # Refracted rays that end above the surface count here, as in Cycles' tables; the lobe itself drops them.
    cos_i = (cos_ho * h[:, 2] - mu - g * h[:, 2]) / eta
    through = one_plus_lambda / (one_plus_lambda + _smith(alpha, cos_i))
    result = (f * mirror + np.where(f < 1.0, (1.0 - f) * through, 0.0)).mean(axis=1)
    return np.where(np.abs(eta[:, 0] - 1.0) < 1e-4, 1.0, result)


def dielectric_position(rough: float, mu: float, eta: float) -> float:
    """Average, over the normals whose mirror direction is above the horizon, of (F - F0) / (1 - F0); others count 0."""
    cos_ho, ratio = reflected(rough, mu)
    f, _ = _fresnel(cos_ho, eta)
    f0 = ((eta - 1.0) / (eta + 1.0)) ** 2
    return float(np.where(ratio > 0.0, np.clip((f - f0) / (1.0 - f0), 0.0, 1.0), 0.0).mean())


def schlick_position(rough: float, mu: float, exponent: float) -> float:
    """The same for Schlick's (1 - cos)^exponent."""
    cos_ho, ratio = reflected(rough, mu)
    return float(np.where(ratio > 0.0, np.maximum(1.0 - cos_ho, 0.0) ** exponent, 0.0).mean())


def average(albedo, count: int = 16):
    """2 ∫ albedo(µ) µ dµ by Gauss–Legendre; the nodes crowd towards grazing, where albedos bend."""
    x, w = np.polynomial.legendre.leggauss(count)
    t, w = 0.5 * (x + 1.0), 0.5 * w
    return sum(weight * 4.0 * s**3 * albedo(s * s) for weight, s in zip(w, t, strict=True))


def _ggx() -> np.ndarray:
    a = axis(layout.GGX_SIZE)
    return np.array([[ggx_albedo(rough, mu) for rough in a] for mu in a])


def _ggx_average() -> np.ndarray:
    return np.array([average(lambda m, r=rough: ggx_albedo(r, m)) for rough in axis(layout.GGX_SIZE)])


def _etas(outwards: bool) -> np.ndarray:
    eta = ior_of(axis(layout.GLASS_SIZE, 0.99))
    return 1.0 / eta if outwards else eta


def _glass(outwards: bool) -> np.ndarray:
    a, etas = axis(layout.GLASS_SIZE), _etas(outwards)
    return np.moveaxis(np.array([[glass_albedo(rough, mu, etas) for rough in a] for mu in a]), 2, 0)


def _glass_average(outwards: bool) -> np.ndarray:
    etas = _etas(outwards)
    return np.array([average(lambda m, r=rough: glass_albedo(r, m, etas)) for rough in axis(layout.GLASS_SIZE)]).T


def _dielectric() -> np.ndarray:
    a = axis(layout.GLASS_SIZE)
    return np.array([[[dielectric_position(r, m, eta) for r in a] for m in a] for eta in _etas(False)])


def _schlick() -> np.ndarray:
    # Cycles keeps Schlick tables for exponents of 5 (1 - z) / z and reads z = 1/2 between the two nearest ones.
    a, middle = axis(layout.GLASS_SIZE), [5.0 * (1.0 - z) / z for z in (7.0 / 15.0, 8.0 / 15.0)]
    return np.array([[np.mean([schlick_position(r, m, e) for e in middle]) for r in a] for m in a])


def _sheen() -> np.ndarray:
    from .fibres import sheen_tables

    return sheen_tables(layout.SHEEN_SIZE)


# In the order of the layout in `albedo`.
MAKERS = {
    "ggx": _ggx,
    "ggx_average": _ggx_average,
    "glass": lambda: _glass(False),
    "glass_average": lambda: _glass_average(False),
    "glass_out": lambda: _glass(True),
    "glass_out_average": lambda: _glass_average(True),
    "dielectric": _dielectric,
    "schlick": _schlick,
    "sheen": _sheen,
}


def make(names: list[str]) -> None:
    """Make the tables of these names and keep the others; the sheen takes minutes."""
    tables = {}
    if _FILE.exists():
        with np.load(_FILE) as data:
            tables.update(data)
    for name in names:
        tables[name] = np.clip(MAKERS[name](), -1.0, 1.0).astype(np.float32)
        np.savez_compressed(_FILE, **tables)


if __name__ == "__main__":
    make(sys.argv[1:] or list(MAKERS))
