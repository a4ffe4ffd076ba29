"""Converters of shader nodes, found by `bl_idname`.

A value converter is `(compiler, node) → {output identifier: register}`; a function without arguments in place of a
register is called when that output is used. A closure converter is `(compiler, node, weight)`, `weight` being the
register of the rgb factor that the Mix Shaders above the node leave it.
"""

from __future__ import annotations

from collections.abc import Callable

NODES: dict[str, Callable] = {}
CLOSURES: dict[str, Callable] = {}
VOLUMES: dict[str, Callable] = {}
INSIDE: dict[str, Callable] = {}
UNLINKED: dict[str, Callable] = {}


def has_converter(identifier: str) -> bool:
    """Whether nodes of this type stand for themselves in a program."""
    return identifier in NODES or identifier in CLOSURES or identifier in VOLUMES


def _registrar(table: dict[str, Callable], identifiers: tuple[str, ...]) -> Callable:
    def register(function: Callable) -> Callable:
        table.update(dict.fromkeys(identifiers, function))
        return function

    return register


def node(*identifiers: str) -> Callable:
    """Register the decorated function as the value converter of these node types."""
    return _registrar(NODES, identifiers)


def closure(*identifiers: str) -> Callable:
    """Register the decorated function as the closure converter of these node types."""
    return _registrar(CLOSURES, identifiers)


def volume(*identifiers: str) -> Callable:
    """Register the decorated function as the converter of these node types in trees of the Volume socket."""
    return _registrar(VOLUMES, identifiers)


def inside(*identifiers: str) -> Callable:
    """Register the decorated function as what these surface shaders say of the medium that glass surrounds."""
    return _registrar(INSIDE, identifiers)


def unlinked(*names: str) -> Callable:
    """Register `(compiler, node) → register` as what hidden vector inputs of these names are when unlinked."""
    return _registrar(UNLINKED, names)
