"""IES profiles: what becomes of a file's angles, and where its text comes from."""

import bpy
import numpy as np
import pytest

from restir_engine.scene.description import SceneDescription
from restir_engine.sync.ies import ies_table
from restir_engine.sync.nodes import Compiler
from testing.blender import kit

WATT = 0.0706650768394
KEPT = 1.0 if bpy.app.version >= (5, 0, 0) else 0.0  # what Cycles goes on with beyond the last angles


def profile(horizontal, vertical, values, kind=1, factor=1.0) -> str:
    """The text of a file; values by horizontal and vertical angle."""
    head = f"1 1000 {factor} {len(vertical)} {len(horizontal)} {kind} 1 0 0 0\n1.0 1.0 60"
    rows = [vertical, horizontal, *values]
    return "\n".join(["IESNA:LM-63-1995", "TILT=NONE", head, *(" ".join(map(str, row)) for row in rows)])


def unpacked(table):
    """(horizontal angles, vertical angles in degrees, intensities without the rows and columns at the ends)."""
    n_h, n_v = int(table[0]), int(table[1])
    angles = np.degrees(table[2 : 2 + n_h + n_v])
    return angles[:n_h], angles[n_h:], table[2 + n_h + n_v :].reshape(n_h + 2, n_v + 2)


def test_quadrants_are_mirrored_twice():
    horizontal, vertical, values = unpacked(
        ies_table(profile([0, 30, 90], [0, 60, 90], [[9, 5, 1], [9, 6, 2], [9, 7, 3]]))
    )
    assert horizontal == pytest.approx([0, 30, 90, 150, 180, 210, 270, 330, 360])
    assert vertical == pytest.approx([0, 60, 90])
    assert values[1:-1, 2] == pytest.approx(WATT * np.array([5, 6, 7, 6, 5, 6, 7, 6, 5]))
    assert values[0] == pytest.approx(KEPT * values[1]) and values[-1] == pytest.approx(KEPT * values[-3])
    assert values[1:-1, 0] == pytest.approx(values[1:-1, 2])  # through the pole
    assert values[1:-1, -1] == pytest.approx(KEPT * values[1:-1, -2])


def test_one_angle_is_the_same_all_round():
    horizontal, _, values = unpacked(ies_table(profile([0], [0, 90, 180], [[4, 2, 1]], factor=2.0)))
    assert horizontal == pytest.approx([0, 360])
    assert values[1:-1] == pytest.approx(2.0 * WATT * np.tile([2, 4, 2, 1, KEPT], (2, 1)))


def test_a_missing_last_angle_is_the_first():
    horizontal, _, values = unpacked(ies_table(profile([0, 120, 240], [0, 90], [[3, 1], [3, 2], [3, 0]])))
    assert horizontal[-1] == pytest.approx(360) and values[4, 2] == pytest.approx(values[1, 2])


def test_type_b_is_turned_and_mirrored():
    horizontal, vertical, values = unpacked(ies_table(profile([0, 90], [-90, 0, 90], [[1, 2, 3], [4, 5, 6]], kind=2)))
    assert horizontal == pytest.approx([0, 90, 180, 360]) and vertical == pytest.approx([0, 90, 180])
    assert values[1:-1, 1:-1] == pytest.approx(WATT * np.array([[4, 1, 4], [5, 2, 5], [6, 3, 6], [4, 1, 4]]))


@pytest.mark.parametrize(
    "text",
    ["", "nothing", profile([10, 90], [0, 90], [[1, 1], [1, 1]]), profile([0, 90], [0, 90], [[1, 1]], kind=3)],
)
def test_what_cycles_cannot_read_either(text):
    assert ies_table(text) is None


def test_files_and_text_blocks(tmp_path):
    """They give the same program; what is missing is told and a hundred times as bright, as in Cycles."""
    text = profile([0], [0, 90, 180], [[4, 2, 1]])
    path = tmp_path / "lamp.ies"
    path.write_text(text)
    block = bpy.data.texts.new("lamp")
    block.from_string(text)

    def program(**choice):
        material = kit.material(lambda node: node("Emission", Strength=node("TexIES", **choice)))
        scene = SceneDescription()
        found = Compiler(scene, "Light", "Lamp").compile(material.node_tree)
        return found.code, scene.shaders.layout().tables, scene.warnings.lines()

    outside = program(mode="EXTERNAL", filepath=str(path))
    inside = program(mode="INTERNAL", ies=block)
    assert np.array_equal(outside[0], inside[0]) and np.array_equal(outside[1], inside[1]) and not outside[2]
    assert "missing" in program(mode="EXTERNAL", filepath=str(tmp_path / "other.ies"))[2][0]
