"""Nodes that read the shading point, the object, the ray or the camera."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ...kernels.core.records import SHAPE_SPHERES, SHAPE_STRANDS
from ...kernels.shading import opcodes as ops
from ...scene import names
from .registry import node, unlinked


def _read(c, key: tuple, size: int, op: int, word: int) -> int:
    """The first of `size` registers that an instruction fills from the shading point, or one shifted for a bump."""

    def read() -> int:
        out = c.allocate(size)
        c.emit(op, out, word, c.offset, c.width)
        return out

    return c.once(key, read)


def point(c, what: int) -> int:
    """The register of a vector POINT_* of the shading point."""
    return _read(c, ("point", what), 3, ops.GEOMETRY, what)


def attribute(c, name: str) -> int:
    """The registers x, y, z, alpha of an attribute."""
    return _read(c, ("attribute", name), 4, ops.ATTRIBUTE, c.attribute(name))


def factor(c, name: str) -> int:
    """The register of an attribute as one number."""
    return _read(c, ("factor", name), 1, ops.ATTRIBUTE_FACTOR, c.attribute(name))


def _zeros(c, node) -> dict[str, int]:
    return {output.identifier: c.constant((0.0, 0.0, 0.0)) for output in node.outputs}


def _light_path(c, name: str) -> int:
    def read() -> int:
        out = c.allocate(1)
        c.emit(ops.LIGHT_PATH, out, ops.LIGHT_PATH_OUTPUTS.index(name))
        return out

    return c.once(("light path", name), read)


def _stands_for(opcode: int) -> Callable:
    return lambda c, node: point(c, opcode)


for _opcode, _names in {
    ops.POINT_NORMAL: ("Normal", "Coat Normal", "Clear Coat Normal", "Direction"),
    ops.POINT_TANGENT: ("Tangent",),
    ops.POINT_POSITION: ("Position",),
}.items():
    unlinked(*_names)(_stands_for(_opcode))


@unlinked("Vector")
def default_coordinates(c, node) -> int:
    """Where a texture node looks when nothing says otherwise."""
    if node.bl_idname == "ShaderNodeTexImage":
        return attribute(c, names.UV)
    if node.bl_idname in ("ShaderNodeTexEnvironment", "ShaderNodeTexWhiteNoise", "ShaderNodeTexPointDensity"):
        return point(c, ops.POINT_POSITION)
    if node.bl_idname == "ShaderNodeTexIES":
        incoming, out = point(c, ops.POINT_INCOMING), c.allocate(3)
        spaces = ops.SPACES.index("WORLD"), ops.SPACES.index("OBJECT")
        c.emit(ops.VECTOR_TRANSFORM, out, ops.TRANSFORM_TYPES.index("VECTOR"), *spaces, incoming)
        return out
    if node.bl_idname.startswith("ShaderNodeTex"):
        return point(c, ops.POINT_GENERATED)
    return c.constant((0.0, 0.0, 0.0))


@node("ShaderNodeValue")
def value(c, node):
    return {"Value": c.parameter(node.outputs[0])}


@node("GeometryNodeInputSceneTime")
def scene_time(c, node):
    scene = c.scene
    return {"Frame": c.constant(scene.time), "Seconds": c.constant(scene.time / scene.frames_per_second)}


@node("ShaderNodeRGB")
def rgb(c, node):
    return {"Color": c.parameter(node.outputs[0])}


@node("ShaderNodeTexCoord")
def texture_coordinate(c, node):
    instancer = node.from_instancer
    return {
        "Generated": lambda: point(c, ops.POINT_INSTANCER_GENERATED if instancer else ops.POINT_GENERATED),
        "Normal": lambda: point(c, ops.POINT_OBJECT_NORMAL),
        "UV": lambda: point(c, ops.POINT_INSTANCER_UV) if instancer else attribute(c, names.UV),
        "Object": lambda: _object_coordinates(c, node.object),
        "Camera": lambda: point(c, ops.POINT_CAMERA),
        "Window": lambda: point(c, ops.POINT_WINDOW),
        "Reflection": lambda: point(c, ops.POINT_REFLECTION),
    }


def _object_coordinates(c, target) -> int:
    if target is None:
        return point(c, ops.POINT_OBJECT)
    c.objects.add(target.original.session_uid)
    matrix = np.array(target.matrix_world, np.float64)
    inverse = np.linalg.pinv(matrix) if abs(np.linalg.det(matrix)) < 1e-30 else np.linalg.inv(matrix)
    out = c.allocate(3)
    c.emit(ops.AFFINE, out, point(c, ops.POINT_POSITION), c.constant(tuple(inverse[:3].ravel())))
    return out


@node("ShaderNodeUVMap")
def uv_map(c, node):
    return {"UV": point(c, ops.POINT_INSTANCER_UV) if node.from_instancer else attribute(c, node.uv_map)}


@node("ShaderNodeAttribute")
def attribute_node(c, node):
    name = node.attribute_name
    if not name:
        return _zeros(c, node)
    if node.attribute_type != "GEOMETRY":
        name = names.object_property(name, node.attribute_type)
    return _attribute_outputs(c, name)


@node("ShaderNodeVertexColor")
def color_attribute(c, node):
    return _attribute_outputs(c, node.layer_name or names.COLOR)


def _attribute_outputs(c, name: str):
    return {
        "Color": lambda: attribute(c, name),
        "Vector": lambda: attribute(c, name),
        "Fac": lambda: factor(c, name),
        "Alpha": lambda: attribute(c, name) + 3,
    }


@node("ShaderNodeNewGeometry")
def geometry(c, node):
    return {
        "Position": lambda: point(c, ops.POINT_POSITION),
        "Normal": lambda: point(c, ops.POINT_NORMAL),
        "Tangent": lambda: point(c, ops.POINT_TANGENT),
        "True Normal": lambda: point(c, ops.POINT_TRUE_NORMAL),
        "Incoming": lambda: point(c, ops.POINT_INCOMING),
        "Parametric": lambda: point(c, ops.POINT_PARAMETRIC),
        "Backfacing": lambda: _light_path(c, "Backfacing"),
        "Pointiness": lambda: attribute(c, names.POINTINESS),
        "Random Per Island": lambda: attribute(c, names.ISLAND),
    }


def _object_info(c) -> int:
    def read() -> int:
        out = c.allocate(12)
        c.emit(ops.OBJECT_INFO, out)
        return out

    return c.once("object info", read)


@node("ShaderNodeObjectInfo")
def object_info(c, node):
    out = _object_info(c)
    places = {"Location": 0, "Color": 3, "Alpha": 6, "Object Index": 7, "Material Index": 8, "Random": 9}
    return {name: out + place for name, place in places.items()}


@node("ShaderNodeParticleInfo")
def particle_info(c, node):
    if any(output.is_linked and output.identifier != "Random" for output in node.outputs):
        c.warn("particle data other than Random is zero")
    return _zeros(c, node) | {"Random": lambda: _object_info(c) + 10}


@node("ShaderNodeCameraData")
def camera_data(c, node):
    out = c.allocate(5)
    c.emit(ops.CAMERA_DATA, out)
    return {"View Vector": out, "View Z Depth": out + 3, "View Distance": out + 4}


@node("ShaderNodeLightPath")
def light_path(c, node):
    known = [output.identifier for output in node.outputs if output.identifier in ops.LIGHT_PATH_OUTPUTS]
    return _zeros(c, node) | {name: (lambda name=name: _light_path(c, name)) for name in known}


@node("ShaderNodeFresnel")
def fresnel(c, node):
    out = c.allocate(1)
    c.emit(ops.FRESNEL, out, c.value(node, "IOR"), c.normal(node))
    return {"Fac": out}


@node("ShaderNodeLayerWeight")
def layer_weight(c, node):
    out = c.allocate(2)
    c.emit(ops.LAYER_WEIGHT, out, c.value(node, "Blend"), c.normal(node))
    return {"Fresnel": out, "Facing": out + 1}


@node("ShaderNodeLightFalloff")
def light_falloff(c, node):
    out = c.allocate(3)
    c.emit(ops.LIGHT_FALLOFF, out, c.value(node, "Strength"), c.value(node, "Smooth"))
    return {"Quadratic": out, "Linear": out + 1, "Constant": out + 2}


@node("ShaderNodeWireframe")
def wireframe(c, node):
    out = c.allocate(1)
    c.emit(ops.WIREFRAME, out, node.use_pixel_size, c.offset, c.width, c.value(node, "Size"))
    return {"Fac": out}


def _shape_info(c, shape: int) -> int:
    """The first of the five registers of SHAPE_INFO; shape: SHAPE_STRANDS or SHAPE_SPHERES."""

    def read() -> int:
        out = c.allocate(5)
        c.emit(ops.SHAPE_INFO, out, shape)
        return out

    return c.once(("shape info", shape), read)


@node("ShaderNodeHairInfo")
def strand_info(c, node):
    return {
        "Is Strand": lambda: _shape_info(c, SHAPE_STRANDS) + 4,
        "Intercept": lambda: factor(c, names.INTERCEPT),
        "Length": lambda: factor(c, names.LENGTH),
        "Thickness": lambda: _shape_info(c, SHAPE_STRANDS) + 3,
        "Tangent Normal": lambda: _shape_info(c, SHAPE_STRANDS),
        "Random": lambda: factor(c, names.STRAND_RANDOM),
    }


@node("ShaderNodePointInfo")
def point_info(c, node):
    return {
        "Position": lambda: _shape_info(c, SHAPE_SPHERES),
        "Radius": lambda: _shape_info(c, SHAPE_SPHERES) + 3,
        "Random": lambda: factor(c, names.POINT_RANDOM),
    }
