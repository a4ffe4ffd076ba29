"""Names to ids, and the slots of a pixel."""

import json

import numpy as np
import pytest

from restir_engine.film import Film
from restir_engine.kernels.core.jit import kernel
from restir_engine.kernels.core.memory import address
from restir_engine.kernels.film.cryptomatte import add_to_slots, merge_slots
from restir_engine.scene.cryptomatte import Manifests, murmur3, name_bits, name_id, united
from restir_engine.settings import cryptomatte, required_passes


@pytest.mark.parametrize("text, expected", [
    ("", 0), ("test", 0xBA6BD213), ("hello", 0x248BFA47), ("hello, world", 0x149BBB7F),
    ("The quick brown fox jumps over the lazy dog", 0x2E4FF723),
])  # fmt: skip
def test_hashes_of_others(text, expected):
    """Vectors that the hash's author and users have published."""
    assert murmur3(text.encode()) == expected


def test_ids_are_numbers():
    """No id is denormal, infinite or not a number; it is never 0 where the name is not empty."""
    names = [f"name {i}" for i in range(5000)]
    ids = np.array([name_id(name) for name in names], np.float32)
    assert np.isfinite(ids).all() and (np.abs(ids) >= np.finfo(np.float32).tiny).all()
    turned = sum(name_bits(name) != murmur3(name.encode()) for name in names)
    assert 10 < turned < 100  # two exponents of 256


def test_metadata():
    manifests = Manifests()
    manifests.note("Object", "Würfel")
    fields = manifests.metadata("Object", "ViewLayer")
    assert fields["cryptomatte/542cafa/name"] == "ViewLayer.CryptoObject"
    assert json.loads(fields["cryptomatte/542cafa/manifest"]) == {"Würfel": "c959a2b5"}


@kernel
def _add(slots, count, ids, weights, other):
    for i in range(len(ids)):
        add_to_slots(slots, count, float(ids[i]), float(weights[i]))
    merge_slots(slots, other, count)


def test_slots():
    """Weights gather by id, the last slot takes those that find none; a pixel's are added to another's alike."""
    slots = np.zeros((3, 2), np.float32)
    other = np.array([(5.0, 0.5), (7.0, 0.25), (0.0, 0.0)], np.float32)
    ids, weights = np.array([5.0, 6.0, 5.0, 9.0, 8.0, 6.0]), np.array([1.0, 0.5, 0.25, 0.125, 2.0, 0.0])
    _add(address(slots), 3, ids, weights, address(other))
    assert slots.tolist() == [[5.0, 1.75], [6.0, 0.5], [9.0, 2.375]]


def test_passes_rank_by_coverage():
    """Slots become passes by what they cover, over all passes of a kind."""
    names = frozenset(cryptomatte("Object", i) for i in range(2))
    film = Film(1, 1, required_passes(names, False))
    film.samples = 4
    film.pixels[0, 0, 4:] = [1.0, 0.4, 2.0, 1.2, 3.0, 2.0, 0.0, 0.0]
    first, second = (film.pass_array(name)[0, 0] for name in sorted(names))
    np.testing.assert_allclose([*first, *second], [3.0, 0.5, 2.0, 0.3, 1.0, 0.1, 0.0, 0.0], rtol=1e-6)
    assert film.record["crypto_slots"] == 4 and film.record["summed"] == 4


def test_slots_of_two_pictures_are_added_by_id_and_ranked_anew():
    """Told by it: slots added by rank, of which one id would have what another covers."""
    one = np.array([[[5.0, 3.0], [6.0, 1.0]], [[7.0, 4.0], [0.0, 0.0]]], np.float32)
    other = np.array([[[9.0, 2.0], [6.0, 1.5]], [[0.0, 0.0], [0.0, 0.0]]], np.float32)
    both = united(one, other)
    assert both.tolist() == [[[5.0, 3.0], [6.0, 2.5], [9.0, 2.0]], [[7.0, 4.0], [0.0, 0.0], [0.0, 0.0]]]
    assert united(both, one[:, :0])[..., 1].sum() == 11.5  # nothing is lost where there is nothing to add
    assert united(np.zeros((2, 3, 2, 2), np.float32), np.zeros((2, 3, 2, 2), np.float32)).shape == (2, 3, 1, 2)
