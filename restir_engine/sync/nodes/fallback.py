"""Nodes without a converter: the nearest sensible value and a warning."""

from __future__ import annotations

from ...kernels.lobes import BSDF_NODES

# What is rendered instead of a shader node, with the warning.
_INSTEAD = {
    "ShaderNodeBsdfRayPortal": ("ShaderNodeBsdfTransparent", "ray portals are rendered as transparent"),
}


def unsupported_node(c, node) -> dict[str, int]:
    """The first input of each output's type, else the output's own default."""
    c.warn(f"{node.bl_label} is not supported")
    result = {}
    for output in node.outputs:
        if output.type not in ("VALUE", "VECTOR", "RGBA"):
            continue
        source = next((socket for socket in node.inputs if socket.type == output.type and socket.enabled), None)
        read = c.value if output.type == "VALUE" else c.vector
        if source is not None:
            result[output.identifier] = read(node, source.identifier)
        else:
            result[output.identifier] = c.parameter(output)
    return result


def unsupported_closure(c, node, weight: int) -> None:
    """A simpler node of the same colour, else the first shader that the node takes."""
    if node.bl_idname in _INSTEAD:
        instead, text = _INSTEAD[node.bl_idname]
        c.warn(text)
        if instead == "ShaderNodeBsdfTransparent":
            c.lets_light_through()
        layout = BSDF_NODES[instead]
        words = [-1 if item.name == "Normal" else _input(c, node, item) for item in layout.inputs]
        c.emit(layout.opcode, weight, *words)
        return
    c.warn(f"{node.bl_label} is not supported")
    source = next((socket for socket in node.inputs if socket.type == "SHADER"), None)
    if source is not None:
        c.closure(node, source.identifier, weight)


def _input(c, node, item) -> int:
    return c.vector(node, item.name) if item.components == 3 else c.constant(0.0)
