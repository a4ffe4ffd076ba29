"""Trees that differ in numbers alone share a compilation: their programs are those that each has by itself."""

from contextlib import suppress

import bpy
import numpy as np
import pytest

from restir_engine.scene.description import SceneDescription
from restir_engine.scene.shaders import alike
from restir_engine.sync.materials import Materials
from restir_engine.sync.nodes.compiler import Compiler
from restir_engine.sync.nodes.registry import CLOSURES, NODES
from testing.blender import kit

TREES = 15
KINDS = sorted(name for name in {*NODES, *CLOSURES} if name.startswith("ShaderNode") and hasattr(bpy.types, name))
KINDS.remove("ShaderNodeTexSky")  # computed at length, and never shared
ODD = (0.0, 1.0, 0.5, -0.0, 3.0)  # numbers that decide, or stand in several sockets


@pytest.fixture
def compiled(monkeypatch) -> list[str]:
    """Names of the datablocks whose trees are compiled."""
    kit.reset()
    names = []
    compile_ = Compiler.compile

    def noted(self, tree):
        names.append(self.name)
        return compile_(self, tree)

    monkeypatch.setattr(Compiler, "compile", noted)
    return names


def number(random) -> float:
    return float(random.choice(ODD)) if random.random() < 0.5 else float(random.random())


def give_numbers(random, sockets) -> None:
    """Change about half of what the sockets hold."""
    for socket in sockets:
        value = getattr(socket, "default_value", None)
        if random.random() < 0.5 or isinstance(value, (str, bpy.types.ID, type(None))):
            continue
        if isinstance(value, (bool, int, float)):
            socket.default_value = type(value)(3.0 * number(random))
        else:
            socket.default_value = [number(random) for _ in value]


def give_settings(random, node) -> None:
    """Change one enum, switch, ramp or mapping of a node."""
    common = bpy.types.ShaderNode.bl_rna.properties.keys()
    own = [item for item in node.bl_rna.properties if item.identifier not in common and not item.is_readonly]
    own = [item for item in own if item.type in ("ENUM", "BOOLEAN") and not getattr(item, "is_array", False)]
    for item in random.permutation(own).tolist()[:1]:
        choices = [choice.identifier for choice in item.enum_items] if item.type == "ENUM" else [False, True]
        with suppress(TypeError):  # a choice that only other kinds of trees have
            setattr(node, item.identifier, choices[random.integers(len(choices))])
    if hasattr(node, "color_ramp"):
        node.color_ramp.elements[0].color = [number(random) for _ in range(4)]
    elif hasattr(node, "texture_mapping"):
        node.texture_mapping.scale[0] = number(random)


def random_tree(random) -> bpy.types.Material:
    """Some nodes of all kinds, linked as it happens."""
    material = bpy.data.materials.new("Random")
    if bpy.app.version < (5, 0, 0):
        material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    nodes = [tree.nodes.new(kind) for kind in random.choice(KINDS, 8)]
    nodes.append(tree.nodes.new("ShaderNodeMixShader"))
    for place, node in enumerate(nodes):
        give_settings(random, node)
        for socket in node.inputs:
            sources = [output for other in nodes[:place] for output in other.outputs if output.type == socket.type]
            if sources and (socket.type == "SHADER" or random.random() < 0.5):
                tree.links.new(sources[random.integers(len(sources))], socket)
    tree.links.new(nodes[-1].outputs[0], tree.nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
    return material


def edit(random, material) -> None:
    """Change something other than a number, or nothing."""
    tree = material.node_tree
    node = tree.nodes[random.integers(len(tree.nodes))]
    links = list(tree.links)
    link = links[random.integers(len(links))]
    edits = (
        lambda: None,
        lambda: give_settings(random, node),
        lambda: setattr(node, "mute", not node.mute),
        lambda: tree.links.remove(link),
        lambda: setattr(link, "is_muted", True),
        lambda: [setattr(socket, "hide_value", not socket.hide_value) for socket in node.inputs],
        lambda: [setattr(socket, "enabled", not socket.enabled) for socket in node.outputs],
    )
    edits[random.integers(len(edits))]()


def programs(scene, materials, together: bool) -> list:
    """Programs of materials, by what is shared between them or each by itself."""
    reader = Materials(scene)
    found = []
    for material in materials:
        reader = reader if together else Materials(scene)
        found.append(scene.shaders[reader.index(material)])
    return found


@pytest.mark.parametrize("seed", range(4))
def test_programs_are_those_of_each_tree_by_itself(compiled, seed):
    random = np.random.default_rng(seed)
    scene = SceneDescription()
    shared = 0
    for _ in range(TREES):
        materials = [random_tree(random)]
        for _ in range(3):
            materials.append(materials[0].copy())
            edit(random, materials[-1])
        for material in materials:
            for node in material.node_tree.nodes:
                give_numbers(random, [*node.inputs, *node.outputs])
        compiled.clear()
        together = programs(scene, materials, together=True)
        shared += len(materials) - len(compiled)
        for one, other in zip(together, programs(scene, materials, together=False), strict=True):
            assert alike(one, other)
    assert shared > 0


def many(build) -> list[bpy.types.Material]:
    return [kit.material(lambda node, k=k: build(node, 0.1 * k)) for k in range(6)]


def test_one_compilation_serves_all_numbers_ramps_and_images(compiled):
    images = iter([kit.image(f"Image {k}", np.full((2, 2, 4), 0.1 * k)) for k in range(6)])

    def build(node, x):
        ramp = node("ValToRGB", Fac=node("TexNoise", Scale=1.0 + x).outputs[0])
        ramp.color_ramp.elements[0].color = (x, 0.0, 0.0, 1.0)
        place = node("Mapping", Vector=node("TexCoord").outputs["UV"], Scale=(x, 1.0, 1.0))
        picture = node("TexImage", Vector=place)
        picture.image = next(images)
        color = node("MixRGB", Fac=x, Color1=ramp.outputs["Color"], Color2=picture.outputs["Color"])
        return node("BsdfPrincipled", Base_Color=color, Roughness=x, IOR=1.0 + x)

    materials = many(build)
    scene = SceneDescription()
    found = programs(scene, materials, together=True)
    assert len(compiled) == 1
    assert len(scene.images) == 6
    assert len({program.code.tobytes() for program in found}) == 6  # other ramps, other images
    for one, other in zip(found, programs(scene, materials, together=False), strict=True):
        assert alike(one, other)


EDITS = {
    "a setting": lambda nodes, links: setattr(nodes["Math"], "operation", "MULTIPLY"),
    "a mapping": lambda nodes, links: setattr(nodes["Noise Texture"].texture_mapping, "mapping_x", "Y"),
    "a ramp's interpolation": lambda nodes, links: setattr(nodes["Color Ramp"].color_ramp, "interpolation", "CONSTANT"),
    "a ramp's stops": lambda nodes, links: nodes["Color Ramp"].color_ramp.elements.new(0.4),
    "a hidden value": lambda nodes, links: setattr(nodes["Noise Texture"].inputs["Vector"], "hide_value", False),
    "a disabled socket": lambda nodes, links: setattr(nodes["Color Ramp"].outputs["Color"], "enabled", False),
    "a muted node": lambda nodes, links: setattr(nodes["Math"], "mute", True),
    "a muted link": lambda nodes, links: setattr(links[0], "is_muted", True),
    "a missing link": lambda nodes, links: links.remove(links[0]),
}


@pytest.mark.parametrize("name", EDITS)
def test_what_is_no_number_is_compiled(compiled, name):
    def build(node):
        value = node("Math", {0: node("TexNoise").outputs[0], 1: 0.2})
        return node("BsdfDiffuse", Color=node("ValToRGB", Fac=value).outputs["Color"])

    before = kit.material(build)
    after = before.copy()
    EDITS[name](after.node_tree.nodes, after.node_tree.links)
    scene = SceneDescription()
    together = programs(scene, [before, after], together=True)
    assert not alike(*together)
    assert alike(together[1], *programs(scene, [after], together=False))


def test_what_a_number_decides_is_decided_for_each(compiled):
    """Mix Shader leaves out the side of factor 0, Principled lets light through where its alpha is below 1."""

    def build(node, x):
        factor = 0.0 if x < 0.25 else x
        glass = node("BsdfPrincipled", Alpha=1.0 if x < 0.35 else x)
        return node("MixShader", {0: factor, 1: glass, 2: node("BsdfDiffuse")})

    materials = many(build)
    found = programs(SceneDescription(), materials, together=True)
    assert len({(len(program.code), program.flags) for program in found}) == 3
    for one, other in zip(found, programs(SceneDescription(), materials, together=False), strict=True):
        assert alike(one, other)


def test_a_warning_is_said_of_each(compiled):
    scene = SceneDescription()
    materials = many(lambda node, x: node("BsdfDiffuse", Color=node("TexImage").outputs["Color"]))
    programs(scene, materials, together=True)
    assert len(scene.warnings.lines()) == len(materials)
