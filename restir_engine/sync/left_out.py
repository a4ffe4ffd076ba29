"""What Cycles would show and this engine does not: each property that switches it on, named at every render.

Properties that the engine reads are in the modules of their datablocks. What is in neither changes no picture.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import NamedTuple

import bpy

from ..settings import MOST_LIGHT_GROUPS


class LeftOut(NamedTuple):
    """A property by its path from the datablock, the text of the warning, and which values of it ask for something."""

    path: str
    text: str
    asks: Callable[[object], bool] = bool


SCENE = (
    LeftOut("render.use_freestyle", "Freestyle lines are left out"),
    LeftOut("cycles.use_fast_gi", "Fast GI is left out: indirect light is traced"),
    LeftOut("cycles.shading_system", "Open Shading Language is left out"),
)
WHEN_SIMPLIFIED = (
    LeftOut("cycles.texture_limit_render", "the texture limit is left out: images have all their pixels", "OFF".__ne__),
)
WHEN_BLURRED = (
    LeftOut("restir.sss_irradiance_cache", "the irradiance cache is left out: with motion blur, light varies in time"),
)
WITH_LIGHT_GROUPS = (
    LeftOut("restir.sss_irradiance_cache", "the irradiance cache is left out: it does not tell light groups apart"),
)
PASSES = (
    LeftOut("use_pass_shadow", "Shadow"),
    LeftOut("use_pass_subsurface_direct", "Subsurface Direct"),
    LeftOut("use_pass_subsurface_indirect", "Subsurface Indirect"),
    LeftOut("use_pass_subsurface_color", "Subsurface Color"),
    LeftOut("cycles.use_pass_volume_scatter", "Volume Scatter"),
    LeftOut("cycles.use_pass_volume_transmit", "Volume Transmit"),
    LeftOut("cycles.use_pass_volume_majorant", "Volume Majorant"),
    LeftOut("cycles.pass_debug_sample_count", "Debug Sample Count"),
    LeftOut("cycles.pass_render_time", "Render Time"),
)
# Cycles' switches of passes that view_layer.restir has switches of its own for.
OWN_PASSES = {
    "use_pass_volume": (
        LeftOut("cycles.use_pass_volume_direct", "Volume Direct"),
        LeftOut("cycles.use_pass_volume_indirect", "Volume Indirect"),
    ),
    "use_pass_shadow_catcher": (LeftOut("cycles.use_pass_shadow_catcher", "Shadow Catcher"),),
    "use_pass_denoising": (LeftOut("cycles.denoising_store_passes", "Denoising Data"),),
}
LIGHT = (LeftOut("cycles.is_caustics_light", "shadow caustics are left out: caustics are found by chance alone"),)
WORLD = LIGHT
# Blender lists curves, text, surfaces and metaballs twice: as themselves, and, where they have faces, as an instance
# with a mesh of its own. What is left has no triangles.
DATA = {
    "GreasePencil": "grease pencil strokes are not rendered; convert them to a mesh to see them",
    "GreasePencilv3": "grease pencil strokes are not rendered; convert them to a mesh to see them",  # before Blender 5
}


def note_scene(depsgraph, warnings) -> None:
    """Name what the depsgraph's scene, view layer and world ask for in vain."""
    for kind, name, text in scene_lines(depsgraph.scene_eval, [depsgraph.view_layer_eval]):
        warnings.add(kind, name, text)


def scene_lines(scene: bpy.types.Scene, layers: list[bpy.types.ViewLayer]) -> Iterator[tuple[str, str, str]]:
    """(kind, name, text) of all that a scene and view layers of it ask for in vain."""
    yield from (("Scene", scene.name, text) for text in asked(scene, SCENE))
    if scene.render.use_simplify:
        yield from (("Scene", scene.name, text) for text in asked(scene, WHEN_SIMPLIFIED))
    if scene.render.use_motion_blur and any(layer.use_motion_blur for layer in layers):
        yield from (("Scene", scene.name, text) for text in asked(scene, WHEN_BLURRED))
    if any(layer.lightgroups for layer in layers):
        yield from (("Scene", scene.name, text) for text in asked(scene, WITH_LIGHT_GROUPS))
    if scene.world is not None:
        yield from (("World", scene.world.name, text) for text in asked(scene.world, WORLD))
    for layer in layers:
        names = [*asked(layer, PASSES)]
        for own, switches in OWN_PASSES.items():
            if not getattr(getattr(layer, "restir", None), own, False):
                names += [f"{name} (its switch is under ReSTIR)" for name in asked(layer, switches)]
        names += [f"AOV {aov.name} (another pass has this name)" for aov in layer.aovs if not aov.is_valid]
        too_many = [group.name for group in layer.lightgroups][MOST_LIGHT_GROUPS:]
        names += [f"Light Group {name} (there are more than {MOST_LIGHT_GROUPS})" for name in too_many]
        if names:
            yield "View Layer", layer.name, f"passes that are left out: {', '.join(names)}"


def note_object(item, warnings) -> None:
    """Name what an evaluated object that is rendered asks for in vain, by itself or by its data."""
    text = DATA.get(type(item.data).__name__)
    if text:
        warnings.add("Object", item.name, text)
    if isinstance(item.data, bpy.types.Light):
        for text in asked(item.data, LIGHT):
            warnings.add("Light", item.data.name, text)


def asked(owner, table: tuple[LeftOut, ...]) -> Iterator[str]:
    """The texts of those properties of a datablock that ask for something."""
    for entry in table:
        value = owner
        for name in entry.path.split("."):
            value = getattr(value, name, None)
        if value is not None and entry.asks(value):
            yield entry.text
