"""What passes, the denoiser and filter glossy ask of the closures."""

import numpy as np
import pytest

from testing.kernels.lobes import Surface, direction

GLOSSY, PRINCIPLED = "ShaderNodeBsdfAnisotropic", "ShaderNodeBsdfPrincipled"


def test_mirrors_hand_the_denoiser_what_is_seen_in_them():
    mirror = Surface(GLOSSY, direction(0.6), Roughness=0.1, Color=(0.9, 0.5, 0.1), distribution="GGX").summary()
    assert mirror["diffuse_like"] == 0.0
    assert mirror["specular"] == pytest.approx([0.9, 0.5, 0.1])
    assert mirror["albedo"] == pytest.approx(0.0)
    matte = Surface(GLOSSY, direction(0.6), Roughness=0.5, Color=(0.9, 0.5, 0.1), distribution="GGX").summary()
    assert matte["diffuse_like"] == 1.0
    assert matte["albedo"] == pytest.approx([0.9, 0.5, 0.1])


def test_a_surface_without_closures_is_diffuse_like_and_black():
    nothing = Surface("ShaderNodeBsdfDiffuse", direction(0.6), Color=0.0).summary()
    assert nothing["diffuse_like"] == 1.0 and nothing["has_eval"] == 0.0
    assert nothing["normal"] == pytest.approx([0.0, 0.0, 1.0])
    assert nothing["albedo"] == pytest.approx(0.0)


def test_the_normal_is_the_average_by_weight():
    tilted = np.array([0.6, 0.0, 0.8])
    point = Surface("ShaderNodeBsdfDiffuse", direction(0.6), Roughness=0.0, Normal=2.0 * tilted).summary()
    assert point["normal"] == pytest.approx(tilted)
    assert point["feature_normal"] == pytest.approx(tilted)


def test_roughness_is_the_node_s():
    assert Surface(GLOSSY, direction(0.6), Roughness=0.3, distribution="GGX").summary()["roughness"] == pytest.approx(
        0.3
    )
    principled = Surface(PRINCIPLED, direction(0.6), Roughness=0.3, Metallic=0.5).summary()
    assert principled["roughness"] == pytest.approx(0.3)
    assert Surface("ShaderNodeBsdfTranslucent", direction(0.6)).summary()["roughness"] == 1.0


def test_only_what_can_be_evaluated_needs_lights():
    assert Surface(GLOSSY, direction(0.6), Roughness=0.0, distribution="GGX").summary()["has_eval"] == 0.0
    assert Surface("ShaderNodeBsdfTransparent", direction(0.6)).summary()["has_eval"] == 0.0
    assert Surface(PRINCIPLED, direction(0.6), Roughness=0.0).summary()["has_eval"] == 1.0


def test_filter_glossy_widens_what_is_sharper_and_makes_mirrors_evaluable():
    point = Surface(GLOSSY, direction(0.6), Roughness=0.0, Color=1.0, distribution="GGX")
    point.blur(0.04)
    assert point.closures[0]["alpha_x"] == 0.04
    labels, _, _, _ = point.sample(256)
    assert (labels[labels > 0] & 8 == 8).all()
    rough = Surface(GLOSSY, direction(0.6), Roughness=0.5, distribution="GGX")
    rough.blur(0.04)
    assert rough.closures[0]["alpha_x"] == pytest.approx(0.25)
