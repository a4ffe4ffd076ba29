"""Names of attributes that are no name of an artist's: what `Scene.attribute_name` is asked for besides those.

An artist's attribute is interned by its own name. Names made here begin with a character that Blender does not let
into one. A mesh has the attributes that had been asked for when it was read, and all its UV maps.
"""

UV = ""  # the render UV map
GENERATED = "\x00generated"  # texture space of the undeformed shape; only on meshes that are deformed
COLOR = "\x00color"  # the render colour attribute
RESERVED = (UV, GENERATED, COLOR)  # in the order of records.ATTRIBUTE_*

POINTINESS = "\x00pointiness"  # convexity of a point's surroundings, 0.5 where flat
ISLAND = "\x00island"  # a random number for each connected part
INTERCEPT = "\x00intercept"  # of points of strands: the share of the strand's length on the way to them
LENGTH = "\x00length"  # of strands, in object space
STRAND_RANDOM = "\x00strand random"  # a number for each strand
POINT_RANDOM = "\x00point random"  # a number for each point of a cloud

VERTEX_NORMAL = "\x00vertex normal"  # Blender's normal at a vertex; on meshes that are flat, for what displaces them
UNDISPLACED = "\x00undisplaced"  # where a displaced point was before; on meshes that are displaced

_TANGENT = "\x00tangent:"
_PROPERTY = "\x00property:"


def tangent(uv_map: str = "") -> str:
    """The MikkTSpace tangent along a UV map ("": the render UV map): object space, w its bitangent's sign."""
    return _TANGENT + uv_map


def tangent_uv(name: str) -> str | None:
    """The UV map that a name made by `tangent` stands for, None for any other name."""
    return name[len(_TANGENT) :] if name.startswith(_TANGENT) else None


def object_property(name: str, kind: str = "OBJECT") -> str:
    """An Attribute node's name when its type is OBJECT, INSTANCER or VIEW_LAYER rather than GEOMETRY."""
    return f"{_PROPERTY}{kind}:{name}"


def split_object_property(name: str) -> tuple[str, str] | None:
    """(kind, name) of what `object_property` made, None for any other name."""
    if not name.startswith(_PROPERTY):
        return None
    kind, _, rest = name[len(_PROPERTY) :].partition(":")
    return kind, rest


def reserved() -> dict[str, int]:
    """Numbers by name, to which more are added: those that kernels know."""
    return {name: index for index, name in enumerate(RESERVED)}
