"""The operator that sets a material's medium to a preset."""

import importlib
from types import SimpleNamespace

import bpy
import pytest

from restir_engine.presets import MEDIA


@pytest.fixture
def operator(scene, ui):
    """The operator's class, registered."""
    module = importlib.import_module(f"{ui.__name__.rpartition('.')[0]}.operators.medium_presets")
    cls = module.RESTIR_OT_medium_preset
    bpy.utils.register_class(cls)
    yield cls
    bpy.utils.unregister_class(cls)


@pytest.mark.parametrize("unit", [1.0, 0.001])
def test_presets_are_in_real_units(scene, operator, unit):
    scene.unit_settings.scale_length = unit
    material = bpy.data.materials.new("Wax")
    material.restir.scale = 3.0
    for key, medium in MEDIA.items():
        with bpy.context.temp_override(material=material):
            assert bpy.ops.restir.medium_preset(preset=key) == {"FINISHED"}
        own = material.restir
        assert own.use_medium and own.use_color and own.scale == 1.0 and own.anisotropy == 0.0
        assert tuple(own.color) == pytest.approx(medium.color)
        assert [unit * length for length in own.mean_free_path] == pytest.approx(medium.mean_free_path)


def test_without_a_material_there_is_no_preset(operator):
    assert not operator.poll(SimpleNamespace(material=None))
    assert "UNDO" in operator.bl_options
