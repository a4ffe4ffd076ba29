"""Placing meshes in the world: INSTANCE arrays built at once from columns."""

from typing import NamedTuple

import numpy as np

from ..kernels.core.records import INSTANCE, INSTANCE_MIRRORED

_THICKNESS = 1e-4


class InstanceSteps(NamedTuple):
    """How instances move while the shutter is open."""

    instances: np.ndarray  # (n,) indices
    matrices: np.ndarray  # (n, steps, 12) object to world, at even distances of time; the middle ones are INSTANCE's


def inverse(matrices: np.ndarray) -> np.ndarray:
    """Inverses of invertible affine 3x4 matrices, (n, 12) float64."""
    matrices = np.asarray(matrices, np.float64).reshape(-1, 3, 4)
    rows, determinants = _cofactors(matrices)
    result = np.empty_like(matrices)
    result[:, :, :3] = rows / determinants[:, None, None]
    result[:, :, 3] = -np.einsum("nij,nj->ni", result[:, :, :3], matrices[:, :, 3])
    return result.reshape(-1, 12)


def _cofactors(matrices: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The inverses of the linear parts times their determinants, and these determinants."""
    x, y, z = matrices[:, :, 0], matrices[:, :, 1], matrices[:, :, 2]
    rows = np.stack([np.cross(y, z), np.cross(z, x), np.cross(x, y)], axis=1)
    return rows, (x * rows[:, 0]).sum(axis=1)


def usable(matrices: np.ndarray) -> np.ndarray:
    """Which 3x4 matrices (n, 12) are finite and flatten nothing: a bool (n,).

    A determinant is compared with the product of the axes' lengths, so that tiny objects count as usable.
    """
    finite = np.isfinite(matrices).all(axis=1)
    matrices = np.where(finite[:, None], matrices, 0.0).reshape(-1, 3, 4)
    volume = np.linalg.norm(matrices[:, :, :3], axis=1).prod(axis=1)
    # Below 1e-30 single precision (Embree's) has no inverse to offer.
    return (volume > 1e-30) & (np.abs(_cofactors(matrices)[1]) > 1e-9 * volume)


def thickened(matrices: np.ndarray) -> np.ndarray:
    """3x4 matrices (n, 12) that flatten in one direction alone made `usable`: they leave a ten-thousandth of the size.

    Others stay as they are, also those that leave but a line or a point, of which nothing can be seen.
    """
    result = np.array(matrices, np.float64).reshape(-1, 3, 4)
    flat = np.isfinite(matrices).all(axis=1) & ~usable(matrices)
    for i in np.flatnonzero(flat):
        u, sizes, v = np.linalg.svd(result[i, :, :3])
        if sizes[1] > _THICKNESS * sizes[0] > 1e-30:
            sizes[2] = _THICKNESS * sizes[0]
            result[i, :, :3] = (u * sizes) @ v
    return result.reshape(-1, 12)


def build_instances(matrices: np.ndarray, meshes: np.ndarray, **columns: np.ndarray) -> np.ndarray:
    """The INSTANCE array of n placements.

    matrices: object to world, (n, 12) or (n, 4, 4), all `usable`; meshes: indices (n,); columns: any other field of
    INSTANCE, one row an instance or one value for all. What is derived (inverse, location, mirroring) is filled in; an
    instance has no emissive triangles until the light table gives it some.
    """
    matrices = np.asarray(matrices, np.float64)
    if matrices.ndim == 3:
        matrices = matrices[:, :3, :].reshape(-1, 12)
    result = np.zeros(len(matrices), INSTANCE)
    result["mesh"] = meshes
    result["lights"] = -1
    result["links"] = result["blockers"] = result["light_group"] = -1
    result["terminator_frequency"] = 1.0
    result["volume_density"] = 1.0
    for name, values in columns.items():
        result[name] = values
    result["to_world"] = matrices
    result["to_object"] = inverse(matrices)
    result["location"] = matrices[:, [3, 7, 11]]
    result["flags"] |= np.where(_cofactors(matrices.reshape(-1, 3, 4))[1] < 0.0, INSTANCE_MIRRORED, 0)
    return result
