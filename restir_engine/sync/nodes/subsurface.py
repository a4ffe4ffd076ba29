"""What the running Blender's Cycles, and the material, make of a node's subsurface scattering."""

from __future__ import annotations

from dataclasses import dataclass

import bpy

from ...kernels.core import records as rec
from ...kernels.lobes.nodes import BSDF_NODES
from .thin_film import FILM_ON_METAL

# From 5.2 on Random Walk takes a radius as the mean free path and light may scatter backwards; what Random Walk was
# before has a name of its own.
_HAS_LEGACY = bpy.app.version >= (5, 2, 0)
_METHODS = ("subsurface_method", "falloff")
_NODE = "ShaderNodeSubsurfaceScattering"


@dataclass(frozen=True)
class Medium:
    """A material's own medium; `color` None: that of the node."""

    color: tuple[float, float, float] | None
    mean_free_path: tuple[float, float, float]  # scene units
    anisotropy: float


@dataclass(frozen=True)
class Subsurface:
    """What a material says about light below its surface: how it enters (lobes.nodes.ENTRIES), its own medium, whether
    that is also behind glass."""

    entry: str = "METHOD"
    medium: Medium | None = None
    scatter_inside: bool = False


def material_subsurface(material: bpy.types.Material) -> Subsurface:
    """What `material.restir` says."""
    own = material.restir
    if not own.use_medium:
        return Subsurface(own.entry, scatter_inside=own.scatter_inside)
    lengths = tuple(own.scale * length for length in own.mean_free_path)
    medium = Medium(tuple(own.color) if own.use_color else None, lengths, own.anisotropy)
    return Subsurface(own.entry, medium, own.scatter_inside)


def choice(c, node, attribute: str) -> str:
    """The identifier of an immediate: a choice of the node, of the material, or one that Blender's version decides."""
    medium = c.subsurface.medium
    if attribute == "entry":
        return "DIFFUSE" if medium and c.subsurface.entry == "METHOD" else c.subsurface.entry
    if attribute == "sign":
        return "ANY" if medium or _HAS_LEGACY else "POSITIVE"
    if attribute == "film":
        return "ALL" if FILM_ON_METAL else "DIELECTRICS"
    if attribute not in _METHODS:
        return getattr(node, attribute)
    if medium:
        return "RANDOM_WALK"
    method = getattr(node, attribute)
    return "RANDOM_WALK_LEGACY" if method == "RANDOM_WALK" and not _HAS_LEGACY else method


def medium_inputs(c, node) -> dict[str, int]:
    """The inputs, by name, that a material's own medium takes the place of, and their registers."""
    medium = c.subsurface.medium
    if medium is None or node.bl_idname not in (_NODE, "ShaderNodeBsdfPrincipled"):
        return {}
    values = {"Radius": medium.mean_free_path, "Scale": 1.0, "Anisotropy": medium.anisotropy}
    result = {name: c.constant(value) for name, value in values.items()}
    if node.bl_idname != _NODE:
        result = {f"Subsurface {name}": register for name, register in result.items()}
        if c.constant_value(c.value(node, "Subsurface Weight")) == (0.0,):
            result["Subsurface Weight"] = c.constant(1.0)
    if medium.color is not None:
        result["Color" if node.bl_idname == _NODE else "Base Color"] = c.constant(medium.color)
    return result


def emit_medium(c) -> None:
    """Emit a surface that is nothing but the material's own medium."""
    medium, layout = c.subsurface.medium, BSDF_NODES[_NODE]
    inputs = {
        "Color": medium.color or (0.8, 0.8, 0.8),
        "Scale": 1.0,
        "Radius": medium.mean_free_path,
        "IOR": 1.4,
        "Roughness": 1.0,
        "Anisotropy": medium.anisotropy,
    }
    words = [-1 if item.name == "Normal" else c.constant(inputs[item.name]) for item in layout.inputs]
    words += [values[choice(c, None, attribute)] for attribute, values in layout.enums]
    c.flags |= rec.MATERIAL_SUBSURFACE
    c.emit(layout.opcode, c.one, *words)


def note_subsurface(c, node, weight: int | None) -> None:
    """Set the material's flags where a node scatters below the surface; `weight` is the register of its share."""
    if weight is not None and c.constant_value(weight) == (0.0,):
        return
    c.flags |= rec.MATERIAL_SUBSURFACE
    if any(hasattr(node, attribute) and choice(c, node, attribute) == "BURLEY" for attribute in _METHODS):
        c.flags |= rec.MATERIAL_BURLEY
    if c.is_linked(node, "Normal"):
        c.flags |= rec.MATERIAL_BUMPED_EXIT
