"""Where things are in the frames before and after, for the pass Vector."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from ..kernels.core import records as rec
from ..kernels.core.jit import load
from ..kernels.core.memory import address
from ..kernels.film.vectors import write_vector
from .freeze import freeze
from .instances import InstanceSteps
from .record_owner import RecordOwner

if TYPE_CHECKING:
    from .scene import Scene


@dataclass
class Vectors:
    """What is elsewhere. instances: with three steps, a frame apart; shapes: vertices (2, n, 3) before and after, by
    their index among meshes. Cameras know themselves where they are (`Camera.around`).
    """

    instances: list[InstanceSteps]
    shapes: dict[int, np.ndarray] = field(default_factory=dict)


class VectorTable(RecordOwner):
    """Owner of the VECTORS record of a scene that is being committed."""

    def __init__(self, scene: Scene, vectors: Vectors) -> None:
        load([write_vector])
        rows = np.full(len(scene.instances), -1, np.int32)
        count = 0
        matrices = [np.zeros((0, 2, 12))]
        for indices, steps in vectors.instances:
            rows[indices] = np.arange(count, count + len(indices))
            count += len(indices)
            matrices.append(steps[:, [0, -1]])
        shapes = np.zeros(len(scene.meshes), np.int64)
        places = {index: np.ascontiguousarray(points, np.float32) for index, points in vectors.shapes.items()}
        for index, points in places.items():
            shapes[index] = address(points)
        self._kept = (rows, np.concatenate(matrices), shapes, places, vectors)
        freeze(*self._kept[:3])
        self._record = np.zeros(1, rec.VECTORS)
        self._record[0]["code"] = write_vector.address
        for name, array in zip(("rows", "matrices", "shapes"), self._kept, strict=False):
            self._record[0][name] = address(array)
