"""Instructions with symbolic registers, and the program that comes of them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import chain

import numpy as np

from ...kernels.core.records import MAX_REGISTERS
from ...kernels.shading import opcodes as ops

# Words from here on are numbers that are looked up when the program is linked, the registers of constants, and those of
# what is computed; smaller ones are as they are.
LOOKED_UP, CONSTANT, TEMPORARY = 1 << 26, 1 << 27, 1 << 28


class TooManyRegisters(Exception):
    """The tree keeps more values at once than the interpreter has registers."""


class Code:
    """Machine words that want the values of their constants, and what is looked up, to become a program."""

    def __init__(self, words: list[int], starts: dict[str, int], constants: list[int], registers: int) -> None:
        """starts: of the parts of the code, by name; constants: where each block of them begins; registers: how many
        the code needs beside."""
        self.starts = starts
        self._words = np.array(words, np.int32)
        self._computed = np.flatnonzero(self._words >= TEMPORARY)
        self._constant = np.flatnonzero((self._words >= CONSTANT) & (self._words < TEMPORARY))
        self._looked_up = np.flatnonzero((self._words >= LOOKED_UP) & (self._words < CONSTANT))
        numbers = self._words[self._constant] - CONSTANT
        block = np.searchsorted(constants, numbers, side="right") - 1
        self._component = numbers - np.array(constants, np.int32)[block]
        used, self._block = np.unique(block, return_inverse=True)
        self.blocks: list[int] = used.tolist()  # those that the code reads
        self.lookups: list[int] = (self._words[self._looked_up] - LOOKED_UP).tolist()
        self._registers = registers

    def link(self, values: Sequence[tuple[float, ...]], found: Sequence[int]) -> tuple[np.ndarray, np.ndarray]:
        """(code, constants), of the values of `blocks` and what is found for `lookups`; equal values are kept once."""
        if not len(self._words):
            return self._words, np.zeros(0)
        starts = dict.fromkeys(values, 0)
        constants = np.array([*chain.from_iterable(starts)], np.float64)
        end = 0
        for value in starts:
            starts[value] = end
            end += len(value)
        if len(constants) + self._registers > MAX_REGISTERS:
            raise TooManyRegisters
        code = self._words.copy()
        where = np.array([*map(starts.__getitem__, values)], np.int32)
        code[self._constant] = where[self._block] + self._component
        code[self._computed] += len(constants) - TEMPORARY
        code[self._looked_up] = found
        return code, constants


class Assembler:
    """Collects constants and instructions. A register is an int; `register + 1` is the next component of a value."""

    def __init__(self) -> None:
        self.instructions: list[list[int]] = []
        self.sources: list = []  # of each block of constants: its values, or what they come from
        self.seen: dict[tuple[int, int], tuple[float, ...]] = {}  # constants that were asked for their values
        self._constants: list[float] = []
        self._known: dict = {}  # the register of a source
        self.constant_starts: list[int] = []  # of each block
        self._blocks: list[int] = []  # owner of each temporary register: index of its block's first register
        self._sizes: dict[int, int] = {}  # of the blocks
        self._most = 0  # registers that are in use at once, constants apart

    def constant(self, value: float | tuple[float, ...]) -> int:
        """The register that holds a number, or the first of those that hold several."""
        values = tuple(map(float, value)) if hasattr(value, "__len__") else (float(value),)
        register = self._known.get(values)
        return self._new_constant(values, values) if register is None else register

    def _new_constant(self, source, values: tuple[float, ...]) -> int:
        register = self._known[source] = CONSTANT + len(self._constants)
        self.constant_starts.append(len(self._constants))
        self._constants += values
        self.sources.append(source)
        return register

    def constant_value(self, register: int, count: int = 1) -> tuple[float, ...] | None:
        """The numbers that a register is known to hold when the program starts, or None.

        What is made of them is made for these alone: `folded` is for what can be made of any.
        """
        if not CONSTANT <= register < TEMPORARY:
            return None
        values = self.seen[register, count] = self._numbers(register, count)
        return values

    def _numbers(self, register: int, count: int) -> tuple[float, ...]:
        return tuple(self._constants[register - CONSTANT : register - CONSTANT + count])

    def block_values(self, code: Code) -> list[tuple[float, ...]]:
        """The values of the constants that code reads, as `link` takes them."""
        ends = [*self.constant_starts[1:], len(self._constants)]
        return [tuple(self._constants[self.constant_starts[block] : ends[block]]) for block in code.blocks]

    def folded(self, function: Callable[..., tuple[float, ...]], *operands: tuple[int, int]) -> int | None:
        """The register of what a function makes of the values of operands (register, count), where all are constant."""
        if not all(CONSTANT <= register < TEMPORARY for register, _ in operands):
            return None
        source = function, operands
        register = self._known.get(source)
        if register is None:
            register = self._new_constant(source, function(*(self._numbers(*operand) for operand in operands)))
        return register

    def allocate(self, count: int) -> int:
        """The first of `count` new consecutive registers."""
        start = len(self._blocks)
        self._blocks.extend([start] * count)
        self._sizes[start] = count
        return TEMPORARY + start

    def emit(self, opcode: int, *words: int) -> None:
        """Append an instruction. Words are registers or immediates (smaller than 2²⁶)."""
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

    def finish(self, parts: dict[str, list[list[int]]], shadow: list[list[int]] | None = None) -> Code:
        """The code of the instructions and of `parts`; empty when it does nothing.

        Shadow rays run `shadow` when it is given.
        """
        starts, words = dict.fromkeys(parts, -1), []
        if self.instructions or any(parts.values()):
            words = self._words(self.instructions)
            if shadow is not None:
                words = [ops.JUMP_SHADOW, 1, len(words), *words, *self._words(shadow)]
            for name, instructions in parts.items():
                if instructions:
                    starts[name] = len(words)
                    words += self._words(instructions)
        return Code(words, starts, self.constant_starts, self._most)

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
        """Temporary registers as few as can be. A block is free again after its last use: jumps only go forward."""
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
        places: dict[int, int] = {}
        expiring: dict[int, list[int]] = {}
        for block, start in first.items():
            for time in [time for time in expiring if time < start]:
                for old in expiring.pop(time):
                    at = places[old] - TEMPORARY
                    used[at : at + self._sizes[old]] = bytes(self._sizes[old])
            size = self._sizes[block]
            place = used.find(bytes(size))
            if place < 0:
                raise TooManyRegisters
            used[place : place + size] = b"\1" * size
            self._most = max(self._most, place + size)
            expiring.setdefault(last[block], []).append(block)
            for component in range(size):
                places[block + component] = TEMPORARY + place + component
        return places
