"""What a program says about each BSDF node: opcode, inputs and immediates.

The operands of an instruction are: the register of the closure's weight (rgb: the product of Mix Shader factors,
without the node's own colour), the registers of the inputs in order, then the immediates in order.

An input that is not linked has, by its `default`:

* VALUE: the socket's own value, as a constant (`missing` when the running Blender has no such socket);
* NORMAL: operand -1, the kernel takes `sp.n`;
* FILM: operand -1, no thin film; else three registers that a THIN_FILM instruction has written;
* TANGENT: a tangent that the compiler emits (the active UV map's, or radial about z without one) where the node's
  anisotropy is linked or not 0, else -1: the kernel takes any frame around the normal.

A linked Normal of zero length counts as `sp.n`.
"""

from typing import NamedTuple

from ..subsurface.parameters import ANY_SIGN, METHODS, POSITIVE

VALUE, NORMAL, TANGENT, FILM = "VALUE", "NORMAL", "TANGENT", "FILM"

# Opcodes.
(
    DIFFUSE,
    PRINCIPLED,
    GLOSSY,
    METALLIC,
    GLASS,
    REFRACTION,
    TRANSLUCENT,
    TRANSPARENT,
    SHEEN,
    TOON,
    SUBSURFACE,
    HAIR,
    CHIANG,
    HUANG,
) = range(200, 214)

# What lies on a surface, for the BSDFs that follow: out (3), thickness in nm, IOR, table! (`thin_film`).
THIN_FILM = 190
FILM_REFLECTANCE = 191  # no instruction: where the code that closures under a film refer to stands among the entries

# No instructions: where the code of the lobes of fibres stands among the entries (`fibre`).
HAIR_LOBE, CHIANG_LOBE, HUANG_LOBE = 196, 197, 198

# What an artist gives a strand's colour by, as immediates.
HAIR_ABSORPTION, HAIR_MELANIN, HAIR_COLOR = 0, 1, 2

# Microfacet distributions, as immediates.
GGX, MULTI_GGX, BECKMANN, ASHIKHMIN_SHIRLEY = 0, 1, 2, 3

# How light enters below the surface: ENTRY_* of `closure`, or as the method has it.
ENTRY_OF_METHOD = -1
ENTRIES = {"METHOD": ENTRY_OF_METHOD, "DIFFUSE": 0, "REFRACTIVE": 1, "SKIN": 2}


class Input(NamedTuple):
    """One input socket: its name (and names in other versions), its components, what it is when unlinked."""

    name: str
    components: int
    default: str = VALUE
    alternates: tuple[str, ...] = ()
    missing: float = 0.0


class BsdfNode(NamedTuple):
    """An instruction's layout; `enums` holds (attribute of the node or choice of `sync`, identifier → immediate)."""

    opcode: int
    inputs: tuple[Input, ...]
    enums: tuple[tuple[str, dict[str, int]], ...] = ()

    def operand(self, name: str) -> int:
        """Index of an input among the operands (the weight is operand 0)."""
        return 1 + [item.name for item in self.inputs].index(name)


_COLOR, _ROUGHNESS, _IOR = Input("Color", 3), Input("Roughness", 1), Input("IOR", 1)
_NORMAL, _TANGENT = Input("Normal", 3, NORMAL), Input("Tangent", 3, TANGENT)
_THIN_FILM = Input("Thin Film", 3, FILM)
_ANISOTROPY, _ROTATION = Input("Anisotropy", 1), Input("Rotation", 1)
# The choices of subsurface scattering that sync makes for the running Blender and the material.
_SUBSURFACE_CHOICES = (("entry", ENTRIES), ("sign", {"POSITIVE": POSITIVE, "ANY": ANY_SIGN}))

BSDF_NODES: dict[str, BsdfNode] = {
    "ShaderNodeBsdfDiffuse": BsdfNode(DIFFUSE, (_COLOR, _ROUGHNESS, _NORMAL)),
    "ShaderNodeBsdfPrincipled": BsdfNode(
        PRINCIPLED,
        (
            Input("Base Color", 3),
            Input("Metallic", 1),
            Input("Roughness", 1),
            Input("IOR", 1),
            Input("Alpha", 1),
            Input("Normal", 3, NORMAL),
            Input("Diffuse Roughness", 1),
            Input("Specular IOR Level", 1, alternates=("Specular",), missing=0.5),
            Input("Specular Tint", 3, missing=1.0),
            Input("Anisotropic", 1),
            Input("Anisotropic Rotation", 1),
            Input("Tangent", 3, TANGENT),
            Input("Transmission Weight", 1, alternates=("Transmission",)),
            Input("Coat Weight", 1),
            Input("Coat Roughness", 1),
            Input("Coat IOR", 1, missing=1.5),
            Input("Coat Tint", 3, missing=1.0),
            Input("Coat Normal", 3, NORMAL),
            Input("Sheen Weight", 1),
            Input("Sheen Roughness", 1, missing=0.5),
            Input("Sheen Tint", 3, missing=1.0),
            Input("Emission Color", 3),
            Input("Emission Strength", 1),
            Input("Thin Wall", 1),
            Input("Subsurface Weight", 1, alternates=("Subsurface",)),
            Input("Subsurface Radius", 3),
            Input("Subsurface Scale", 1, missing=1.0),
            Input("Subsurface IOR", 1, missing=1.4),
            Input("Subsurface Anisotropy", 1),
            _THIN_FILM,
        ),
        (
            ("distribution", {"GGX": GGX, "MULTI_GGX": MULTI_GGX}),
            ("subsurface_method", METHODS),
            *_SUBSURFACE_CHOICES,
            ("film", {"DIELECTRICS": 0, "ALL": 1}),
        ),
    ),
    "ShaderNodeBsdfAnisotropic": BsdfNode(
        GLOSSY,
        (_COLOR, _ROUGHNESS, _ANISOTROPY, _ROTATION, _NORMAL, _TANGENT),
        (
            (
                "distribution",
                {"GGX": GGX, "MULTI_GGX": MULTI_GGX, "BECKMANN": BECKMANN, "ASHIKHMIN_SHIRLEY": ASHIKHMIN_SHIRLEY},
            ),
        ),
    ),
    "ShaderNodeBsdfMetallic": BsdfNode(
        METALLIC,
        (
            Input("Base Color", 3),
            Input("Edge Tint", 3),
            Input("IOR", 3),
            Input("Extinction", 3),
            _ROUGHNESS,
            _ANISOTROPY,
            _ROTATION,
            _NORMAL,
            _TANGENT,
            _THIN_FILM,
        ),
        (
            ("distribution", {"GGX": GGX, "MULTI_GGX": MULTI_GGX, "BECKMANN": BECKMANN}),
            ("fresnel_type", {"PHYSICAL_CONDUCTOR": 0, "F82": 1}),
        ),
    ),
    "ShaderNodeBsdfGlass": BsdfNode(
        GLASS,
        (_COLOR, _ROUGHNESS, _IOR, _NORMAL, _THIN_FILM),
        (("distribution", {"GGX": GGX, "MULTI_GGX": MULTI_GGX, "BECKMANN": BECKMANN}),),
    ),
    "ShaderNodeBsdfRefraction": BsdfNode(
        REFRACTION,
        (_COLOR, _ROUGHNESS, _IOR, _NORMAL),
        (("distribution", {"GGX": GGX, "BECKMANN": BECKMANN}),),
    ),
    "ShaderNodeBsdfTranslucent": BsdfNode(TRANSLUCENT, (_COLOR, _NORMAL)),
    "ShaderNodeBsdfTransparent": BsdfNode(TRANSPARENT, (_COLOR,)),
    "ShaderNodeBsdfSheen": BsdfNode(
        SHEEN,
        (_COLOR, _ROUGHNESS, _NORMAL),
        (("distribution", {"ASHIKHMIN": 0, "MICROFIBER": 1}),),
    ),
    "ShaderNodeBsdfToon": BsdfNode(
        TOON,
        (_COLOR, Input("Size", 1), Input("Smooth", 1), _NORMAL),
        (("component", {"DIFFUSE": 0, "GLOSSY": 1}),),
    ),
    "ShaderNodeSubsurfaceScattering": BsdfNode(
        SUBSURFACE,
        (_COLOR, Input("Scale", 1), Input("Radius", 3), _IOR, _ROUGHNESS, _ANISOTROPY, _NORMAL),
        (("falloff", METHODS), *_SUBSURFACE_CHOICES),
    ),
    "ShaderNodeBsdfHair": BsdfNode(
        HAIR,
        (_COLOR, Input("Offset", 1), Input("RoughnessU", 1), Input("RoughnessV", 1), Input("Tangent", 3, NORMAL)),
        (("component", {"Reflection": 0, "Transmission": 1}),),
    ),
}

_STRAND = (
    _COLOR,
    Input("Melanin", 1),
    Input("Melanin Redness", 1),
    Input("Tint", 3, missing=1.0),
    Input("Absorption Coefficient", 3),
    Input("Random Color", 1),
    Input("Random", 1, missing=0.5),
    Input("Random Roughness", 1),
    _ROUGHNESS,
    _IOR,
    Input("Offset", 1),
)
_PARAMETRIZATION = (("parametrization", {"ABSORPTION": HAIR_ABSORPTION, "MELANIN": HAIR_MELANIN, "COLOR": HAIR_COLOR}),)
# The Principled Hair BSDF by its model.
PRINCIPLED_HAIR: dict[str, BsdfNode] = {
    "CHIANG": BsdfNode(CHIANG, (*_STRAND, Input("Radial Roughness", 1), Input("Coat", 1)), _PARAMETRIZATION),
    "HUANG": BsdfNode(
        HUANG,
        (
            *_STRAND,
            Input("Reflection", 1, missing=1.0),
            Input("Transmission", 1, missing=1.0),
            Input("Secondary Reflection", 1, missing=1.0),
        ),
        _PARAMETRIZATION,
    ),
}
