"""A scene whose objects are baked by either engine into images or color attributes, and what they say of it."""

from __future__ import annotations

from typing import NamedTuple

import bpy
import numpy as np

from . import kit, render

UNTOUCHED = -7.0  # what pixels hold that no bake has written to


def empty() -> bpy.types.Scene:
    """A lamp and an even sky over nothing, with settings that mean the same to both engines."""
    render.register()
    scene = kit.reset()
    kit.assign(scene.cycles, render.CYCLES)
    for ours, theirs, value in render.SHARED:
        setattr(scene.restir, ours, value)
        setattr(scene.cycles, theirs, value)
    scene.restir.is_initialized = True
    scene.render.bake.margin = 0
    scene.render.resolution_x = scene.render.resolution_y = 16
    kit.lamp()
    kit.world(lambda node: node("Background", Color=(0.3, 0.35, 0.45)))
    return scene


def stage() -> tuple[bpy.types.Object, bpy.types.Object]:
    """A bumpy body that glows, reflects and lets light through, on a checkered floor beside glass: body and floor."""
    empty()

    def bumpy(node):
        noise = node("TexNoise", Vector=node("TexCoord").outputs["Generated"], Scale=9.0)
        color = kit.ramp(node, noise, [(0.3, (0.8, 0.2, 0.1)), (0.7, (0.1, 0.4, 0.8))])
        bump = node("Bump", Height=noise, Distance=0.08)
        body = node("BsdfPrincipled", Base_Color=color, Roughness=0.35, Normal=bump, Transmission_Weight=0.2)
        return node("AddShader", {0: body, 1: node("Emission", Color=(0.2, 0.5, 0.1), Strength=0.3)})

    def checkered(node):
        return node("BsdfDiffuse", Color=node("TexChecker", Vector=node("TexCoord").outputs["UV"], Scale=6.0))

    body = kit.put("coarse ball", kit.material(bumpy), (-0.7, 0.0, 0.7), 0.7)
    floor = kit.put("plane", kit.material(checkered), scale=3.0)
    kit.put("ball", kit.material(lambda node: node("BsdfGlass", Roughness=0.0)), (1.0, -0.4, 0.5), 0.5)
    return body, floor


def target(item: bpy.types.Object, size: int) -> bpy.types.Image:
    """A new float image that an object's materials are baked into."""
    image = bpy.data.images.new("Baked", size, size, alpha=True, float_buffer=True)
    image.colorspace_settings.name = "Non-Color"
    for material in item.data.materials:
        node = material.node_tree.nodes.new("ShaderNodeTexImage")
        node.image = image
        material.node_tree.nodes.active = node
    return image


class Baked(NamedTuple):
    """What a bake has written: values (n, 4) and which of an image's pixels (height, width) these are."""

    values: np.ndarray
    mask: np.ndarray


def bake(
    engine: str, item: bpy.types.Object, image: bpy.types.Image, kind: str, samples: int, seed: int = 0, **options
) -> Baked:
    """Bake an object into an image; options are those of `bpy.ops.object.bake`."""
    prepare(engine, samples, seed, item, options.pop("selected", ()))
    height, width = image.size[1], image.size[0]
    image.pixels.foreach_set(np.full(height * width * 4, UNTOUCHED, np.float32))
    bpy.ops.object.bake(type=kind, use_clear=False, **options)
    found = pixels(image)
    mask = found[..., 0] != UNTOUCHED
    return Baked(found[mask], mask)


def pixels(image: bpy.types.Image) -> np.ndarray:
    """What an image holds, (height, width, 4)."""
    found = np.empty((image.size[1], image.size[0], 4), np.float32)
    image.pixels.foreach_get(found.reshape(-1))
    return found


def bake_corners(engine: str, item: bpy.types.Object, kind: str, samples: int) -> np.ndarray:
    """The active color attribute of an object, after a bake: (n, 4)."""
    prepare(engine, samples, 0, item)
    bpy.ops.object.bake(type=kind, target="VERTEX_COLORS")
    data = item.data.color_attributes.active_color.data
    values = np.empty(4 * len(data), np.float32)
    data.foreach_get("color", values)
    return values.reshape(-1, 4)


def prepare(engine: str, samples: int, seed: int, item: bpy.types.Object, selected=()) -> None:
    """Let the next bake be of an object with an engine."""
    scene = bpy.context.scene
    scene.render.engine = engine
    for settings in (scene.cycles, scene.restir):
        settings.samples, settings.seed = samples, seed
    for each in scene.objects:
        each.select_set(each == item or each in selected)
    bpy.context.view_layer.objects.active = item
