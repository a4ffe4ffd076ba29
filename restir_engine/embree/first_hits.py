"""What many rays hit first, one call a ray from Python: a microsecond and a half each, nothing to be compiled."""

from __future__ import annotations

import numpy as np

from . import library as lib
from .scenes import WorldScene

_WORDS = 32  # an RTCRayHit and room to keep them aligned


def first_hits(scene: WorldScene, origins: np.ndarray, directions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(instance, normal) of rays (n, 3): index into the scene's content, -1: none; Ng in the instance's own space."""
    count = len(origins)
    memory = np.zeros(count * _WORDS + 16, np.float32)
    start = (-memory.ctypes.data // 4) % 16
    rays = memory[start : start + count * _WORDS].reshape(count, _WORDS)
    bits = rays.view(np.uint32)
    rays[:, 0:3], rays[:, 4:7], rays[:, 8] = origins, directions, np.inf
    bits[:, 9] = bits[:, 18:21] = lib.INVALID
    query, first, stride = lib.load().rtcIntersect1, rays.ctypes.data, rays.strides[0]
    for place in range(first, first + count * stride, stride):
        query(scene.handle, place, None)
    instance = np.where(bits[:, 18] == lib.INVALID, -1, bits[:, 19].astype(np.int64))
    return instance, rays[:, 12:15]
