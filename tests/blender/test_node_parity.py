"""Every converter against Cycles: the same node, the same points, the same numbers."""

import bpy
import numpy as np
import pytest

from restir_engine.kernels.shading import opcodes as ops
from testing.blender.nodes import add_node, compare

TOLERANCE = 2e-4  # Cycles works in float32 and its sample lies up to 0.005 pixels off the middle


def _coordinates(tree, output="Generated", **settings):
    return add_node(tree, "ShaderNodeTexCoord", **settings).outputs[output]


def _uv(tree):
    return _coordinates(tree, "UV")


def _paint(tree):
    return add_node(tree, "ShaderNodeVertexColor", layer_name="Paint").outputs["Color"]


def _heat(tree):
    return add_node(tree, "ShaderNodeAttribute", attribute_name="Heat").outputs["Fac"]


def _one(identifier, inputs=None, output=0, **settings):
    """A case of a single node; values of `inputs` may be functions of the tree."""

    def build(tree):
        filled = {key: item(tree) if callable(item) else item for key, item in (inputs or {}).items()}
        node = add_node(tree, identifier, inputs=filled, **settings)
        return node.outputs[output]

    return build


def _math_cases():
    operands = {"ARCSINE": (_heat, 0.3, 0.1), "LOGARITHM": (_heat, 2.5, 0.0)}
    for operation in ops.MATH_OPERATIONS:
        a, b, c = operands.get(operation, (_heat, 0.37, 0.21))
        inputs = {"Value": a, "Value_001": b, "Value_002": c}
        yield f"math {operation}", _one("ShaderNodeMath", inputs, operation=operation)
    yield "math clamp", _one("ShaderNodeMath", {"Value": _heat, "Value_001": 0.6}, operation="ADD", use_clamp=True)


def _vector_math_cases():
    inputs = {"Vector": _paint, "Vector_001": (0.3, -0.4, 0.7), "Vector_002": (0.1, 0.2, -0.3), "Scale": 0.7}
    names = [item.identifier for item in bpy.types.ShaderNodeVectorMath.bl_rna.properties["operation"].enum_items]
    for operation in names:
        scalar = operation in ("DOT_PRODUCT", "DISTANCE", "LENGTH")
        output = "Value" if scalar else "Vector"
        yield f"vector {operation}", _one("ShaderNodeVectorMath", inputs, output, operation=operation)


def _mix_value(data_type, output, inputs, **settings):
    def build(tree):
        node = add_node(tree, "ShaderNodeMix", data_type=data_type, **settings)
        for name, item in inputs.items():
            socket = next(s for s in node.inputs if s.identifier == name)
            if callable(item):
                tree.links.new(item(tree), socket)
            else:
                socket.default_value = item
        return next(s for s in node.outputs if s.identifier == output)

    return build


def _mix_cases():
    floats = {"Factor_Float": 1.4, "A_Float": _heat, "B_Float": 0.9}
    yield "mix float", _mix_value("FLOAT", "Result_Float", floats, clamp_factor=False)
    yield "mix float clamped", _mix_value("FLOAT", "Result_Float", floats, clamp_factor=True)
    vectors = {"Factor_Float": _heat, "Factor_Vector": (0.2, 0.5, 1.5), "A_Vector": _paint, "B_Vector": (1.0, 0.5, 0.0)}
    yield "mix vector", _mix_value("VECTOR", "Result_Vector", vectors)
    yield "mix vector each", _mix_value("VECTOR", "Result_Vector", vectors, factor_mode="NON_UNIFORM")


def _blend_results():
    cases = {}
    for blend in ops.BLEND_MODES:
        inputs = {"Factor_Float": 0.6, "A_Color": _paint, "B_Color": (0.2, 0.7, 0.4, 1.0)}
        cases[f"mix {blend}"] = _mix_value("RGBA", "Result_Color", inputs, blend_type=blend)
    inputs = {"Factor_Float": 1.7, "A_Color": _paint, "B_Color": (0.2, 0.7, 0.4, 1.0)}
    cases["mix unclamped"] = _mix_value("RGBA", "Result_Color", inputs, clamp_factor=False, clamp_result=True)
    other = {"Fac": _heat, "Color1": _paint, "Color2": (0.9, 0.1, 0.3, 1.0)}
    cases["mix legacy"] = _one("ShaderNodeMixRGB", other, blend_type="SOFT_LIGHT", use_clamp=True)
    return cases


def _range_cases():
    for mode in ops.MAP_RANGE_MODES:
        for clamp in (True, False):
            inputs = {"Value": _heat, "From Min": 0.2, "From Max": 0.7, "To Min": 0.9, "To Max": 0.1, "Steps": 3.0}
            settings = {"interpolation_type": mode, "clamp": clamp}
            yield f"range {mode} {clamp}", _one("ShaderNodeMapRange", inputs, **settings)
        vectors = {
            "Vector": _paint,
            "From_Min_FLOAT3": (0.1, 0.9, 0.0),
            "From_Max_FLOAT3": (0.8, 0.2, 0.0),
            "To_Min_FLOAT3": (0.0, 1.0, 0.5),
            "To_Max_FLOAT3": (1.0, 0.2, 0.7),
            "Steps_FLOAT3": (2.0, 3.0, 4.0),
        }
        settings = {"data_type": "FLOAT_VECTOR", "interpolation_type": mode}
        yield f"range vector {mode}", _one("ShaderNodeMapRange", vectors, "Vector", **settings)
    limits = {"Value": _heat, "Min": 0.6, "Max": 0.4}
    yield "clamp", _one("ShaderNodeClamp", limits)
    yield "clamp range", _one("ShaderNodeClamp", limits, clamp_type="RANGE")


def _vector_cases():
    turned = {"Location": (0.1, 0.2, 0.3), "Rotation": (0.3, -0.5, 0.9), "Scale": (0.5, 2.0, 0.7)}
    for kind in ops.MAPPING_TYPES:
        yield f"mapping {kind}", _one("ShaderNodeMapping", {"Vector": _coordinates, **turned}, vector_type=kind)
        inputs = {"Vector": _coordinates, **turned, "Location": _paint, "Scale": _paint}
        yield f"mapping linked {kind}", _one("ShaderNodeMapping", inputs, vector_type=kind)
    for kind in ("AXIS_ANGLE", "X_AXIS", "Y_AXIS", "Z_AXIS", "EULER_XYZ"):
        for invert in (False, True):
            inputs = {
                "Vector": _coordinates,
                "Center": (0.3, 0.2, 0.1),
                "Axis": (0.2, 0.5, 1.0),
                "Angle": 0.7,
                "Rotation": (0.2, 0.4, -0.6),
            }
            settings = {"rotation_type": kind, "invert": invert}
            yield f"rotate {kind} {invert}", _one("ShaderNodeVectorRotate", inputs, **settings)
    for kind in ops.TRANSFORM_TYPES:
        for source in ops.SPACES:
            for target in ops.SPACES:
                settings = {"vector_type": kind, "convert_from": source, "convert_to": target}
                inputs = {"Vector": _coordinates}
                yield f"transform {kind} {source} {target}", _one("ShaderNodeVectorTransform", inputs, **settings)


def _color_cases():
    numbers = {"Hue": 0.7, "Saturation": 1.3, "Value": 0.9, "Fac": 0.8, "Color": _paint}
    yield "hue saturation", _one("ShaderNodeHueSaturation", numbers)
    yield "bright contrast", _one("ShaderNodeBrightContrast", {"Color": _paint, "Bright": 0.1, "Contrast": 0.4})
    yield "gamma", _one("ShaderNodeGamma", {"Color": _paint, "Gamma": 2.2})
    yield "invert", _one("ShaderNodeInvert", {"Color": _paint, "Fac": 0.7})
    yield "rgb to bw", _one("ShaderNodeRGBToBW", {"Color": _paint})
    for mode in ops.COLOR_MODES:
        for output in range(3):
            yield f"separate {mode} {output}", _one("ShaderNodeSeparateColor", {"Color": _paint}, output, mode=mode)
        inputs = {"Red": _heat, "Green": 0.6, "Blue": 0.4}
        yield f"combine {mode}", _one("ShaderNodeCombineColor", inputs, mode=mode)
    yield "combine xyz", _one("ShaderNodeCombineXYZ", {"X": _heat, "Y": 0.6, "Z": 0.4})
    yield "separate xyz", _one("ShaderNodeSeparateXYZ", {"Vector": _paint}, 1)
    yield "color to float", _one("ShaderNodeMath", {"Value": _paint, "Value_001": 0.0})
    yield "vector to float", _one("ShaderNodeMath", {"Value": _coordinates, "Value_001": 0.0})
    for kelvin in (700.0, 1000.0, 1300.0, 1800.0, 2700.0, 5000.0, 9000.0, 13000.0):
        yield f"blackbody {kelvin}", _one("ShaderNodeBlackbody", {"Temperature": kelvin})
    for length in (420.0, 551.0, 633.0):
        yield f"wavelength {length}", _one("ShaderNodeWavelength", {"Wavelength": length})


def _ramp(interpolation, color_mode="RGB"):
    def build(tree):
        node = add_node(tree, "ShaderNodeValToRGB", inputs={"Fac": _heat(tree)})
        ramp = node.color_ramp
        ramp.interpolation, ramp.color_mode = interpolation, color_mode
        ramp.elements[0].color, ramp.elements[1].color = (0.1, 0.8, 0.3, 1.0), (0.9, 0.2, 0.1, 0.5)
        middle = ramp.elements.new(0.43)
        middle.color = (0.5, 0.1, 0.9, 0.2)
        return node.outputs["Color"]

    return build


def _curves(identifier, socket, source, extend):
    def build(tree):
        node = add_node(tree, identifier, inputs={socket: source(tree), node_factor(identifier): 0.8})
        node.mapping.extend = extend
        for curve in node.mapping.curves:
            curve.points.new(0.35, 0.6)
            curve.points[0].location = (0.1, 0.05)
        node.mapping.update()
        return node.outputs[0]

    return build


def node_factor(identifier):
    return "Factor" if identifier == "ShaderNodeFloatCurve" else "Fac"


def _table_cases():
    for interpolation in ("LINEAR", "CONSTANT", "EASE", "CARDINAL", "B_SPLINE"):
        yield f"ramp {interpolation}", _ramp(interpolation)
    yield "ramp hsv", _ramp("LINEAR", "HSV")
    for extend in ("HORIZONTAL", "EXTRAPOLATED"):
        yield f"rgb curves {extend}", _curves("ShaderNodeRGBCurve", "Color", _paint, extend)
        yield f"vector curves {extend}", _curves("ShaderNodeVectorCurve", "Vector", _coordinates, extend)
        yield f"float curve {extend}", _curves("ShaderNodeFloatCurve", "Value", _heat, extend)


def _input_cases():
    for output in ("Generated", "Normal", "UV", "Object", "Camera", "Window", "Reflection"):
        yield f"coordinate {output}", lambda tree, output=output: _coordinates(tree, output)
    for output in ("Position", "Normal", "Tangent", "True Normal", "Incoming", "Backfacing"):
        yield f"geometry {output}", _one("ShaderNodeNewGeometry", output=output)
    for output in ("Location", "Color", "Alpha", "Object Index", "Material Index", "Random"):
        yield f"object {output}", _one("ShaderNodeObjectInfo", output=output)
    for output in ("View Vector", "View Z Depth", "View Distance"):
        yield f"camera {output}", _one("ShaderNodeCameraData", output=output)
    for output in ("Is Camera Ray", "Is Shadow Ray", "Is Diffuse Ray", "Ray Length", "Ray Depth", "Transparent Depth"):
        yield f"light path {output}", _one("ShaderNodeLightPath", output=output)
    yield "uv map", _one("ShaderNodeUVMap", uv_map="Second")
    for output in ("Color", "Vector", "Fac", "Alpha"):
        yield f"attribute {output}", _one("ShaderNodeAttribute", output=output, attribute_name="Paint")
        yield f"attribute missing {output}", _one("ShaderNodeAttribute", output=output, attribute_name="Nothing")
    yield "color attribute", _one("ShaderNodeVertexColor", output="Alpha", layer_name="Paint")
    yield "fresnel", _one("ShaderNodeFresnel", {"IOR": 1.3})
    for blend in (0.2, 0.5, 0.8):
        yield f"layer fresnel {blend}", _one("ShaderNodeLayerWeight", {"Blend": blend}, "Fresnel")
        yield f"layer facing {blend}", _one("ShaderNodeLayerWeight", {"Blend": blend}, "Facing")
    yield "wireframe", _one("ShaderNodeWireframe", {"Size": 0.07})
    yield "wireframe pixels", _one("ShaderNodeWireframe", {"Size": 0.9}, use_pixel_size=True)
    yield "layer normal", _one("ShaderNodeLayerWeight", {"Normal": _paint}, "Facing")
    yield "normal node", _one("ShaderNodeNormal", {"Normal": _paint}, "Dot")
    for axis in "XYZ":
        yield f"tangent {axis}", _one("ShaderNodeTangent", axis=axis)
    yield "tangent uv", _one("ShaderNodeTangent", direction_type="UV_MAP")
    yield "tangent second", _one("ShaderNodeTangent", direction_type="UV_MAP", uv_map="Second")


# Types of attributes: the field of their values and how many numbers it takes.
_ATTRIBUTE_TYPES = {
    "FLOAT": ("value", 1),
    "INT": ("value", 1),
    "INT8": ("value", 1),
    "BOOLEAN": ("value", 1),
    "FLOAT2": ("vector", 2),
    "INT32_2D": ("value", 2),
    "INT16_2D": ("value", 2),
    "FLOAT_VECTOR": ("vector", 3),
    "FLOAT_COLOR": ("color", 4),
    "BYTE_COLOR": ("color", 4),
    "QUATERNION": ("value", 4),
    "FLOAT4X4": ("value", 16),
}


def _attribute_cases():
    """Every type of attribute, through each output of the Attribute node."""
    known = {item.identifier for item in bpy.types.Attribute.bl_rna.properties["data_type"].enum_items}

    def stored(name, kind, output):
        def build(tree):
            attribute = bpy.data.meshes[name].attributes.new("stored", kind, "POINT")
            field, size = _ATTRIBUTE_TYPES[kind]
            numbers = [True] if kind == "BOOLEAN" else [3, 1] if kind.startswith("INT") else [0.7, 0.2, 0.4, 0.9]
            values = np.resize(np.array(numbers), size).tolist()
            if kind == "FLOAT4X4":
                values = np.reshape(values, (4, 4)).tolist()
            for element in attribute.data:
                setattr(element, field, values if size > 1 else values[0])
            return add_node(tree, "ShaderNodeAttribute", attribute_name="stored").outputs[output]

        return build

    for kind in known & _ATTRIBUTE_TYPES.keys():
        for output in ("Color", "Vector", "Fac", "Alpha"):
            yield f"{kind} {output}", stored(f"{kind} {output}", kind, output)
    for name in ("UVMap", "Second", "position", "uv"):
        for output in ("Color", "Fac", "Alpha"):
            yield f"{name} {output}", _one("ShaderNodeAttribute", output=output, attribute_name=name)


def _bump(**settings):
    inputs = settings.pop("inputs", {"Strength": 0.8, "Distance": 0.5})

    def build(tree):
        wave = add_node(tree, "ShaderNodeMath", operation="SINE")
        scaled = add_node(tree, "ShaderNodeVectorMath", operation="SCALE", inputs={"Scale": 9.0})
        tree.links.new(settings.get("source", _coordinates)(tree), scaled.inputs[0])
        split = add_node(tree, "ShaderNodeSeparateXYZ", inputs={0: scaled.outputs[0]})
        tree.links.new(split.outputs[0], wave.inputs[0])
        node = add_node(tree, "ShaderNodeBump", inputs={**inputs, "Height": wave.outputs[0]})
        node.invert = settings.get("invert", False)
        return node.outputs[0]

    return build


def _normal_cases():
    yield "bump", _bump()
    yield "bump invert", _bump(invert=True)
    yield "bump uv", _bump(source=_uv)
    yield "bump position", _bump(source=lambda tree: add_node(tree, "ShaderNodeNewGeometry").outputs["Position"])
    yield "bump object", _bump(source=lambda tree: _coordinates(tree, "Object"))
    yield "bump strong", _bump(inputs={"Strength": 1.7, "Distance": 2.0})
    yield "bump unlinked", _one("ShaderNodeBump", {"Strength": 0.5})
    for space in ops.NORMAL_SPACES:
        inputs = {"Color": _paint, "Strength": 0.7}
        yield f"normal map {space}", _one("ShaderNodeNormalMap", inputs, space=space)
    yield "normal map second", _one("ShaderNodeNormalMap", {"Color": _paint, "Strength": 1.3}, uv_map="Second")


def _generic_cases():
    yield "boolean", _one("FunctionNodeInputBool", boolean=True)
    yield "integer", _one("FunctionNodeInputInt", integer=3)
    yield "vector", _one("FunctionNodeInputVector", vector=(0.1, 0.2, 0.3))
    for choice in "AB":
        inputs = {"Menu": choice, "Item_0": (0.1, 0.9, 0.4, 1.0), "Item_1": _paint}
        yield f"menu {choice}", _one("GeometryNodeMenuSwitch", inputs)
        yield f"menu is {choice}", _one("GeometryNodeMenuSwitch", inputs, "A")


FAMILIES = {
    "math": (_math_cases, 1.0, 0.0),
    "vector math": (_vector_math_cases, 0.1, 0.5),
    "blend": (lambda: _blend_results().items(), 0.5, 0.5),
    "mix": (_mix_cases, 0.5, 0.5),
    "range": (_range_cases, 0.5, 0.5),
    "vectors": (_vector_cases, 0.05, 0.5),
    "colors": (_color_cases, 1.0, 0.0),
    "tables": (_table_cases, 0.5, 0.5),
    "inputs": (_input_cases, 0.05, 0.5),
    "attributes": (_attribute_cases, 0.2, 0.2),
    "normals": (_normal_cases, 0.5, 0.5),
}
if bpy.app.version >= (5, 0, 0):
    FAMILIES["generic"] = (_generic_cases, 0.2, 0.1)


@pytest.mark.parametrize("family", FAMILIES)
def test_programs_agree_with_cycles(family):
    _check(family, back=False)


@pytest.mark.parametrize("family", ("inputs", "normals"))
def test_programs_agree_with_cycles_on_flat_back_faces(family):
    _check(family, back=True)


def _check(family, back):
    cases, scale, offset = FAMILIES[family]
    results = compare(dict(cases()), scale, offset, back)
    wrong = {}
    for name, result in results.items():
        assert np.isfinite(result.ours).all(), name
        if result.error > TOLERANCE / scale:
            wrong[name] = (result.error, result.cycles[3, 3], result.ours[3, 3])
    assert not wrong, "\n".join(f"{name}: {error:.2g} {a} {b}" for name, (error, a, b) in wrong.items())
