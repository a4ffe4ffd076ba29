"""From one frame to another: which instance, lamp and pixel something was in the frame before.

Objects are found again by their keys. A shape whose primitives are listed as before has kept its topology: a point of
it is then the same point by the same barycentrics, however the shape was moved or deformed.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from ...kernels.core.jit import device, inlined
from ...kernels.core.memory import address, call_entry, load_i32, load_i64, record_address, record_at
from ...kernels.core.records import (
    LIGHT_DELTA,
    LIGHT_ELLIPSE,
    LIGHT_SPHERE,
    SHAPE_CENTRE,
    SHAPE_ENTRIES,
    SHAPE_TRIANGLES,
    mesh_at,
)
from ...kernels.core.vec import add, load3_f64, normalize, scale, transform_normal, transform_point, vec
from ...kernels.geometry.camera import camera_pixel
from ...kernels.geometry.placed import corners, placed_at
from ...scene.record_owner import RecordOwner

if TYPE_CHECKING:
    from ...scene.scene import Scene
    from ...scene.shape import Shape

MOTION = np.dtype(
    [
        # int32 tables from now to before and back, -1: there is none; address 0: nothing has changed its index
        ("instance_before", np.int64),
        ("instance_after", np.int64),
        ("lamp_before", np.int64),
        ("lamp_after", np.int64),
    ]
)
motion_at = record_at(MOTION)


class Motion(RecordOwner):
    """Owner of the tables of MOTION between two committed scenes, the same one or two frames of an animation."""

    def __init__(self, now: Scene, before: Scene) -> None:
        self._record = np.zeros(1, MOTION)
        self._tables: list[np.ndarray] = []
        if now is before:
            return
        there = match(now.instances["key"], before.instances["key"])
        there[~_same_topology(now, before, there)] = -1
        self._share("instance", there, len(before.instances))
        self._share("lamp", _same_lamps(now.lights.lamps, before.lights.lamps), len(before.lights.lamps))

    def _share(self, name: str, there: np.ndarray, count: int) -> None:
        back = np.full(count, -1, np.int32)
        found = there >= 0
        back[there[found]] = np.flatnonzero(found)
        # A table of no entries is never read; its address must not be 0, which stands for no change.
        for field, table in (("before", there), ("after", back)):
            table = np.append(table, np.int32(-1))
            self._tables.append(table)
            self._record[0][f"{name}_{field}"] = address(table)


def _same_lamps(now: np.ndarray, before: np.ndarray) -> np.ndarray:
    """For each lamp its index before; -1 also where it has become another kind, whose points mean something else."""
    there = match(now["key"], before["key"])
    found = np.flatnonzero(there >= 0)
    shape = LIGHT_DELTA | LIGHT_SPHERE | LIGHT_ELLIPSE
    for field, bits in (("kind", -1), ("flags", shape)):
        changed = ((now[field][found] ^ before[field][there[found]]) & bits) != 0
        there[found[changed]] = -1
    return there


def match(now: np.ndarray, before: np.ndarray) -> np.ndarray:
    """For each key of now its index in before, -1: none; int32. The k-th of equal keys is the k-th of before."""
    numbered_now, numbered_before = _numbered(now), _numbered(before)
    index = {key: i for i, key in enumerate(zip(before.tolist(), numbered_before.tolist(), strict=True))}
    keys = zip(now.tolist(), numbered_now.tolist(), strict=True)
    return np.fromiter((index.get(key, -1) for key in keys), np.int32, len(now))


def _numbered(keys: np.ndarray) -> np.ndarray:
    """How many equal keys stand before each."""
    order = np.argsort(keys, kind="stable")
    ordered = keys[order]
    starts = np.flatnonzero(np.append(True, ordered[1:] != ordered[:-1])) if len(keys) else np.zeros(0, np.int64)
    counts = np.arange(len(keys)) - np.repeat(starts, np.diff(np.append(starts, len(keys))))
    result = np.empty(len(keys), np.int64)
    result[order] = counts
    return result


def _same_topology(now: Scene, before: Scene, there: np.ndarray) -> np.ndarray:
    """Which instances of now have the primitives of their instance `there` before."""
    found = there >= 0
    pairs = np.stack([now.instances["mesh"], np.where(found, before.instances["mesh"][there], -1)], axis=1)
    same = {
        (a, b): b >= 0 and _same_primitives(now.meshes[a], before.meshes[b])
        for a, b in {tuple(pair) for pair in pairs.tolist()}
    }
    return np.array([same[tuple(pair)] for pair in pairs.tolist()], bool).reshape(len(there))


def _same_primitives(a: Shape, b: Shape) -> bool:
    if type(a) is not type(b) or len(a.points) != len(b.points):
        return False
    return all(_equal(x, y) for x, y in zip(a.form[1:], b.form[1:], strict=True))


def _equal(a: np.ndarray, b: np.ndarray) -> bool:
    return a is b or (a.shape == b.shape and np.array_equal(a, b))


@inlined
def look_up(table, index):
    """The index in the other frame by one of MOTION's tables, -1: none there; without a table it is the same."""
    return index if table == 0 else load_i32(table, index)


@device
def place_before(scene, before, motion, sp):
    """Where the surface at `sp` was in the frame before: (instance, p, n), the instance -1 where that is not known.

    n: the shading normal now, turned as the object has turned; what deformation does to it is left out.
    """
    instance = look_up(motion.instance_before, sp.instance)
    if instance < 0:
        return instance, vec(sp.p), vec(sp.n)
    placed = placed_at(before, instance)
    mesh = mesh_at(before.meshes, placed.mesh)
    if mesh.shape != SHAPE_TRIANGLES:
        entry = load_i64(before.shape_entries, SHAPE_ENTRIES * mesh.shape + SHAPE_CENTRE)
        call_entry(entry, record_address(before), record_address(sp), placed.mesh, sp.registers, 0)
        p = load3_f64(sp.registers, 0)
    else:
        a, b, c = corners(mesh, before.time, sp.primitive)
        p = add(scale(a, 1.0 - sp.u - sp.v), add(scale(b, sp.u), scale(c, sp.v)))
    n = transform_normal(placed_at(scene, sp.instance).to_world, vec(sp.n))
    return instance, transform_point(placed.to_world, p), normalize(transform_normal(placed.to_object, n))


@device
def pixel_before(camera, camera_before, p, p_before, x, y):
    """The pixel of the frame before that showed what the pixel (x, y) shows at p now: (x, y), maybe off the film.

    The motion vector is that of the surface point; it is added to the pixel, not to the jittered place in it, so that
    nothing moves where nothing moves. (-1, -1) where the old camera did not look.
    """
    seen, here_x, here_y = camera_pixel(camera, p)
    seen_before, there_x, there_y = camera_pixel(camera_before, p_before)
    if not (seen and seen_before):
        return -1, -1
    return math.floor(x + there_x - here_x + 0.5), math.floor(y + there_y - here_y + 0.5)
