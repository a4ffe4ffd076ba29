"""Shader trees to programs. Importing this package registers every converter."""

from . import bump, closures, color, converters, generic, ies, images, inputs, rays, sky, textures, volumes
from .compiler import Compiler

__all__ = [
    "Compiler",
    "bump",
    "closures",
    "color",
    "converters",
    "generic",
    "ies",
    "images",
    "inputs",
    "rays",
    "sky",
    "textures",
    "volumes",
]
