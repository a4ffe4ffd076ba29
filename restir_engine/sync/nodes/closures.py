"""Shader nodes: closures, emission, and how they are mixed."""

from __future__ import annotations

from ...kernels.lobes import BSDF_NODES
from ...kernels.lobes import nodes as lobes
from ...kernels.shading import opcodes as ops
from ...scene import names
from .inputs import factor
from .registry import closure
from .subsurface import choice, medium_inputs, note_subsurface
from .thin_film import thin_film


@closure("ShaderNodeMixShader")
def mix_shader(c, node, weight):
    factor = c.value(node, "Fac")
    first, second = (socket.identifier for socket in node.inputs if socket.type == "SHADER")
    known = c.constant_value(factor)
    if known is not None and known[0] <= 0.0:
        c.closure(node, first, weight)
    elif known is not None and known[0] >= 1.0:
        c.closure(node, second, weight)
    else:
        share = 0.5 if known is None else known[0]
        left, right = c.allocate(3), c.allocate(3)
        c.emit(ops.MIX_WEIGHTS, left, right, weight, factor)
        c.branches(node, [(first, left, 1.0 - share), (second, right, share)])


@closure("ShaderNodeAddShader")
def add_shader(c, node, weight):
    for socket in node.inputs:
        c.closure(node, socket.identifier, weight)


@closure("ShaderNodeEmission", "ShaderNodeBackground")
def emission(c, node, weight):
    color, strength = c.vector(node, "Color"), c.value(node, "Strength")
    c.emits(weight, color, strength)
    c.emit(ops.EMISSION, weight, color, strength)


@closure("ShaderNodeHoldout")
def holdout(c, node, weight):
    c.emit(ops.HOLDOUT, weight)


@closure(*BSDF_NODES)
def bsdf(c, node, weight):
    layout = BSDF_NODES[node.bl_idname]
    own = medium_inputs(c, node)
    words = [operand(c, node, item) if item.name not in own else own[item.name] for item in layout.inputs]
    words += [values.get(choice(c, node, attribute), 0) for attribute, values in layout.enums]
    _analyse(c, node, layout, weight, words)
    c.emit(layout.opcode, weight, *words)


@closure("ShaderNodeBsdfHairPrincipled")
def principled_hair(c, node, weight):
    layout = lobes.PRINCIPLED_HAIR[node.model]
    words = [operand(c, node, item) for item in layout.inputs]
    spreads = [words[layout.operand(name) - 1] for name in ("Random Color", "Random Roughness")]
    if not c.is_linked(node, "Random") and any(c.constant_value(word) != (0.0,) for word in spreads):
        words[layout.operand("Random") - 1] = factor(c, names.STRAND_RANDOM)
    words += [values[getattr(node, attribute)] for attribute, values in layout.enums]
    if node.model == "HUANG":
        c.warn("hair by Huang differs from Cycles': up to 3 % under a sky, 12 % where it is light, more by small lamps")
        ratio = next((socket for socket in node.inputs if socket.name == "Aspect Ratio"), None)
        if ratio is not None and (ratio.is_linked or c.look_at(ratio) != 1.0):
            c.warn("the aspect ratio of hair is left out: strands are round")
    c.emit(layout.opcode, weight, *words)


def operand(c, node, item) -> int:
    if item.default == lobes.FILM:
        return thin_film(c, node)
    find = c.inputs(node).find
    name = item.name if find(item.name) else next((name for name in item.alternates if find(name)), None)
    if name is None:
        return c.constant(item.missing if item.components == 1 else (item.missing,) * 3)
    if item.default != lobes.VALUE and not c.is_linked(node, name):
        return _default_frame(c, node, item)
    return c.value(node, name) if item.components == 1 else c.vector(node, name)


def _default_frame(c, node, item) -> int:
    if item.default == lobes.TANGENT:
        anisotropy = c.value(node, "Anisotropy" if node.bl_idname != "ShaderNodeBsdfPrincipled" else "Anisotropic")
        return -1 if c.constant_value(anisotropy) == (0.0,) else c.vector(node, item.name)
    return -1


def _analyse(c, node, layout, weight, words) -> None:
    if node.bl_idname == "ShaderNodeBsdfTransparent":
        c.lets_light_through()
    if node.bl_idname == "ShaderNodeBsdfPrincipled":
        inputs = dict(zip((item.name for item in layout.inputs), words, strict=False))
        alpha = c.constant_value(inputs["Alpha"])
        opaque = alpha is not None and alpha[0] >= 1.0
        if not opaque:
            c.lets_light_through()
        bare = all(c.constant_value(inputs[layer]) == (0.0,) for layer in ("Coat Weight", "Sheen Weight"))
        c.emits(weight, inputs["Emission Color"], inputs["Emission Strength"], opaque and bare)
        note_subsurface(c, node, inputs["Subsurface Weight"])
    if node.bl_idname == "ShaderNodeSubsurfaceScattering":
        note_subsurface(c, node, None)
