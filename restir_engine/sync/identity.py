"""Keys by which an object or instance of one frame is found again in another: hashes of names and instance numbers."""

import hashlib

import numpy as np


def name_key(instance) -> int:
    """What all instances of an object under one instancer share: 63 bits of their names."""
    owner = instance.instance_object if instance.is_instance else instance.object
    owners = (owner, instance.parent, instance.object.data)
    names = "\0".join(item.name_full if item else "" for item in owners)
    return int.from_bytes(hashlib.blake2b(names.encode(), digest_size=8).digest(), "little") >> 1


def numbered(keys: np.ndarray, numbers: np.ndarray) -> np.ndarray:
    """Keys (n,) int64 told apart by the instances' persistent_id (n, 8)."""
    result = np.asarray(keys, np.uint64)
    for column in np.asarray(numbers, np.int64).astype(np.uint64).T:
        result = (result ^ column) * np.uint64(0x9E3779B97F4A7C15)
        result ^= result >> np.uint64(29)
    return (result >> np.uint64(1)).astype(np.int64)


def identity(instance) -> int:
    """The key of one entry of `depsgraph.object_instances`."""
    key = name_key(instance)
    return int(numbered([key], [instance.persistent_id])[0]) if instance.is_instance else key
