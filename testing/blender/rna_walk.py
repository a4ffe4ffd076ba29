"""Which RNA properties change Cycles' picture of a small scene.

`python -m testing.blender.rna_walk FILE` tries all of the running Blender and puts its column into the table
tests/blender/cycles_properties.txt. For a new Blender, run it once and say in tests/blender/test_rna_walk.py what
becomes of the properties that are new.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import bpy
import numpy as np

from . import kit, render

# Where and how the picture is written, which device computes it, and what replaces the scene that is looked at.
_NOT_TRIED = {"engine", "filepath", "device", "shading_system", "use_lock_interface", "threads", "threads_mode"}
_NOT_TRIED |= {"use"}  # a scene without a view layer to render ends the process
_SAMPLES = 2
CHANGES, SAME, ABSENT = "changes", "same", "-"


def build() -> dict[str, object]:
    """The scene, and the owners of properties in it by name."""
    scene = kit.reset()
    render.exact_files(scene)
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = 24, 18, 100
    scene.restir.is_initialized = True
    scene.render.use_simplify = True
    scene.render.simplify_subdivision_render = 6
    scene.cycles.use_denoising = scene.cycles.use_adaptive_sampling = False
    scene.cycles.samples, scene.cycles.seed = _SAMPLES, 0
    scene.render.film_transparent = True
    kit.floor()
    kit.put("ball", kit.material(lambda node: node("BsdfGlass", Roughness=0.05)), (-1.0, -0.5, 0.6), 0.6)
    veil = kit.material(lambda node: node("BsdfTransparent", Color=(0.5, 0.5, 0.5)))
    kit.put("plane", veil, (0.0, -1.0, 1.5), 0.4, rotation=(80, 0, 0))
    fog = kit.material(lambda node: {"Volume": node("VolumeScatter", Density=0.4, Anisotropy=0.3)})
    kit.put("cube", fog, (-0.2, 0.8, 0.4), 0.4)

    def bumped(node):
        info = node("ObjectInfo")
        normal = node("Bump", Height=node("TexNoise", Scale=6.0), Strength=1.0, Distance=1.0)
        color = node("MixRGB", Fac=0.5, Color1=info.outputs["Color"], Color2=info.outputs["Object Index"])
        color = node("MixRGB", Fac=0.1, Color1=color, Color2=info.outputs["Material Index"])
        surface = node(
            "BsdfPrincipled", Normal=normal, Base_Color=color, Emission_Strength=0.2, Subsurface_Weight=0.2, Alpha=0.8
        )
        return {"Surface": surface, "Displacement": node("Displacement", Height=node("TexNoise"), Scale=0.3)}

    thing = kit.put("coarse ball", kit.material(bumped), (1.0, 0.0, 0.7), 0.6)
    thing.modifiers.new("Subdivision", "SUBSURF").render_levels = 2
    lamp = kit.lamp()
    sun = kit.light("SUN", 1.0, (2.0, 0.5, 2.0), angle=0.3)
    spot = kit.light("SPOT", 200.0, (-2.0, -1.0, 3.0))
    point = kit.light("POINT", 60.0, (0.5, 1.0, 2.0))
    ramp = lambda node: node("Background", Color=node("TexCoord").outputs["Generated"], Strength=0.3)  # noqa: E731
    world = kit.world(ramp)
    scene.camera.data.clip_end = 100.0
    scene.camera.data.dof.use_dof = True
    scene.camera.data.dof.aperture_fstop = 0.5
    material = thing.data.materials[0]
    return {
        "RenderSettings": scene.render,
        "ViewLayer": bpy.context.view_layer,
        "ViewLayer.cycles": bpy.context.view_layer.cycles,
        "Object": thing,
        "Object.cycles": thing.cycles,
        "Camera": scene.camera.data,
        "Camera.dof": scene.camera.data.dof,
        "Camera.cycles": getattr(scene.camera.data, "cycles", None),
        "AreaLight": lamp.data,
        "SunLight": sun.data,
        "SpotLight": spot.data,
        "PointLight": point.data,
        "Light.cycles": lamp.data.cycles,
        "World": world,
        "World.cycles": world.cycles,
        "World.cycles_visibility": getattr(world, "cycles_visibility", None),
        "Material": material,
        "Material.cycles": getattr(material, "cycles", None),
        "Scene.cycles": scene.cycles,
    }


def tried(owner) -> Iterator[bpy.types.Property]:
    """The properties of an owner that can be set and could matter."""
    for item in owner.bl_rna.properties if owner is not None else ():
        simple = item.type in ("BOOLEAN", "INT", "FLOAT", "ENUM")
        if simple and not item.is_readonly and item.identifier not in _NOT_TRIED:
            yield item


def _others(owner, item) -> list:
    """A few other values of a property."""
    now = getattr(owner, item.identifier)
    if getattr(item, "is_array", False):
        now = list(now)
        if not isinstance(now[0], (int, float)):  # a matrix: what it holds has names of its own
            return []
        return [[not x for x in now]] if item.type == "BOOLEAN" else [[0.5 * x + 0.3 for x in now], [0] * len(now)]
    if item.type == "BOOLEAN":
        return [not now]
    if item.type == "ENUM":
        if item.is_enum_flag:
            return []
        return [other.identifier for other in item.enum_items if other.identifier != now]
    if item.type == "FLOAT":
        return [0.5 * now + 0.3, 0.1 * now, 20.0 * now + 3.0]
    return [now + 3, now // 2, 0, 1]


def picture() -> np.ndarray:
    """Cycles' picture of the current scene."""
    scene = bpy.context.scene
    with render.quiet():
        return render.render("CYCLES", scene.cycles.samples, scene.cycles.seed)


def changes(owner, item, reference: np.ndarray, picture=picture) -> bool:
    """Whether another value of a property changes the picture."""
    before = getattr(owner, item.identifier)
    before = tuple(before) if getattr(item, "is_array", False) else before
    try:
        for value in _others(owner, item):
            try:
                setattr(owner, item.identifier, value)
                found = picture()
            except (RuntimeError, TypeError, ValueError, AttributeError):
                continue
            if found.shape != reference.shape or np.abs(found - reference).max() > 1e-6:
                return True
        return False
    finally:
        with suppress(TypeError, ValueError, AttributeError):
            setattr(owner, item.identifier, before)


def walk() -> Iterator[tuple[str, str]]:
    """(owner.property, CHANGES or SAME) of the running Blender."""
    render.register()
    owners = build()
    reference = picture()
    for name in list(owners):
        for identifier in [item.identifier for item in tried(owners[name])]:
            changed = changes(owners[name], owners[name].bl_rna.properties[identifier], reference)
            yield f"{name}.{identifier}", CHANGES if changed else SAME
            if not np.array_equal(picture(), reference):  # some properties do not go back
                owners = build()
                reference = picture()


def version() -> str:
    """The running Blender's."""
    return f"{bpy.app.version[0]}.{bpy.app.version[1]}"


def read_table(path: Path) -> tuple[list[str], dict[str, dict[str, str]]]:
    """(versions, word by property and version) of the table."""
    head, *lines = path.read_text().splitlines()
    versions = head.split()[1:]
    rows = (line.split() for line in lines)
    return versions, {name: dict(zip(versions, words, strict=True)) for name, *words in rows}


def write_table(path: Path, versions: list[str], table: dict[str, dict[str, str]]) -> None:
    """The other way round."""
    lines = [
        f"{name} {' '.join(words.get(each, ABSENT) for each in versions)}" for name, words in sorted(table.items())
    ]
    path.write_text("\n".join([f"property {' '.join(versions)}", *lines]) + "\n")


def main() -> None:
    """Try all properties of the running Blender."""
    path = Path(sys.argv[1])
    versions, table = read_table(path) if path.exists() else ([], {})
    for words in table.values():
        words.pop(version(), None)
    for name, word in walk():
        table.setdefault(name, {})[version()] = word
    write_table(path, sorted({*versions, version()}), table)


if __name__ == "__main__":
    main()
