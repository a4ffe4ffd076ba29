"""Blender's world → its program, and how finely its light is sampled."""

from __future__ import annotations

from collections.abc import Iterator

import bpy
import numpy as np

from ..kernels.core import records as rec
from ..scene.world import World

# Widths of the importance map: of a world without images, and the largest; that in which no sun is missed, times its
# angular diameter.
_WIDTH, _MAX_WIDTH = 1024, 4096
_OF_SUN = 1.6 * 2.0 * np.pi

_VISIBILITY = {
    "camera": rec.RAY_CAMERA,
    "diffuse": rec.RAY_DIFFUSE,
    "glossy": rec.RAY_GLOSSY,
    "transmission": rec.RAY_TRANSMIT,
    "scatter": rec.RAY_VOLUME,
    "shadow": rec.RAY_SHADOW,
}


def sync_world(scene, depsgraph, materials) -> None:
    """Replace the scene's world by that of the depsgraph's scene (or of its view layer), which may show none."""
    scene.world = World()
    world = depsgraph.scene_eval.world
    override = getattr(depsgraph.view_layer_eval, "world_override", None)
    if override is not None:
        world = override.evaluated_get(depsgraph)
    if world is None or not depsgraph.view_layer_eval.use_sky:
        return
    settings = getattr(world, "cycles", None)
    target = scene.world
    target.light_group = scene.light_groups.get(world.lightgroup, -1)
    # Before, Cycles forgot what emits in the world's medium.
    target.medium_group = target.light_group if bpy.app.version >= (5, 0, 0) else -1
    target.material = materials.compile_world(world)
    target.max_bounces = getattr(settings, "max_bounces", 1024)
    target.casts_shadow = getattr(settings, "use_shadows", True)
    visibility = getattr(world, "cycles_visibility", None)
    if visibility is not None:
        for name, bits in _VISIBILITY.items():
            if not getattr(visibility, name, True):
                target.seen_by &= ~bits
    if target.material < 0 or not scene.shaders[target.material].flags & rec.MATERIAL_VARYING_EMISSION:
        return
    method = getattr(settings, "sampling_method", "AUTOMATIC")
    if method == "NONE":
        return
    suns = [node.sun_size for node in _nodes(world.node_tree) if _has_sun(node)]
    target.sun_angle = float(max(suns, default=0.0))
    widths = [_WIDTH, *_image_widths(world.node_tree)] if method != "MANUAL" else []
    widths += [int(_OF_SUN / max(size, 1e-3)) for size in suns]
    chosen = settings.sample_map_resolution if method == "MANUAL" else 0
    target.map_width = max(chosen, min(max(widths, default=0), _MAX_WIDTH))


def _image_widths(tree) -> list[int]:
    return [
        node.image.size[0]
        for node in _nodes(tree)
        if node.bl_idname in ("ShaderNodeTexEnvironment", "ShaderNodeTexImage") and node.image is not None
    ]


def _has_sun(node) -> bool:
    if node.bl_idname != "ShaderNodeTexSky" or node.sky_type in ("PREETHAM", "HOSEK_WILKIE"):
        return False
    return node.sun_disc and node.sun_size > 0.0


def _nodes(tree, seen: set | None = None) -> Iterator:
    """All nodes of a tree and of its groups."""
    seen = set() if seen is None else seen
    if tree is None or tree.as_pointer() in seen:
        return
    seen.add(tree.as_pointer())
    for node in tree.nodes:
        yield node
        yield from _nodes(getattr(node, "node_tree", None), seen)
