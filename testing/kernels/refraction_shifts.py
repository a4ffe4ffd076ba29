"""Shifts of light that crosses straight between the pixels of a frame, and the directions in which it enters."""

from __future__ import annotations

import numpy as np

from restir_engine.integrators.resampling.frame import FRAME
from restir_engine.integrators.resampling.inputs import point_at
from restir_engine.integrators.techniques.refraction.target import density_of
from restir_engine.integrators.techniques.subsurface.sample import sample_at
from restir_engine.integrators.techniques.subsurface.target import place_of
from restir_engine.kernels.core.jit import kernel
from restir_engine.kernels.core.memory import address, load_f64, load_i64, store_f64
from restir_engine.kernels.core.records import CLOSURE, SCENE, SHADING_POINT, closure_at, shading_point_at
from restir_engine.kernels.core.vec import length, load3_f64, normalize, store3_f64, sub, vec
from restir_engine.kernels.geometry.surface import triangle_place
from restir_engine.kernels.lobes.closure import P_ENTRY
from restir_engine.kernels.subsurface.entry import entry_density, entry_direction
from restir_engine.kernels.subsurface.hybrid import first_hit

from .subsurface_shifts import LayerShifts

_COLUMNS = 9  # ω, r, p(ω), x₁, how far x₂ is from what is met first


@kernel
def _crossings(scene: SCENE, frame: FRAME, scratch, pixels, reservoirs, count, out):
    """What samples are in their pixels: float64 [count, _COLUMNS]."""
    for k in range(count):
        pixel = load_i64(pixels, k)
        sp, r = point_at(frame, pixel), sample_at(reservoirs, k)
        x, _ = place_of(scene, r)
        row = out + 8 * _COLUMNS * k
        offset = sub(x, vec(sp.p))
        d = normalize(offset)
        store3_f64(row, 0, d)
        store_f64(row, 3, length(offset))
        store_f64(row, 4, density_of(frame, pixel, d))
        store3_f64(row, 5, vec(sp.p))
        _, primitive, u, v = first_hit(scene, scratch, sp, vec(sp.p), d)
        off = 1.0e30
        if primitive >= 0:
            y, _, _ = triangle_place(scene, sp.instance, primitive, u, v)
            off = length(sub(y, x))
        store_f64(row, 8, off)


@kernel
def _enter(sp, closure, numbers, count, out):
    """(whether light enters, its direction) by two numbers in [0, 1): float64 [count, 4]."""
    for k in range(count):
        c = closure_at(closure, 0)
        u0, u1 = load_f64(numbers, 2 * k), load_f64(numbers, 2 * k + 1)
        enters, d = entry_direction(shading_point_at(sp, 0), c, u0, u1)
        store_f64(out, 4 * k, 1.0 if enters else 0.0)
        store3_f64(out, 4 * k + 1, d)


@kernel
def _density(sp, closure, directions, count, out):
    """The density of entry along directions, float64 [count]."""
    sp, c = shading_point_at(sp, 0), closure_at(closure, 0)
    for k in range(count):
        d = load3_f64(directions, 3 * k)
        kind, alpha, ior = c.p[P_ENTRY], float(c.alpha_x), float(c.ior)
        store_f64(out, k, entry_density(vec(c.n), vec(sp.ng), vec(sp.wo), kind, alpha, ior, d))


class Crossings(LayerShifts):
    """Those of a choice of `sss_refraction`."""

    def __init__(self, scene, sss_refraction: str, seed: int = 1) -> None:
        super().__init__(scene, "refraction", seed=seed, sss_method="HYBRID", sss_refraction=sss_refraction)

    def crossings(self, pixels, reservoirs) -> dict[str, np.ndarray]:
        """Of samples in their pixels: direction (n, 3), length and density (n,), x₁ (n, 3), `off` (n,).

        off: how far x₂ lies from the point that the direction meets first.
        """
        pixels, reservoirs = np.ascontiguousarray(pixels, np.int64), np.ascontiguousarray(reservoirs)
        out = np.zeros((len(pixels), _COLUMNS))
        scene, _, frame = self._records
        args = address(self.scratch), address(pixels), address(reservoirs), len(pixels), address(out)
        _crossings(scene, frame, *args)
        return {"direction": out[:, :3], "length": out[:, 3], "density": out[:, 4], "x1": out[:, 5:8], "off": out[:, 8]}


class Entry:
    """Light that enters a surface whose normals are along z, seen from `wo`."""

    def __init__(self, kind: int, wo, alpha: float, ior: float, tilt=(0.0, 0.0, 1.0)) -> None:
        """kind: ENTRY_*; tilt: the closure's normal."""
        self._point, self._closure = np.zeros(1, SHADING_POINT), np.zeros(1, CLOSURE)
        self._point["ng"], self._point["wo"] = (0.0, 0.0, 1.0), np.asarray(wo) / np.linalg.norm(wo)
        closure = self._closure[0]
        closure["n"] = np.asarray(tilt) / np.linalg.norm(tilt)
        closure["p"][P_ENTRY], closure["alpha_x"], closure["ior"] = kind, alpha, ior

    def directions(self, numbers) -> tuple[np.ndarray, np.ndarray]:
        """(whether light enters (n,), its direction (n, 3)) by numbers (n, 2)."""
        numbers = np.ascontiguousarray(numbers, float)
        out = np.zeros((len(numbers), 4))
        _enter(address(self._point), address(self._closure), address(numbers), len(numbers), address(out))
        return out[:, 0] > 0.0, out[:, 1:]

    def density(self, directions) -> np.ndarray:
        """The density (n,) of directions (n, 3)."""
        directions = np.ascontiguousarray(directions, float)
        out = np.zeros(len(directions))
        _density(address(self._point), address(self._closure), address(directions), len(directions), address(out))
        return out
