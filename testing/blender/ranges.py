"""A scene with all passes, rendered in ranges of its samples; files of such renders compared pass by pass."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import bpy
import numpy as np

from restir_engine.farm.exr import MultilayerFile
from restir_engine.farm.films import arrays_of, passes_in, views_of
from restir_engine.scene.cryptomatte import KINDS

from . import kit
from .render import quiet, register

LAYERS = ("All", "Few")


def build(size: int = 32, samples: int = 24) -> bpy.types.Scene:
    """A cube and a ball of glass on a shadow catcher; the first of two view layers has all passes, the other few."""
    register()
    scene = kit.reset()
    shapes = bpy.ops.mesh
    _add(shapes.primitive_plane_add, "Boden", None, (0, 0, -1), size=8).is_shadow_catcher = True
    solid = _material("Häute", Base_Color=(0.8, 0.3, 0.2, 1.0))
    cube = _add(shapes.primitive_cube_add, "Würfel", solid, (0, 0, -0.3), size=1.2)
    _add(
        shapes.primitive_uv_sphere_add, "Ball", _material("Klar", Transmission_Weight=0.7, Alpha=0.7), (1.1, -0.8, -0.2)
    )
    cube.pass_index, solid.pass_index = 3, 2
    for frame in (1, 3):
        cube.location.x = 0.2 * frame
        cube.keyframe_insert("location", frame=frame)
    shown = solid.node_tree.nodes.new("ShaderNodeOutputAOV")
    shown.aov_name, shown.inputs[0].default_value = "mine", (0.3, 0.6, 0.9, 1.0)
    lamp = bpy.data.objects.new("Lamp", bpy.data.lights.new("Lamp", "AREA"))
    lamp.data.energy, lamp.data.size, lamp.location, lamp.rotation_euler = 300.0, 1.5, (2, -2, 4), (0.6, 0.4, 0)
    scene.collection.objects.link(lamp)
    scene.world = bpy.data.worlds.new("World")
    if bpy.app.version < (5, 0, 0):
        scene.world.use_nodes = True
    next(n for n in scene.world.node_tree.nodes if n.type == "BACKGROUND").inputs[0].default_value = (0.2, 0.3, 0.5, 1)
    kit.camera((0, -7, 3), (0, 0, 0))
    scene.render.resolution_x, scene.render.resolution_y, scene.render.engine = size, size * 3 // 4, "RESTIR"
    own = scene.restir
    own.samples, own.integrator, own.use_animated_seed, own.is_initialized = samples, "PATH", False, True
    own.use_adaptive_sampling = own.use_denoising = False
    _passes(scene, lamp)
    return scene


def _passes(scene: bpy.types.Scene, lamp: bpy.types.Object) -> None:
    every, few = scene.view_layers[0], scene.view_layers.new(LAYERS[1])
    every.name = LAYERS[0]
    for name in ("z", "normal", "position", "uv", "object_index", "material_index", "mist", "vector", "emit",
                 "environment", *(f"cryptomatte_{kind.lower()}" for kind in KINDS),
                 *(f"{lobes}_{part}" for lobes in ("diffuse", "glossy", "transmission")
                   for part in ("direct", "indirect", "color"))):  # fmt: skip
        setattr(every, f"use_pass_{name}", True)
    for name in ("volume", "subsurface", "sample_count", "denoising"):
        setattr(every.restir, f"use_pass_{name}", True)
    every.pass_cryptomatte_depth = 4
    every.aovs.add().name = "mine"
    every.lightgroups.add(name="Lamps")
    lamp.lightgroup = "Lamps"
    few.use_pass_diffuse_direct = few.use_pass_vector = few.restir.use_pass_shadow_catcher = True


def _material(name: str, **inputs) -> bpy.types.Material:
    made = bpy.data.materials.new(name)
    if bpy.app.version < (5, 0, 0):
        made.use_nodes = True
    node = next(n for n in made.node_tree.nodes if n.type == "BSDF_PRINCIPLED")
    for key, value in inputs.items():
        node.inputs[key.replace("_", " ")].default_value = value
    return made


def _add(operator, name: str, material, location, **options) -> bpy.types.Object:
    operator(location=location, **options)
    made = bpy.context.object
    made.name = name
    if material:
        made.data.materials.append(material)
    return made


def save(scene: bpy.types.Scene, path: Path, depth: str = "32", **own) -> Path:
    """Render to a multilayer file, with settings of `scene.restir` changed for this render."""
    image = scene.render.image_settings
    if hasattr(image, "media_type"):
        image.media_type = "MULTI_LAYER_IMAGE"
    image.file_format, image.color_depth, image.exr_codec = "OPEN_EXR_MULTILAYER", depth, "ZIP"
    before = {name: getattr(scene.restir, name) for name in own}
    for name, value in own.items():
        setattr(scene.restir, name, value)
    scene.render.filepath = str(path)
    with quiet():
        bpy.ops.render.render(write_still=True)
    for name, value in before.items():
        setattr(scene.restir, name, value)
    return path


def save_ranges(scene: bpy.types.Scene, folder: Path, count: int, **own) -> list[Path]:
    """Render all samples in so many ranges; the files are in no order."""
    size = scene.restir.samples // count
    starts = range(0, count * size, size)
    files = [save(scene, folder / f"part_{k}.exr", sample_offset=k, sample_subset=size, **own) for k in starts]
    return files[::-1]


def differences(one: Path, other: Path) -> Iterator[tuple[str, str, float]]:
    """(view layer, pass, greatest difference over the greatest value of the other's) of all passes of two files.

    Slots of Cryptomatte are compared as masks: an id's coverage, whichever its rank. Raises AssertionError where the
    files have different passes.
    """
    first, second = MultilayerFile(one), MultilayerFile(other)
    assert set(first.keys) == set(second.keys), set(first.keys) ^ set(second.keys)
    for layer, view in views_of(first):
        arrays = arrays_of(first, layer, view), arrays_of(second, layer, view)
        slots = {item.slots for item in passes_in(first, layer, view)} - {""}
        for name in arrays[0]:
            if not name.startswith("Crypto"):
                yield layer, name, _difference(arrays[0][name], arrays[1][name])
        for kind in slots:
            masks = [_masks(each, kind) for each in arrays]
            assert masks[0].keys() == masks[1].keys()
            for identity in masks[0]:
                yield layer, f"Crypto{kind} {identity:.3e}", _difference(masks[0][identity], masks[1][identity])


def _difference(one: np.ndarray, other: np.ndarray) -> float:
    scale = float(np.abs(other).max()) or 1.0
    return float(np.abs(one.astype(float) - other).max()) / scale


def _masks(arrays: dict[str, np.ndarray], kind: str) -> dict[float, np.ndarray]:
    slots = np.concatenate([arrays[name] for name in sorted(arrays) if name.startswith(f"Crypto{kind}")], -1)
    ids, weights = slots[..., 0::2], slots[..., 1::2]
    return {float(i): np.where(ids == i, weights, 0.0).sum(-1) for i in np.unique(ids) if i != 0.0}
