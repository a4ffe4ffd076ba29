"""White furnaces: no lobe makes light, and those that keep energy keep it. Errors are standard errors of the mean."""

import math

import numpy as np
import pytest

from testing.kernels.lobes import Surface, direction

KINDS = {
    "diffuse": ("ShaderNodeBsdfDiffuse", {"Color": 1.0}),
    "translucent": ("ShaderNodeBsdfTranslucent", {"Color": 1.0}),
    "sheen": ("ShaderNodeBsdfSheen", {"Color": 1.0, "distribution": "MICROFIBER"}),
    "toon": ("ShaderNodeBsdfToon", {"Color": 1.0, "Size": 0.5, "Smooth": 0.3, "component": "DIFFUSE"}),
    "glossy toon": ("ShaderNodeBsdfToon", {"Color": 1.0, "Size": 0.2, "Smooth": 0.2, "component": "GLOSSY"}),
    "transparent": ("ShaderNodeBsdfTransparent", {"Color": 1.0}),
    **{
        f"glossy {name}": ("ShaderNodeBsdfAnisotropic", {"Color": 1.0, "distribution": name})
        for name in ("GGX", "MULTI_GGX", "BECKMANN", "ASHIKHMIN_SHIRLEY")
    },
    "anisotropic": (
        "ShaderNodeBsdfAnisotropic",
        {"Color": 1.0, "Anisotropy": 0.6, "Tangent": (1.0, 0.0, 0.0), "distribution": "GGX"},
    ),
    "metal": (
        "ShaderNodeBsdfMetallic",
        {"Base_Color": 1.0, "Edge_Tint": 1.0, "distribution": "MULTI_GGX", "fresnel_type": "F82"},
    ),
    "conductor": (
        "ShaderNodeBsdfMetallic",
        {"IOR": 1.0, "Extinction": 9.0, "distribution": "MULTI_GGX", "fresnel_type": "PHYSICAL_CONDUCTOR"},
    ),
    **{
        f"glass {name}": ("ShaderNodeBsdfGlass", {"Color": 1.0, "IOR": 1.45, "distribution": name})
        for name in ("GGX", "MULTI_GGX", "BECKMANN")
    },
    "refraction": ("ShaderNodeBsdfRefraction", {"Color": 1.0, "distribution": "GGX"}),
}
ROUGHNESSES = (0.0, 0.2, 0.5, 1.0)


def surface(kind, wo, roughness=None, **more):
    node, inputs = KINDS[kind]
    rough = (
        {} if roughness is None or "oon" in kind or kind in ("translucent", "transparent") else {"Roughness": roughness}
    )
    return Surface(node, wo, **inputs, **rough, **more)


@pytest.mark.parametrize("kind", KINDS)
def test_no_lobe_makes_light(kind):
    for roughness in ROUGHNESSES:
        for cosine in (0.95, 0.6, 0.25):
            for back in (0, 1):
                mean, error = surface(kind, direction(cosine), roughness, backfacing=back).albedo(2048)
                assert (mean <= 1.002 + 3.0 * error).all(), f"roughness {roughness}, cosine {cosine}: {mean} ± {error}"


@pytest.mark.parametrize(
    "kind", ["diffuse", "glossy MULTI_GGX", "metal", "glass MULTI_GGX", "translucent", "transparent"]
)
def test_white_lobes_keep_all_energy(kind):
    for roughness in ROUGHNESSES:
        for cosine in (0.95, 0.6, 0.25):
            mean, error = surface(kind, direction(cosine), roughness).albedo(8192)
            assert (np.abs(mean - 1.0) <= 0.01 + 3.0 * error).all(), f"{roughness}, {cosine}: {mean} ± {error}"


def principled(rng, wo):
    """A white Principled BSDF at random settings."""
    u = rng.random(12)
    on = rng.random(6) < 0.5
    return Surface(
        "ShaderNodeBsdfPrincipled",
        wo,
        backfacing=int(on[5]),
        Base_Color=1.0,
        Metallic=u[0] * on[0],
        Roughness=u[1],
        IOR=1.0 + u[2],
        Diffuse_Roughness=u[3],
        Specular_IOR_Level=u[4],
        Anisotropic=u[5] * on[1],
        Anisotropic_Rotation=u[6],
        Tangent=(1.0, 0.0, 0.0),
        Transmission_Weight=u[7] * on[2],
        Coat_Weight=u[8] * on[3],
        Coat_Roughness=u[9],
        Coat_IOR=1.0 + u[2],
        Sheen_Weight=u[10] * on[4],
        Sheen_Roughness=u[11],
        distribution="MULTI_GGX",
    )


def test_principled_at_random_settings_makes_no_light():
    """The mean over cosine-weighted directions, as on a ball in a white sky: layering is exact on average only."""
    rng = np.random.default_rng(7)
    for _ in range(12):
        seed = rng.integers(1 << 30)
        results = []
        for k in range(32):
            wo = direction(math.sqrt((k + 0.5) / 32), 2.4 * k)
            mean, error = principled(np.random.default_rng(seed), wo).albedo(512, key=k + 1)
            results.append((mean[0], error[0]))
        mean, error = np.mean(results, axis=0)
        error /= math.sqrt(len(results))
        assert mean <= 1.002 + 3.0 * error, f"settings {seed}: {mean} ± {error}"


@pytest.mark.parametrize("roughness", [0.0, 0.3, 0.8])
def test_white_dielectric_over_white_keeps_all_energy(roughness):
    for cosine in (0.95, 0.6, 0.3):
        point = Surface(
            "ShaderNodeBsdfPrincipled", direction(cosine), Base_Color=1.0, Roughness=roughness, distribution="MULTI_GGX"
        )
        mean, error = point.albedo(8192)
        assert (np.abs(mean - 1.0) <= 0.01 + 3.0 * error).all(), f"cosine {cosine}: {mean} ± {error}"


def test_colour_passes_are_the_albedos():
    """What the colour passes say is what the lobes reflect, where the distribution keeps energy."""
    for kind, part in (("diffuse", 0), ("glossy MULTI_GGX", 1), ("metal", 1), ("sheen", 0), ("translucent", 0)):
        point = surface(kind, direction(0.6), 0.4)
        mean, error = point.albedo(8192)
        assert np.abs(point.color()[part] - mean).max() <= 0.01 + 3.0 * error.max(), kind
    glass = surface("glass MULTI_GGX", direction(0.6), 0.3)
    assert glass.color().sum(axis=0) == pytest.approx(1.0, abs=0.02)


def test_transparency_and_emission_are_written_beside_the_closures():
    point = Surface(
        "ShaderNodeBsdfPrincipled",
        direction(0.7),
        Alpha=0.25,
        Emission_Color=(1.0, 0.5, 0.0),
        Emission_Strength=2.0,
        distribution="GGX",
    )
    assert point.point["transparent"] == pytest.approx(0.75)
    assert point.point["emission"] == pytest.approx([0.5, 0.25, 0.0])
    coated = Surface(
        "ShaderNodeBsdfPrincipled", direction(0.2), Coat_Weight=1.0, Emission_Color=1.0, Emission_Strength=1.0
    )
    assert 0.3 < coated.point["emission"][0] < 0.9


@pytest.mark.parametrize("flag", [512, 1024, 2048], ids=["shadow", "emission", "last"])
def test_no_closures_are_made_where_none_are_wanted(flag):
    point = Surface(
        "ShaderNodeBsdfPrincipled",
        direction(0.7),
        ray_flags=flag,
        Alpha=0.5,
        Coat_Weight=1.0,
        Emission_Color=1.0,
        Emission_Strength=1.0,
    )
    assert point.kinds == []
    assert point.point["transparent"] == pytest.approx(0.5)
    if flag != 512:
        full = Surface(
            "ShaderNodeBsdfPrincipled",
            direction(0.7),
            Alpha=0.5,
            Coat_Weight=1.0,
            Emission_Color=1.0,
            Emission_Strength=1.0,
        )
        assert point.point["emission"] == pytest.approx(full.point["emission"])
    assert Surface("ShaderNodeBsdfGlass", direction(0.7), ray_flags=flag, distribution="GGX").kinds == []


def test_lobes_that_make_caustics_can_be_off():
    """After a diffuse bounce without caustics what mirrors or refracts is left out, and what lies under it stays."""
    no_reflection, no_refraction = 8 | 4096, 8 | 8192
    for kind in ("glossy GGX", "metal", "glossy toon"):
        assert surface(kind, direction(0.6), 0.5, ray_flags=no_reflection).kinds == []
        assert len(surface(kind, direction(0.6), 0.5, ray_flags=no_refraction).kinds) == 1
    assert surface("refraction", direction(0.6), 0.5, ray_flags=no_refraction).kinds == []
    for flags, left, right in ((no_reflection, 0.0, 1.0), (no_refraction, 1.0, 0.0)):
        glass = surface("glass GGX", direction(0.6), 0.3, ray_flags=flags).color()
        assert (glass[1] > 0.0).all() == bool(left) and (glass[2] > 0.0).all() == bool(right)
    assert surface("glass GGX", direction(0.6), 0.3, ray_flags=no_reflection | no_refraction).kinds == []
    layers = {"Coat_Weight": 1.0, "Metallic": 0.5, "Base_Color": 0.5}
    point = Surface("ShaderNodeBsdfPrincipled", direction(0.6), ray_flags=no_reflection, **layers)
    assert point.kinds == [1]
    assert point.albedo(256)[0] == pytest.approx(0.25, rel=1e-6)
