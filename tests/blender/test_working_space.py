"""Files whose scene-linear colours have other primaries, against Cycles: luminance, spectra, textures, the sky."""

import bpy
import pytest

from testing.blender import image_files
from testing.blender.nodes import add_node, compare

pytestmark = pytest.mark.skipif(bpy.app.version < (5, 0, 0), reason="files choose their primaries from Blender 5 on")

TOLERANCE = 2e-3  # Cycles' conversions are in half precision in part


def _paint(tree):
    return add_node(tree, "ShaderNodeVertexColor", layer_name="Paint").outputs["Color"]


def _luminance(tree):
    return add_node(tree, "ShaderNodeMath", operation="ADD", inputs={"Value": _paint(tree), "Value_001": 0.0}).outputs[
        0
    ]


def _one(identifier, **settings):
    def build(tree):
        filled = {k: v(tree) if callable(v) else v for k, v in settings.get("inputs", {}).items()}
        return add_node(tree, identifier, **{**settings, "inputs": filled}).outputs[0]

    return build


def _texture(path, space):
    def build(tree):
        picture = bpy.data.images.load(str(path), check_existing=False)
        picture.colorspace_settings.name = space
        return add_node(tree, "ShaderNodeTexImage", image=picture, extension="EXTEND").outputs["Color"]

    return build


def _in(space, build):
    def chosen(tree):
        if bpy.data.colorspace.working_space != space:
            bpy.ops.wm.set_working_color_space(working_space=space, convert_colors=False)
        return build(tree)

    return chosen


@pytest.mark.parametrize("space", ["Linear Rec.2020", "ACEScg"])
def test_colours_by_the_primaries_of_the_file(space, tmp_path):
    cases = {
        "luminance": _luminance,
        "rgb to bw": _one("ShaderNodeRGBToBW", inputs={"Color": _paint}),
        "constant": _one("ShaderNodeRGBToBW", inputs={"Color": (0.9, 0.2, 0.1, 1.0)}),
        "blackbody 1500": _one("ShaderNodeBlackbody", inputs={"Temperature": 1500.0}),
        "blackbody 9000": _one("ShaderNodeBlackbody", inputs={"Temperature": 9000.0}),
        "sky": _one("ShaderNodeTexSky", sky_type="PREETHAM"),
    }
    for length in (450.0, 530.0, 620.0):
        cases[f"wavelength {length}"] = _one("ShaderNodeWavelength", inputs={"Wavelength": length})
    for bits in (8, 16):
        path = tmp_path / f"{bits}.png"
        image_files.write_png(path, (0.8, 0.5, 0.2), bits)
        for name in ("sRGB", "Non-Color", "Linear Rec.709", "Linear Rec.2020", "ACEScg"):
            cases[f"{bits} bits {name}"] = _texture(path, name)
    wrong = {}
    for name, parity in compare({name: _in(space, build) for name, build in cases.items()}).items():
        if parity.error > TOLERANCE:
            wrong[name] = parity.error, parity.cycles[4, 4], parity.ours[4, 4]
    bpy.ops.wm.read_factory_settings(use_empty=True)
    assert not wrong, "\n".join(f"{name}: {values}" for name, values in wrong.items())
