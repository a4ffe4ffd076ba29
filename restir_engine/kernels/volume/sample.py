"""The program of a medium at many points at once: what bounds of its extinction are made from."""

from ..core.jit import device, kernel
from ..core.memory import clear_record, load_f32, load_f64, store_f32, store_i32
from ..core.records import (
    PHASE,
    SCENE,
    SCRATCH_MEDIA,
    instance_at,
    majorants_at,
    shadow_point_in,
    voxels_at,
)
from ..core.vec import max3, put, scale, store3_f32, transform_point, vec
from .stack import entry_at, evaluate


@kernel
def sample_medium(scene: SCENE, scratch, instance, material, points, first, last, out):
    """Run the program of a medium at points [first, last).

    instance: its index, -1: the world's medium; points: float64 [n, 3] in object space; out: float32 [n, 5]: the
    extinction, rgb, and the largest channels of scattering and emission.
    """
    _start(scene, scratch, instance, material)
    point = shadow_point_in(scratch)
    entry = entry_at(scratch + SCRATCH_MEDIA, 0)
    for i in range(first, last):
        p = (load_f64(points, 3 * i), load_f64(points, 3 * i + 1), load_f64(points, 3 * i + 2))
        if instance >= 0:
            p = transform_point(instance_at(scene.instances, instance).to_world, p)
        put(point.p, p)
        evaluate(scene, entry, point)
        store3_f32(out + 20 * i, 0, vec(entry.sigma_t))
        store_f32(out, 5 * i + 3, max3(vec(entry.sigma_s)))
        store_f32(out, 5 * i + 4, max3(vec(entry.emission)))


@kernel
def describe_medium(scene: SCENE, scratch, instance, material, point, value, majorants):
    """Put to MAJORANTS the coefficients of a medium at a point over `value`, and its phase functions.

    point: float64 [3] in object space; value: float64 [1]; both and MAJORANTS by their addresses.
    """
    _start(scene, scratch, instance, material)
    sp = shadow_point_in(scratch)
    entry = entry_at(scratch + SCRATCH_MEDIA, 0)
    p = (load_f64(point, 0), load_f64(point, 1), load_f64(point, 2))
    put(sp.p, transform_point(instance_at(scene.instances, instance).to_world, p))
    evaluate(scene, entry, sp)
    target = majorants_at(majorants, 0)
    over = 1.0 / load_f64(value, 0)
    put(target.sigma_t, scale(vec(entry.sigma_t), over))
    put(target.sigma_s, scale(vec(entry.sigma_s), over))
    target.n_phases = entry.n_phases
    for k in range(PHASE * entry.n_phases):
        target.phases[k] = entry.phases[k]


@device
def _start(scene, scratch, instance, material):
    """Make the scratch's second SHADING_POINT one inside the medium that no ray in particular arrives at."""
    clear_record(shadow_point_in(scratch))
    point = shadow_point_in(scratch)
    point.instance = instance
    point.mesh = instance_at(scene.instances, instance).mesh if instance >= 0 else -1
    point.primitive = -1
    point.light = -1
    point.material = material
    put(point.wo, (0.0, 0.0, 1.0))
    put(point.n, (0.0, 0.0, 1.0))
    put(point.ng, (0.0, 0.0, 1.0))


@kernel
def cell_extremes(voxels, size, first, last, ny, nz, out, means):
    """Where the VOXELS at an address have their extremes in each cell of a grid, for cells [first, last) along x.

    A cell (i, j, k) is made of the voxels from size (i, j, k) to size (i + 1, j + 1, k + 1), both included: all that
    linear interpolation inside of it uses. out: int32 [nx, ny, nz, 2, 3], indices of the least and the largest, by the
    sum of the components. means: float32 [nx, ny, nz], the mean of that sum where it is not below 0.
    """
    grid = voxels_at(voxels, 0)
    for i in range(first, last):
        for j in range(ny):
            for k in range(nz):
                cell = (i * ny + j) * nz + k
                store_f32(means, cell, _extremes_of(grid, size, i, j, k, out + 24 * cell))


@device
def _extremes_of(grid, size, i, j, k, out):
    """Put the indices of a cell's extremes to `out`; the mean of what is not below 0."""
    low = 1.0e300
    high = -1.0e300
    total = 0.0
    count = 0
    for x in range(size * i, min(size * (i + 1), grid.nx - 1) + 1):
        for y in range(size * j, min(size * (j + 1), grid.ny - 1) + 1):
            at = ((x * grid.ny + y) * grid.nz + size * k) * grid.components
            for z in range(size * k, min(size * (k + 1), grid.nz - 1) + 1):
                value = 0.0
                for _ in range(grid.components):
                    value += load_f32(grid.values, at)
                    at += 1
                total += max(value, 0.0)
                count += 1
                if value < low:
                    low = value
                    _put_index(out, 0, x, y, z)
                if value > high:
                    high = value
                    _put_index(out, 3, x, y, z)
    return total / count if count > 0 else 0.0


@device
def _put_index(out, at, x, y, z):
    store_i32(out, at, x)
    store_i32(out, at + 1, y)
    store_i32(out, at + 2, z)
