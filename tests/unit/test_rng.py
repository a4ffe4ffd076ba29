"""Random numbers: stratified, independent between keys and dimensions, replayable."""

import numpy as np
import pytest
from scipy import stats

from restir_engine.kernels.core import rng
from restir_engine.kernels.core.jit import kernel
from restir_engine.kernels.core.memory import address, store_f64


@kernel
def fill_pairs(out, key, n, dimension):
    for i in range(n):
        a, b = rng.sample2(key, i, dimension)
        store_f64(out, 2 * i, a)
        store_f64(out, 2 * i + 1, b)


@kernel
def fill_singles(out, first_key, n, index, dimension):
    for i in range(n):
        store_f64(out, i, rng.sample1(rng.key(first_key, i, 0, 0), index, dimension))


def pairs(key: int, n: int, dimension: int) -> np.ndarray:
    out = np.zeros((n, 2))
    fill_pairs(address(out), key, n, dimension)
    return out


@pytest.mark.parametrize("key", [1, 77, 123456])
def test_a_pair_of_dimensions_is_a_0_2_sequence(key):
    points = pairs(key, 256, 3)
    for columns in 2 ** np.arange(9):
        counts = np.histogram2d(*points.T, bins=[columns, 256 // columns], range=[[0, 1], [0, 1]])[0]
        assert (counts == 1).all()


def test_numbers_are_uniform_over_keys():
    out = np.zeros(20000)
    fill_singles(address(out), 5, len(out), 3, 2)
    assert (out >= 0.0).all() and (out < 1.0).all()
    assert stats.kstest(out, "uniform").pvalue > 1e-3


def test_dimensions_and_keys_are_uncorrelated():
    columns = np.concatenate([pairs(key, 4096, d) for key in (1, 2) for d in range(6)], axis=1)
    correlation = np.corrcoef(columns.T) - np.eye(columns.shape[1])
    # standard error 1/√4096, 276 pairs of columns: the largest of so many stays below 4.5 standard errors
    assert np.abs(correlation).max() < 4.5 / 64


def test_the_same_arguments_give_the_same_numbers():
    assert np.array_equal(pairs(9, 64, 1), pairs(9, 64, 1))
    assert not np.array_equal(pairs(9, 64, 1), pairs(10, 64, 1))
    assert not np.array_equal(pairs(9, 64, 1), pairs(9, 64, 2))
