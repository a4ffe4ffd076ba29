"""Every shader node class of the running Blender compiles, runs, and leaves finite numbers."""

import bpy
import numpy as np
import pytest

from restir_engine.kernels.shading import opcodes as ops
from restir_engine.scene.warnings import Warnings
from restir_engine.settings import RenderSettings
from restir_engine.sync.depsgraph import read_scene
from restir_engine.sync.materials import Materials
from restir_engine.sync.nodes.registry import CLOSURES, NODES
from restir_engine.sync.nodes.sockets import kind_of
from testing.blender.nodes import emission


def shader_nodes() -> list[str]:
    """The identifiers of all node classes that can be created in a material's tree."""
    tree = bpy.data.node_groups.new("All", "ShaderNodeTree")
    found = []
    for name in dir(bpy.types):
        kind = getattr(bpy.types, name)
        if isinstance(kind, type) and issubclass(kind, bpy.types.Node):
            try:
                tree.nodes.new(name)
            except RuntimeError:  # of another kind of tree
                continue
            found.append(name)
    bpy.data.node_groups.remove(tree)
    return sorted(found)


@pytest.fixture(scope="module")
def scene():
    """One plane with one material."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.mesh.primitive_plane_add(size=4.0)
    bpy.context.object.data.materials.append(bpy.data.materials.new("Every node"))
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location.z = 3.0
    bpy.context.scene.collection.objects.link(camera)
    bpy.context.scene.camera = camera
    bpy.context.scene.render.resolution_x = bpy.context.scene.render.resolution_y = 4
    return read_scene(bpy.context.evaluated_depsgraph_get(), RenderSettings())


def run(scene, material) -> np.ndarray:
    """What the material emits, after it has taken the place of the scene's only one."""
    scene.shaders.replace(0, scene.shaders[Materials(scene).index(material)])
    return emission(scene.commit())


def material_with(name: str):
    material = bpy.data.materials.new(name)
    if bpy.app.version < (5, 0, 0):
        material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    return material, tree, tree.nodes.new("ShaderNodeOutputMaterial"), tree.nodes.new(name)


@pytest.mark.parametrize("name", shader_nodes())
def test_node_compiles_and_runs(scene, name):
    material, tree, output, node = material_with(name)
    for target in ("Surface", "Displacement"):
        for socket in node.outputs:
            if target == "Displacement" and socket.type == "SHADER":
                continue
            tree.links.new(socket, output.inputs[target])
            assert np.isfinite(run(scene, material)).all(), (socket.name, target)
    _for_each_choice(node, lambda: run(scene, material))
    bpy.data.materials.remove(material)


def _for_each_choice(node, action):
    """Call action with each value of each enum that is the node's own."""
    common = {item.identifier for item in bpy.types.ShaderNode.bl_rna.properties}
    for item in node.bl_rna.properties:
        if item.type != "ENUM" or item.identifier in common or item.is_readonly:
            continue
        for choice in item.enum_items:
            try:
                setattr(node, item.identifier, choice.identifier)
            except TypeError:  # a choice that only other kinds of trees have
                continue
            action()


def test_every_operation_of_blender_has_a_number():
    def choices(name, attribute):
        return {item.identifier for item in getattr(bpy.types, name).bl_rna.properties[attribute].enum_items}

    vector = set(ops.VECTOR_OPERATIONS) | set(ops.MATH_OPERATIONS) | {"SCALE", "FRACTION"}
    assert choices("ShaderNodeMath", "operation") == set(ops.MATH_OPERATIONS)
    assert choices("ShaderNodeVectorMath", "operation") <= vector
    assert choices("ShaderNodeMix", "blend_type") == set(ops.BLEND_MODES)
    assert choices("ShaderNodeMixRGB", "blend_type") == set(ops.BLEND_MODES)
    assert choices("ShaderNodeMapping", "vector_type") == set(ops.MAPPING_TYPES)
    assert choices("ShaderNodeMapRange", "interpolation_type") == set(ops.MAP_RANGE_MODES)
    assert choices("ShaderNodeVectorTransform", "convert_from") == set(ops.SPACES)
    assert choices("ShaderNodeNormalMap", "space") == set(ops.NORMAL_SPACES)
    assert choices("ShaderNodeCombineColor", "mode") == set(ops.COLOR_MODES)


def test_a_node_without_a_converter_is_named_once(scene):
    names = [name for name in shader_nodes() if name not in NODES and name not in CLOSURES]
    names = [name for name in names if name.startswith("ShaderNode")]
    names = [name for name in names if not name.startswith(("ShaderNodeOutput", "ShaderNodeGroup"))]
    for name in names:
        material, tree, output, node = material_with(name)
        if not node.outputs or kind_of(node.outputs[0]) is None:
            continue
        tree.links.new(node.outputs[0], output.inputs["Surface"])
        scene.warnings = Warnings()
        run(scene, material)
        run(scene, material)
        added = scene.warnings.lines()
        assert len(added) == 1 and node.name in added[0] and material.name in added[0], (name, added)
