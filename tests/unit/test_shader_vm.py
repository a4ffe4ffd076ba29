"""The interpreter of programs: every opcode does something, numbers agree with NumPy, branches are skipped."""

import numpy as np
import pytest

from restir_engine.kernels.core import records as rec
from restir_engine.kernels.core.jit import kernel
from restir_engine.kernels.core.memory import address
from restir_engine.kernels.lobes.entries import BSDF_ENTRIES, FIBRE_ENTRIES, FILM_ENTRIES
from restir_engine.kernels.shading import opcodes as ops
from restir_engine.kernels.shading.interpreter import opcodes_in, shader_entries, shader_eval
from restir_engine.kernels.shading.textures import TEXTURE_ENTRIES
from restir_engine.scene.shaders import Program, ShaderTable
from restir_engine.sync.nodes.spectra import BLACKBODY_FITS

OUT = 100  # register where these tests let instructions write


@kernel
def _evaluate(scene, sp):
    shader_eval(scene, sp)


@kernel
def _evaluate_often(scene, sp, times):
    for _ in range(times):
        shader_eval(scene, sp)


class Machine:
    """Runs instructions at a point of a world (no object) and keeps everything alive that they reach."""

    def __init__(self, instructions, constants=(), table=()):
        code = [word for op, *words in instructions for word in (op, len(words), *words)] + [ops.END, 0]
        programs = ShaderTable()
        programs.table(np.array([*table, 0.0]))
        programs.add(Program(np.array(code, np.int32), np.array(constants, np.float64)))
        shaders = programs.layout()
        self.keep = [shaders, shader_entries(shaders.code), np.zeros(1, rec.CAMERA)]
        self.scene, self.point = np.zeros(1, rec.SCENE), np.zeros(1, rec.SHADING_POINT)
        self.registers, self.closures = np.full(rec.MAX_REGISTERS, np.nan), np.zeros(rec.MAX_CLOSURES, rec.CLOSURE)
        scene, point = self.scene[0], self.point[0]
        for field in ("materials", "code", "constants", "tables"):
            scene[field] = address(getattr(shaders, field))
        scene["shader_entries"], scene["camera"] = address(self.keep[1]), address(self.keep[2])
        point["registers"], point["closures"] = address(self.registers), address(self.closures)
        point["instance"] = point["light"] = -1
        point["n"] = point["ng"] = point["wo"] = point["p"] = (0.0, 0.6, 0.8)

    def run(self) -> np.ndarray:
        """The registers from OUT on."""
        _evaluate(self.scene[0], self.point[0])
        return self.registers[OUT : OUT + 16]


def _opcodes(first: int, last: int) -> dict[str, int]:
    return {
        name: value
        for name, value in vars(ops).items()
        if isinstance(value, int) and first <= value <= last and not name.startswith(("_", "POINT_"))
    }


@pytest.mark.parametrize("name", _opcodes(10, 99))
def test_every_opcode_writes_its_output(name):
    # 2 is a valid register, mode, table offset and table size alike; the longest table is that of black bodies.
    table = np.full(2 + BLACKBODY_FITS.size, 0.25)
    machine = Machine([(getattr(ops, name), OUT, *[2] * 9)], constants=np.full(40, 0.5), table=table)
    assert np.isfinite(machine.run()[0])


def test_opcodes_are_distinct_and_within_families():
    values = [value for name, value in vars(ops).items() if isinstance(value, int) and not name.startswith("POINT_")]
    assert len(set(values)) == len(values)
    taken = {*range(100, 192), *range(200, ops.VOLUME_SCATTER)}  # by textures, films and lobes
    assert not taken & set(values)


def test_no_two_pieces_of_code_share_an_opcode():
    tables = [TEXTURE_ENTRIES, BSDF_ENTRIES, FILM_ENTRIES, FIBRE_ENTRIES]
    found = [opcode for table in tables for opcode in table]
    found += [value for name, value in vars(ops).items() if isinstance(value, int) and not name.startswith("POINT_")]
    assert len(set(found)) == len(found)


def test_flow_and_closure_instructions():
    constants = (1.0, 1.0, 1.0, 0.25, 2.0, 4.0, 8.0, 0.5, 0.0)
    machine = Machine(
        [
            (ops.MIX_WEIGHTS, OUT, OUT + 3, 0, 3),
            (ops.EMISSION, OUT, 4, 7),  # 0.75 · (2, 4, 8) · 0.5
            (ops.HOLDOUT, OUT + 3),
            (ops.JUMP_ZERO, 8, 5),
            (ops.EMISSION, 0, 4, 7),  # skipped
            (ops.JUMP_ZERO, 3, 5),
            (ops.EMISSION, 0, 0, 3),
            (ops.SET_NORMAL, 4),
        ],
        constants,
    )
    machine.run()
    assert np.allclose(machine.registers[OUT : OUT + 6], (0.75, 0.75, 0.75, 0.25, 0.25, 0.25))
    assert np.allclose(machine.point[0]["emission"], (1.0, 1.75, 3.25))
    assert np.isclose(machine.point[0]["holdout"], 0.25)
    assert np.allclose(machine.point[0]["n"], np.array([2.0, 4.0, 8.0]) / np.sqrt(84.0))


def test_shadow_rays_jump_to_their_own_program():
    instructions = [(ops.JUMP_SHADOW, 7), (ops.EMISSION, 0, 0, 0), (ops.END,), (ops.HOLDOUT, 0)]
    machine = Machine(instructions, (1.0, 1.0, 1.0))
    machine.run()
    assert machine.point[0]["emission"][0] == 1.0 and machine.point[0]["holdout"] == 0.0
    machine.point[0]["ray_flags"] = rec.RAY_SHADOW_TRANSPARENT
    machine.run()
    assert machine.point[0]["emission"][0] == 0.0 and machine.point[0]["holdout"] == 1.0


NUMPY = {
    "ADD": lambda a, b, c: a + b,
    "DIVIDE": lambda a, b, c: a / b if b else 0.0,
    "MULTIPLY_ADD": lambda a, b, c: a * b + c,
    "POWER": lambda a, b, c: 0.0 if a < 0 and b % 1 else a**b,
    "LOGARITHM": lambda a, b, c: np.log(a) / np.log(b) if a > 0 and b > 0 and b != 1 else 0.0,
    "INVERSE_SQRT": lambda a, b, c: a**-0.5 if a > 0 else 0.0,
    "MODULO": lambda a, b, c: np.fmod(a, b) if b else 0.0,
    "FLOORED_MODULO": lambda a, b, c: np.mod(a, b) if b else 0.0,
    "WRAP": lambda a, b, c: c + np.mod(a - c, b - c) if b != c else c,
    "PINGPONG": lambda a, b, c: abs(np.mod(a - b, 2 * b) - b) if b else 0.0,
    "SNAP": lambda a, b, c: np.floor(a / b) * b if b else 0.0,
    "TRUNC": lambda a, b, c: np.trunc(a),
    "COMPARE": lambda a, b, c: float(abs(a - b) <= max(c, 1.1920929e-7)),
    "ARCTAN2": lambda a, b, c: np.arctan2(a, b),
    "ROUND": lambda a, b, c: np.floor(a + 0.5),
}


@pytest.mark.parametrize("operation", NUMPY)
def test_math_agrees_with_numpy(operation):
    values = (-2.5, -1.0, 0.0, 0.4, 1.0, 3.7)
    for a in values:
        for b in values:
            if operation == "POWER" and a == 0.0 and b < 0.0:
                continue
            machine = Machine([(ops.MATH, OUT, ops.MATH_OPERATIONS.index(operation), 0, 1, 2)], (a, b, 0.3))
            assert np.isclose(machine.run()[0], NUMPY[operation](a, b, 0.3)), (a, b)


@pytest.mark.parametrize("operation", ops.MATH_OPERATIONS)
def test_math_stays_finite(operation):
    values = (-1e20, -2.0, -1.0, 0.0, 1.0, 2.5, 1e20)
    mode = ops.MATH_OPERATIONS.index(operation)
    with np.errstate(all="ignore"):
        for a in values:
            for b in (-2.0, -1.0, 0.0, 1.0, 2.0):
                assert not np.isnan(Machine([(ops.MATH, OUT, mode, 0, 1, 2)], (a, b, 0.5)).run()[0]), (a, b)


def test_colors_go_to_hsv_and_hsl_and_back():
    for color in np.random.default_rng(3).random((20, 3)):
        for mode in range(3):
            separate = (ops.SEPARATE_COLOR, OUT + 3, mode, 0)
            machine = Machine([separate, (ops.COMBINE_COLOR, OUT, mode, OUT + 3)], color)
            assert np.allclose(machine.run()[:3], color)


def test_a_table_is_interpolated_and_continued():
    table = np.array([0.0, 1.0, 4.0])
    for x, extrapolated, expected in (
        (0.25, 0, 0.5),
        (0.75, 0, 2.5),
        (1.0, 0, 4.0),
        (-1.0, 0, 0.0),
        (2.0, 0, 4.0),
        (-0.5, 1, -1.0),
        (1.5, 1, 7.0),
        (np.nan, 0, 0.0),
    ):
        machine = Machine([(ops.CURVE, OUT, 0, 3, extrapolated, 0, 3, 2, 1)], (1.0, 1.0, 0.0, x), table)
        result = machine.run()[0]
        assert np.isnan(result) if np.isnan(x) else np.isclose(result, expected), x


def test_opcodes_are_found_behind_operands():
    assert opcodes_in(np.array([ops.MATH, 5, 200, 0, 1, 1, 1, ops.END, 0], np.int32)) == {ops.MATH, ops.END}


def test_a_short_program_takes_less_than_a_microsecond():
    import time

    program = [(ops.MATH, OUT + k, 3, 0, 1, 2) for k in range(5)] + [(ops.MULTIPLY, OUT, 3, 0, 0)] * 10
    program += [(ops.LUMINANCE, OUT, 0)] * 3 + [(ops.SPLAT, OUT, 0), (ops.EMISSION, 0, 0, 0)]
    machine = Machine(program, (0.5, 0.25, 0.125))
    _evaluate_often(machine.scene[0], machine.point[0], 1)
    times = []
    for _ in range(50):  # each shorter than a time slice, so that the shortest is one that nothing interrupted
        start = time.perf_counter()
        _evaluate_often(machine.scene[0], machine.point[0], 1000)
        times.append((time.perf_counter() - start) / 1000)
    assert min(times) < 1e-6, f"{1e9 * min(times):.0f} ns"
