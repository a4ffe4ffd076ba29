"""Meshes whose materials displace them: vertices moved by programs, as Cycles moves them (`mesh_displace`).

A vertex moves by the program of the first triangle with a material that displaces, evaluated at that triangle's corner,
where it sees the vertex' normal, although the triangle may be flat.
Where the material is of the method DISPLACEMENT the vertex gets a normal anew, the mean of those of its triangles,
each counting as one; with BOTH it keeps its normal, which the material bends as a bump does.

What a mesh has become is kept while all that its programs can see is the same, and with it its acceleration structure.
"""

from __future__ import annotations

import copy
from collections.abc import Hashable
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..kernels.core import records as rec
from ..kernels.core.digest import digest
from ..kernels.core.memory import address
from ..kernels.shading.displace import displacements
from . import names
from .mesh import Mesh, empty_vertices, with_normals_for
from .shape import Attribute, Shape, attribute_table

if TYPE_CHECKING:
    from .scene import Scene
    from .trees import Trees

# Of an INSTANCE: where things lie, and what no program sees.
_UNSEEN = (
    "mesh", "materials", "attributes", "majorants", "lights", "steps", "n_steps", "seen_by", "light_group", "light_set",
    "blocker_set", "links", "blockers", "crypto_object", "crypto_asset",
)  # fmt: skip
_OF_RAYS = (192, 193, 194)  # opcodes whose instructions look at other meshes


class Moved(NamedTuple):
    """What a mesh has become, with all whose identity is in the key that it is kept by."""

    result: Mesh
    seen: tuple


def displaced(scene: Scene, trees: Trees) -> tuple[Shape, ...]:
    """The meshes of a scene whose programs are committed, with those that are displaced in their places.

    A mesh that instances show with other materials, of which some displace it, gets a copy for each list of materials,
    behind the others; `scene.instances` refers to these. trees: what scenes before have left.
    """
    displaces = scene.shaders.materials["displacement"] >= 0
    if not displaces.any():
        return scene.meshes
    counts = np.concatenate([[0], np.cumsum(displaces[scene.material_slots])])
    start = scene.instances["materials"]
    asked = counts[start + scene.instances["n_materials"]] > counts[start]
    meshes, copies = list(scene.meshes), {}
    for index in np.flatnonzero(asked).tolist():
        row = scene.instances[index]
        mesh, key = meshes[row["mesh"]], (int(row["mesh"]), int(row["materials"]))
        if not isinstance(mesh, Mesh):
            continue
        if key not in copies:
            alone = bool((scene.instances["mesh"] == row["mesh"]).sum() == 1)
            sight = _sight(scene, index, mesh, alone)
            known = trees.moved.get(sight) if sight else None
            if known is None:
                moved = _displaced(scene, index, mesh)
                known = Moved(with_normals_for(moved, row["to_object"]) if alone else moved, _seen(scene, mesh))
                if sight:
                    trees.moved.put(sight, known)
            copies[key] = len(meshes)
            meshes.append(known.result)
    for (mesh, materials), other in copies.items():
        mine = (scene.instances["mesh"] == mesh) & (scene.instances["materials"] == materials)
        scene.instances["mesh"][mine] = other
    return tuple(meshes)


def _seen(scene: Scene, mesh: Mesh) -> tuple[np.ndarray, ...]:
    """The arrays by whose identity a mesh and what its programs look up are known again."""
    arrays = (array for name, array in mesh.arrays.items() if array is not None and name != "normals")
    return *arrays, *(item.values for item in mesh.attributes), *scene.image_arrays


def _sight(scene: Scene, index: int, mesh: Mesh, alone: bool) -> Hashable:
    """All that tells how an instance's materials displace a mesh; None: that cannot be told."""
    row = scene.instances[index : index + 1].copy()
    programs = [scene.shaders[slot] for slot in _slots(scene, index)]
    if row["n_attributes"][0] or any(np.isin(program.code, _OF_RAYS).any() for program in programs):
        return None
    for name in _UNSEEN:
        row[name] = 0
    camera = scene.camera
    return (
        tuple(map(id, _seen(scene, mesh))),
        tuple((item.name, item.domain) for item in mesh.attributes),
        mesh.normals is not None and digest(np.ascontiguousarray(mesh.normals)),
        (mesh.normals_domain, tuple(mesh.generated_offset), tuple(mesh.generated_scale), alone),
        row.tobytes(),
        tuple((program.code.tobytes(), program.constants.tobytes(), program.displacement, program.flags)
              for program in programs),
        digest(scene.shaders.tables),
        (camera.kind, camera.to_world.tobytes(), camera.screen, camera.width, camera.height, camera.projection),
        scene.attribute_names.get(names.UNDISPLACED),
    )  # fmt: skip


def _slots(scene: Scene, index: int) -> np.ndarray:
    """The materials of an instance's slots."""
    row = scene.instances[index]
    return scene.material_slots[row["materials"] : row["materials"] + row["n_materials"]]


def _displaced(scene: Scene, index: int, mesh: Mesh) -> Mesh:
    """The mesh as an instance's materials displace it."""
    slots = _slots(scene, index)
    material = np.zeros(len(mesh.triangles), np.int32)
    if mesh.material_slots is not None:
        material = np.clip(mesh.material_slots, 0, len(slots) - 1)
    material = scene.shaders.materials[slots[material]]
    corners = np.flatnonzero(np.repeat(material["displacement"] >= 0, 3))
    vertices, first = np.unique(mesh.triangles.reshape(-1)[corners], return_index=True)
    places = np.ascontiguousarray(corners[first], np.uint32)
    moves = _moves(scene, index, mesh, places)

    result = copy.copy(mesh)
    result.vertices = empty_vertices(len(mesh.vertices))
    result.vertices[:] = mesh.vertices
    result.vertices[vertices] += np.where(np.isfinite(moves), moves, 0.0)
    if mesh.attribute(rec.ATTRIBUTE_GENERATED) is None:
        generated = (mesh.vertices - mesh.generated_offset) * mesh.generated_scale
        result.attributes = [*mesh.attributes, Attribute(rec.ATTRIBUTE_GENERATED, rec.DOMAIN_POINT, generated)]
    if names.UNDISPLACED in scene.attribute_names:
        before = Attribute(scene.attribute_names[names.UNDISPLACED], rec.DOMAIN_POINT, mesh.vertices)
        result.attributes = [*result.attributes, before]
    anew = (material["flags"] & rec.MATERIAL_DISPLACED_NORMALS) != 0
    bends = mesh.normals is not None and anew.any()
    if bends:
        result.normals = _normals(mesh, result.vertices, anew)
    if mesh.steps is not None:
        result.steps = mesh.steps.copy()
        result.steps[:, : len(mesh.vertices)] += result.vertices - mesh.vertices
        if bends:
            steps = [_normals(mesh, step[: len(mesh.vertices)], anew) for step in result.steps]
            result.normal_steps = np.stack(steps).astype(np.float32)
    return result


def _moves(scene: Scene, index: int, mesh: Mesh, places: np.ndarray) -> np.ndarray:
    """How far an instance's programs move corners of triangles, in object space: float32 (n, 3)."""
    attributes, mesh = attribute_table(mesh.attributes), copy.copy(mesh)
    mesh.steps = mesh.normal_steps = mesh.smooth = None
    if mesh.normals is None:
        known = mesh.attribute(scene.attribute_names.get(names.VERTEX_NORMAL, -1))
        mesh.normals, mesh.normals_domain = known.values if known else vertex_normals(mesh), rec.DOMAIN_POINT
    meshes, instances = np.array([mesh.record(attributes)]), scene.instances[index : index + 1].copy()
    instances["mesh"] = 0
    record = np.array([scene.record], rec.SCENE)
    record[0]["meshes"], record[0]["instances"] = address(meshes), address(instances)
    record[0]["material_slots"] = address(scene.material_slots)
    moves = np.zeros((len(places), 3), np.float32)
    scratch = np.zeros(rec.SCRATCH_BYTES, np.uint8)
    displacements(record[0], address(scratch), 0, address(places), len(places), address(moves))
    return moves


def vertex_normals(mesh: Mesh) -> np.ndarray:
    """The mean normals of the triangles round vertices, each by its angle there: float32 (n, 3), unit or zero."""
    corners = mesh.vertices[mesh.triangles].astype(np.float64)
    before, after = np.roll(corners, 1, axis=1) - corners, np.roll(corners, -1, axis=1) - corners
    normals = np.cross(after[:, 0], before[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30)
    sines = np.linalg.norm(np.cross(after, before), axis=2)
    angles = np.arctan2(sines, (after * before).sum(axis=2)).ravel()
    index, normals = mesh.triangles.ravel(), np.repeat(normals, 3, axis=0)
    sums = np.stack([np.bincount(index, angles * axis, len(mesh.vertices)) for axis in normals.T], axis=1)
    length = np.linalg.norm(sums, axis=1, keepdims=True)
    return (sums / np.maximum(length, 1e-30)).astype(np.float32)


def _normals(mesh: Mesh, vertices: np.ndarray, anew: np.ndarray) -> np.ndarray:
    """Normals of the domain of the mesh's, those of the triangles `anew` from moved vertices.

    Corners of a vertex whose normals differed before, at a sharp edge, are kept apart.
    """
    triangles = vertices[mesh.triangles]
    faces = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    length = np.linalg.norm(faces, axis=1, keepdims=True)
    faces = np.where(length > 0.0, faces / np.where(length > 0.0, length, 1.0), np.float32([1.0, 0.0, 0.0]))
    elements = (mesh.corners if mesh.normals_domain == rec.DOMAIN_CORNER else mesh.triangles).astype(np.int64)
    group = np.arange(len(mesh.normals))
    if mesh.normals_domain == rec.DOMAIN_CORNER:
        vertex_of = np.zeros(len(mesh.normals), np.int64)
        vertex_of[elements.ravel()] = mesh.triangles.ravel()
        rounded = np.round(mesh.normals * 1e4).astype(np.int64)
        group = np.unique(np.column_stack([vertex_of, rounded]), axis=0, return_inverse=True)[1].reshape(-1)
    sums = np.zeros((group.max() + 1, 3))
    for k in range(3):
        for axis in range(3):
            sums[:, axis] += np.bincount(group[elements[anew, k]], faces[anew, axis], len(sums))
    length = np.linalg.norm(sums, axis=1, keepdims=True)
    sums = (sums / np.where(length > 0.0, length, 1.0))[group]
    result = mesh.normals.copy()
    touched = np.zeros(len(result), bool)
    touched[elements[anew].ravel()] = True
    result[touched] = sums[touched]
    return result
