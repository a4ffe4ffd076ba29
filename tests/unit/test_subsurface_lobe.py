"""The closures that nodes make of subsurface scattering: weights, parameters, what is diffuse instead."""

import math

import numpy as np
import pytest

from restir_engine.kernels.core import records as rec
from restir_engine.kernels.lobes import closure as c
from restir_engine.kernels.lobes.closure import LABEL_SUBSURFACE
from testing.kernels.lobes import Surface, direction

NODE, PRINCIPLED = "ShaderNodeSubsurfaceScattering", "ShaderNodeBsdfPrincipled"
COLOR, RADIUS = (0.8, 0.5, 0.2), (1.0, 0.5, 0.25)
METHODS = ("BURLEY", "RANDOM_WALK", "RANDOM_WALK_LEGACY", "RANDOM_WALK_SKIN")


def node(**more):
    inputs = {"Color": COLOR, "Scale": 2.0, "Radius": RADIUS, "IOR": 1.4, "Roughness": 0.3, "falloff": "RANDOM_WALK"}
    return Surface(NODE, direction(0.6), **inputs | more)


def principled(**more):
    inputs = {"Base_Color": COLOR, "Subsurface_Weight": 1.0, "Subsurface_Radius": RADIUS, "Subsurface_Scale": 2.0}
    return Surface(PRINCIPLED, direction(0.6), **inputs | {"subsurface_method": "RANDOM_WALK"} | more)


def lobes(surface, kind):
    return [x for x in surface.closures[: surface.point["n_closures"]] if x["kind"] == kind]


def lobe(surface):
    (found,) = lobes(surface, c.LOBE_SUBSURFACE)
    return found


def parameters(x):
    p = x["p"]
    names = {"sigma_t": c.P_SIGMA_T, "albedo": c.P_ALBEDO, "color": c.P_COLOR, "length": c.P_LENGTH}
    return {name: p[at : at + 3] for name, at in names.items()}


def test_the_node_makes_one_lobe_of_its_colour():
    x = lobe(node(weight=(0.5, 0.5, 0.5)))
    assert x["weight"] == pytest.approx(0.5 * np.array(COLOR))
    assert x["sample_weight"] == pytest.approx(3.0 * 0.5 * np.mean(COLOR))
    found = parameters(x)
    assert found["color"] == pytest.approx(COLOR)
    assert found["sigma_t"] == pytest.approx(0.5 / np.array(RADIUS))
    assert found["length"] == pytest.approx(2.0 * np.array(RADIUS))
    assert (x["ior"], x["alpha_x"]) == pytest.approx((1.4, 0.3))


@pytest.mark.parametrize(("method", "entry"), list(zip(METHODS, (0, 1, 1, 2), strict=True)))
def test_methods_enter_in_their_own_way(method, entry):
    x = lobe(node(falloff=method))
    assert x["p"][c.P_ENTRY] == entry and x["p"][c.P_BURLEY] == (method == "BURLEY")
    assert x["alpha_x"] == (1.0 if entry == c.ENTRY_SKIN else 0.3)


@pytest.mark.parametrize(("name", "entry"), [("DIFFUSE", 0), ("REFRACTIVE", 1), ("SKIN", 2)])
def test_the_materials_entry_goes_before_the_methods(name, entry):
    assert all(lobe(node(falloff=method, entry=name))["p"][c.P_ENTRY] == entry for method in METHODS)


def test_a_channel_without_radius_is_diffuse():
    surface = node(Radius=(1.0, 0.0, 0.25))
    x, (y,) = lobe(surface), lobes(surface, c.LOBE_LAMBERT)
    assert x["weight"] == pytest.approx((0.8, 0.0, 0.2))
    assert y["weight"] == pytest.approx((0.0, 0.5, 0.0))
    assert x["sample_weight"] == pytest.approx(2.0 * np.mean((0.8, 0.0, 0.2)))
    assert node(Scale=0.0).kinds == [c.LOBE_LAMBERT]
    assert node(Radius=math.nan).kinds == [c.LOBE_LAMBERT]


@pytest.mark.parametrize("method", METHODS)
def test_rays_after_a_diffuse_bounce_see_diffuse_where_they_are_told_to(method):
    diffuse = {bit: node(falloff=method, ray_flags=rec.RAY_DIFFUSE | bit).kinds == [c.LOBE_LAMBERT]
               for bit in (0, rec.RAY_BURLEY_DIFFUSE, rec.RAY_SUBSURFACE_DIFFUSE)}  # fmt: skip
    assert list(diffuse.values()) == [False, method == "BURLEY", True]


def test_principled_scatters_under_its_layers_and_keeps_the_rest_diffuse():
    plain = lobes(principled(Subsurface_Weight=0.0), c.LOBE_LAMBERT)[0]["weight"]
    surface = principled(Subsurface_Weight=0.3)
    assert lobe(surface)["weight"] == pytest.approx(0.3 * plain)
    assert lobes(surface, c.LOBE_LAMBERT)[0]["weight"] == pytest.approx(0.7 * plain)
    assert parameters(lobe(surface))["color"] == pytest.approx(COLOR)
    assert lobes(principled(), c.LOBE_LAMBERT) == []


def test_principled_enters_by_its_surface_and_skin_by_its_own_ior():
    x = lobe(principled(Roughness=0.5, IOR=1.3, Subsurface_IOR=1.6))
    assert (x["alpha_x"], x["ior"]) == pytest.approx((0.25, 1.3))
    f0 = 2.0 * 0.8 * (0.3 / 2.3) ** 2
    leveled = lobe(principled(IOR=1.3, Specular_IOR_Level=0.8))
    assert leveled["ior"] == pytest.approx((1.0 + math.sqrt(f0)) / (1.0 - math.sqrt(f0)))
    skin = lobe(principled(IOR=1.3, Subsurface_IOR=1.6, subsurface_method="RANDOM_WALK_SKIN"))
    assert (skin["alpha_x"], skin["ior"]) == pytest.approx((1.0, 1.6))
    assert lobe(principled(IOR=0.5))["ior"] == 1.01


def test_the_lobe_is_chosen_by_its_share_and_has_no_direction():
    surface = principled(Subsurface_Weight=0.3)
    closures = surface.closures[: surface.point["n_closures"]]
    x = lobe(surface)
    share = x["sample_weight"] / closures["sample_weight"].sum()
    labels, _, values, pdf = surface.sample(20_000)
    chosen = labels == LABEL_SUBSURFACE
    assert chosen.mean() == pytest.approx(share, abs=4.0 * math.sqrt(share * (1.0 - share) / 20_000))
    assert values[chosen][0, :3] == pytest.approx(x["weight"]) and pdf[chosen][0] == pytest.approx(share)


def test_passes_count_it_as_diffuse():
    surface = node()
    assert surface.color()[0] == pytest.approx(COLOR)
    summary = surface.summary()
    assert summary["albedo"] == pytest.approx(COLOR) and summary["diffuse_like"] == 1.0
    assert summary["has_eval"] == 0.0


@pytest.mark.parametrize("roughness", [0.0, 0.6])
def test_a_thin_sheet_scatters_to_both_sides(roughness):
    surface = principled(Thin_Wall=1.0, Subsurface_Anisotropy=0.4, Diffuse_Roughness=roughness)
    assert lobes(surface, c.LOBE_SUBSURFACE) == []
    back, through = surface.closures[1], surface.closures[2]
    assert through["weight"] == pytest.approx(back["weight"] * 0.7 / 0.3)
    up, down = surface.evaluate([direction(0.5), -direction(0.5)])[0][:, :3]
    if roughness == 0.0:
        assert down == pytest.approx(through["weight"] * 0.5 / math.pi)
    else:  # what is scattered forwards is the mirror image of what is scattered backwards
        alone = principled(Thin_Wall=1.0, Subsurface_Anisotropy=-1.0, Diffuse_Roughness=roughness, IOR=1.0)
        other = principled(Thin_Wall=1.0, Subsurface_Anisotropy=1.0, Diffuse_Roughness=roughness, IOR=1.0)
        wi = direction(0.5, 2.0)
        mirrored = wi * (1.0, 1.0, -1.0)
        assert other.evaluate(mirrored)[0] == pytest.approx(alone.evaluate(wi)[0])
        assert other.evaluate(wi)[1] == alone.evaluate(mirrored)[1] == 0.0
    assert (up > 0.0).all() and (down > 0.0).all()
