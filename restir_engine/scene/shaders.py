"""Shader programs and what stands beside them: code, constants, tables, one MATERIAL record a program."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from ..kernels.core import records as rec
from ..kernels.lobes.nodes import DIFFUSE
from ..kernels.shading.opcodes import END
from .freeze import freeze


@dataclass
class Program:
    """A compiled shader tree. `code` is empty for a surface that neither scatters nor emits."""

    code: np.ndarray = field(default_factory=lambda: np.zeros(0, np.int32))
    constants: np.ndarray = field(default_factory=lambda: np.zeros(0))
    flags: int = 0  # MATERIAL_*
    pass_index: int = 0
    crypto_material: float = 0.0  # see scene.cryptomatte
    emission_sampling: int = 0  # see MATERIAL
    emission_estimate: tuple[float, float, float] = (0.0, 0.0, 0.0)
    medium: int = -1  # where in `code` the program of the medium inside starts, -1: none
    medium_priority: int = 0
    medium_grid: int = -1  # name of the attribute that all coefficients of the medium are proportional to, -1: none is
    displacement: int = -1  # where that which displaces vertices starts
    aovs: int = -1  # where that of its AOV Output nodes starts


def constant_lambert(program: Program) -> np.ndarray | None:
    """The weight (3,) of the lobe when a program is one smooth Diffuse BSDF with constant inputs, else None."""
    code = program.code.tolist()
    if len(code) != 8 or code[0] != DIFFUSE or code[6] != END:
        return None
    weight, color, roughness, normal = code[2:6]
    if max(weight + 2, color + 2, roughness) >= len(program.constants) or normal != -1:
        return None
    if program.constants[roughness] > 0.0:
        return None
    return program.constants[weight : weight + 3] * program.constants[color : color + 3]


def alike(a: Program, b: Program) -> bool:
    """Whether two programs do the same, where their tables and images are the same."""
    return all(np.array_equal(getattr(a, name), getattr(b, name)) for name in Program.__dataclass_fields__)


@dataclass(frozen=True)
class Shaders:
    """Programs behind one another in `code` and `constants`, with `tables` and a MATERIAL record each."""

    programs: tuple[Program, ...]
    materials: np.ndarray
    code: np.ndarray
    constants: np.ndarray
    tables: np.ndarray

    def __post_init__(self) -> None:
        freeze(self.materials, self.code, self.constants, self.tables)
        freeze([(program.code, program.constants) for program in self.programs])

    def __getitem__(self, index: int) -> Program:
        return self.programs[index]


class ShaderTable:
    """All programs of a scene that is put together, by index; `layout` lays them out for kernels."""

    def __init__(self) -> None:
        self._programs: list[Program] = []
        self._table_parts: list[np.ndarray] = []
        self._table_offsets: dict[bytes, int] = {}
        self._table_size = 0
        self._named_tables: dict[tuple, int] = {}

    def __len__(self) -> int:
        return len(self._programs)

    def __getitem__(self, index: int) -> Program:
        return self._programs[index]

    def add(self, program: Program) -> int:
        """The index of a new program."""
        self._programs.append(program)
        return len(self._programs) - 1

    def replace(self, index: int, program: Program) -> None:
        """Put another program in the place of one, if it differs; nothing that refers to the index need change."""
        if not alike(program, self._programs[index]):
            self._programs[index] = program

    def copy(self, tables: bool = True) -> ShaderTable:
        """A table of the same programs, to be changed apart from this one; tables: and of what they look up."""
        result = ShaderTable()
        result._programs = list(self._programs)
        if tables:
            result._table_parts = list(self._table_parts)
            result._table_offsets, result._table_size = dict(self._table_offsets), self._table_size
            result._named_tables = dict(self._named_tables)
        return result

    def same_as(self, other: ShaderTable) -> bool:
        """Whether `other` has our programs and tables; where one is a copy of the other this is quick."""
        return (
            len(self._programs) == len(other._programs)
            and all(a is b or alike(a, b) for a, b in zip(self._programs, other._programs, strict=True))
            and self._table_offsets == other._table_offsets
        )

    @property
    def table_size(self) -> int:
        """The length of all tables, in floats."""
        return self._table_size

    def table(self, values: np.ndarray) -> int:
        """The offset in `tables` (in floats) of these values; equal tables are kept once."""
        values = np.ascontiguousarray(values, np.float32).ravel()
        offset = self._table_offsets.setdefault(values.tobytes(), self._table_size)
        if offset == self._table_size:
            self._table_parts.append(values)
            self._table_size += len(values)
        return offset

    def named_table(self, name: tuple, make: Callable[[], np.ndarray]) -> int:
        """The offset of what `make()` gives for a name, made once."""
        offset = self._named_tables.get(name)
        if offset is None:
            offset = self._named_tables[name] = self.table(make())
        return offset

    def layout(self) -> Shaders:
        """What there is now, laid out for kernels."""
        programs = self._programs
        materials = np.zeros(len(programs), rec.MATERIAL)
        code_at = constants_at = 0
        for record, program in zip(materials, programs, strict=True):
            record["code"] = code_at if len(program.code) else -1
            record["constants"] = constants_at
            record["n_constants"] = len(program.constants)
            for part in ("medium", "displacement", "aovs"):
                start = getattr(program, part)
                record[part] = code_at + start if start >= 0 else -1
            for name in (
                "flags",
                "pass_index",
                "crypto_material",
                "emission_sampling",
                "emission_estimate",
                "medium_priority",
            ):
                record[name] = getattr(program, name)
            lambert = constant_lambert(program)
            if lambert is not None:
                record["flags"] |= rec.MATERIAL_LAMBERT
                record["lambert"] = lambert
            code_at += len(program.code)
            constants_at += len(program.constants)
        code = np.concatenate([np.zeros(0, np.int32), *(p.code for p in programs)]).astype(np.int32)
        constants = np.concatenate([np.zeros(0), *(p.constants for p in programs)])
        tables = np.concatenate([np.zeros(0, np.float32), *self._table_parts])
        return Shaders(tuple(programs), materials, code, constants, tables)
