"""How light enters a medium: directions of entry, and their density."""

import numpy as np

from restir_engine.kernels.core.jit import kernel
from restir_engine.kernels.core.memory import address, load_f64, store_f64
from restir_engine.kernels.core.records import CLOSURE, SHADING_POINT
from restir_engine.kernels.core.vec import load3_f64, store3_f64, vec
from restir_engine.kernels.lobes.closure import ENTRY_DIFFUSE, ENTRY_SKIN, P_ENTRY
from restir_engine.kernels.subsurface.entry import entry_direction, lobe_density


@kernel
def _directions(sp: SHADING_POINT, c: CLOSURE, numbers, n, out):
    for i in range(n):
        enters, d = entry_direction(sp, c, load_f64(numbers, 2 * i), load_f64(numbers, 2 * i + 1))
        store_f64(out, 4 * i, 1.0 if enters else 0.0)
        store3_f64(out, 4 * i + 1, d)


@kernel
def _densities(sp: SHADING_POINT, c: CLOSURE, diffuse, alpha: float, directions, n, out):
    for i in range(n):
        d = load3_f64(directions, 3 * i)
        store_f64(out, i, lobe_density(vec(c.n), vec(sp.ng), vec(sp.wo), diffuse != 0, alpha, c.ior, d))


class Entry:
    """Where light enters by ENTRY_* through a surface of normals n (of the closure) and ng, seen from wo."""

    def __init__(self, kind: int, alpha: float, ior: float, wo, n=(0.0, 0.0, 1.0), ng=(0.0, 0.0, 1.0)) -> None:
        self._point, self._closure = np.zeros(1, SHADING_POINT), np.zeros(1, CLOSURE)
        point, c = self._point[0], self._closure[0]
        point["wo"], point["ng"], c["n"] = wo, ng, n
        c["alpha_x"], c["ior"], c["p"][P_ENTRY] = alpha, ior, kind

    def directions(self, numbers: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(whether light enters (n,), its directions (n, 3)) by random numbers (n, 2)."""
        out = np.empty((len(numbers), 4))
        _directions(self._point[0], self._closure[0], address(numbers), len(numbers), address(out))
        return out[:, 0] > 0.0, out[:, 1:]

    def densities(self, directions: np.ndarray) -> np.ndarray:
        """By solid angle of directions (n, 3)."""
        directions = np.ascontiguousarray(directions, np.float64)
        kind, alpha = self._closure[0]["p"][P_ENTRY], self._closure[0]["alpha_x"]
        if kind == ENTRY_SKIN:
            return 0.5 * (self._lobe(1, 1.0, directions) + self._lobe(0, 1.0, directions))
        return self._lobe(int(kind == ENTRY_DIFFUSE), alpha, directions)

    def _lobe(self, diffuse: int, alpha: float, directions: np.ndarray) -> np.ndarray:
        out = np.empty(len(directions))
        _densities(self._point[0], self._closure[0], diffuse, alpha, address(directions), len(out), address(out))
        return out
