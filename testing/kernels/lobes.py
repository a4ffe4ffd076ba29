"""One shading point with the closures of one BSDF node, without a scene: for the tests of the lobes."""

import math

import numpy as np

from restir_engine.kernels.core import rng
from restir_engine.kernels.core.jit import kernel
from restir_engine.kernels.core.memory import address, call_entry, load_f64, record_at, store_f64
from restir_engine.kernels.core.records import CLOSURE, MAX_CLOSURES, SCENE, SHADING_POINT, shading_point_at
from restir_engine.kernels.lobes import (
    BSDF_NODES,
    bsdf_blur,
    bsdf_color,
    bsdf_eval,
    bsdf_has_eval,
    bsdf_normal,
    bsdf_roughness,
    bsdf_sample,
    denoise_features,
    lobe_tables,
)
from restir_engine.kernels.lobes.classes import store_lobes
from restir_engine.kernels.lobes.entries import BSDF_ENTRIES, COMPANIONS, FIBRE_ENTRIES, FILM_ENTRIES, makes_no_lobes
from restir_engine.kernels.lobes.nodes import FILM_REFLECTANCE, PRINCIPLED_HAIR

_scene_at = record_at(SCENE)
_TABLES = lobe_tables()
COLUMNS = 14  # label, wi, 9 of value, pdf


@kernel
def _run(scene, sp, op, registers, code, instruction):
    if not makes_no_lobes(op, shading_point_at(sp, 0)):
        call_entry(instruction, scene, sp, registers, code, 0)


@kernel
def _evaluate(scene, sp, directions, out, count):
    """Ten columns for each direction."""
    s, p = _scene_at(scene, 0), shading_point_at(sp, 0)
    for i in range(count):
        wi = (load_f64(directions, 3 * i), load_f64(directions, 3 * i + 1), load_f64(directions, 3 * i + 2))
        value, pdf = bsdf_eval(s, p, wi)
        row = out + 80 * i
        store_lobes(row, 0, value)
        store_f64(row, 9, pdf)


@kernel
def _sample(scene, sp, key, out, count):
    s, p = _scene_at(scene, 0), shading_point_at(sp, 0)
    for i in range(count):
        u0 = rng.sample1(key, i, 0)
        u1, u2 = rng.sample2(key, i, 1)
        label, wi, value, pdf = bsdf_sample(s, p, u0, u1, u2)
        row = 14 * i
        store_f64(out, row, float(label))
        for k in range(3):
            store_f64(out, row + 1 + k, wi[k])
        store_lobes(out + 8 * (row + 4), 0, value)
        store_f64(out, row + 13, pdf)


@kernel
def _color(scene, sp, out):
    store_lobes(out, 0, bsdf_color(_scene_at(scene, 0), shading_point_at(sp, 0)))


@kernel
def _blur(sp, roughness):
    bsdf_blur(shading_point_at(sp, 0), roughness)


@kernel
def _summary(scene, sp, out):
    """Normal, roughness, whether anything can be evaluated; the denoiser's albedo, normal, specular, diffuse-like."""
    p = shading_point_at(sp, 0)
    n = bsdf_normal(p)
    albedo, normal, specular, diffuse_like = denoise_features(_scene_at(scene, 0), p)
    for k in range(3):
        store_f64(out, k, n[k])
        store_f64(out, 5 + k, albedo[k])
        store_f64(out, 8 + k, normal[k])
        store_f64(out, 11 + k, specular[k])
    store_f64(out, 3, bsdf_roughness(p))
    store_f64(out, 4, 1.0 if bsdf_has_eval(p) else 0.0)
    store_f64(out, 14, 1.0 if diffuse_like else 0.0)


def direction(cosine: float, phi: float = 0.3) -> np.ndarray:
    """A unit vector at an angle to z."""
    sine = math.sqrt(max(1.0 - cosine * cosine, 0.0))
    return np.array([sine * math.cos(phi), sine * math.sin(phi), cosine])


class Surface:
    """The closures of a BSDF node seen from `wo`, with the smooth and the geometric normal along z.

    Inputs are keywords with spaces as underscores; enums (distribution, fresnel_type, component) likewise.
    The Principled Hair BSDF goes by its model's name; `tangent` is the strand's.
    film_table: the table of `kernels.lobes.thin_film` that the input Thin_Film (nm, IOR, 0) refers to.
    """

    def __init__(
        self,
        node,
        wo,
        *,
        ng=(0.0, 0.0, 1.0),
        backfacing=0,
        ray_flags=1,
        weight=(1.0, 1.0, 1.0),
        film_table=None,
        tangent=(1.0, 0.0, 0.0),
        **inputs,
    ):
        self.closures = np.zeros(MAX_CLOSURES, CLOSURE)
        self.registers = np.zeros(256)
        self._scene, self._point = np.zeros(1, SCENE), np.zeros(1, SHADING_POINT)
        self.point = self._point[0]
        self._scene[0]["lobe_tables"] = address(_TABLES)
        if film_table is not None:
            self._kept = np.ascontiguousarray(film_table, np.float32), np.zeros(FILM_REFLECTANCE + 1, np.int64)
            self._kept[1][FILM_REFLECTANCE] = FILM_ENTRIES[FILM_REFLECTANCE].address
            self._scene[0]["tables"], self._scene[0]["shader_entries"] = (address(array) for array in self._kept)
        layout = (BSDF_NODES | PRINCIPLED_HAIR)[node]
        if COMPANIONS.get(layout.opcode) in FIBRE_ENTRIES:
            code = COMPANIONS[layout.opcode]
            self._kept = np.zeros(code + 1, np.int64)
            self._kept[code] = FIBRE_ENTRIES[code].address
            self._scene[0]["shader_entries"] = address(self._kept)
            self.point["dpdu"] = self.point["dpdv"] = tangent
        self.point["closures"] = address(self.closures)
        self.point["registers"] = address(self.registers)
        self.point["n"], self.point["ng"], self.point["wo"] = (0.0, 0.0, 1.0), ng, wo
        self.point["backfacing"], self.point["ray_flags"] = backfacing, ray_flags
        words, free = [self._put(0, weight)], 3
        for item in layout.inputs:
            value = inputs.pop(item.name.replace(" ", "_"), None)
            if value is None and item.default != "VALUE":
                words.append(-1)
                continue
            value = _default(item) if value is None else value
            words.append(self._put(free, np.broadcast_to(value, item.components)))
            free += item.components
        words += [values[inputs.pop(name, next(iter(values)))] for name, values in layout.enums]
        assert not inputs, f"{node} has no {inputs}"
        self._code = np.array(words, np.int32)
        instruction, op = BSDF_ENTRIES[layout.opcode].address, layout.opcode
        scene, point = address(self._scene), address(self._point)
        _run(scene, point, op, address(self.registers), address(self._code), instruction)

    def _put(self, register, value):
        self.registers[register : register + len(value)] = value
        return register

    @property
    def kinds(self) -> list[int]:
        return [int(c["kind"]) for c in self.closures[: self.point["n_closures"]]]

    def evaluate(self, wi: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(values [n, 9], pdfs [n]) for directions [n, 3]."""
        wi = np.ascontiguousarray(wi, dtype=np.float64).reshape(-1, 3)
        out = np.empty((len(wi), 10))
        _evaluate(address(self._scene), address(self._point), address(wi), address(out), len(wi))
        return out[:, :9], out[:, 9]

    def sample(self, count: int, key: int = 1) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """(labels [n], wi [n, 3], values [n, 9], pdfs [n])."""
        out = np.empty((count, COLUMNS))
        _sample(address(self._scene), address(self._point), key, address(out), count)
        return out[:, 0].astype(int), out[:, 1:4], out[:, 4:13], out[:, 13]

    def albedo(self, count: int = 4096, key: int = 1) -> tuple[np.ndarray, np.ndarray]:
        """(reflected and transmitted light under a white sky rgb, standard error rgb)."""
        labels, _, values, pdf = self.sample(count, key)
        rgb = values.reshape(-1, 3, 3).sum(axis=1)
        throughput = np.where((labels > 0)[:, None], rgb / np.maximum(pdf, 1e-300)[:, None], 0.0)
        return throughput.mean(axis=0), throughput.std(axis=0) / math.sqrt(count)

    def color(self) -> np.ndarray:
        """The colour passes: diffuse, glossy, transmission [3, 3]."""
        out = np.empty(9)
        _color(address(self._scene), address(self._point), address(out))
        return out.reshape(3, 3)

    def blur(self, alpha: float) -> None:
        """Filter glossy."""
        _blur(address(self._point), alpha)

    def summary(self) -> dict[str, np.ndarray]:
        """What the passes and the denoiser ask for."""
        out = np.empty(15)
        _summary(address(self._scene), address(self._point), address(out))
        names = {
            "normal": slice(0, 3),
            "roughness": 3,
            "has_eval": 4,
            "albedo": slice(5, 8),
            "feature_normal": slice(8, 11),
        }
        return {key: out[at] for key, at in (names | {"specular": slice(11, 14), "diffuse_like": 14}).items()}


def _default(item):
    return {"Base Color": 0.8, "Color": 0.8, "Alpha": 1.0, "Roughness": 0.5, "IOR": 1.5}.get(item.name, item.missing)
