"""Random walks on their own: through one mesh, from one point of it, many at once on two threads."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np

from restir_engine.integrators.base import integrator_record
from restir_engine.kernels.core import records as rec
from restir_engine.kernels.core.jit import kernel
from restir_engine.kernels.core.memory import address, load_f64, store_f64
from restir_engine.kernels.core.records import (
    CLOSURE,
    FILM,
    SCRATCH_BYTES,
    SCRATCH_CLOSURES,
    SCRATCH_PATH,
    SCRATCH_POINT,
    SCRATCH_REGISTERS,
    closure_at,
    path_at,
    shading_point_at,
)
from restir_engine.kernels.core.vec import load3_f64, neg, put, store3_f64, vec
from restir_engine.kernels.geometry.surface import surface_point
from restir_engine.kernels.lobes.closure import (
    ENTRY_DIFFUSE,
    ENTRY_REFRACTIVE,
    LOBE_SUBSURFACE,
    P_ALBEDO,
    P_ANISOTROPY,
    P_COLOR,
    P_ENTRY,
    P_SIGMA_T,
)
from restir_engine.kernels.subsurface.method_table import EXACT_WALKS
from restir_engine.kernels.subsurface.methods import scatter, scatter_entries
from restir_engine.scene.description import SceneDescription
from restir_engine.scene.instances import build_instances
from restir_engine.scene.mesh import Mesh
from restir_engine.scene.shaders import Program
from restir_engine.settings import RenderSettings

UNLIMITED = -1


@kernel
def _walks(scene, integrator, film, scratch, closure, starts, key, first, n, out):
    """n walks, each from a row of `starts`: primitive, u, v, wo. A row of `out`: throughput, p, n, g of the exit."""
    path = path_at(scratch + SCRATCH_PATH, 0)
    sp = shading_point_at(scratch + SCRATCH_POINT, 0)
    sp.closures = scratch + SCRATCH_CLOSURES
    sp.registers = scratch + SCRATCH_REGISTERS
    source = closure_at(closure, 0)
    for i in range(first, first + n):
        start = starts + 48 * i
        wo = load3_f64(start, 3)
        primitive = int(load_f64(start, 0))
        surface_point(scene, sp, 0, primitive, load_f64(start, 1), load_f64(start, 2), 1.0, neg(wo))
        c = closure_at(sp.closures, 0)
        c.kind = source.kind
        put(c.n, vec(sp.n))
        c.alpha_x = source.alpha_x
        c.ior = source.ior
        for k in range(16):
            c.p[k] = source.p[k]
        sp.n_closures = 1
        sp.scatterer = 0
        path.key = key
        path.sample = i
        path.dimension = 0
        put(path.throughput, vec(source.weight))
        row = out + 80 * i
        if scatter(scene, integrator, film, scratch, path, sp):
            store3_f64(row, 0, vec(path.throughput))
            store3_f64(row, 3, vec(sp.p))
            store3_f64(row, 6, vec(sp.n))
            store_f64(row, 9, float(sp.primitive))
        else:
            store3_f64(row, 0, (0.0, 0.0, 0.0))


def closure(sigma_t, alpha, g=0.0, entry=ENTRY_DIFFUSE, roughness=0.0, ior=1.4, color=1.0, weight=1.0) -> np.ndarray:
    """A CLOSURE (1,) of a medium; numbers stand for all channels."""
    result = np.zeros(1, CLOSURE)
    c = result[0]
    c["kind"] = LOBE_SUBSURFACE
    c["weight"] = weight
    c["alpha_x"] = roughness
    c["ior"] = ior
    for at, values in ((P_SIGMA_T, sigma_t), (P_ALBEDO, alpha), (P_COLOR, color)):
        c["p"][at : at + 3] = values
    c["p"][P_ANISOTROPY] = g
    c["p"][P_ENTRY] = entry
    return result


def normal_entry(sigma_t, alpha, g=0.0) -> np.ndarray:
    """A CLOSURE whose light enters along the normal when it is seen from there: a smooth boundary."""
    return closure(sigma_t, alpha, g, ENTRY_REFRACTIVE)


class Body:
    """One object made of a medium."""

    def __init__(self, vertices, triangles, matrix=None, flags=rec.MATERIAL_SUBSURFACE, **mesh) -> None:
        scene = SceneDescription()
        scene.meshes.append(Mesh(np.asarray(vertices), np.asarray(triangles), **mesh))
        material = scene.shaders.add(Program(flags=flags))
        matrix = np.eye(4) if matrix is None else np.asarray(matrix)
        scene.instances = build_instances(matrix[None], [0], n_materials=1, seen_by=rec.RAY_ALL)
        scene.material_slots = np.array([material], np.int32)
        self.scene = scene.commit()
        self.table = np.zeros(rec.FILTER_TABLE_SIZE, np.float32)

    def walks(
        self, medium: np.ndarray, starts, n: int, events: int = UNLIMITED, exact: bool = True, key: int = 1
    ) -> np.ndarray:
        """n walks (n, 10): throughput, position and normal of the exit, its triangle; throughput 0 where lost.

        starts: rows of triangle, u, v, direction of view; one row is used for all.
        """
        starts = np.ascontiguousarray(np.broadcast_to(np.asarray(starts, float), (n, 6)))
        integrator = integrator_record(RenderSettings(), self.table)
        table = scatter_entries(self.scene.record["flags"], options=EXACT_WALKS if exact else 0)
        integrator["scatter"] = address(table)
        integrator["max_scatters"] = events
        film = np.zeros(1, FILM)
        out = np.zeros((n, 10))

        def part(first, count):
            block = np.zeros(SCRATCH_BYTES + 64, np.uint8)
            start = address(block) + -address(block) % 64
            _walks(
                self.scene.record, integrator[0], film[0], start, address(medium), address(starts), key, first, count,
                address(out),
            )  # fmt: skip

        with ThreadPoolExecutor(2) as pool:
            list(pool.map(part, (0, n // 2), (n // 2, n - n // 2)))
        return out


def mean(values: np.ndarray) -> tuple[float, float]:
    """Mean and its standard error."""
    return values.mean(), values.std() / np.sqrt(len(values))
