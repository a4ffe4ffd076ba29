"""Scene-linear colours of other primaries, of file or environment, against Cycles: luminance, spectra, images."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import bpy
import pytest

from restir_engine import properties
from testing.blender import image_files
from testing.blender.nodes import add_node, compare

ROOT = Path(__file__).parents[2]
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


def _cases(folder):
    cases = {
        "luminance": _luminance,
        "rgb to bw": _one("ShaderNodeRGBToBW", inputs={"Color": _paint}),
        "constant": _one("ShaderNodeRGBToBW", inputs={"Color": (0.9, 0.2, 0.1, 1.0)}),
        "blackbody 1500": _one("ShaderNodeBlackbody", inputs={"Temperature": 1500.0}),
        "blackbody 9000": _one("ShaderNodeBlackbody", inputs={"Temperature": 9000.0}),
        "sky": _one("ShaderNodeTexSky", sky_type="PREETHAM"),
        "bytes of points": _one("ShaderNodeVertexColor", layer_name="Bytes of POINT"),
        "bytes of corners": _one("ShaderNodeVertexColor", layer_name="Bytes of CORNER"),
    }
    for length in (450.0, 530.0, 620.0):
        cases[f"wavelength {length}"] = _one("ShaderNodeWavelength", inputs={"Wavelength": length})
    for bits in (8, 16):
        path = folder / f"{bits}.png"
        image_files.write_png(path, (0.8, 0.5, 0.2), bits)
        for name in ("sRGB", "Non-Color", "Linear Rec.709", "Linear Rec.2020", "ACEScg"):
            cases[f"{bits} bits {name}"] = _texture(path, name)
    return cases


def _wrong(cases):
    """A line for each case that differs from Cycles."""
    return [
        f"{name}: {parity.error} {parity.cycles[4, 4]} {parity.ours[4, 4]}"
        for name, parity in compare(cases).items()
        if parity.error > TOLERANCE
    ]


@pytest.mark.skipif(bpy.app.version < (5, 0, 0), reason="files choose their primaries from Blender 5 on")
@pytest.mark.parametrize("space", ["Linear Rec.2020", "ACEScg"])
def test_colours_by_the_primaries_of_the_file(space, tmp_path):
    wrong = _wrong({name: _in(space, build) for name, build in _cases(tmp_path).items()})
    bpy.ops.wm.read_factory_settings(use_empty=True)
    assert not wrong, "\n".join(wrong)


@pytest.mark.deep
@pytest.mark.parametrize("space", ["ACEScg", "Linear DCI-P3 D65"])
def test_colours_by_the_configuration_of_the_environment(space, tmp_path):
    """Blender's own configuration with another scene-linear space, one of them unknown to us by name."""
    folder = tmp_path / "config"
    shutil.copytree(Path(bpy.utils.system_resource("DATAFILES")) / "colormanagement", folder)
    config = folder / "config.ocio"
    text = config.read_text()
    assert text.count("scene_linear: Linear Rec.709") == 1
    config.write_text(text.replace("scene_linear: Linear Rec.709", f"scene_linear: {space}"))
    environment = os.environ | {"OCIO": str(config), "PYTHONPATH": str(ROOT)}
    run = subprocess.run(
        [sys.executable, __file__, str(tmp_path)], env=environment, capture_output=True, text=True, cwd=ROOT
    )
    lines = [line for line in run.stdout.splitlines() if line.startswith("case ")]
    assert run.returncode == 0 and lines == ["case none"], run.stdout + run.stderr


if __name__ == "__main__":
    properties.register()
    for line in _wrong(_cases(Path(sys.argv[1]))) or ["none"]:
        print("case", line)
