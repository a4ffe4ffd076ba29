"""Nodes of the Volume socket: media of constant coefficients, as Cycles understands them."""

from __future__ import annotations

from ...kernels.shading import opcodes as ops
from ...kernels.subsurface.parameters import ANY_SIGN, METHODS, POSITIVE
from ...kernels.volume import phase as phases
from .closures import add_shader, mix_shader
from .color import blackbody_color
from .generic import menu_switch_shader
from .inputs import attribute, factor
from .registry import inside, node, volume
from .subsurface import choice, medium_inputs

# Phase functions by the identifier in the nodes: kind and the inputs it reads.
PHASES: dict[str, tuple[int, tuple[str, ...]]] = {
    "HENYEY_GREENSTEIN": (phases.PHASE_HG, ("Anisotropy",)),
    "RAYLEIGH": (phases.PHASE_RAYLEIGH, ()),
    "DRAINE": (phases.PHASE_DRAINE, ("Anisotropy", "Alpha")),
    "FOURNIER_FORAND": (phases.PHASE_FOURNIER_FORAND, ("IOR", "Backscatter")),
    "MIE": (phases.PHASE_MIE, ("Diameter",)),
}

for register in (volume, inside):
    register("ShaderNodeMixShader")(mix_shader)
    register("ShaderNodeAddShader")(add_shader)
    register("GeometryNodeMenuSwitch")(menu_switch_shader)


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
    temperature = c.value(node, "Temperature")
    density, color = c.value(node, "Density"), c.vector(node, "Color")
    blackbody = c.value(node, "Blackbody Intensity")
    if c.in_grids:
        density = _times_grid(c, node, "Density Attribute", density, 1)
        color = _times_grid(c, node, "Color Attribute", color, 3)
    black = c.constant_value(blackbody) == (0.0,)
    if c.in_grids and not black:
        temperature = _times_grid(c, node, "Temperature Attribute", temperature, 1)
    c.emit(
        ops.VOLUME_PRINCIPLED,
        weight,
        color,
        density,
        c.value(node, "Anisotropy"),
        c.vector(node, "Absorption Color"),
        c.value(node, "Emission Strength"),
        c.vector(node, "Emission Color"),
        blackbody,
        c.vector(node, "Blackbody Tint"),
        temperature,
        c.one if black else blackbody_color(c, temperature),
    )


def _times_grid(c, node, socket: str, factor: int, components: int) -> int:
    """A value times the grid that the node names, where the object has such a one."""
    grid = c.look_at(c.inputs(node).find(socket)[0])
    return _times(c, grid, factor, components) if grid else factor


def _times(c, grid: str, factor: int, components: int) -> int:
    values, out = c.allocate(4), c.allocate(components)
    c.emit(ops.VOLUME_ATTRIBUTE, values, c.attribute(grid))
    if components == 1:
        mean = c.allocate(1)
        c.emit(ops.AVERAGE, mean, values)
        values = mean
    c.emit(ops.MULTIPLY, out, components, factor, values)
    return out


@node("ShaderNodeVolumeInfo")
def volume_info(c, _):
    return {
        "Color": lambda: attribute(c, "color"),
        "Density": lambda: factor(c, "density"),
        "Flame": lambda: factor(c, "flame"),
        "Temperature": lambda: factor(c, "temperature"),
    }


@volume("ShaderNodeEmission")
def emission(c, node, weight):
    c.emit(ops.EMISSION, weight, c.vector(node, "Color"), c.value(node, "Strength"))


@inside("ShaderNodeBsdfPrincipled")
def principled_inside(c, node, weight):
    """Scatter Inside: behind its glass, Principled's subsurface parameters are those of the medium."""
    own = medium_inputs(c, node)

    def number(name: str) -> int:
        return own[name] if name in own else c.value(node, name)

    def color(name: str) -> int:
        return own[name] if name in own else c.vector(node, name)

    share = number("Subsurface Weight")
    if (0.0,) in (c.constant_value(share), c.constant_value(c.value(node, "Transmission Weight"))):
        return
    c.emit(
        ops.VOLUME_SUBSURFACE,
        weight,
        share,
        color("Base Color"),
        color("Subsurface Radius"),
        number("Subsurface Scale"),
        number("Subsurface Anisotropy"),
        number("IOR"),
        METHODS[choice(c, node, "subsurface_method")],
        ANY_SIGN if choice(c, node, "sign") == "ANY" else POSITIVE,
    )


def default_medium(c) -> None:
    """Cycles' Principled Volume as it comes: grey smoke of the density of its grid, coloured by another."""
    zero, black = c.constant(0.0), c.constant((0.0, 0.0, 0.0))

    def emit() -> None:
        density, color = _times(c, "density", c.constant(1.0), 1), _times(c, "color", c.constant((0.5, 0.5, 0.5)), 3)
        operands = (c.one, color, density, zero, black, zero, c.one, zero, c.one, c.constant(1000.0), c.one)
        c.emit(ops.VOLUME_PRINCIPLED, *operands)

    c.medium(emit)
