"""Instructions with symbolic registers, and the program that comes of them."""

from __future__ import annotations

import numpy as np

from ...kernels.core.records import MAX_REGISTERS
from ...kernels.shading import opcodes as ops

# Words from here on are registers that are not constants; their final numbers follow those of the constants.
TEMPORARY = 1 << 28


class TooManyRegisters(Exception):
    """The tree keeps more values at once than the interpreter has registers."""


class Assembler:
    """Collects constants and instructions. A register is an int; `register + 1` is the next component of a value."""

    def __init__(self) -> None:
        self.instructions: list[list[int]] = []
        self._constants: list[float] = []
        self._known: dict[tuple[float, ...], int] = {}
        self._blocks: list[int] = []  # owner of each temporary register: index of its block's first register
        self._sizes: dict[int, int] = {}  # of the blocks

    def constant(self, value: float | tuple[float, ...]) -> int:
        """The register that holds a number, or the first of those that hold several."""
        values = tuple(map(float, value)) if hasattr(value, "__len__") else (float(value),)
        register = self._known.get(values)
        if register is None:
            register = self._known[values] = len(self._constants)
            self._constants.extend(values)
        return register

    def constant_value(self, register: int, count: int = 1) -> tuple[float, ...] | None:
        """The numbers that a register is known to hold when the program starts, or None."""
        return tuple(self._constants[register : register + count]) if 0 <= register < TEMPORARY else None

    def allocate(self, count: int) -> int:
        """The first of `count` new consecutive registers."""
        start = len(self._blocks)
        self._blocks.extend([start] * count)
        self._sizes[start] = count
        return TEMPORARY + start

    def emit(self, opcode: int, *words: int) -> None:
        """Append an instruction. Words are registers or immediates (smaller than 2²⁸)."""
        self.instructions.append([opcode, *map(int, words)])

    @property
    def position(self) -> int:
        """The number of instructions so far."""
        return len(self.instructions)

    def insert_jump(self, position: int, weight: int) -> None:
        """Before the instruction at `position`, a jump to the present end that is taken when `weight` is 0."""
        distance = sum(len(instruction) + 1 for instruction in self.instructions[position:])
        self.instructions.insert(position, [ops.JUMP_ZERO, weight, distance])

    def block(self, register: int) -> int:
        """What tells apart the values that temporary registers belong to."""
        return self._blocks[register - TEMPORARY]

    def finish(
        self, parts: dict[str, list[list[int]]], shadow: list[list[int]] | None = None
    ) -> tuple[np.ndarray, np.ndarray, dict[str, int]]:
        """(code, constants, starts of `parts` in the code by name, -1 for empty ones); empty when it does nothing.

        Shadow rays run `shadow` when it is given.
        """
        if not self.instructions and not any(parts.values()):
            return np.zeros(0, np.int32), np.zeros(0), dict.fromkeys(parts, -1)
        words = self._words(self.instructions)
        if shadow is not None:
            words = [ops.JUMP_SHADOW, 1, len(words), *words, *self._words(shadow)]
        starts = dict.fromkeys(parts, -1)
        for name, instructions in parts.items():
            if instructions:
                starts[name] = len(words)
                words += self._words(instructions)
        return np.array(words, np.int32), np.array(self._constants), starts

    def _words(self, instructions: list[list[int]]) -> list[int]:
        """Machine words of instructions and the end."""
        places = self._place(instructions)
        words = []
        for instruction in instructions:
            words.append(instruction[0])
            words.append(len(instruction) - 1)
            words += [word if word < TEMPORARY else places[word - TEMPORARY] for word in instruction[1:]]
        return [*words, ops.END, 0]

    def _place(self, instructions: list[list[int]]) -> dict[int, int]:
        """Final numbers of temporary registers. A block is free again after its last use: jumps only go forward."""
        first: dict[int, int] = {}
        last: dict[int, int] = {}
        for index, instruction in enumerate(instructions):
            for word in instruction:
                if word >= TEMPORARY:
                    block = self._blocks[word - TEMPORARY]
                    if block not in last:
                        first[block] = index
                    last[block] = index
        used = bytearray(MAX_REGISTERS)  # 1 where a register is taken
        used[: len(self._constants)] = b"\1" * len(self._constants)
        places: dict[int, int] = {}
        expiring: dict[int, list[int]] = {}
        for block, start in first.items():
            for time in [time for time in expiring if time < start]:
                for old in expiring.pop(time):
                    used[places[old] : places[old] + self._sizes[old]] = bytes(self._sizes[old])
            size = self._sizes[block]
            place = used.find(bytes(size))
            if place < 0 or len(self._constants) > MAX_REGISTERS:
                raise TooManyRegisters
            used[place : place + size] = b"\1" * size
            expiring.setdefault(last[block], []).append(block)
            for component in range(size):
                places[block + component] = place + component
        return places
