"""All that emits, and the table by which kernels choose among it: lamps, emissive triangles, the world."""

from __future__ import annotations

import math
from collections.abc import Hashable, Mapping
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from ..kernels.core import records as rec
from ..kernels.core.memory import address
from ..kernels.lights.build import build_alias, measure_emission
from ..kernels.lights.entries import TRIANGLE, WITH_PORTALS, WORLD, light_entries
from .emitter_tree import EmitterTree, Run, is_closed, morton_order, normals_and_areas, run_length, runs
from .freeze import freeze
from .lamp_tree import sphere_tree
from .lamps import LUMINANCE
from .mesh import Mesh
from .record_owner import RecordOwner

if TYPE_CHECKING:
    from .scene import Scene

# Lamps are weighed against each other at every point that is lit; more than this number in clusters.
_FEW = 32

# Of the choice between lamps, triangles and world, the share that goes by the root of the power: power says little
# about what a point behind a wall or near a lamp sees.
_FLAT = 0.3

# Evaluations of programs that measuring textured emission of one mesh may take, and at most of one triangle or cell.
_MEASURES, _MEASURES_EACH = 400_000, 256
_MEASURES_CELL = 8

# Cells along an edge of triangles whose emission varies, and of all of a mesh together.
_MOST_CELLS, _ALL_CELLS = 32, 1 << 14


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
    """The emissive triangles of a mesh under one list of materials, what is near in space near in the list.

    radiance: luminance of the cells of each, (n, cells²) (kernels.lights.cells); sides: that emit, 1 or 2 (n,); back:
    whether the back alone does (n,).
    """

    def __init__(self, mesh, primitives: np.ndarray, radiance: np.ndarray, sides: np.ndarray, back: np.ndarray) -> None:
        count = radiance.shape[1]
        self.cells = math.isqrt(count)
        a, b, c = mesh.vertices[mesh.triangles[primitives].T]
        order = morton_order((a + b + c) / 3.0) if len(primitives) else np.zeros(0, np.int64)
        self._corners = a[order], b[order], c[order]
        self._normals, areas = normals_and_areas(*self._corners)
        self._normals[back[order]] *= -1.0
        self._both = (sides == 2)[order]
        power = radiance[order] * areas[:, None] / count
        self._one_sided = power.sum(1)
        weights = self._one_sided * sides[order]
        alias = AliasTable(weights)
        self.power = float(weights.sum())
        self.primitives = primitives[order].astype(np.int32)
        self.alias = alias.table
        self.cumulated = np.concatenate([[0.0], np.cumsum(power * sides[order][:, None])])
        self.positions = np.full(len(mesh.triangles), -1, np.int32)
        self.positions[self.primitives] = np.arange(len(primitives), dtype=np.int32)
        self.probabilities = np.zeros(len(mesh.triangles), np.float32)
        self.probabilities[self.primitives] = alias.probabilities
        if len(primitives) and self._both.all() and is_closed(mesh.triangles):
            self._both[:] = False  # nobody sees the inside, unless he is in it

    def runs(self, length: int) -> Run:
        """Runs of triangles, for the tree."""
        return runs(self._corners, self._normals, self._one_sided, self._both, length)

    def fill(self, record: np.void) -> None:
        record["n"], record["cells"] = len(self.primitives), self.cells
        for name in ("alias", "primitives", "cumulated", "positions", "probabilities"):
            record[name] = address(getattr(self, name))


class LightTable(RecordOwner):
    """What light selection needs of a scene that is being committed: its instances, programs and world are in place.

    lamps: LIGHT records in any order, here in that of kernels. known: `groups` of another table, whose programs found
    the same images and tables. weights: of each, by about the irradiance that all of a kind send. first_emitters:
    INSTANCE.lights of each instance. groups: the emissive triangles of meshes, by all that they are made of.
    """

    def __init__(self, scene: Scene, lamps: np.ndarray, known: Mapping[Hashable, _Group] | None = None) -> None:
        self._known, self.groups = known or {}, {}
        self._record = np.zeros(1, rec.LIGHT_TABLE)
        self._kept: list = []  # what addresses point to
        self.lamps, bounds = _in_order(lamps)
        self.first_emitters = np.full(len(scene.instances), -1)
        from_lamps = self._commit_lamps(scene, bounds)
        triangles = self._commit_triangles(scene)
        world = np.pi * scene.world.mean
        if scene.world.has_portals:
            portals = scene.world.portals
            world = min(world, float((portals["importance"] / self._distances(scene, portals) ** 2).sum()))
        shares = np.array([from_lamps, triangles, world])
        if shares.sum() > 0.0:
            roots = np.sqrt(shares)
            shares = (1.0 - _FLAT) * shares / shares.sum() + _FLAT * roots / roots.sum()
        for name, share in zip(("lamps", "triangles", "world"), shares, strict=True):
            self._record[0][name] = share
        del self._known
        kinds = set(self.lamps["kind"].tolist())
        # Light that is not sampled is found by rays, and reservoirs keep it.
        of_surfaces = scene.shaders.materials["flags"][scene.material_slots]
        kinds |= {TRIANGLE} if (of_surfaces & rec.MATERIAL_EMITS).any() else set()
        if scene.world.material >= 0:
            kinds.add(WITH_PORTALS if scene.world.has_portals else WORLD)
        self._share("entries", light_entries(kinds))
        owners = (self, *(kept for kept in self._kept if not isinstance(kept, np.ndarray)))
        freeze(*(value for owner in owners for value in vars(owner).values()))

    def _share(self, field: str, array: np.ndarray) -> None:
        self._record[0][field] = address(array)
        self._kept.append(array)

    # Lamps ------------------------------------------------------------------------------------------------

    def _commit_lamps(self, scene: Scene, bounds: list[int]) -> float:
        """What is chosen among lamps by; returns about the irradiance that they send to the scene."""
        lamps, table = self.lamps, self._record[0]
        n, n_local = len(lamps), int((lamps["kind"] != rec.LIGHT_SUN).sum())
        table["n_local"] = n_local
        self._weigh_programs(scene, lamps)
        self.weights = lamps["importance"].copy()
        if n == 0:
            return 0.0
        if n > _FEW:
            self._commit_clusters(lamps, [*bounds, n] if n > n_local else bounds)
        flags, radii = lamps["flags"], lamps["radius"]
        found = np.flatnonzero(((flags & rec.LIGHT_HITTABLE) != 0) & (lamps["kind"] != rec.LIGHT_SUN))
        targets = sphere_tree(lamps["center"][found], radii[found], found)
        if len(found):
            self._share("targets", targets)
            table["targets_width"] = len(targets) // 2
        irradiance = lamps["importance"] / self._distances(scene, lamps) ** 2
        near = slice(0, n_local)
        self.weights[near] *= irradiance[near].sum() / max(self.weights[near].sum(), 1e-300)
        return float(irradiance.sum())

    def _commit_clusters(self, lamps: np.ndarray, bounds: list[int]) -> None:
        """Bounding spheres and importance of the lamps between successive bounds."""
        table = self._record[0]
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
        # Strands and spheres are found by rays alone, as in Cycles.
        have_triangles = np.array([isinstance(mesh, Mesh) for mesh in scene.meshes], bool)
        emitting = counts[start + instances["n_materials"]] > counts[start]
        candidates = np.flatnonzero(emitting & have_triangles[instances["mesh"]])
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
                built.append(self._known_group(scene, index, slots, emits))
            if built[groups[key]].power > 0.0:
                emitters[used]["instance"], emitters[used]["group"] = index, groups[key]
                used += 1
        if used == 0:
            return 0.0
        emitters = emitters[:used].copy()
        members = emitters["group"]
        table = self._record[0]
        records = np.zeros(len(built), rec.EMITTER_GROUP)
        for record, group in zip(records, built, strict=True):
            group.fill(record)
        self._kept.extend(built)
        # Areas grow with the square of the mean scale.
        linear = instances["to_world"][emitters["instance"]].reshape(-1, 3, 4)[:, :, :3]
        growth = np.abs(np.linalg.det(linear)) ** (2.0 / 3.0)
        power = growth * np.array([built[group].power for group in members])
        alias = AliasTable(power)
        emitters["probability"] = alias.probabilities
        for place in np.flatnonzero(scene.changing()[emitters["instance"]]).tolist():
            emitters[place]["reach"] = scene.reach(int(emitters[place]["instance"]))
        tree = EmitterTree(run_length(sum(len(built[group].primitives) for group in members)))
        for group in np.unique(members):
            mine = np.flatnonzero(members == group)
            matrices = instances["to_world"][emitters["instance"][mine]].reshape(-1, 3, 4)
            emitters["first_leaf"][mine] = tree.add(
                mine, matrices, growth[mine], built[group].runs(tree.run), emitters["reach"][mine]
            )
        self.first_emitters[emitters["instance"]] = np.arange(used)
        table["n_emitters"] = used
        self._share("emitter_alias", alias.table)
        self._share("emitter_tree", tree.build())
        self._kept.append(tree)
        self._share("emitters", emitters)
        self._share("groups", records)
        bounds = scene.record["bounds"]
        size2 = float(((bounds[3:] - bounds[:3]) ** 2).sum()) / 16.0
        return float(power.sum()) / max(size2, 1e-12)

    def _known_group(self, scene: Scene, index: int, slots: np.ndarray, emits: np.ndarray) -> _Group:
        """What `_group` gives, from what is known where that is the same."""
        mesh, materials = scene.meshes[scene.instances[index]["mesh"]], scene.shaders.materials[slots]
        shape = (mesh.vertices, mesh.triangles, mesh.material_slots)
        key = (*map(id, shape), emits[slots].tobytes())
        key += tuple(materials[name].tobytes() for name in ("flags", "emission_estimate", "emission_sampling"))
        if ((materials["flags"] & rec.MATERIAL_VARYING_EMISSION) != 0).any():
            # It may depend on anything that the instance, its mesh and the programs say.
            place = scene.instances[index : index + 1].copy()
            if place["n_attributes"][0]:
                return self._group(scene, index, slots, emits)
            place["lights"], place["attributes"], place["mesh"], place["materials"] = 0, 0, 0, 0
            programs = [scene.shaders[slot] for slot in slots.tolist()]
            shape += (mesh, *programs)
            key += (place.tobytes(), id(mesh), *map(id, programs))
        group = self.groups[key] = self._known.get(key) or self._group(scene, index, slots, emits)
        group.made_of = shape  # as long as it lives, nothing else takes their identity
        return group

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
        cells = _cells(len(primitives)) if varying[slot].any() else 1
        luminance = per_slot[slot][:, None].repeat(cells**2, 1)
        for k in np.flatnonzero(varying & emitting):
            chosen = np.flatnonzero(slot == k)
            if len(chosen):
                luminance[chosen] = self._measured(scene, index, primitives[chosen], cells)
        sides = np.where((sampling == 2) | (sampling == 3), 1, 2)[slot]
        return _Group(mesh, primitives, luminance, sides, (sampling == 3)[slot])

    @staticmethod
    def _measured(scene: Scene, index: int, primitives: np.ndarray, cells: int) -> np.ndarray:
        """Luminance (root mean square) of cells where it varies, mixed with that of all: points may miss some.

        Float64 (n, cells²).
        """
        primitives = np.ascontiguousarray(primitives, np.int32)
        values = np.zeros((len(primitives), cells**2))
        points = int(np.clip(_MEASURES // len(primitives), 1, _MEASURES_EACH)) if cells == 1 else _MEASURES_CELL
        scratch = np.zeros(rec.SCRATCH_BYTES, np.uint8)
        start = scene.record, address(scratch), int(index), address(primitives), len(primitives)
        measure_emission(*start, cells, points, address(values))
        # Not quite nothing where all is black: another instance may have another colour.
        return 0.9 * values + 0.1 * values.mean() + 1e-6


def _cells(triangles: int) -> int:
    """Cells along an edge of so many triangles of a mesh whose emission varies: a power of two."""
    most = math.isqrt(_ALL_CELLS // max(triangles, 1))
    return min(_MOST_CELLS, 1 << max(most.bit_length() - 1, 0))


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
