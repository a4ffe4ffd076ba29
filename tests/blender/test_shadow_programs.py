"""Shadow rays run a shorter program that lets the same light through."""

import bpy
import numpy as np
import pytest

from restir_engine.kernels.core import records as rec
from restir_engine.kernels.core.jit import kernel
from restir_engine.kernels.core.memory import address
from restir_engine.kernels.core.records import RAY_CAMERA
from restir_engine.kernels.core.vec import store3_f64, vec
from restir_engine.kernels.geometry.camera import camera_ray
from restir_engine.kernels.geometry.intersect import intersect
from restir_engine.kernels.geometry.surface import surface_point
from restir_engine.kernels.shading import opcodes as ops
from restir_engine.kernels.shading.interpreter import shader_eval
from restir_engine.settings import RenderSettings
from restir_engine.sync.depsgraph import build_scene
from testing.blender.nodes import _add_camera, _add_grid, add_node


@kernel
def _transparency(scene, camera, sp, scratch, size, flags, out):
    for y in range(size):
        for x in range(size):
            o, d, _, _ = camera_ray(camera, x + 0.5, y + 0.5, 0.5, 0.5)
            t, instance, primitive, u, v = intersect(scene, scratch, o, d, 0.0, 1e30, RAY_CAMERA)
            if instance >= 0:
                surface_point(scene, sp, instance, primitive, u, v, t, d)
                sp.ray_flags = flags
                shader_eval(scene, sp)
                store3_f64(out, 3 * (y * size + x), vec(sp.transparent))


def _paint(tree):
    return add_node(tree, "ShaderNodeVertexColor", layer_name="Paint").outputs["Color"]


def _alpha_of_principled(tree):
    bump = add_node(tree, "ShaderNodeBump", inputs={"Height": _paint(tree)})
    alpha = add_node(tree, "ShaderNodeMath", operation="POWER", inputs={"Value": _paint(tree), "Value_001": 2.0})
    inputs = {"Base Color": _paint(tree), "Alpha": alpha.outputs[0], "Normal": bump.outputs[0]}
    return add_node(tree, "ShaderNodeBsdfPrincipled", inputs=inputs).outputs[0]


def _mixed(tree):
    split = add_node(tree, "ShaderNodeSeparateXYZ", inputs={"Vector": _paint(tree)})
    step = add_node(tree, "ShaderNodeMath", operation="GREATER_THAN", inputs={0: split.outputs[0], 1: 0.5})
    inner, outer = (add_node(tree, "ShaderNodeMixShader", inputs={"Fac": step.outputs[0]}) for _ in range(2))
    tree.links.new(_alpha_of_principled(tree), inner.inputs[1])
    tree.links.new(add_node(tree, "ShaderNodeBsdfDiffuse", inputs={"Color": _paint(tree)}).outputs[0], inner.inputs[2])
    transparent = add_node(tree, "ShaderNodeBsdfTransparent", inputs={"Color": _paint(tree)})
    tree.links.new(inner.outputs[0], outer.inputs[1])
    tree.links.new(transparent.outputs[0], outer.inputs[2])
    return outer.outputs[0]


def _light_path(tree):
    path = add_node(tree, "ShaderNodeLightPath")
    mix = add_node(tree, "ShaderNodeMixShader", inputs={"Fac": path.outputs["Is Camera Ray"]})
    tree.links.new(
        add_node(tree, "ShaderNodeBsdfTransparent", inputs={"Color": _paint(tree)}).outputs[0], mix.inputs[1]
    )
    tree.links.new(_alpha_of_principled(tree), mix.inputs[2])
    return mix.outputs[0]


def _transparent(build, opaque_shadows, *flags):
    """(transparency for each of the ray flags, program) of a grid with a material."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    _add_grid("Grid", build, 0.0, 0.0, 1.0, 0.0)
    _add_camera(1, 1)
    bpy.data.materials["Grid"].use_transparent_shadow = not opaque_shadows
    scene = build_scene(bpy.context.evaluated_depsgraph_get(), RenderSettings())
    size = scene.camera.film_size[0]
    camera, sp = np.zeros(1, rec.CAMERA), np.zeros(1, rec.SHADING_POINT)
    camera[0] = scene.camera.record()
    closures, registers = np.zeros(rec.MAX_CLOSURES, rec.CLOSURE), np.zeros(rec.MAX_REGISTERS)
    sp["closures"], sp["registers"] = address(closures), address(registers)
    scratch = np.zeros(rec.SCRATCH_BYTES + 64, np.uint8)
    start = address(scratch) + -address(scratch) % 64
    pictures = []
    for rays in flags:
        registers[:] = np.nan
        out = np.zeros((size, size, 3))
        _transparency(scene.record, camera[0], sp[0], start, size, rays, address(out))
        pictures.append(out)
    return pictures, scene.shaders[scene.material_slots[0]]


SHADOW, LAST = rec.RAY_DIFFUSE | rec.RAY_SHADOW, rec.RAY_DIFFUSE | rec.RAY_LAST


@pytest.mark.parametrize("build", (_alpha_of_principled, _mixed, _light_path))
def test_shadow_rays_see_the_same_transparency(build):
    pictures, program = _transparent(build, False, SHADOW, LAST)
    assert np.ptp(pictures[0]) > 0.1
    assert np.array_equal(*pictures)
    assert program.code[0] == ops.JUMP_SHADOW
    assert len(program.code) - program.code[2] < program.code[2]


def test_a_material_may_be_opaque_to_shadow_rays_alone():
    (shadow, last), program = _transparent(_mixed, True, SHADOW, LAST)
    assert not shadow.any() and last.any()
    assert program.flags & rec.MATERIAL_TRANSPARENT
