"""The part of a program that shadow rays need: what decides how much light passes, and nothing else."""

from __future__ import annotations

from ...kernels.lobes.nodes import BSDF_NODES, DIFFUSE, PRINCIPLED, TRANSPARENT
from ...kernels.shading import opcodes as ops
from .assembler import TEMPORARY, Assembler

_NODE = BSDF_NODES["ShaderNodeBsdfPrincipled"]
_ALPHA, _THIN_WALL = _NODE.operand("Alpha"), _NODE.operand("Thin Wall")


def shadow_instructions(assembler: Assembler) -> list[list[int]]:
    """The instructions of a program that has been emitted, less those whose results no shadow ray sees.

    Walks backwards from the instructions that add transparency and keeps what writes a value that is still needed.
    Principled keeps its weight and alpha alone, unless it is a thin wall, which lets light through its lobes.
    """
    instructions = assembler.instructions
    ends = _word_ends(instructions)
    needed: set[int] = set()
    kept: dict[int, list[int]] = {}

    def need(words: list[int]) -> None:
        needed.update(assembler.block(word) for word in words if word >= TEMPORARY)

    for index in range(len(instructions) - 1, -1, -1):
        opcode, *words = instructions[index]
        if opcode == ops.JUMP_ZERO:
            last = ends.index(ends[index] + words[1])
            wanted = any(index < other <= last for other in kept)
        elif opcode in (TRANSPARENT, PRINCIPLED, ops.SET_NORMAL):
            wanted = True
            if opcode == PRINCIPLED and assembler.constant_value(words[_THIN_WALL]) == (0.0,):
                wanted = assembler.constant_value(words[_ALPHA]) != (1.0,)
                used = (0, _ALPHA, _THIN_WALL)
                words = [word if k in used or word < TEMPORARY else words[_THIN_WALL] for k, word in enumerate(words)]
        else:
            outputs = words[:2] if opcode == ops.MIX_WEIGHTS else words[:1]
            writes = 10 <= opcode < DIFFUSE or opcode == ops.MIX_WEIGHTS
            wanted = writes and any(word >= TEMPORARY and assembler.block(word) in needed for word in outputs)
        if wanted:
            kept[index] = [opcode, *words]
            need(words)
    return _with_distances(instructions, kept, ends)


def _word_ends(instructions: list[list[int]]) -> list[int]:
    """Where each instruction ends, in words from the program's start."""
    ends, at = [], 0
    for instruction in instructions:
        at += len(instruction) + 1
        ends.append(at)
    return ends


def _with_distances(instructions, kept: dict[int, list[int]], ends: list[int]) -> list[list[int]]:
    """The kept instructions in order, their jumps as long as what is left between."""
    result = []
    for index in sorted(kept):
        instruction = kept[index]
        if instruction[0] == ops.JUMP_ZERO:
            last = ends.index(ends[index] + instructions[index][2])
            distance = sum(len(kept[other]) + 1 for other in kept if index < other <= last)
            instruction = [ops.JUMP_ZERO, instruction[1], distance]
        result.append(instruction)
    return result
