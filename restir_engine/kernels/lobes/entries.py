"""The BSDF nodes' instructions by opcode: each is compiled when a scene first uses its node."""

from ..core.jit import Entry, inlined
from ..core.records import RAY_NO_LOBES, RAY_NO_REFLECTION, RAY_NO_REFRACTION
from . import nodes
from .chiang import chiang_lobe
from .hair import hair_lobe
from .huang import huang_lobe
from .principled import principled_op
from .setup import (
    diffuse_op,
    glass_op,
    glossy_op,
    metallic_op,
    refraction_op,
    sheen_op,
    toon_op,
    translucent_op,
    transparent_op,
)
from .strands import chiang_op, hair_op, huang_op
from .subsurface import subsurface_op
from .thin_film import film_reflectance, thin_film_op

BSDF_ENTRIES: dict[int, Entry] = {
    nodes.DIFFUSE: diffuse_op,
    nodes.PRINCIPLED: principled_op,
    nodes.GLOSSY: glossy_op,
    nodes.METALLIC: metallic_op,
    nodes.GLASS: glass_op,
    nodes.REFRACTION: refraction_op,
    nodes.TRANSLUCENT: translucent_op,
    nodes.TRANSPARENT: transparent_op,
    nodes.SHEEN: sheen_op,
    nodes.TOON: toon_op,
    nodes.SUBSURFACE: subsurface_op,
    nodes.HAIR: hair_op,
    nodes.CHIANG: chiang_op,
    nodes.HUANG: huang_op,
}
# Beside them: an instruction that BSDFs take a value from, and what it needs to be compiled.
FILM_ENTRIES: dict[int, Entry] = {nodes.THIN_FILM: thin_film_op, nodes.FILM_REFLECTANCE: film_reflectance}
FIBRE_ENTRIES: dict[int, Entry] = {
    nodes.HAIR_LOBE: hair_lobe,
    nodes.CHIANG_LOBE: chiang_lobe,
    nodes.HUANG_LOBE: huang_lobe,
}
# What instructions need beside themselves: the code that closures which they make refer to.
COMPANIONS = {
    nodes.THIN_FILM: nodes.FILM_REFLECTANCE,
    nodes.HAIR: nodes.HAIR_LOBE,
    nodes.CHIANG: nodes.CHIANG_LOBE,
    nodes.HUANG: nodes.HUANG_LOBE,
}
_FIRST, _LAST = min(BSDF_ENTRIES), max(BSDF_ENTRIES)


@inlined
def makes_no_lobes(op, sp):
    """Whether a ray has no use for a BSDF node: Principled's emission and transparency concern every ray."""
    if op < _FIRST or op > _LAST or op == nodes.PRINCIPLED or op == nodes.TRANSPARENT:
        return False
    mirrors = op == nodes.GLOSSY or op == nodes.METALLIC
    off = RAY_NO_LOBES | (RAY_NO_REFLECTION if mirrors else RAY_NO_REFRACTION if op == nodes.REFRACTION else 0)
    return sp.ray_flags & off != 0
