"""What instances place in the world: the base of meshes, curves and points, and their attributes."""

from __future__ import annotations

import abc
from dataclasses import dataclass, field

import numpy as np

from ..embree.scenes import ShapeScene
from ..kernels.core.memory import address
from ..kernels.core.records import ATTRIBUTE, MESH
from .freeze import freeze


@dataclass
class Attribute:
    """A value for each element of a domain. name: interned; values: (elements, 1 to 4)."""

    name: int
    domain: int
    values: np.ndarray

    def __post_init__(self) -> None:
        values = np.ascontiguousarray(self.values, np.float32)
        self.values = values.reshape(len(values), -1)
        if not 1 <= self.values.shape[1] <= 4:
            raise ValueError("an attribute has one to four components")

    @property
    def components(self) -> int:
        return self.values.shape[1]

    @property
    def table(self) -> np.ndarray:
        """What ATTRIBUTE.values points to."""
        return self.values


def attribute_table(attributes: list[Attribute]) -> np.ndarray:
    """The ATTRIBUTE array; it does not keep the values alive."""
    table = np.zeros(len(attributes), ATTRIBUTE)
    for record, attribute in zip(table, attributes, strict=True):
        record["name"], record["domain"] = attribute.name, attribute.domain
        record["components"], record["values"] = attribute.components, address(attribute.table)
    return table


@dataclass(eq=False, kw_only=True)
class Shape(abc.ABC):
    """Arrays of a MESH record, which kernels and Embree read in place."""

    name: str = ""
    problem: str = ""  # what of it is left out, and why
    material_slots: np.ndarray | None = None
    attributes: list[Attribute] = field(default_factory=list)
    generated_offset: tuple[float, float, float] = (-1.0, -1.0, -1.0)
    generated_scale: tuple[float, float, float] = (0.5, 0.5, 0.5)
    # Of what changes its form while the shutter is open: `points` at even distances of time, those above in the middle.
    steps: np.ndarray | None = None  # float32 (steps, rows, 3 or 4)

    @property
    def arrays(self) -> dict[str, np.ndarray | None]:
        """By the names of fields of MESH: the arrays whose addresses these hold."""
        return {"steps": self.steps, "material_slots": self.material_slots}

    @property
    @abc.abstractmethod
    def form(self) -> tuple[np.ndarray | None, ...]:
        """The arrays that its acceleration structure is made of: `points`, how they hang together, and `steps`."""

    @property
    @abc.abstractmethod
    def points(self) -> np.ndarray:
        """Where it lies, (n, 3), or (n, 4) with radii; the same array every time."""

    @property
    def places(self) -> np.ndarray:
        """All places of its points, at any step: (m, 3)."""
        count = len(self.points)
        return self.points[:, :3] if self.steps is None else self.steps[:, :count, :3].reshape(-1, 3)

    @abc.abstractmethod
    def tree(self) -> ShapeScene:
        """A new acceleration structure of it, in object space."""

    def freeze(self) -> None:
        """Make all arrays read-only: scenes, acceleration structures and frames to come share them."""
        freeze([array for array in self.arrays.values() if array is not None], [a.values for a in self.attributes])

    def attribute(self, name: int) -> Attribute | None:
        """The attribute of an interned name."""
        return next((attribute for attribute in self.attributes if attribute.name == name), None)

    def record(self, attributes: np.ndarray | None = None) -> np.void:
        """The MESH record, without its acceleration structure; valid as long as this shape and its arrays are.

        attributes: the `attribute_table` of its attributes, where they are to be found.
        """
        result = np.zeros((), MESH)
        for name, array in self.arrays.items():
            result[name] = address(array)
        if attributes is not None:
            result["attributes"], result["n_attributes"] = address(attributes), len(attributes)
        if self.steps is not None:
            result["n_steps"], result["steps_stride"] = self.steps.shape[:2]
        result["generated_offset"], result["generated_scale"] = self.generated_offset, self.generated_scale
        return result[()]

    @property
    def nbytes(self) -> int:
        """Memory of all arrays."""
        own = sum(array.nbytes for array in self.arrays.values() if array is not None)
        return own + sum(a.values.nbytes for a in self.attributes)
