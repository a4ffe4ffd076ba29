"""Instances and meshes at the time of a path: what moves while the shutter is open.

Matrices go along straight lines from step to step, as in Embree, which has the same ones: `scene.motion` has made the
steps so fine that lines are as good as arcs. A tile keeps the last few, as a path asks for the same instance several
times. Vertices and their normals go along lines as well, as in Embree and in Cycles.
"""

from ..core.jit import device, inlined, outcome_entry
from ..core.memory import call_for_outcome, copy_words, load_f32, load_u32, record_address, record_at
from ..core.records import (
    INSTANCE,
    PLACED_BYTES,
    PLACED_HEADER,
    PLACES,
    instance_at,
    scene_at,
    shutter_at,
)
from ..core.records.layout import record
from ..core.vec import add, cross, dot, load3_f32, normalize, scale

_PLACED = record("instances", "index", ("time", 1))  # an INSTANCE follows
_placed_at = record_at(_PLACED)
_WORDS = INSTANCE.itemsize // 8


@inlined
def placed_at(scene, index):
    """The INSTANCE of an index, as it stands at the scene's time.

    The reference holds until a tile has asked for many others at other times: not over rays that are traced.
    """
    placed = instance_at(scene.instances, index)
    if placed.n_steps != 0 and scene.placed != 0:
        code = shutter_at(scene.shutter, 0).place
        placed = instance_at(call_for_outcome(code, record_address(scene), index, 0, 0, 0), 0)
    return placed


@outcome_entry
def place(scene, index, a, b, c):
    """The address of a copy of the INSTANCE of an index with the matrices and the location that it has at the time."""
    scene = scene_at(scene, 0)
    slot = scene.placed + PLACED_BYTES * (index % PLACES)
    kept = _placed_at(slot, 0)
    copied = slot + PLACED_HEADER
    if kept.index != index or kept.instances != scene.instances:
        copy_words(copied, record_address(instance_at(scene.instances, index)), _WORDS)
        kept.instances = scene.instances
        kept.index = index
    elif kept.time == scene.time:
        return copied
    kept.time = scene.time
    placed = instance_at(copied, 0)
    step, share = segment(scene.time, placed.n_steps)
    for i in range(12):
        a, b = load_f32(placed.steps, 12 * step + i), load_f32(placed.steps, 12 * step + 12 + i)
        placed.to_world[i] = a + (b - a) * share
    invert(placed.to_world, placed.to_object)
    for i in range(3):
        placed.location[i] = placed.to_world[4 * i + 3]
    return copied


@device
def invert(m, result):
    """The inverse of an affine 3x4 matrix, into another."""
    x, y, z = (m[0], m[4], m[8]), (m[1], m[5], m[9]), (m[2], m[6], m[10])
    rows = cross(y, z), cross(z, x), cross(x, y)
    inverse = 1.0 / dot(x, rows[0])
    t = (m[3], m[7], m[11])
    for i in range(3):
        row = scale(rows[i], inverse)
        result[4 * i], result[4 * i + 1], result[4 * i + 2] = row
        result[4 * i + 3] = -dot(row, t)


@inlined
def vertex(mesh, time, index):
    """A vertex of a mesh at a time, in object space."""
    if mesh.n_steps == 0:
        return load3_f32(mesh.vertices, index)
    return _between(time, mesh.n_steps, mesh.steps, mesh.steps_stride, index)


@inlined
def normal(mesh, time, index):
    """A normal of a mesh (a point's or a corner's) at a time, in object space."""
    if mesh.n_steps == 0:
        return load3_f32(mesh.normals, index)
    return normalize(_between(time, mesh.n_steps, mesh.normal_steps, mesh.normals_stride, index))


@device
def point(mesh, time, index):
    """A point of strands or spheres at a time: place and radius (x, y, z, r), in object space."""
    if mesh.n_steps == 0:
        return _load4(mesh.points, index)
    step, share = segment(time, mesh.n_steps)
    a = _load4(mesh.steps, step * mesh.steps_stride + index)
    b = _load4(mesh.steps, (step + 1) * mesh.steps_stride + index)
    return (
        a[0] + (b[0] - a[0]) * share,
        a[1] + (b[1] - a[1]) * share,
        a[2] + (b[2] - a[2]) * share,
        a[3] + (b[3] - a[3]) * share,
    )


@inlined
def _load4(address, index):
    at = 4 * index
    return load_f32(address, at), load_f32(address, at + 1), load_f32(address, at + 2), load_f32(address, at + 3)


@device
def _between(time, n_steps, steps, stride, index):
    """Element `index` of float32 [n_steps, stride, 3] between the steps before and after a time."""
    step, share = segment(time, n_steps)
    a = load3_f32(steps, step * stride + index)
    b = load3_f32(steps, (step + 1) * stride + index)
    return add(scale(a, 1.0 - share), scale(b, share))


@inlined
def segment(time, n_steps):
    """(the last step before a time, how much of the way to the next one is done), of steps at even distances."""
    place = time * (n_steps - 1)
    step = max(0, min(int(place), n_steps - 2))
    return step, place - step


@inlined
def corners(mesh, time, primitive):
    """The three vertices of a triangle at a time, in object space."""
    return (
        vertex(mesh, time, load_u32(mesh.triangles, 3 * primitive)),
        vertex(mesh, time, load_u32(mesh.triangles, 3 * primitive + 1)),
        vertex(mesh, time, load_u32(mesh.triangles, 3 * primitive + 2)),
    )
