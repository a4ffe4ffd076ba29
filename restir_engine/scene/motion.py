"""What moves while the shutter is open: transforms taken apart, so that what is between two of them turns on an arc."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np


class Parts(NamedTuple):
    """Affine matrices as translation · rotation · stretch; the stretch is upper triangular, as Embree has it."""

    translation: np.ndarray  # (n, 3)
    rotation: np.ndarray  # (n, 4) unit quaternions (w, x, y, z)
    stretch: np.ndarray  # (n, 3, 3)


def decompose(matrices: np.ndarray) -> Parts:
    """The parts of 3x4 matrices (n, 12) that are not singular.

    Of those that mirror, the stretch does: its diagonal is negative. Rotations that follow one another take the shorter
    arc.
    """
    matrices = np.asarray(matrices, np.float64).reshape(-1, 3, 4)
    linear = matrices[:, :, :3] * np.sign(np.linalg.det(matrices[:, :, :3]))[:, None, None]
    rotation, stretch = np.linalg.qr(linear)
    sign = np.sign(np.einsum("nii->ni", stretch))
    rotation, stretch = rotation * sign[:, None, :], stretch * sign[:, :, None]
    stretch *= np.sign(np.linalg.det(matrices[:, :, :3]))[:, None, None]
    return Parts(matrices[:, :, 3], _shorter_arcs(_quaternions(rotation)), stretch)


def _quaternions(rotation: np.ndarray) -> np.ndarray:
    """Unit quaternions (n, 4) of rotation matrices (n, 3, 3), from the largest of their components."""
    m = rotation
    x, y, z = np.einsum("nii->in", m)
    # 4 times the squares of w, x, y, z, and all products with each of them.
    squares = np.stack([1 + x + y + z, 1 + x - y - z, 1 - x + y - z, 1 - x - y + z], axis=1)
    wx, wy, wz = m[:, 2, 1] - m[:, 1, 2], m[:, 0, 2] - m[:, 2, 0], m[:, 1, 0] - m[:, 0, 1]
    xy, xz, yz = m[:, 1, 0] + m[:, 0, 1], m[:, 0, 2] + m[:, 2, 0], m[:, 2, 1] + m[:, 1, 2]
    products = np.array(
        [
            [squares[:, 0], wx, wy, wz],
            [wx, squares[:, 1], xy, xz],
            [wy, xy, squares[:, 2], yz],
            [wz, xz, yz, squares[:, 3]],
        ]
    )
    rows = products[squares.argmax(axis=1), :, np.arange(len(m))]
    return rows / np.linalg.norm(rows, axis=1, keepdims=True)


def _shorter_arcs(quaternions: np.ndarray) -> np.ndarray:
    """The same rotations (n, 4), none of them more than a right angle of quaternions from the one before."""
    turns = np.sign((quaternions[1:] * quaternions[:-1]).sum(axis=1))
    signs = np.concatenate([[1.0], np.cumprod(np.where(turns < 0.0, -1.0, 1.0))])
    return quaternions * signs[:, None]


def embree_parts(matrices: np.ndarray) -> np.ndarray:
    """RTCQuaternionDecomposition of 3x4 matrices (n, 12): float32 (n, 16), 16-byte aligned."""
    parts = decompose(matrices)
    block = np.zeros((len(parts.translation) + 1) * 16, np.float32)
    start = (-block.ctypes.data // 4) % 4
    result = block[start : start + 16 * len(parts.translation)].reshape(-1, 16)
    s = parts.stretch
    result[:, 0:3] = np.einsum("nii->ni", s)
    result[:, 3], result[:, 4], result[:, 5] = s[:, 0, 1], s[:, 0, 2], s[:, 1, 2]
    result[:, 9:13], result[:, 13:16] = parts.rotation, parts.translation
    return result


def swept(points: np.ndarray, matrices: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Lower and upper corner of a box that contains points (n, 3) under all that is between matrices (steps, 12)."""
    parts = decompose(matrices)
    reach = np.linalg.norm(np.einsum("sij,nj->sni", parts.stretch, points), axis=2).max()
    return parts.translation.min(axis=0) - reach, parts.translation.max(axis=0) + reach


def differ(steps: np.ndarray) -> np.ndarray:
    """Which rows of (n, steps, m) are not the same at all steps: bool (n,)."""
    return (steps != steps[:, :1]).any(axis=(1, 2))
