"""Triangle meshes, as arrays that kernels and Embree read in place."""

import copy
from dataclasses import dataclass

import numpy as np

from ..embree.scenes import MeshScene
from ..kernels.core.records import DOMAIN_POINT
from .shape import Shape


@dataclass(eq=False)
class Mesh(Shape):
    """Triangles: the arrays of a MESH record; None where the record allows an address of 0.

    `vertices` may be any (n, 3); it is kept with 16 readable bytes behind the last row, which Embree asks for. Corners
    and polygons left out stand for a mesh of separate triangles: three corners and one polygon each, in order.
    """

    vertices: np.ndarray
    triangles: np.ndarray
    corners: np.ndarray | None = None
    polygons: np.ndarray | None = None
    normals: np.ndarray | None = None
    normals_domain: int = DOMAIN_POINT
    smooth: np.ndarray | None = None
    # Of a mesh that deforms (Shape.steps, two rows more than vertices):
    normal_steps: np.ndarray | None = None  # float32 (steps, n, 3)

    def __post_init__(self) -> None:
        self.vertices = padded(self.vertices)
        self.triangles = np.ascontiguousarray(self.triangles, np.uint32).reshape(-1, 3)
        count = len(self.triangles)
        if self.corners is None:
            self.corners = np.arange(3 * count, dtype=np.uint32)
        self.corners = np.ascontiguousarray(self.corners, np.uint32).reshape(-1, 3)
        if self.polygons is None:
            self.polygons = np.arange(count)
        self.polygons = np.ascontiguousarray(self.polygons, np.int32)
        for name, dtype in (
            ("normals", np.float32),
            ("smooth", np.uint8),
            ("material_slots", np.int32),
        ):
            array = getattr(self, name)
            if array is not None:
                setattr(self, name, np.ascontiguousarray(array, dtype))

    @property
    def arrays(self) -> dict[str, np.ndarray | None]:
        names = "vertices", "triangles", "corners", "polygons", "normals", "smooth", "material_slots", "normal_steps"
        return super().arrays | {name: getattr(self, name) for name in names}

    @property
    def form(self) -> tuple[np.ndarray, ...]:
        return self.vertices, self.triangles, self.steps

    @property
    def points(self) -> np.ndarray:
        return self.vertices

    def tree(self) -> MeshScene:
        return MeshScene(self.vertices, self.triangles, self.steps)

    def record(self, attributes: np.ndarray | None = None) -> np.void:
        result = super().record(attributes)
        result["n_vertices"], result["n_triangles"] = len(self.vertices), len(self.triangles)
        result["normals_domain"] = self.normals_domain
        result["normals_stride"] = 0 if self.normal_steps is None else self.normal_steps.shape[1]
        return result


def empty_vertices(count: int) -> np.ndarray:
    """An uninitialised (count, 3) float32 array with 24 readable bytes behind it."""
    return np.empty((count + 2, 3), np.float32)[:count]


def moved(vertices: np.ndarray, matrix: np.ndarray) -> np.ndarray:
    """The vertices (n, 3) under a 3x4 matrix, float32 and padded for Embree."""
    result = empty_vertices(len(vertices))
    np.add(vertices @ matrix[:, :3].T, matrix[:, 3], out=result, casting="same_kind")
    return result


def padded(vertices: np.ndarray) -> np.ndarray:
    """`vertices` itself when it is a view that `empty_vertices` made, else a copy that is."""
    vertices = np.asarray(vertices)
    base = vertices.base
    if (
        isinstance(base, np.ndarray)
        and base.dtype == np.float32
        and base.shape == (len(vertices) + 2, 3)
        and base.flags.c_contiguous
        and base.ctypes.data == vertices.ctypes.data
        and vertices.shape[1:] == (3,)
    ):
        return vertices
    result = empty_vertices(len(vertices))
    result[:] = vertices
    return result


def clean(mesh: Mesh) -> str:
    """Drop triangles with vertices that are not finite or not there; the sentence that says so, "" when none were.

    Values of attributes that are not finite become 0, silently.
    """
    for attribute in mesh.attributes:
        _finite(attribute.values)
    if mesh.normals is not None:
        _finite(mesh.normals)
    keep = None
    if len(mesh.triangles) and int(mesh.triangles.max()) >= len(mesh.vertices):
        keep = (mesh.triangles < len(mesh.vertices)).all(axis=1)
    if not _all_finite(mesh.vertices):
        good = np.isfinite(mesh.vertices).all(axis=1)
        mesh.vertices[~good] = 0.0
        inside = good[np.minimum(mesh.triangles, len(good) - 1)].all(axis=1)
        keep = inside if keep is None else keep & inside
    if keep is None:
        return ""
    for name in ("triangles", "corners", "polygons", "smooth", "material_slots"):
        array = getattr(mesh, name)
        if array is not None:
            setattr(mesh, name, np.ascontiguousarray(array[keep]))
    dropped = int(len(keep) - keep.sum())
    return f"{dropped} triangles with invalid vertices (not finite, or not there) are left out"


def with_normals_for(mesh: Mesh, to_object: np.ndarray) -> Mesh:
    """The mesh with normals that in world space are of unit length at every corner, and interpolated there.

    to_object: (12,) inverse of the matrix of the one instance that shows this mesh. Cycles bakes such a matrix into the
    mesh, which is seen in the shading of objects that are stretched.
    """
    if mesh.normals is None:
        return mesh
    inverse = to_object.reshape(3, 4)[:, :3]
    squares = inverse @ inverse.T
    if np.allclose(squares, squares[0, 0] * np.eye(3), rtol=1e-5, atol=1e-5 * abs(squares[0, 0])):
        return mesh
    length = np.linalg.norm(mesh.normals @ inverse.astype(np.float32), axis=1, keepdims=True)
    result = copy.copy(mesh)
    result.normals = mesh.normals / np.where(length > 0.0, length, 1.0)
    return result


def _all_finite(values: np.ndarray) -> bool:
    # A sum of squares is finite only if all its terms are, and is one fast pass; it may overflow without that.
    flat = values.reshape(-1)
    with np.errstate(all="ignore"):
        return bool(np.isfinite(flat @ flat)) or bool(np.isfinite(flat).all())


def _finite(values: np.ndarray) -> None:
    if not _all_finite(values):
        np.nan_to_num(values, copy=False, nan=0.0, posinf=0.0, neginf=0.0)
