"""Shader trees to programs. Importing this package registers every converter."""

from . import closures, converters, inputs
from .compiler import Compiler

__all__ = ["Compiler", "closures", "converters", "inputs"]
