"""Bounds of media that vary in space, found when a scene is committed (docs/media.md, Majorants)."""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..kernels.core import records as rec
from ..kernels.core.jit import load
from ..kernels.core.memory import address
from ..kernels.volume.sample import cell_extremes, describe_medium, sample_medium
from .instances import inverse
from .mesh import Mesh
from .voxels import VoxelAttribute, same_place

if TYPE_CHECKING:
    from .scene import Scene

# Cells along the longest side of a box, of media whose program depends on the point and of grids of voxels.
_TEXTURED_CELLS, _VOXEL_CELLS = 32, 64

# Points of each cell that a program is sampled at, besides the extremes of its voxels: 8 where it depends on the point.
_TEXTURED_SAMPLES, _VOXEL_SAMPLES = 8, 1

# The largest sample of a cell and of those around it, times this, bounds a program that depends on the point; where it
# does not, no cell has less than that share of the largest bound.
_MARGIN, _LEAST_SHARE = 1.2, 0.01

_UNITS = 65534  # that bounds and means are counted in, of their largest: 16 bits, and one more by rounding
_EMISSION_EVENTS = 16.0  # tentative collisions along a box's diagonal where it emits most
_WORLD_SIZE = 16.0  # of the box that the world's medium fills, against that of the scene


class _Cells(NamedTuple):
    """A box divided into cells. to_object: 3x4, from cells to object space; voxels: those that it is aligned with."""

    shape: tuple[int, int, int]
    to_object: np.ndarray
    voxels: list[VoxelAttribute]
    size: int = 0  # voxels along a cell


class _Bounds(NamedTuple):
    """What MAJORANTS have by cells, and whether the medium scatters and emits. units: of bounds, residuals, means."""

    bounds: np.ndarray
    means: np.ndarray
    units: tuple[float, float, float]
    color: np.ndarray
    scatters: bool
    emits: bool


def commit_majorants(scene: Scene) -> list[np.ndarray]:
    """Put MAJORANTS to the instances (and the world) whose media vary; what has to stay alive for them."""
    table = scene.shaders.materials
    varies = (table["flags"] & rec.MATERIAL_MEDIUM_VARIES) != 0
    kept: list[np.ndarray] = []
    of_grids: dict[int, _Bounds] = {}
    if not scene.record["flags"] & rec.SCENE_HAS_VARYING_MEDIA:
        return kept
    load([sample_medium, cell_extremes, describe_medium])
    if scene.record["flags"] & rec.SCENE_WORLD_MEDIUM and varies[scene.record["world_material"]]:
        record = _world_majorants(scene, kept)
        scene.record["world_majorants"] = address(record)
        kept.append(record)
    for index in np.flatnonzero(scene.have_flag(rec.MATERIAL_MEDIUM_VARIES)).tolist():
        instance = scene.instances[index]
        if not isinstance(scene.meshes[instance["mesh"]], Mesh):
            continue
        start, count = instance["materials"], instance["n_materials"]
        materials = scene.material_slots[start : start + count]
        slots = np.zeros(count, np.int64)
        for slot, material in enumerate(materials):
            if varies[material]:
                record = _majorants(scene, index, material, of_grids, kept)
                slots[slot] = address(record)
                kept.append(record)
        scene.instances["majorants"][index] = address(slots)
        kept.append(slots)
    return kept


def _majorants(scene: Scene, index: int, material: int, of_grids: dict, kept: list) -> np.ndarray:
    instance = scene.instances[index]
    mesh = scene.meshes[instance["mesh"]]
    cells = _cells_of(mesh)
    to_world = _square(instance["to_world"])
    name = scene.shaders[material].medium_grid
    grid = next((grid for grid in cells.voxels if grid.name == name and grid.components == 1), None)
    if grid is not None and grid.values.max() > 0.0:
        if id(grid) not in of_grids:
            of_grids[id(grid)] = _grid_bounds(cells, grid)
        record = _record(cells, of_grids[id(grid)], to_world, kept)
        _describe(scene, index, material, cells, grid, record)
        return record
    textured = bool(scene.shaders.materials["flags"][material] & rec.MATERIAL_MEDIUM_TEXTURED) or not cells.voxels
    found = _bounds(scene, index, material, cells, textured, _diagonal(cells, to_world))
    return _record(cells, found, to_world, kept)


def _grid_bounds(cells: _Cells, grid: VoxelAttribute) -> _Bounds:
    """What MAJORANTS have of a grid of voxels, by the voxels' own unit: the same for all media proportional to it."""
    found, mean = _extremes(cells, grid)
    low, high = (np.maximum(grid.values[tuple(np.moveaxis(found[..., k, :], -1, 0))][..., 0], 0.0) for k in (0, 1))
    bound, bound_unit = _in_units(high, np.ceil)
    mean, mean_unit = _in_units(mean, np.rint)
    residual, residual_unit = _in_units(np.maximum(high - mean * mean_unit, mean * mean_unit - low), np.ceil)
    units = bound_unit, residual_unit, mean_unit
    return _Bounds(bound.astype(np.uint16), (mean << 16) + residual, units, np.ones(3), False, False)


def _describe(scene: Scene, index: int, material: int, cells: _Cells, grid: VoxelAttribute, record: np.ndarray) -> None:
    """Make MAJORANTS of a grid those of a medium that is proportional to it, by its coefficients at the largest value.

    Instances differ in these alone, by their density or by what a program asks of their object.
    """
    place = np.array(np.unravel_index(grid.values.argmax(), grid.values.shape[:3]), np.float64)
    point = grid.to_object @ (*place, 1.0)
    value = np.array([grid.values.max()], np.float64)
    scratch = np.zeros(rec.SCRATCH_BYTES, np.uint8)
    describe_medium(scene.record, address(scratch), index, material, address(point), address(value), address(record))
    medium = record[0]
    medium["voxels"], medium["size"] = address(grid.table), cells.size
    medium["scatters"] = medium["sigma_s"].any()
    most = medium["sigma_t"].max()
    if most > 0.0:
        medium["color"] = medium["sigma_t"] / most
    for unit in ("bound_unit", "residual_unit", "mean_unit"):
        medium[unit] *= most


def _world_majorants(scene: Scene, kept: list) -> np.ndarray:
    bounds = np.array(scene.record["bounds"]).reshape(2, 3)
    points = np.concatenate([bounds, *(np.array(camera.origins()) for camera in scene.cameras)])
    low, high = points.min(0), points.max(0)
    half = np.full(3, max(0.5 * _WORLD_SIZE * np.linalg.norm(high - low), 1.0))
    center = 0.5 * (low + high)
    cells = _box(center - half, center + half)
    values = _bounds(scene, -1, int(scene.record["world_material"]), cells, True, _diagonal(cells, np.eye(4)))
    return _record(cells, values, np.eye(4), kept)


def _cells_of(mesh) -> _Cells:
    grids = [attribute for attribute in mesh.attributes if isinstance(attribute, VoxelAttribute)]
    if grids and all(same_place(grid, grids[0]) for grid in grids):
        counts = np.array(grids[0].values.shape[:3]) - 1
        size = max(2, -(-int(counts.max()) // _VOXEL_CELLS))
        to_object = grids[0].to_object.copy()
        to_object[:, :3] *= size
        return _Cells(tuple(-(-counts // size)), to_object, grids, size)
    return _box(mesh.vertices.min(0).astype(float), mesh.vertices.max(0).astype(float))


def _box(low: np.ndarray, high: np.ndarray) -> _Cells:
    extent = np.maximum(high - low, 1e-20)
    shape = np.clip(np.ceil(_TEXTURED_CELLS * extent / extent.max()), 1, _TEXTURED_CELLS).astype(int)
    margin = 1.0e-6 * extent.max()  # vertices are rounded
    edges = (extent + 2.0 * margin) / shape
    return _Cells(tuple(shape), np.column_stack([np.diag(edges), low - margin]), [])


def _bounds(scene: Scene, index: int, material: int, cells: _Cells, textured: bool, diagonal: float) -> _Bounds:
    """What MAJORANTS have of a medium."""
    samples = _TEXTURED_SAMPLES if textured else _VOXEL_SAMPLES
    points, empty = _points(cells, samples, textured)
    found = np.zeros((*cells.shape, points.shape[1], 5), np.float32)
    found[~empty] = _sampled(scene, index, material, points)
    if empty.any() and not textured:
        # Nothing but the grids makes a difference, and they are 0 there: one point stands for all.
        place = cells.to_object @ (*np.argwhere(empty)[0] + 0.5, 1.0)
        found[empty] = _sampled(scene, index, material, place.reshape(1, 1, 3))[0]
    extinction, emission = found[..., :3].max((-1, -2)), found[..., 4].max(-1)
    mean = found[..., :samples, :3].mean(-2)
    color = mean.sum((0, 1, 2), dtype=np.float64)
    color = color / color.max() if color.any() else np.ones(3)
    mean, mean_unit = _in_units(mean @ color / (color @ color), np.rint)
    residual = np.abs(found[..., :3] - (mean * mean_unit)[..., None, None] * color).max((-1, -2))
    if textured:
        extinction, emission, residual = _MARGIN * _around(extinction), _around(emission), _MARGIN * _around(residual)
        least = _LEAST_SHARE * extinction.max(initial=0.0)
        extinction, residual = np.maximum(extinction, least), np.maximum(residual, least)
    bound = extinction
    if emission.any():
        rate = _EMISSION_EVENTS / diagonal * np.maximum(emission / emission.max(), 1.0 / _EMISSION_EVENTS)
        bound = np.maximum(bound, np.where((emission > 0.0) | textured, rate, 0.0))
    bound, bound_unit = _in_units(bound, np.ceil)
    residual, residual_unit = _in_units(residual, np.ceil)
    means = (mean << 16) + residual
    units = bound_unit, residual_unit, mean_unit
    return _Bounds(bound.astype(np.uint16), means, units, color, bool(found[..., 3].any()), bool(emission.any()))


def _in_units(values: np.ndarray, rounded) -> tuple[np.ndarray, float]:
    """(values as uint32 of at most 16 bits, their unit)."""
    unit = float(values.max(initial=0.0)) / _UNITS or 1.0
    return rounded(values / unit).astype(np.uint32), unit


def _points(cells: _Cells, samples: int, textured: bool) -> tuple[np.ndarray, np.ndarray]:
    """Points in cells that are not empty, (m, points a cell, 3) in object space; which cells are empty."""
    empty = np.zeros(cells.shape, bool)
    extremes = []
    for grid in cells.voxels:
        extremes.append(_extremes(cells, grid)[0])
    if cells.voxels and not textured:
        empty[...] = True
        for grid, found in zip(cells.voxels, extremes, strict=True):
            empty &= ~grid.values[found[..., 0], found[..., 1], found[..., 2]].any((-2, -1))
    where = np.argwhere(~empty)
    random = np.random.default_rng(1)
    side = round(samples ** (1.0 / 3.0))
    strata = np.stack(np.meshgrid(*[np.arange(side)] * 3, indexing="ij"), -1).reshape(1, -1, 3)
    places = where[:, None] + (strata + random.random((len(where), samples, 3))) / side
    points = [places @ cells.to_object[:, :3].T + cells.to_object[:, 3]]
    for grid, found in zip(cells.voxels, extremes, strict=True):
        points.append(found[~empty] @ grid.to_object[:, :3].T + grid.to_object[:, 3])
    return np.ascontiguousarray(np.concatenate(points, 1), np.float64), empty


def _extremes(cells: _Cells, grid: VoxelAttribute) -> tuple[np.ndarray, np.ndarray]:
    """What `cell_extremes` gives for a grid: the indices of the least and the largest voxel of each cell, the means."""
    nx, ny, nz = cells.shape
    found = np.zeros((nx, ny, nz, 2, 3), np.int32)
    means = np.zeros((nx, ny, nz), np.float32)

    def part(first: int, last: int, _: np.ndarray) -> None:
        cell_extremes(address(grid.table), cells.size, first, last, ny, nz, address(found), address(means))

    _in_parts(part, nx)
    return found, means


def _sampled(scene: Scene, index: int, material: int, points: np.ndarray) -> np.ndarray:
    """What `sample_medium` gives at points (…, 3), float32 (…, 5)."""
    out = np.zeros((*points.shape[:-1], 5), np.float32)

    def part(first: int, last: int, scratch: np.ndarray) -> None:
        sample_medium(scene.record, address(scratch), index, material, address(points), first, last, address(out))

    _in_parts(part, points.size // 3)
    return np.nan_to_num(out, nan=0.0, posinf=0.0)


def _in_parts(function, count: int) -> None:
    """Call function(first, last, scratch memory) for parts of `count`, on as many threads as there are processors."""
    edges = np.linspace(0, count, (os.cpu_count() or 1) + 1).astype(int)

    def run(first: int, last: int) -> None:
        function(first, last, np.zeros(rec.SCRATCH_BYTES, np.uint8))

    with ThreadPoolExecutor(os.cpu_count()) as pool:
        list(pool.map(run, edges[:-1].tolist(), edges[1:].tolist()))


def _around(values: np.ndarray) -> np.ndarray:
    """The largest of each cell and those around it."""
    for axis in range(3):
        low = np.pad(values, [(1, 1) if k == axis else (0, 0) for k in range(3)])
        n = values.shape[axis]
        values = np.maximum.reduce([low.take(range(k, k + n), axis) for k in range(3)])
    return values


def _diagonal(cells: _Cells, to_world: np.ndarray) -> float:
    return float(np.linalg.norm(to_world[:3, :3] @ (cells.to_object[:, :3] @ np.array(cells.shape))))


def _square(matrix: np.ndarray) -> np.ndarray:
    return np.vstack([np.asarray(matrix, np.float64).reshape(3, 4), (0.0, 0.0, 0.0, 1.0)])


def _record(cells: _Cells, found: _Bounds, to_world: np.ndarray, kept: list) -> np.ndarray:
    record = np.zeros(1, rec.MAJORANTS)
    record[0]["to_grid"] = inverse((to_world @ _square(cells.to_object))[:3].reshape(1, 12))[0]
    record[0]["nx"], record[0]["ny"], record[0]["nz"] = cells.shape
    record[0]["scatters"], record[0]["emits"] = found.scatters, found.emits
    record[0]["bounds"], record[0]["means"] = address(found.bounds), address(found.means)
    record[0]["bound_unit"], record[0]["residual_unit"], record[0]["mean_unit"] = found.units
    record[0]["color"] = found.color
    kept += [found.bounds, found.means]
    return record
