"""The one place where texture opcodes become calls.

Every texture instruction is an entry: compiled once, on its own, when a scene first uses it, instead of again and
again inside the kernels that run programs. A scene without Voronoi never compiles it.
"""

import numpy as np

from ...core.jit import Entry, device, entry
from ...core.memory import call_entry, load_i64, record_address
from ...core.records import scene_at, shading_point_at
from . import opcodes as ops
from .environment import environment_op
from .gabor import gabor_op
from .image import image_box_op, image_op, image_tiles_op
from .mapping import texture_mapping_op
from .noise import noise_op
from .patterns import brick_op, checker_op, gradient_op, magic_op
from .sky import sky_op
from .voronoi import voronoi_op
from .wave import wave_op
from .white_noise import white_noise_op

FIRST, LAST = 100, 199


@device
def texture_op(op, scene, sp, registers, code, at):
    """Run the texture instruction `op` whose operand words start at index `at` of the program `code`."""
    function = load_i64(scene.texture_entries, op - FIRST)
    if function != 0:
        call_entry(function, record_address(scene), record_address(sp), registers, code, at)


@entry
def _noise(scene, sp, registers, code, at):
    noise_op(registers, code, at)


@entry
def _voronoi(scene, sp, registers, code, at):
    voronoi_op(registers, code, at)


@entry
def _wave(scene, sp, registers, code, at):
    wave_op(registers, code, at)


@entry
def _brick(scene, sp, registers, code, at):
    brick_op(registers, code, at)


@entry
def _checker(scene, sp, registers, code, at):
    checker_op(registers, code, at)


@entry
def _gradient(scene, sp, registers, code, at):
    gradient_op(registers, code, at)


@entry
def _magic(scene, sp, registers, code, at):
    magic_op(registers, code, at)


@entry
def _white_noise(scene, sp, registers, code, at):
    white_noise_op(registers, code, at)


@entry
def _gabor(scene, sp, registers, code, at):
    gabor_op(registers, code, at)


@entry
def _image(scene, sp, registers, code, at):
    image_op(scene_at(scene, 0), registers, code, at)


@entry
def _image_box(scene, sp, registers, code, at):
    image_box_op(scene_at(scene, 0), shading_point_at(sp, 0), registers, code, at)


@entry
def _image_tiles(scene, sp, registers, code, at):
    image_tiles_op(scene_at(scene, 0), registers, code, at)


@entry
def _environment(scene, sp, registers, code, at):
    environment_op(scene_at(scene, 0), registers, code, at)


@entry
def _sky(scene, sp, registers, code, at):
    sky_op(scene_at(scene, 0), registers, code, at)


@entry
def _texture_mapping(scene, sp, registers, code, at):
    texture_mapping_op(scene_at(scene, 0), registers, code, at)


ENTRIES: dict[int, Entry] = {
    ops.NOISE: _noise,
    ops.VORONOI: _voronoi,
    ops.WAVE: _wave,
    ops.BRICK: _brick,
    ops.CHECKER: _checker,
    ops.GRADIENT: _gradient,
    ops.MAGIC: _magic,
    ops.WHITE_NOISE: _white_noise,
    ops.GABOR: _gabor,
    ops.IMAGE: _image,
    ops.IMAGE_BOX: _image_box,
    ops.IMAGE_TILES: _image_tiles,
    ops.ENVIRONMENT: _environment,
    ops.SKY: _sky,
    ops.TEXTURE_MAPPING: _texture_mapping,
}


def used_opcodes(code: np.ndarray) -> set[int]:
    """The texture opcodes in the instructions of `code`: opcode, number of operand words, operands."""
    found = set()
    words = code.tolist()
    at = 0
    while at < len(words):
        if FIRST <= words[at] <= LAST:
            found.add(words[at])
        at += 2 + words[at + 1]
    return found


def texture_entries(code: np.ndarray) -> np.ndarray:
    """Addresses by opcode (from FIRST on) of the texture instructions in `code`, compiled where they are not yet."""
    table = np.zeros(LAST - FIRST + 1, np.int64)
    for op in used_opcodes(code):
        table[op - FIRST] = ENTRIES[op].address
    return table
