"""Procedural texture nodes."""

from __future__ import annotations

import bpy

from ...kernels.shading import opcodes as vm
from ...kernels.shading.textures import noise, patterns, voronoi, wave
from ...kernels.shading.textures import opcodes as ops
from .coordinates import texture_vector
from .registry import node

# Blender 5 changed Voronoi's hash and where Magic wraps its coordinates.
_BLENDER_5 = bpy.app.version >= (5, 0, 0)

_DIMENSIONS = {"1D": 1, "2D": 2, "3D": 3, "4D": 4}
_NOISE_KINDS = {
    "MULTIFRACTAL": noise.MULTIFRACTAL,
    "FBM": noise.FBM,
    "HYBRID_MULTIFRACTAL": noise.HYBRID_MULTIFRACTAL,
    "RIDGED_MULTIFRACTAL": noise.RIDGED_MULTIFRACTAL,
    "HETERO_TERRAIN": noise.HETERO_TERRAIN,
}
_FEATURES = {
    "F1": voronoi.F1,
    "F2": voronoi.F2,
    "SMOOTH_F1": voronoi.SMOOTH_F1,
    "DISTANCE_TO_EDGE": voronoi.DISTANCE_TO_EDGE,
    "N_SPHERE_RADIUS": voronoi.N_SPHERE_RADIUS,
}
_METRICS = {
    "EUCLIDEAN": voronoi.EUCLIDEAN,
    "MANHATTAN": voronoi.MANHATTAN,
    "CHEBYCHEV": voronoi.CHEBYCHEV,
    "MINKOWSKI": voronoi.MINKOWSKI,
}
_WAVE_DIRECTIONS = {"X": wave.X, "Y": wave.Y, "Z": wave.Z, "DIAGONAL": wave.DIAGONAL, "SPHERICAL": wave.SPHERICAL}
_WAVE_PROFILES = {"SIN": wave.SINE, "SAW": wave.SAW, "TRI": wave.TRIANGLE}
_GRADIENTS = {
    "LINEAR": patterns.LINEAR,
    "QUADRATIC": patterns.QUADRATIC,
    "EASING": patterns.EASING,
    "DIAGONAL": patterns.DIAGONAL,
    "RADIAL": patterns.RADIAL,
    "QUADRATIC_SPHERE": patterns.QUADRATIC_SPHERE,
    "SPHERICAL": patterns.SPHERICAL,
}


def _values(c, node, *names: str) -> list[int]:
    return [c.value(node, name) for name in names]


def _gray(c, register: int) -> int:
    out = c.allocate(3)
    c.emit(vm.SPLAT, out, register)
    return out


@node("ShaderNodeTexNoise")
def noise_texture(c, node):
    out = c.allocate(4)
    flags = _DIMENSIONS[node.noise_dimensions] | _NOISE_KINDS[node.noise_type] << 4
    flags |= noise.FLAG_NORMALIZE if node.normalize else 0
    flags |= noise.FLAG_COLOR if node.outputs["Color"].is_linked else 0
    names = ("W", "Scale", "Detail", "Roughness", "Lacunarity", "Offset", "Gain", "Distortion")
    c.emit(ops.NOISE, out, texture_vector(c, node), *_values(c, node, *names), flags)
    return {"Fac": out, "Color": out + 1}


@node("ShaderNodeTexVoronoi")
def voronoi_texture(c, node):
    out = c.allocate(voronoi.RESULTS + voronoi.WORK)
    dimensions, feature = _DIMENSIONS[node.voronoi_dimensions], _FEATURES[node.feature]
    points = feature in (voronoi.F1, voronoi.F2, voronoi.SMOOTH_F1)
    # Metrics are for points, and all the same along a line.
    metric = _METRICS[node.distance] if points and dimensions > 1 else voronoi.EUCLIDEAN
    flags = dimensions | feature << 4 | metric << 8
    flags |= voronoi.FLAG_NORMALIZE if node.normalize else 0
    flags |= voronoi.FLAG_INTEGER_CELLS if _BLENDER_5 else 0
    names = ("W", "Scale", "Detail", "Roughness", "Lacunarity", "Smoothness", "Exponent", "Randomness")
    c.emit(ops.VORONOI, out, texture_vector(c, node), *_values(c, node, *names), flags)
    return {"Distance": out, "Color": out + 1, "Position": out + 4, "W": out + 7, "Radius": out + 8}


@node("ShaderNodeTexWave")
def wave_texture(c, node):
    bands = node.wave_type == "BANDS"
    direction = _WAVE_DIRECTIONS[node.bands_direction if bands else node.rings_direction]
    flags = (wave.BANDS if bands else wave.RINGS) | direction << 4 | _WAVE_PROFILES[node.wave_profile] << 8
    names = ("Scale", "Distortion", "Detail", "Detail Scale", "Detail Roughness", "Phase Offset")
    factor = c.allocate(1)
    c.emit(ops.WAVE, factor, texture_vector(c, node), *_values(c, node, *names), flags)
    return {"Fac": factor, "Color": _gray(c, factor)}


@node("ShaderNodeTexBrick")
def brick_texture(c, node):
    out = c.allocate(4)
    colors = [c.vector(node, name) for name in ("Color1", "Color2", "Mortar")]
    names = ("Scale", "Mortar Size", "Mortar Smooth", "Bias", "Brick Width", "Row Height")
    numbers = [*_values(c, node, *names), c.constant(node.offset), c.constant(node.squash)]
    words = [*colors, *numbers, node.offset_frequency, node.squash_frequency]
    c.emit(ops.BRICK, out, texture_vector(c, node), *words)
    return {"Color": out, "Fac": out + 3}


@node("ShaderNodeTexChecker")
def checker_texture(c, node):
    out = c.allocate(4)
    colors = [c.vector(node, "Color1"), c.vector(node, "Color2")]
    c.emit(ops.CHECKER, out, texture_vector(c, node), *colors, c.value(node, "Scale"))
    return {"Color": out, "Fac": out + 3}


@node("ShaderNodeTexGradient")
def gradient_texture(c, node):
    factor = c.allocate(1)
    c.emit(ops.GRADIENT, factor, texture_vector(c, node), _GRADIENTS[node.gradient_type])
    return {"Fac": factor, "Color": _gray(c, factor)}


@node("ShaderNodeTexMagic")
def magic_texture(c, node):
    out = c.allocate(4)
    numbers = _values(c, node, "Scale", "Distortion")
    c.emit(ops.MAGIC, out, texture_vector(c, node), *numbers, node.turbulence_depth, int(_BLENDER_5))
    return {"Color": out, "Fac": out + 3}


@node("ShaderNodeTexWhiteNoise")
def white_noise_texture(c, node):
    out = c.allocate(4)
    # This node alone has no coordinates of its own: an unlinked vector is the origin.
    vector = c.vector(node, "Vector") if c.is_linked(node, "Vector") else c.constant((0.0, 0.0, 0.0))
    c.emit(ops.WHITE_NOISE, out, vector, c.value(node, "W"), _DIMENSIONS[node.noise_dimensions])
    return {"Value": out, "Color": out + 1}


@node("ShaderNodeTexGabor")
def gabor_texture(c, node):
    out = c.allocate(3)
    words = [*_values(c, node, "Scale", "Frequency", "Anisotropy", "Orientation 2D"), c.vector(node, "Orientation 3D")]
    c.emit(ops.GABOR, out, texture_vector(c, node), *words, 2 if node.gabor_type == "2D" else 3)
    return {"Value": out, "Phase": out + 1, "Intensity": out + 2}


@node("ShaderNodeRadialTiling")
def radial_tiling(c, node):
    out = c.allocate(6)
    c.emit(ops.RADIAL_TILING, out, c.vector(node, "Vector"), *_values(c, node, "Sides", "Roundness"), node.normalize)
    names = ("Segment Coordinates", "Segment ID", "Segment Width", "Segment Rotation")
    return dict(zip(names, (out, out + 3, out + 4, out + 5), strict=True))


@node("ShaderNodeTexPointDensity")
def point_density_texture(c, node):
    c.warn("point density is not supported: it is 0 everywhere")
    return {"Density": c.constant(0.0), "Color": c.constant((0.0, 0.0, 0.0))}
