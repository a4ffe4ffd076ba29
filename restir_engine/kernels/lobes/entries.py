"""The BSDF nodes' instructions as entries: each is compiled when a scene first uses its node."""

from ..core.jit import Entry, device, entry
from ..core.records import RAY_NO_LOBES, scene_at, shading_point_at
from ..core.vec import mul
from ..shading.math_ops import triple
from . import nodes
from .principled import principled_op
from .setup import (
    add_transparent,
    diffuse_op,
    glass_op,
    glossy_op,
    metallic_op,
    refraction_op,
    sheen_op,
    toon_op,
    translucent_op,
)
from .subsurface import subsurface_op

FIRST = nodes.DIFFUSE


@device
def makes_lobes(op, sp):
    """Whether an instruction has anything to do: Principled's emission and transparency concern every ray."""
    return sp.ray_flags & RAY_NO_LOBES == 0 or op == nodes.PRINCIPLED or op == nodes.TRANSPARENT


@entry
def _diffuse(scene, sp, op, registers, at):
    diffuse_op(shading_point_at(sp, 0), registers, scene_at(scene, 0).code, at)


@entry
def _principled(scene, sp, op, registers, at):
    scene = scene_at(scene, 0)
    principled_op(scene, shading_point_at(sp, 0), registers, scene.code, at)


@entry
def _glossy(scene, sp, op, registers, at):
    scene = scene_at(scene, 0)
    glossy_op(scene, shading_point_at(sp, 0), registers, scene.code, at)


@entry
def _metallic(scene, sp, op, registers, at):
    scene = scene_at(scene, 0)
    metallic_op(scene, shading_point_at(sp, 0), registers, scene.code, at)


@entry
def _glass(scene, sp, op, registers, at):
    scene = scene_at(scene, 0)
    glass_op(scene, shading_point_at(sp, 0), registers, scene.code, at)


@entry
def _refraction(scene, sp, op, registers, at):
    refraction_op(shading_point_at(sp, 0), registers, scene_at(scene, 0).code, at)


@entry
def _translucent(scene, sp, op, registers, at):
    translucent_op(shading_point_at(sp, 0), registers, scene_at(scene, 0).code, at)


@entry
def _transparent(scene, sp, op, registers, at):
    code = scene_at(scene, 0).code
    add_transparent(shading_point_at(sp, 0), mul(triple(registers, code, at), triple(registers, code, at + 1)))


@entry
def _sheen(scene, sp, op, registers, at):
    scene = scene_at(scene, 0)
    sheen_op(scene, shading_point_at(sp, 0), registers, scene.code, at)


@entry
def _toon(scene, sp, op, registers, at):
    toon_op(shading_point_at(sp, 0), registers, scene_at(scene, 0).code, at)


@entry
def _subsurface(scene, sp, op, registers, at):
    subsurface_op(shading_point_at(sp, 0), registers, scene_at(scene, 0).code, at)


_BY_OPCODE: dict[int, Entry] = {
    nodes.DIFFUSE: _diffuse,
    nodes.PRINCIPLED: _principled,
    nodes.GLOSSY: _glossy,
    nodes.METALLIC: _metallic,
    nodes.GLASS: _glass,
    nodes.REFRACTION: _refraction,
    nodes.TRANSLUCENT: _translucent,
    nodes.TRANSPARENT: _transparent,
    nodes.SHEEN: _sheen,
    nodes.TOON: _toon,
    nodes.SUBSURFACE: _subsurface,
}
BSDF_ENTRIES: tuple[Entry, ...] = tuple(_BY_OPCODE[op] for op in sorted(_BY_OPCODE))  # by opcode, from FIRST on
