"""Runs one texture instruction at many points, through the same entries that programs use."""

from __future__ import annotations

import numpy as np

from restir_engine.kernels.core import records as rec
from restir_engine.kernels.core.jit import kernel
from restir_engine.kernels.core.memory import address, call_entry, load_f64, record_address, store_f64
from restir_engine.kernels.shading.textures import TEXTURE_ENTRIES
from restir_engine.scene.images import ImageTable

OUT, VECTOR, INPUTS = 100, 0, 8  # registers


@kernel
def _run(entry, scene, sp, registers, code, points, count, width, out):
    for n in range(count):
        for axis in range(3):
            store_f64(registers, axis, load_f64(points, 3 * n + axis))
        call_entry(entry, record_address(scene), record_address(sp), registers, code, 2)
        for i in range(width):
            store_f64(out, n * width + i, load_f64(registers, 100 + i))


def run(op, points, words, width, images: ImageTable | None = None, tables=(), normal=(0.0, 0.0, 1.0)) -> np.ndarray:
    """Registers OUT … OUT + width of instruction `op` at points (n, 3).

    `words` follow the operands out and vector: a float is an input in a register of its own, an int is an immediate.
    """
    points = np.ascontiguousarray(points, float).reshape(-1, 3)
    registers = np.zeros(rec.MAX_REGISTERS)
    code = [op, len(words) + 2, OUT, VECTOR]
    for i, word in enumerate(words):
        if isinstance(word, int):
            code.append(word)
        else:
            values = np.atleast_1d(word)
            registers[INPUTS + 4 * i : INPUTS + 4 * i + len(values)] = values
            code.append(INPUTS + 4 * i)
    code = np.array(code, np.int32)
    tables = np.array(tables, np.float32)
    records = (images or ImageTable()).records()
    scene, sp = np.zeros(1, rec.SCENE), np.zeros(1, rec.SHADING_POINT)
    scene["tables"], scene["images"] = address(tables), address(records)
    sp["instance"], sp["n"] = -1, normal
    out = np.zeros((len(points), width))
    entry = TEXTURE_ENTRIES[op].address
    _run(entry, scene[0], sp[0], address(registers), address(code), address(points), len(points), width, address(out))
    return out
