"""Names as Cryptomatte's ids (specification 1.2.0): MurmurHash3 of a name as a float32 that is a number."""

from __future__ import annotations

import json
from functools import cache

import numpy as np

KINDS = ("Object", "Material", "Asset")
_MASK = 0xFFFFFFFF


def _rotate(x: int, bits: int) -> int:
    return (x << bits | x >> 32 - bits) & _MASK


def murmur3(data: bytes) -> int:
    """MurmurHash3_x86_32 of seed 0 (Appleby 2011)."""
    h = 0
    whole = len(data) // 4
    blocks = [*np.frombuffer(data, "<u4", whole).tolist(), int.from_bytes(data[4 * whole :], "little")]
    for i, block in enumerate(blocks):
        h ^= _rotate(block * 0xCC9E2D51 & _MASK, 15) * 0x1B873593 & _MASK
        if i < whole:
            h = _rotate(h, 13) * 5 + 0xE6546B64 & _MASK
    h ^= len(data)
    h = (h ^ h >> 16) * 0x85EBCA6B & _MASK
    h = (h ^ h >> 13) * 0xC2B2AE35 & _MASK
    return h ^ h >> 16


@cache
def name_bits(name: str) -> int:
    """The 32 bits of a name's id: its hash, bit 23 turned over where it would be denormal, infinite or no number."""
    bits = murmur3(name.encode())
    return bits ^ 1 << 23 if bits >> 23 & 255 in (0, 255) else bits


@cache
def name_id(name: str) -> float:
    """The id of a name."""
    return float(np.uint32(name_bits(name)).view(np.float32))


def united(slots: np.ndarray, others: np.ndarray) -> np.ndarray:
    """Pixels' ids and their weights, (…, slots, 2), with those of `others` added, the heaviest first.

    There are as many slots as the pixel with most ids needs, at least one.
    """
    both = np.concatenate([slots, others], -2)
    order = np.argsort(both[..., 0], -1, kind="stable")
    both = np.take_along_axis(both, order[..., None], -2)
    ids, weights = both[..., 0], both[..., 1]
    for k in range(1, ids.shape[-1]):
        same = ids[..., k] == ids[..., k - 1]
        weights[..., k] += np.where(same, weights[..., k - 1], 0.0)
        weights[..., k - 1][same] = ids[..., k - 1][same] = 0.0
    weights[ids == 0.0] = 0.0
    order = np.argsort(-weights, -1, kind="stable")
    needed = max(int((weights > 0.0).sum(-1).max(initial=0)), 1)
    return np.take_along_axis(both, order[..., :needed, None], -2)


class Manifests:
    """The names that ids of a scene stand for, by kind."""

    def __init__(self) -> None:
        self.names: dict[str, dict[str, int]] = {kind: {} for kind in KINDS}

    def note(self, kind: str, name: str) -> float:
        """The id of a name, which the manifest of its kind then tells."""
        self.names[kind][name] = name_bits(name)
        return name_id(name)

    def metadata(self, kind: str, layer: str) -> dict[str, str]:
        """The fields that an image with passes of that kind of a view layer carries."""
        name = f"{layer}.Crypto{kind}"
        prefix = f"cryptomatte/{murmur3(name.encode()):08x}"[:-1]
        manifest = {each: f"{bits:08x}" for each, bits in self.names[kind].items()}
        return {
            f"{prefix}/name": name,
            f"{prefix}/hash": "MurmurHash3_32",
            f"{prefix}/conversion": "uint32_to_float32",
            f"{prefix}/manifest": json.dumps(manifest, ensure_ascii=False, separators=(",", ":")),
        }
