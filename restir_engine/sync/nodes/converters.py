"""Converter nodes: numbers and vectors to others."""

from __future__ import annotations

from ...kernels import opcodes as ops
from .registry import node


def _inputs(node) -> list[str]:
    return [socket.identifier for socket in node.inputs]


@node("ShaderNodeMath")
def math(c, node):
    out = c.allocate(1)
    operands = [c.value(node, name) for name in _inputs(node)]
    c.emit(ops.MATH, out, ops.MATH_OPERATIONS.index(node.operation), *operands)
    if node.use_clamp:
        c.emit(ops.CLAMP, out, out, c.constant(0.0), c.constant(1.0), 0)
    return {"Value": out}
