"""All that emits, and the table by which kernels choose among it: lamps, emissive triangles, the world."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from ..kernels.core import records as rec
from ..kernels.core.memory import address
from ..kernels.lights.build import build_alias, measure_emission
from ..kernels.lights.entries import TRIANGLE, WORLD, light_entries
from .lamps import LUMINANCE

if TYPE_CHECKING:
    from .scene import Scene

# Lamps are weighed against each other at every point that is lit; more than this number in clusters.
_FEW = 32

# Of the choice between lamps, triangles and world, the share that goes by the root of the power: power says little
# about what a point behind a wall or near a lamp sees.
_FLAT = 0.3

# Evaluations of programs that measuring textured emission of one mesh may take, and at most of one triangle.
_MEASURES, _MEASURES_EACH = 400_000, 16


class AliasTable:
    """Weights made into an ALIAS table."""

    def __init__(self, weights: np.ndarray) -> None:
        weights = np.ascontiguousarray(weights, np.float64)
        n = len(weights)
        total = weights.sum()
        if not total > 0.0:
            weights, total = np.ones(n), float(n)
        self.probabilities = weights / total
        self.table = np.zeros(n, rec.ALIAS)
        scratch = np.zeros(2 * n, np.float64)
        build_alias(address(weights), n, address(self.table), address(scratch))


class _Group:
    """The emissive triangles of a mesh under one list of materials."""

    def __init__(self, primitives: np.ndarray, weights: np.ndarray, n_triangles: int) -> None:
        alias = AliasTable(weights)
        self.power = float(weights.sum())
        self.primitives = primitives.astype(np.int32)
        self.alias = alias.table
        self.probabilities = np.zeros(n_triangles, np.float32)
        self.probabilities[primitives] = alias.probabilities
        for array in (self.primitives, self.alias, self.probabilities):
            array.flags.writeable = False

    def fill(self, record: np.void) -> None:
        record["n"] = len(self.primitives)
        for name in ("alias", "primitives", "probabilities"):
            record[name] = address(getattr(self, name))


class LightTable:
    """What light selection needs of a scene that is being committed: its instances, programs and world are in place.

    lamps: LIGHT records in any order, here in that of kernels. weights: of each, by about the irradiance that all of a
    kind send. first_emitters: INSTANCE.lights of each instance.
    """

    def __init__(self, scene: Scene, lamps: np.ndarray) -> None:
        self._table = np.zeros(1, rec.LIGHT_TABLE)
        self._kept: list = []  # what addresses point to
        self.lamps, bounds = _in_order(lamps)
        self.first_emitters = np.full(len(scene.instances), -1)
        from_lamps = self._commit_lamps(scene, bounds)
        triangles = self._commit_triangles(scene)
        world = np.pi * scene.world.mean if scene.world.sampled else 0.0
        shares = np.array([from_lamps, triangles, world])
        if shares.sum() > 0.0:
            roots = np.sqrt(shares)
            shares = (1.0 - _FLAT) * shares / shares.sum() + _FLAT * roots / roots.sum()
        for name, share in zip(("lamps", "triangles", "world"), shares, strict=True):
            self._table[0][name] = share
        kinds = set(self.lamps["kind"].tolist())
        # Light that is not sampled is found by rays, and reservoirs keep it.
        kinds |= {TRIANGLE} if (scene.shaders.materials["flags"] & rec.MATERIAL_EMITS).any() else set()
        kinds |= {WORLD} if scene.world.material >= 0 else set()
        self._share("entries", light_entries(kinds))
        for array in (self._table, self.lamps, self.weights, self.first_emitters):
            array.flags.writeable = False

    @property
    def record(self) -> np.void:
        """The LIGHT_TABLE record."""
        return self._table[0]

    @property
    def address(self) -> int:
        """That of the record; valid as long as this lives."""
        return address(self._table)

    def _share(self, field: str, array: np.ndarray) -> None:
        array.flags.writeable = False
        self._table[0][field] = address(array)
        self._kept.append(array)

    # Lamps ------------------------------------------------------------------------------------------------

    def _commit_lamps(self, scene: Scene, bounds: list[int]) -> float:
        """What is chosen among lamps by; returns about the irradiance that they send to the scene."""
        lamps, table = self.lamps, self._table[0]
        n, n_local = len(lamps), int((lamps["kind"] != rec.LIGHT_SUN).sum())
        table["n_local"] = n_local
        self._weigh_programs(scene, lamps)
        self.weights = lamps["importance"].copy()
        if n == 0:
            return 0.0
        if n > _FEW:
            self._commit_clusters(lamps, [*bounds, n] if n > n_local else bounds)
        flags, radii = lamps["flags"], lamps["radius"]
        seen = ((flags & rec.LIGHT_HITTABLE) != 0) | ((lamps["seen_by"] & rec.RAY_CAMERA) != 0)
        found = np.flatnonzero(seen & ((flags & rec.LIGHT_DELTA) == 0) & (lamps["kind"] != rec.LIGHT_SUN))
        # Rounding far from the lamp must not make it smaller.
        targets = np.column_stack([lamps["center"], (radii * (1.0 + 1e-6) + 1e-9) ** 2, np.arange(n)])[found]
        table["n_targets"] = len(found)
        self._share("targets", np.ascontiguousarray(targets))
        irradiance = lamps["importance"] / self._distances(scene, lamps) ** 2
        near = slice(0, n_local)
        self.weights[near] *= irradiance[near].sum() / max(self.weights[near].sum(), 1e-300)
        return float(irradiance.sum())

    def _commit_clusters(self, lamps: np.ndarray, bounds: list[int]) -> None:
        """Bounding spheres and importance of the lamps between successive bounds."""
        table = self._table[0]
        spans = [(first, last) for first, last in pairwise(bounds) if last > first]
        clusters = np.zeros((len(spans), 7))
        for cluster, (first, last) in zip(clusters, spans, strict=True):
            inside = lamps[first:last]
            center = 0.5 * (inside["center"].min(axis=0) + inside["center"].max(axis=0))
            reach = np.linalg.norm(inside["center"] - center, axis=1) + inside["radius"]
            radius = -1.0 if inside["kind"][0] == rec.LIGHT_SUN else reach.max()
            cluster[:] = (*center, radius, inside["importance"].sum(), first, last)
        table["n_clusters"] = len(clusters)
        self._share("clusters", clusters)
        self._share("cluster_of", np.repeat(np.arange(len(spans), dtype=np.int32), [b - a for a, b in spans]))

    @staticmethod
    def _weigh_programs(scene: Scene, lamps: np.ndarray) -> None:
        """Bring the emission of lamps' programs into their importance (which is that of their strength)."""
        programmed = np.flatnonzero(lamps["material"] >= 0)
        emission = scene.shaders.materials["emission_estimate"][lamps["material"][programmed]] @ LUMINANCE
        lamps["importance"][programmed] *= np.where(emission > 0.0, emission, 1.0)

    @staticmethod
    def _distances(scene: Scene, lamps: np.ndarray) -> np.ndarray:
        """About how far from each lamp things are that it lights; 1 for suns."""
        result = np.ones(len(lamps))
        places = scene.instances["location"][:: max(1, len(scene.instances) // 256)]
        local = np.flatnonzero(lamps["kind"] != rec.LIGHT_SUN)
        for chunk in np.array_split(local, max(1, len(local) // 1024)):
            if len(places) and len(chunk):
                offsets = lamps["center"][chunk, None, :] - places[None]
                nearest = np.sqrt((offsets**2).sum(axis=2).min(axis=1))
                result[chunk] = np.maximum(nearest, np.maximum(lamps["radius"][chunk], 1e-3))
        return result

    # Emissive triangles -----------------------------------------------------------------------------------

    def _commit_triangles(self, scene: Scene) -> float:
        """The tables of emissive instances; returns about the irradiance that they send to the scene."""
        instances, materials = scene.instances, scene.shaders.materials
        emits = ((materials["flags"] & rec.MATERIAL_EMITS) != 0) & (materials["emission_sampling"] != 0)
        if not len(instances) or not emits.any():
            return 0.0
        counts = np.concatenate([[0], np.cumsum(emits[scene.material_slots])])
        start = instances["materials"]
        candidates = np.flatnonzero(counts[start + instances["n_materials"]] > counts[start])
        groups: dict[tuple, int] = {}
        built: list[_Group] = []
        emitters = np.zeros(len(candidates), rec.EMITTER)
        used = 0
        for index in candidates:
            instance = instances[index]
            slots = scene.material_slots[instance["materials"] : instance["materials"] + instance["n_materials"]]
            key = (int(instance["mesh"]), slots.tobytes())
            if key not in groups:
                groups[key] = len(built)
                built.append(self._group(scene, index, slots, emits))
            if built[groups[key]].power > 0.0:
                emitters[used]["instance"], emitters[used]["group"] = index, groups[key]
                used += 1
        if used == 0:
            return 0.0
        emitters = emitters[:used].copy()
        table = self._table[0]
        records = np.zeros(len(built), rec.EMITTER_GROUP)
        for record, group in zip(records, built, strict=True):
            group.fill(record)
        self._kept.extend(built)
        # Areas grow with the square of the mean scale.
        linear = instances["to_world"][emitters["instance"]].reshape(-1, 3, 4)[:, :, :3]
        growth = np.abs(np.linalg.det(linear)) ** (2.0 / 3.0)
        power = growth * np.array([built[group].power for group in emitters["group"]])
        alias = AliasTable(power)
        emitters["probability"] = alias.probabilities
        self.first_emitters[emitters["instance"]] = np.arange(used)
        table["n_emitters"] = used
        self._share("emitter_alias", alias.table)
        self._share("emitters", emitters)
        self._share("groups", records)
        bounds = scene.record["bounds"]
        size2 = float(((bounds[3:] - bounds[:3]) ** 2).sum()) / 16.0
        return float(power.sum()) / max(size2, 1e-12)

    def _group(self, scene: Scene, index: int, slots: np.ndarray, emits: np.ndarray) -> _Group:
        """The emissive triangles of an instance's mesh, weighed by area and luminance (watt by steradian, about)."""
        mesh, materials = scene.meshes[scene.instances[index]["mesh"]], scene.shaders.materials
        per_slot = materials["emission_estimate"][slots] @ LUMINANCE
        sampling = materials["emission_sampling"][slots]
        varying = (materials["flags"][slots] & rec.MATERIAL_VARYING_EMISSION) != 0
        emitting = emits[slots] & (varying | (per_slot > 0.0))
        if mesh.material_slots is None or len(slots) == 1:
            primitives = np.arange(len(mesh.triangles)) if emitting[0] else np.zeros(0, np.int64)
            slot = np.zeros(len(primitives), np.int64)
        else:
            slot = np.clip(mesh.material_slots, 0, len(slots) - 1)
            primitives = np.flatnonzero(emitting[slot])
            slot = slot[primitives]
        if len(primitives) == 0:
            return _Group(primitives, np.zeros(0), len(mesh.triangles))
        luminance = per_slot[slot]
        for k in np.flatnonzero(varying & emitting):
            chosen = np.flatnonzero(slot == k)
            if len(chosen):
                luminance[chosen] = self._measured(scene, index, primitives[chosen])
        sides = np.where((sampling == 2) | (sampling == 3), 1.0, 2.0)[slot]
        weights = luminance * sides * _areas(mesh, primitives)
        return _Group(primitives, weights, len(mesh.triangles))

    @staticmethod
    def _measured(scene: Scene, index: int, primitives: np.ndarray) -> np.ndarray:
        """Mean luminance of triangles whose emission varies, mixed with that of all: a few points may miss some."""
        primitives = np.ascontiguousarray(primitives, np.int32)
        values = np.zeros(len(primitives))
        points = int(np.clip(_MEASURES // len(primitives), 1, _MEASURES_EACH))
        scratch = np.zeros(rec.SCRATCH_BYTES, np.uint8)
        measure_emission(
            scene.record, address(scratch), int(index), address(primitives), len(primitives), points, address(values)
        )
        # Not quite nothing where all is black: another instance may have another colour.
        return 0.9 * values + 0.1 * values.mean() + 1e-6


def _in_order(lamps: np.ndarray) -> tuple[np.ndarray, list[int]]:
    """(lamps, bounds) in the order of kernels: near ones together, suns last; bounds: of clusters of the former."""
    suns = lamps["kind"] == rec.LIGHT_SUN
    local, suns = lamps[~suns], lamps[suns]
    bounds = [0, len(local)]
    if len(lamps) > _FEW:
        order, bounds = clustered(local["center"], max(_FEW // 2, int(len(local) ** 0.5)))
        local = local[order]
    return np.concatenate([local, suns]), bounds


def clustered(places: np.ndarray, size: int) -> tuple[np.ndarray, list[int]]:
    """(order, bounds) of points (n, 3): those between successive bounds, at most `size`, are near one another."""
    order = np.arange(len(places))
    todo, bounds = [(0, len(places))], [0]
    while todo:
        first, last = todo.pop()
        if last - first <= size:
            bounds.append(last)
            continue
        inside = places[order[first:last]]
        axis = int(np.argmax(np.ptp(inside, axis=0)))
        order[first:last] = order[first:last][np.argsort(inside[:, axis], kind="stable")]
        middle = (first + last) // 2
        todo += [(middle, last), (first, middle)]
    return order, bounds


def _areas(mesh, primitives: np.ndarray) -> np.ndarray:
    """Object-space areas of triangles, float64."""
    corners = mesh.vertices[mesh.triangles[primitives]]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return 0.5 * np.sqrt(np.einsum("ij,ij->i", normals, normals, dtype=np.float64))
