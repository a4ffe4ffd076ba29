"""What moves while the shutter is open: transforms that turn on an arc, and lines that follow it.

Between two steps translation and stretch go linearly, the rotation along the arc between two unit quaternions. Rays
and surfaces know lines between matrices alone, which take a third of an arc's time in Embree: steps are made finer
until the lines are as good as the arcs.
"""

from __future__ import annotations

from itertools import product
from typing import NamedTuple

import numpy as np

# How far a line may be from its arc, by the size of what moves: a quarter of a pixel where it fills a picture of 1000.
_DEVIATION = 2.5e-4
_MOST_STEPS = 129  # that Embree takes


class Parts(NamedTuple):
    """Affine matrices as translation · rotation · stretch; the stretch is upper triangular."""

    translation: np.ndarray  # (..., 3)
    rotation: np.ndarray  # (..., 4) unit quaternions (w, x, y, z)
    stretch: np.ndarray  # (..., 3, 3)


def decompose(matrices: np.ndarray) -> Parts:
    """The parts of 3x4 matrices (..., steps, 12) that are not singular.

    Of those that mirror, the stretch does: its diagonal is negative. Rotations that follow one another take the shorter
    arc.
    """
    matrices = np.asarray(matrices, np.float64)
    matrices = matrices.reshape(*matrices.shape[:-1], 3, 4)
    mirrors = np.sign(np.linalg.det(matrices[..., :3]))[..., None, None]
    rotation, stretch = np.linalg.qr(matrices[..., :3] * mirrors)
    sign = np.sign(np.einsum("...ii->...i", stretch))
    rotation, stretch = rotation * sign[..., None, :], stretch * sign[..., :, None] * mirrors
    quaternions = _quaternions(rotation.reshape(-1, 3, 3)).reshape(*rotation.shape[:-2], 4)
    return Parts(matrices[..., 3], _shorter_arcs(quaternions), stretch)


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
    """The same rotations (..., steps, 4), none of them more than a right angle of quaternions from the one before."""
    turns = np.where((quaternions[..., 1:, :] * quaternions[..., :-1, :]).sum(axis=-1) < 0.0, -1.0, 1.0)
    quaternions = quaternions.copy()
    quaternions[..., 1:, :] *= np.cumprod(turns, axis=-1)[..., None]
    return quaternions


def rotation_matrices(quaternions: np.ndarray) -> np.ndarray:
    """The matrices (..., 3, 3) of unit quaternions (..., 4)."""
    w, x, y, z = np.moveaxis(quaternions, -1, 0)
    rows = [
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
        [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
        [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
    ]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def along_arcs(matrices: np.ndarray, finer: int) -> np.ndarray:
    """Matrices (..., steps, 12) with `finer` steps for each one, between which translation and stretch go linearly."""
    steps = matrices.shape[-2]
    if finer == 1:
        return np.array(matrices, np.float64)
    parts = decompose(matrices)
    before = np.repeat(np.arange(steps - 1), finer)
    share = np.tile(np.arange(finer) / finer, steps - 1)[:, None]

    def line(values: np.ndarray, weight: np.ndarray) -> np.ndarray:
        return values[..., before, :] * (1.0 - weight) + values[..., before + 1, :] * weight

    q, r = parts.rotation[..., before, :], parts.rotation[..., before + 1, :]
    angle = np.arccos(np.clip((q * r).sum(axis=-1, keepdims=True), -1.0, 1.0))
    sine = np.maximum(np.sin(angle), 1e-12)
    arc = (np.sin((1.0 - share) * angle) * q + np.sin(share * angle) * r) / sine
    turns = np.where(angle > 1e-6, arc, line(parts.rotation, share))
    stretch = line(parts.stretch.reshape(*parts.stretch.shape[:-2], 9), share)
    linear = rotation_matrices(turns / np.linalg.norm(turns, axis=-1, keepdims=True)) @ stretch.reshape(
        *stretch.shape[:-1], 3, 3
    )
    between = np.concatenate([linear, line(parts.translation, share)[..., None]], axis=-1)
    between = between.reshape(*between.shape[:-2], 12)
    between[..., ::finer, :] = matrices[..., :-1, :]
    return np.concatenate([between, matrices[..., -1:, :]], axis=-2)


def finer_by(matrices: np.ndarray, angle: np.ndarray | float) -> np.ndarray:
    """How many steps it takes for each of (..., steps, 12) that none turns by more than an angle, a power of two."""
    steps = matrices.shape[-2]
    rotation = decompose(matrices).rotation
    cosine = (rotation[..., 1:, :] * rotation[..., :-1, :]).sum(axis=-1).min(axis=-1)
    wanted = 2.0 * np.arccos(np.clip(cosine, -1.0, 1.0)) / angle
    most = int(np.log2(max((_MOST_STEPS - 1) // (steps - 1), 1)))
    return 1 << np.clip(np.ceil(np.log2(np.maximum(wanted, 1.0))), 0, most).astype(np.int64)


def polylines(matrices: np.ndarray, boxes: np.ndarray) -> list[np.ndarray]:
    """For each of (n, steps, 12) the matrices (more steps, 12), at even distances, between which things go on lines.

    boxes: lower and upper corners (n, 2, 3) of what is placed; a line leaves its arc by a square of the angle.
    """
    middle = matrices[:, matrices.shape[1] // 2].reshape(-1, 3, 4)[:, :, :3]
    corners = np.stack([boxes[:, list(which), [0, 1, 2]] for which in product((0, 1), repeat=3)], axis=1)
    corners = corners @ middle.transpose(0, 2, 1)
    radius = np.linalg.norm(corners, axis=2).max(axis=1)
    size = np.linalg.norm(np.ptp(corners, axis=1), axis=1)
    angle = np.sqrt(8.0 * _DEVIATION * np.maximum(size, 1e-30) / np.maximum(radius, 1e-30))
    finer = finer_by(matrices, np.maximum(angle, 1e-6))
    result: list[np.ndarray] = [matrices[0]] * len(matrices)
    for count in np.unique(finer).tolist():
        mine = np.flatnonzero(finer == count)
        for index, steps in zip(mine.tolist(), along_arcs(matrices[mine], count), strict=True):
            result[index] = steps
    return result


def swept(box: np.ndarray, matrices: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Lower and upper corner of what a box, (2, 3), passes on the lines between matrices (steps, 12)."""
    matrices = matrices.reshape(-1, 3, 4)
    corners = np.array(list(product(*box.T)))
    passed = corners @ matrices[:, :, :3].transpose(0, 2, 1) + matrices[:, None, :, 3]
    return passed.min(axis=(0, 1)), passed.max(axis=(0, 1))


def differ(steps: np.ndarray) -> np.ndarray:
    """Which rows of (n, steps, m) are not the same at all steps: bool (n,)."""
    return (steps != steps[:, :1]).any(axis=(1, 2))
