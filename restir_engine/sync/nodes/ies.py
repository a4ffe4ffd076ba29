"""IES Texture: files and text blocks."""

from __future__ import annotations

from pathlib import Path

import bpy

from ...kernels.shading import opcodes as ops
from ...kernels.shading.textures.opcodes import IES
from ..ies import ies_table
from .registry import node

_MISSING = 100.0  # what Cycles shows for what it cannot read


@node("ShaderNodeTexIES")
def ies_texture(c, node):
    vector, strength, out = c.vector(node, "Vector"), c.value(node, "Strength"), c.allocate(1)
    text = _text(node)
    c.is_alone = True  # a file's path is relative to the tree's library
    table = None if text is None else ies_table(text)
    if table is None:
        c.warn("IES file is missing" if text is None else "IES file cannot be read")
        c.emit(ops.MULTIPLY, out, 1, strength, c.constant(_MISSING))
    else:
        c.emit(IES, out, vector, strength, c.table(table))
    return {"Fac": out}


def _text(node) -> str | None:
    """What stands in the node's text block or file; None where there is none."""
    if node.mode == "INTERNAL":
        return None if node.ies is None else node.ies.as_string()
    path = Path(bpy.path.abspath(node.filepath, library=node.id_data.library))
    return path.read_text("latin-1") if node.filepath and path.is_file() else None
