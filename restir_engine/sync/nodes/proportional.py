"""Media whose coefficients are in proportion to one grid of voxels, which is most smoke: they need no program.

Instructions are followed from the grid's value on: what multiplies it by a constant stays in proportion to it, and the
density of a Volume node may be so, while nothing else of it is. Anything else that reads such a value says no.
"""

from __future__ import annotations

from ...kernels.shading import opcodes as ops
from ...scene.names import split_object_property

_MULTIPLY = ops.MATH_OPERATIONS.index("MULTIPLY")

# Where the density stands among the words of an instruction behind its opcode.
_DENSITY = {ops.VOLUME_SCATTER: 2, ops.VOLUME_ABSORPTION: 2, ops.VOLUME_PRINCIPLED: 2}
_OTHERS = (ops.VOLUME_COEFFICIENTS, ops.VOLUME_SUBSURFACE, ops.EMISSION)  # leave coefficients of their own
_EMISSION, _BLACKBODY = 5, 7  # likewise, the strengths of Principled Volume's


def proportional_to(instructions: list[list[int]], c) -> int:
    """The interned name of the grid, -1 where the medium is not of this kind. c: whose constants and names they use."""
    names = list(c.scene.attribute_names)
    grids: set[int] = set()
    known: set[int] = set()  # registers whose values are proportional to the grid's
    for opcode, *words in instructions:
        reads = known.intersection(words)
        if opcode in (ops.ATTRIBUTE_FACTOR, ops.ATTRIBUTE, ops.VOLUME_ATTRIBUTE):
            if split_object_property(names[words[1]]) is None:
                grids.add(words[1])
                known.add(words[0])
        elif opcode in _OTHERS:
            return -1
        elif opcode in _DENSITY:
            if reads != {words[_DENSITY[opcode]]} or words.count(words[_DENSITY[opcode]]) > 1:
                return -1
            strengths = (words[_EMISSION], words[_BLACKBODY]) if opcode == ops.VOLUME_PRINCIPLED else ()
            if any(c.constant_value(strength) != (0.0,) for strength in strengths):
                return -1
        elif reads and not _keeps_proportion(opcode, words, known, c):
            return -1
        elif reads:
            known.add(words[0])
    return grids.pop() if len(grids) == 1 and known else -1


def _keeps_proportion(opcode: int, words: list[int], known: set[int], c) -> bool:
    """Whether an instruction that reads such a value leaves a multiple of it in its first register."""
    if opcode == ops.AVERAGE:
        return True  # grids of one component have their value in all three
    if (opcode == ops.MULTIPLY and words[1] == 1) or (opcode == ops.MATH and words[1] == _MULTIPLY):
        factors = words[2:4]
    else:
        return False
    constants = [c.constant_value(factor) for factor in factors]
    return any(value is not None and value[0] >= 0.0 for value in constants)
