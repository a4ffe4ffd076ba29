"""Volume objects and smoke domains → a box with grids of voxels as its attributes.

Grids are read where shaders ask for them, by their names. Where Blender says that voxel i lies: from 5.0 on its centre
at the index i, before at i + 0.5.
"""

from __future__ import annotations

import os
from collections.abc import Hashable
from contextlib import nullcontext

import bpy
import numpy as np

from ..scene.mesh import Mesh
from ..scene.voxels import VoxelAttribute, box_mesh
from .voxels import Unreadable, read_voxels, saved

_Grid = tuple[str, np.ndarray, np.ndarray]  # name, values, 4x4 from their indices to object space

_CENTER = 0.0 if bpy.app.version >= (5, 0, 0) else 0.5


def is_grids(item: bpy.types.Object) -> bool:
    """Whether an object is rendered as a box of grids."""
    return isinstance(item.data, bpy.types.Volume) or smoke_domain(item) is not None


def read_grids(scene, item: bpy.types.Object, kept) -> Mesh | None:
    """The box of a Volume object or of a smoke domain; see `read_volume` and `read_domain`."""
    domain = smoke_domain(item)
    return read_domain(scene, item, domain) if domain else read_volume(scene, item, kept)


def read_volume(scene, item: bpy.types.Object, kept) -> Mesh | None:
    """The box of an evaluated Volume object, None where there is nothing to render, which a warning says.

    kept: a `Recent` of what earlier frames have read of files.
    """
    data = item.data
    if not data.grids.load():
        if data.filepath:
            scene.warnings.add("Volume", data.name, f"is not rendered: {data.grids.error_message or 'no file'}")
        return None
    wanted = [grid for grid in data.grids if grid.name in scene.attribute_names]
    path = data.grids.frame_filepath
    file = _identity(bpy.path.abspath(path))
    key = (file, *(grid.name for grid in wanted))
    found = kept.get(key) if file else None
    if found is None and wanted:
        try:
            with nullcontext(path) if file else saved(data) as source:
                found = _cropped(_readable(scene, item, source, wanted))
        except (Unreadable, OSError) as error:
            scene.warnings.add("Volume", data.name, f"is not rendered: {error}")
            return None
    if file:
        kept.put(key, found or [])
    return _box(scene, data.name, found or [])


def _readable(scene, item: bpy.types.Object, path: str, grids: list) -> list[_Grid]:
    """Those grids of a file that can be read; a warning names the others."""
    found = []
    for grid in grids:
        try:
            found.append((grid.name, *_read(path, grid, item.bound_box)))
        except (Unreadable, RuntimeError, TypeError, ValueError) as error:
            scene.warnings.add("Volume", item.data.name, f"grid {grid.name} is left out: {error}")
    return found


def _box(scene, name: str, grids: list[_Grid]) -> Mesh | None:
    """The box of grids that are `_cropped`."""
    return box_mesh(name, [VoxelAttribute(scene.attribute_name(own), *rest) for own, *rest in grids]) if grids else None


def density_factors(matrices: np.ndarray) -> np.ndarray:
    """By what the coefficients of Volumes whose density is meant in object space are multiplied: (n,).

    matrices: 3x4, (n, 12). As in Cycles, sizes are those of the diagonal.
    """
    lengths = np.linalg.norm(matrices.reshape(-1, 3, 4)[:, :, :3].sum(2), axis=1) * 3.0**-0.5
    return 1.0 / np.where(lengths > 0.0, lengths, 1.0)


def smoke_domain(item: bpy.types.Object) -> bpy.types.FluidDomainSettings | None:
    """The settings of an object that is the domain of smoke and fire."""
    for modifier in item.modifiers if item.type == "MESH" else ():
        if modifier.type == "FLUID" and modifier.show_render and modifier.fluid_type == "DOMAIN":
            return modifier.domain_settings if modifier.domain_settings.domain_type == "GAS" else None
    return None


# The grids of a smoke domain by the names that shaders know them by: property and components.
_DOMAIN_GRIDS = {
    "density": ("density_grid", 1),
    "flame": ("flame_grid", 1),
    "heat": ("heat_grid", 1),
    "temperature": ("temperature_grid", 1),
    "color": ("color_grid", 4),
    "velocity": ("velocity_grid", 3),
}


def read_domain(scene, item: bpy.types.Object, domain) -> Mesh | None:
    """The box of a smoke domain, whose grids fill the texture space of its mesh; None before it is simulated."""
    resolution = np.array(domain.domain_resolution)
    location, size = np.array(item.data.texspace_location), np.array(item.data.texspace_size)
    found = []
    for name, (grid, components) in _DOMAIN_GRIDS.items():
        source = getattr(domain, grid)
        if name not in scene.attribute_names or not len(source):
            continue
        shape = resolution
        if len(source) != components * np.prod(resolution):  # with noise some grids are finer
            shape = resolution * domain.noise_scale
        if len(source) != components * np.prod(shape):
            scene.warnings.add("Object", item.name, f"grid {name} of the smoke domain is left out: of unknown size")
            continue
        values = np.empty(len(source), np.float32)
        source.foreach_get(values)
        edges = 2.0 * size / shape
        to_object = np.column_stack([np.diag(edges), location - size + 0.5 * edges])
        values = values.reshape(*shape[::-1], components).transpose(2, 1, 0, 3)
        found.append((name, values, np.vstack([to_object, (0.0, 0.0, 0.0, 1.0)])))
    return _box(scene, item.data.name, _cropped(found))


def _identity(path: str) -> Hashable:
    """What tells a file's content; None where there is no file."""
    try:
        status = os.stat(path) if path else None
    except OSError:
        return None
    return status and (path, status.st_mtime_ns, status.st_size)


def _read(path: str, grid: bpy.types.VolumeGrid, box) -> tuple[np.ndarray, np.ndarray]:
    """(values, 4x4 from indices of these to object space) of a grid that is 0 outside of a box."""
    matrix = np.array(grid.matrix_object, np.float64)
    corners = np.array([tuple(corner) for corner in box])
    to_index = np.linalg.inv(matrix)
    corners = corners @ to_index[:3, :3].T + to_index[:3, 3]
    low = np.floor(corners.min(0) + 1e-4).astype(int) - 1
    high = np.ceil(corners.max(0) - 1e-4).astype(int) + 1
    values = read_voxels(path, grid, low, high - low + 1)
    np.nan_to_num(values, copy=False, nan=0.0, posinf=0.0, neginf=0.0)
    return values, _shifted(matrix, low + _CENTER)


def _shifted(matrix: np.ndarray, low: np.ndarray) -> np.ndarray:
    result = matrix.copy()
    result[:3, 3] += matrix[:3, :3] @ low
    return result


def _cropped(found: list[_Grid]) -> list[_Grid]:
    """Grids without what is 0 in all that have the same place, with zeros around; their matrices inverted."""
    groups: dict[tuple, list[_Grid]] = {}
    for name, values, matrix in found:
        groups.setdefault((values.shape[:3], matrix.tobytes()), []).append((name, values, matrix))
    result = []
    for group in groups.values():
        filled = np.any([values.any(-1) for _, values, _ in group], axis=0)
        if not filled.any():
            continue
        sides = [np.flatnonzero(filled.any(tuple(k for k in range(3) if k != axis))) for axis in range(3)]
        low = np.array([side[0] for side in sides]) - 1
        high = np.array([side[-1] for side in sides]) + 1
        for name, values, matrix in group:
            block = values[tuple(slice(max(a, 0), b + 1) for a, b in zip(low, high, strict=True))]
            pad = [(max(-a, 0), max(b + 1 - n, 0)) for a, b, n in zip(low, high, values.shape[:3], strict=True)]
            block = np.pad(block, [*pad, (0, 0)])
            result.append((name, block, np.linalg.inv(_shifted(matrix, low))))
    return result
