"""The command `restir_farm`, by which a farm has Blender render its tasks."""

from __future__ import annotations

import bpy


def _restir_farm(arguments: list[str]) -> int:
    from ..restir_engine.farm.service import command

    return command(arguments)


class _Command:
    registered = None


def register() -> None:
    """Let `blender --command restir_farm` be known."""
    if _Command.registered is None:
        _Command.registered = bpy.utils.register_cli_command("restir_farm", _restir_farm)


def unregister() -> None:
    """Take it away."""
    if _Command.registered is not None:
        bpy.utils.unregister_cli_command(_Command.registered)
        _Command.registered = None
