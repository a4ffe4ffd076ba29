"""Colour nodes: Mix, curves, ramps, adjustments, separations, Blackbody and Wavelength."""

from __future__ import annotations

import itertools

import numpy as np

from ...kernels.shading import opcodes as ops
from .converters import clamped, mix_color
from .registry import node
from .spectra import BLACKBODY_FITS, WAVELENGTHS, wavelength_colors

TABLE_STEPS = 256  # Cycles samples ramps and curves at this many intervals
_STEPS = np.arange(TABLE_STEPS + 1) / TABLE_STEPS


@node("ShaderNodeMixRGB")
def mix_rgb(c, node):
    return {"Color": mix_color(c, node, clamped(c, c.value(node, "Fac")), "Color1", "Color2", node.use_clamp)}


@node("ShaderNodeValToRGB")
def color_ramp(c, node):
    out = c.allocate(4)
    interpolated = node.color_ramp.interpolation != "CONSTANT"
    c.emit(ops.RAMP, out, c.lookup(_ramp, node), TABLE_STEPS + 1, interpolated, c.value(node, "Fac"))
    return {"Color": out, "Alpha": out + 3}


def _ramp(c, node) -> int:
    """A colour ramp at TABLE_STEPS intervals, rgba; most ramps of a file are like others of it."""
    ramp = node.color_ramp
    stops = tuple([(stop.position, *stop.color) for stop in ramp.elements.values()])
    name = "ramp", ramp.interpolation, ramp.color_mode, ramp.hue_interpolation, stops
    return c.scene.shaders.named_table(name, lambda: _ramp_table(ramp, stops))


def _ramp_table(ramp, stops: tuple[tuple[float, ...], ...]) -> np.ndarray:
    """stops: (position, red, green, blue, alpha). Asking Blender takes 50 times as long as drawing lines."""
    positions, *channels = zip(*stops, strict=True)
    rising = all(a < b for a, b in itertools.pairwise(positions))
    if ramp.interpolation == "LINEAR" and ramp.color_mode == "RGB" and rising:
        return np.column_stack([np.interp(_STEPS, positions, channel) for channel in channels])
    return np.array([ramp.evaluate(step) for step in _STEPS.tolist()])


def _sampled(mapping, curves) -> tuple[np.ndarray, float, float]:
    """(table, low, high): composed curves sampled over the range of their points."""
    mapping.initialize()
    used = [curve for chain in curves for curve in chain]
    low = min(curve.points[0].location[0] for curve in used)
    high = max(curve.points[len(curve.points) - 1].location[0] for curve in used)
    table = np.empty((TABLE_STEPS + 1, len(curves)))
    for column, chain in enumerate(curves):
        for row in range(TABLE_STEPS + 1):
            value = low + (high - low) * row / TABLE_STEPS
            for curve in chain:
                value = mapping.evaluate(curve, value)
            table[row, column] = value
    return table, low, high


def _curves(c, node, opcode: int, curves, source: int) -> int:
    table, low, high = _sampled(node.mapping, curves)
    factor = next(socket.identifier for socket in node.inputs if socket.identifier in ("Fac", "Factor"))
    out = c.allocate(len(curves))
    limits = c.constant(low), c.constant(high)
    extended = node.mapping.extend == "EXTRAPOLATED"
    c.emit(opcode, out, c.table(table), len(table), extended, c.value(node, factor), source, *limits)
    return out


@node("ShaderNodeRGBCurve")
def rgb_curves(c, node):
    red, green, blue, combined = node.mapping.curves
    curves = [(combined, red), (combined, green), (combined, blue)]
    return {"Color": _curves(c, node, ops.CURVES, curves, c.vector(node, "Color"))}


@node("ShaderNodeVectorCurve")
def vector_curves(c, node):
    curves = [(curve,) for curve in node.mapping.curves]
    return {"Vector": _curves(c, node, ops.CURVES, curves, c.vector(node, "Vector"))}


@node("ShaderNodeFloatCurve")
def float_curve(c, node):
    curves = [(node.mapping.curves[0],)]
    return {"Value": _curves(c, node, ops.CURVE, curves, c.value(node, "Value"))}


def _one(c, opcode: int, *words: int) -> dict[str, int]:
    out = c.allocate(3)
    c.emit(opcode, out, *words)
    return {"Color": out}


@node("ShaderNodeHueSaturation")
def hue_saturation(c, node):
    numbers = [c.value(node, name) for name in ("Hue", "Saturation", "Value", "Fac")]
    return _one(c, ops.HUE_SATURATION, *numbers, c.vector(node, "Color"))


@node("ShaderNodeBrightContrast")
def bright_contrast(c, node):
    return _one(c, ops.BRIGHT_CONTRAST, c.vector(node, "Color"), c.value(node, "Bright"), c.value(node, "Contrast"))


@node("ShaderNodeGamma")
def gamma(c, node):
    return _one(c, ops.GAMMA, c.vector(node, "Color"), c.value(node, "Gamma"))


@node("ShaderNodeInvert")
def invert(c, node):
    return _one(c, ops.INVERT, c.value(node, "Fac"), c.vector(node, "Color"))


@node("ShaderNodeRGBToBW")
def rgb_to_bw(c, node):
    return {"Val": c.luminance(c.vector(node, "Color"))}


def _separate(c, node, mode: str, source: str, outputs: tuple[str, ...]) -> dict[str, int]:
    color = c.vector(node, source)
    if mode != "RGB":
        color = _one(c, ops.SEPARATE_COLOR, ops.COLOR_MODES.index(mode), color)["Color"]
    return {name: color + k for k, name in enumerate(outputs)}


def _combine(c, node, mode: str, inputs: tuple[str, ...], output: str) -> dict[str, int]:
    out = c.allocate(3)
    c.emit(ops.COMBINE, out, *(c.value(node, name) for name in inputs))
    if mode != "RGB":
        c.emit(ops.COMBINE_COLOR, out, ops.COLOR_MODES.index(mode), out)
    return {output: out}


@node("ShaderNodeSeparateColor")
def separate_color(c, node):
    return _separate(c, node, node.mode, "Color", ("Red", "Green", "Blue"))


@node("ShaderNodeSeparateRGB")
def separate_rgb(c, node):
    return _separate(c, node, "RGB", "Image", ("R", "G", "B"))


@node("ShaderNodeSeparateHSV")
def separate_hsv(c, node):
    return _separate(c, node, "HSV", "Color", ("H", "S", "V"))


@node("ShaderNodeCombineColor")
def combine_color(c, node):
    return _combine(c, node, node.mode, ("Red", "Green", "Blue"), "Color")


@node("ShaderNodeCombineRGB")
def combine_rgb(c, node):
    return _combine(c, node, "RGB", ("R", "G", "B"), "Image")


@node("ShaderNodeCombineHSV")
def combine_hsv(c, node):
    return _combine(c, node, "HSV", ("H", "S", "V"), "Color")


def blackbody_color(c, temperature: int) -> int:
    """The colour of a black body of a temperature in kelvin, by the file's primaries."""
    return _positive(c, _one(c, ops.BLACKBODY, c.table(BLACKBODY_FITS), temperature)["Color"])


def _positive(c, rec709: int) -> int:
    """A linear Rec. 709 colour by the file's primaries, without what lies outside them."""
    zero = c.constant((0.0, 0.0, 0.0))
    return _one(c, ops.MATH3, ops.MATH_OPERATIONS.index("MAXIMUM"), c.of_rec709(rec709), zero, zero)["Color"]


@node("ShaderNodeBlackbody")
def blackbody(c, node):
    return {"Color": blackbody_color(c, c.value(node, "Temperature"))}


@node("ShaderNodeWavelength")
def wavelength(c, node):
    lookup = c.allocate(3)
    c.emit(ops.SPLAT, lookup, c.value(node, "Wavelength"))
    table, one = c.table(wavelength_colors()), c.constant(1.0)
    limits = (c.constant(limit) for limit in WAVELENGTHS)
    c.emit(ops.CURVES, lookup, table, len(wavelength_colors()), 0, one, lookup, *limits)
    return {"Color": _positive(c, lookup)}
