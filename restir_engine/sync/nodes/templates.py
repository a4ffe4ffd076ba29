"""One compilation for all trees of an outline: what they differ in is put into the code of the first.

A program depends on the numbers in sockets in two ways. Most are constants of its code. Some decide what code there
is, as whether Principled's alpha is 1: a template serves trees that have the same there.
"""

from __future__ import annotations

from bisect import bisect
from dataclasses import replace
from operator import attrgetter

import bpy

from ...scene.shaders import Program
from .assembler import CONSTANT, TooManyRegisters
from .compiler import Compiler
from .outline import Outline
from .values import numbers

_MOST = 8  # templates of an outline
_VALUE = attrgetter("default_value")


class Templates:
    """Programs for one description, by the outlines of their trees."""

    def __init__(self) -> None:
        self._templates: dict[tuple, list[_Template]] = {}

    def program(self, compiler: Compiler, tree: bpy.types.NodeTree, found: Outline | None) -> Program:
        """What `compiler` makes, or would make, of a tree, of which `found` is the outline."""
        if found is None:
            return compiler.compile(tree)
        alike = self._templates.setdefault((compiler.terms, found.key), [])
        for template in alike:
            program = template.fill(compiler, found)
            if program is not None:
                return program
        program = compiler.compile(tree)
        if not compiler.is_alone and len(alike) < _MOST:
            alike.append(_Template(compiler, found, program))
        return program


class _Template:
    """A program, and where its constants come from."""

    def __init__(self, compiler: Compiler, found: Outline, program: Program) -> None:
        self._program, self._code = replace(program), compiler.code
        place = {socket: number for number, socket in enumerate(found.sockets)}
        number = {node: number for number, node in enumerate(found.nodes)}
        self._looked_at = [(place[socket], name, value) for (socket, name), value in compiler.looked_at.items()]
        self._lookups = [(function, number[node]) for function, node in compiler.lookups]
        starts, sources = compiler.constant_starts, compiler.sources

        def block(register: int) -> int:
            return bisect(starts, register - CONSTANT) - 1

        needed = {*self._code.blocks, *(block(register) for register, _ in compiler.seen)}
        for index in range(len(sources) - 1, -1, -1):  # what a constant is folded of stands before it
            if index in needed and _is_folded(sources[index]):
                needed.update(block(register) for register, _ in sources[index][1])
        of_sockets = [index for index in needed if not isinstance(sources[index], tuple)]
        floats = [index for index in of_sockets if sources[index].type == "VALUE"]
        others = [index for index in of_sockets if sources[index].type != "VALUE"]
        literals = [index for index in needed if isinstance(sources[index], tuple) and not _is_folded(sources[index])]
        folded = sorted(index for index in needed if _is_folded(sources[index]))
        order = {index: k for k, index in enumerate((*floats, *others, *literals, *folded))}
        self._floats = [place[sources[index]] for index in floats]
        self._others = [place[sources[index]] for index in others]
        self._literals = [sources[index] for index in literals]

        def part(register: int, count: int) -> tuple[int, int, int]:
            start = register - CONSTANT - starts[block(register)]
            return order[block(register)], start, start + count

        self._folded = [(sources[index][0], [part(*operand) for operand in sources[index][1]]) for index in folded]
        self._constants = [order[index] for index in self._code.blocks]
        kept = frozenset(literals)
        self._seen = [(*part(*key), value) for key, value in compiler.seen.items() if block(key[0]) not in kept]

    def fill(self, compiler: Compiler, found: Outline) -> Program | None:
        """The program of another tree of the outline; None where it would have other code."""
        sockets = found.sockets
        if any(getattr(sockets[place], name) != value for place, name, value in self._looked_at):
            return None
        values = [*zip(map(_VALUE, [sockets[place] for place in self._floats]))]
        values += [numbers(sockets[place]) for place in self._others]
        values += self._literals
        for function, operands in self._folded:
            values.append(function(*[values[block][start:end] for block, start, end in operands]))
        if any(values[block][start:end] != value for block, start, end, value in self._seen):
            return None
        compiler.lookups = [(function, found.nodes[node]) for function, node in self._lookups]
        try:
            code, constants = self._code.link(
                [values[block] for block in self._constants], compiler.look_up(self._code)
            )
        except TooManyRegisters:
            return None
        return replace(self._program, code=code, constants=constants)


def _is_folded(source) -> bool:
    return isinstance(source, tuple) and callable(source[0])
