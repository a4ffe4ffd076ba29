"""Materials that scatter below the surface: the lobes that trees make, as the running Blender's Cycles has it."""

import math

import bpy
import numpy as np
import pytest

from restir_engine.kernels.core import records as rec
from restir_engine.kernels.core.jit import kernel
from restir_engine.kernels.core.memory import address
from restir_engine.kernels.lobes import closure as c
from restir_engine.kernels.shading.interpreter import shader_eval
from restir_engine.scene.description import SceneDescription
from restir_engine.sync.materials import Materials
from testing.blender.nodes import add_node

NEW = bpy.app.version >= (5, 2, 0)
NODE, PRINCIPLED = "ShaderNodeSubsurfaceScattering", "ShaderNodeBsdfPrincipled"
COLOR, RADIUS, SCALE = (0.8, 0.5, 0.2), (1.0, 0.5, 0.25), 0.1
SOCKETS = {
    NODE: {"Color": (*COLOR, 1.0), "Radius": RADIUS, "Scale": SCALE, "IOR": 1.3, "Roughness": 0.3},
    PRINCIPLED: {"Base Color": (*COLOR, 1.0), "Subsurface Radius": RADIUS, "Subsurface Scale": SCALE,
                 "Subsurface Weight": 1.0, "IOR": 1.3, "Roughness": 0.3},
}  # fmt: skip
METHOD = {NODE: "falloff", PRINCIPLED: "subsurface_method"}
PREFIX = {NODE: "", PRINCIPLED: "Subsurface "}
METHODS = ("BURLEY", "RANDOM_WALK", "RANDOM_WALK_SKIN") + (("RANDOM_WALK_LEGACY",) if NEW else ())


def material(identifier, method="RANDOM_WALK", **sockets):
    """A material of one node."""
    result = bpy.data.materials.new("Subsurface")
    if bpy.app.version < (5, 0, 0):
        result.use_nodes = True
    tree = result.node_tree
    tree.nodes.clear()
    node = add_node(tree, identifier, inputs=SOCKETS[identifier] | sockets, **{METHOD[identifier]: method})
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(node.outputs[0], output.inputs["Surface"])
    return result, tree, node, output


@kernel
def _evaluate(scene, sp):
    shader_eval(scene, sp)


def compiled(result) -> tuple[SceneDescription, int]:
    """The description and the flags of the compiled material."""
    scene = SceneDescription()
    index = Materials(scene).index(result)
    return scene, scene.shaders[index].flags


def lobes(result) -> np.ndarray:
    """The closures that the material makes at a point that is seen from straight above."""
    scene, _ = compiled(result)
    assert scene.warnings.lines() == []
    scene = scene.commit()
    sp, registers = np.zeros(1, rec.SHADING_POINT), np.zeros(rec.MAX_REGISTERS)
    closures = np.zeros(rec.MAX_CLOSURES, rec.CLOSURE)
    point = sp[0]
    point["instance"] = point["light"] = -1
    point["ray_flags"] = rec.RAY_CAMERA
    point["n"] = point["ng"] = point["wo"] = (0.0, 0.0, 1.0)
    point["closures"], point["registers"] = address(closures), address(registers)
    _evaluate(scene.record, point)
    return closures[: point["n_closures"]]


def lobe(result):
    (found,) = [x for x in lobes(result) if x["kind"] == c.LOBE_SUBSURFACE]
    return found


def rgb(x, at):
    return x["p"][at : at + 3]


@pytest.mark.parametrize("identifier", SOCKETS)
@pytest.mark.parametrize("method", METHODS)
def test_methods_are_those_of_the_running_blender(scene, identifier, method):
    x = lobe(material(identifier, method)[0])
    radius = SCALE * np.array(RADIUS)
    assert rgb(x, c.P_COLOR) == pytest.approx(COLOR)
    new = NEW and method == "RANDOM_WALK"
    assert rgb(x, c.P_ALBEDO)[1] == pytest.approx(0.91171 if new else 0.91370, abs=1e-5)
    if method != "RANDOM_WALK_SKIN":
        assert rgb(x, c.P_SIGMA_T) == pytest.approx((1.0 if new else 4.0 * math.pi) / radius)
    else:
        ior = 1.3 if identifier == NODE else 1.4
        assert x["ior"] == pytest.approx(ior)
    assert x["p"][c.P_BURLEY] == (method == "BURLEY")
    entries = {"BURLEY": c.ENTRY_DIFFUSE, "RANDOM_WALK_SKIN": c.ENTRY_SKIN}
    assert x["p"][c.P_ENTRY] == entries.get(method, c.ENTRY_REFRACTIVE)


@pytest.mark.parametrize("identifier", SOCKETS)
def test_roughness_is_squared_in_principled_alone(scene, identifier):
    x = lobe(material(identifier)[0])
    assert x["alpha_x"] == pytest.approx(0.3 if identifier == NODE else 0.09)
    assert x["ior"] == pytest.approx(1.3)


@pytest.mark.parametrize("identifier", SOCKETS)
def test_backward_scattering_is_new_in_5_2(scene, identifier):
    assert lobe(material(identifier, **{PREFIX[identifier] + "Anisotropy": 0.5})[0])["p"][c.P_ANISOTROPY] == 0.5
    socket = material(identifier)[2].inputs[PREFIX[identifier] + "Anisotropy"]
    result, _, node, _ = material(identifier)
    node.inputs[socket.name].default_value = -0.5
    found = lobe(result)["p"][c.P_ANISOTROPY]
    assert found == (max(node.inputs[socket.name].default_value, -0.99) if NEW else 0.0)


@pytest.mark.parametrize("identifier", SOCKETS)
def test_inputs_can_be_linked(scene, identifier):
    result, tree, node, _ = material(identifier)
    value = add_node(tree, "ShaderNodeValue")
    value.outputs[0].default_value = 0.3
    color = "Color" if identifier == NODE else "Base Color"
    for name in (color, PREFIX[identifier] + "Radius", PREFIX[identifier] + "Scale"):
        tree.links.new(value.outputs[0], node.inputs[name])
    x = lobe(result)
    assert rgb(x, c.P_COLOR) == pytest.approx(0.3, abs=1e-6)
    assert rgb(x, c.P_LENGTH) == pytest.approx(0.09 if NEW else 0.09 / (4.0 * math.pi), abs=1e-6)


def test_materials_say_that_they_scatter_and_by_which_normal_light_leaves(scene):
    subsurface, bumped = rec.MATERIAL_SUBSURFACE, rec.MATERIAL_BUMPED_EXIT
    for identifier in SOCKETS:
        result, tree, node, output = material(identifier)
        assert compiled(result)[1] == subsurface
        bump = add_node(tree, "ShaderNodeBump")
        tree.links.new(bump.outputs[0], node.inputs["Normal"])
        assert compiled(result)[1] == subsurface | bumped
        tree.links.remove(node.inputs["Normal"].links[0])
        tree.links.new(add_node(tree, "ShaderNodeDisplacement").outputs[0], output.inputs["Displacement"])
        assert compiled(result)[1] == subsurface | bumped
    assert compiled(material(PRINCIPLED, **{"Subsurface Weight": 0.0})[0])[1] == 0


# A material's own medium.

OWN = {"use_medium": True, "color": (0.5, 0.5, 0.5), "mean_free_path": (2.0, 1.0, 0.5), "scale": 0.5, "anisotropy": 0.3}


def own_medium(result, **more):
    for name, value in (OWN | more).items():
        setattr(result.restir, name, value)
    return result


def is_own(x, color=OWN["color"]):
    assert rgb(x, c.P_COLOR) == pytest.approx(color)
    assert rgb(x, c.P_SIGMA_T) == pytest.approx((1.0, 2.0, 4.0))
    assert x["p"][c.P_ANISOTROPY] == pytest.approx(0.3) and not x["p"][c.P_BURLEY]
    assert x["p"][c.P_ENTRY] == c.ENTRY_DIFFUSE


@pytest.mark.parametrize("identifier", SOCKETS)
@pytest.mark.parametrize("method", METHODS)
def test_a_medium_takes_the_place_of_what_nodes_say(scene, identifier, method):
    is_own(lobe(own_medium(material(identifier, method)[0])))
    is_own(lobe(own_medium(material(identifier, method)[0], use_color=False)), COLOR)


def test_a_medium_keeps_a_weight_that_was_set(scene):
    half = own_medium(material(PRINCIPLED, **{"Subsurface Weight": 0.5})[0])
    whole = own_medium(material(PRINCIPLED, **{"Subsurface Weight": 0.0})[0])
    is_own(lobe(half))
    is_own(lobe(whole))
    assert lobe(half)["weight"] == pytest.approx(0.5 * lobe(whole)["weight"])


def test_any_other_material_becomes_the_medium(scene):
    result, tree, _, output = material(NODE)
    tree.links.new(add_node(tree, "ShaderNodeEmission").outputs[0], output.inputs["Surface"])
    is_own(lobe(own_medium(result)))
    assert compiled(result)[1] == rec.MATERIAL_SUBSURFACE
    tree.links.new(add_node(tree, "ShaderNodeDisplacement").outputs[0], output.inputs["Displacement"])
    assert compiled(result)[1] == rec.MATERIAL_SUBSURFACE | rec.MATERIAL_BUMPED_EXIT
    tree.nodes.clear()
    is_own(lobe(result))
    if bpy.app.version < (5, 0, 0):
        result.use_nodes = False
        is_own(lobe(result))


@pytest.mark.parametrize("identifier", SOCKETS)
def test_how_light_enters_is_the_materials(scene, identifier):
    for name, entry in (("DIFFUSE", c.ENTRY_DIFFUSE), ("REFRACTIVE", c.ENTRY_REFRACTIVE), ("SKIN", c.ENTRY_SKIN)):
        result = material(identifier)[0]
        result.restir.entry = name
        assert lobe(result)["p"][c.P_ENTRY] == entry
        assert lobe(own_medium(result))["p"][c.P_ENTRY] == entry


@pytest.mark.skipif(not NEW, reason="thin walls came with Blender 5.2")
def test_a_thin_wall_scatters_to_both_sides(scene):
    kinds = [x["kind"] for x in lobes(material(PRINCIPLED, **{"Thin Wall": True})[0])]
    assert kinds == [c.LOBE_REFLECTION, c.LOBE_LAMBERT, c.LOBE_TRANSLUCENT]
