"""Nodes of the Volume socket: media of constant coefficients, as Cycles understands them."""

from __future__ import annotations

from ...kernels import opcodes as ops
from ...kernels.media import phase as phases
from .closures import add_shader, mix_shader
from .generic import menu_switch_shader
from .registry import volume
from .spectra import BLACKBODY_FITS

# Phase functions by the identifier in the nodes: kind and the inputs it reads.
PHASES: dict[str, tuple[int, tuple[str, ...]]] = {
    "HENYEY_GREENSTEIN": (phases.PHASE_HG, ("Anisotropy",)),
    "RAYLEIGH": (phases.PHASE_RAYLEIGH, ()),
    "DRAINE": (phases.PHASE_DRAINE, ("Anisotropy", "Alpha")),
    "FOURNIER_FORAND": (phases.PHASE_FOURNIER_FORAND, ("IOR", "Backscatter")),
    "MIE": (phases.PHASE_MIE, ("Diameter",)),
}

volume("ShaderNodeMixShader")(mix_shader)
volume("ShaderNodeAddShader")(add_shader)
volume("GeometryNodeMenuSwitch")(menu_switch_shader)


def _phase(c, node) -> list[int]:
    """The operands that say how a node scatters: kind and two registers."""
    kind, inputs = PHASES[node.phase]
    registers = [c.value(node, name) for name in inputs]
    return [kind, *registers, *[c.constant(0.0)] * (2 - len(registers))]


@volume("ShaderNodeVolumeScatter")
def volume_scatter(c, node, weight):
    c.emit(ops.VOLUME_SCATTER, weight, c.vector(node, "Color"), c.value(node, "Density"), *_phase(c, node))


@volume("ShaderNodeVolumeAbsorption")
def volume_absorption(c, node, weight):
    c.emit(ops.VOLUME_ABSORPTION, weight, c.vector(node, "Color"), c.value(node, "Density"))


@volume("ShaderNodeVolumeCoefficients")
def volume_coefficients(c, node, weight):
    names = ("Absorption Coefficients", "Scatter Coefficients", "Emission Coefficients")
    c.emit(ops.VOLUME_COEFFICIENTS, weight, *(c.vector(node, name) for name in names), *_phase(c, node))


@volume("ShaderNodeVolumePrincipled")
def volume_principled(c, node, weight):
    blackbody, temperature = c.value(node, "Blackbody Intensity"), c.value(node, "Temperature")
    color = c.one
    if c.constant_value(blackbody) != (0.0,):
        color = c.allocate(3)
        c.emit(ops.BLACKBODY, color, c.table(BLACKBODY_FITS), temperature)
    c.emit(
        ops.VOLUME_PRINCIPLED,
        weight,
        c.vector(node, "Color"),
        c.value(node, "Density"),
        c.value(node, "Anisotropy"),
        c.vector(node, "Absorption Color"),
        c.value(node, "Emission Strength"),
        c.vector(node, "Emission Color"),
        blackbody,
        c.vector(node, "Blackbody Tint"),
        temperature,
        color,
    )


@volume("ShaderNodeEmission")
def emission(c, node, weight):
    c.emit(ops.EMISSION, weight, c.vector(node, "Color"), c.value(node, "Strength"))
