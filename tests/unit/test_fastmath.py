"""The fast functions against NumPy's."""

import numpy as np

from restir_engine.kernels.core import fastmath
from restir_engine.kernels.core.jit import kernel
from restir_engine.kernels.core.memory import address, load_f64, store_f64


@kernel
def _all(x, out, n):
    """Rows of exp(-700 + 1400 x), log(x), cos and sin of 2 pi x."""
    for i in range(n):
        value = load_f64(x, i)
        store_f64(out, 4 * i, fastmath.exp(1400.0 * value - 700.0))
        store_f64(out, 4 * i + 1, fastmath.log(value))
        c, s = fastmath.circle(value)
        store_f64(out, 4 * i + 2, c)
        store_f64(out, 4 * i + 3, s)


def test_functions_are_right_to_nine_digits():
    x = np.concatenate([np.linspace(1e-9, 1.0, 100_001), 0.5 + np.geomspace(1e-9, 1e-3, 1000), 2.0 ** -np.arange(60)])
    out = np.zeros((len(x), 4))
    _all(address(x), address(out), len(x))
    expected = np.stack([np.exp(1400 * x - 700), np.log(x), np.cos(2 * np.pi * x), np.sin(2 * np.pi * x)], 1)
    scale = np.stack([expected[:, 0], np.maximum(np.abs(expected[:, 1]), 1e-9), np.ones(len(x)), np.ones(len(x))], 1)
    error = (np.abs(out - expected) / scale).max(0)
    assert (error < 1e-9).all(), error
