"""The command `restir_farm`, by which a farm has Blender render its tasks."""

from __future__ import annotations

import bpy


def _restir_farm(arguments: list[str]) -> int:
    from ..restir_engine.farm.service import command

    return command(arguments)


class _Registered:
    command = None


def offer_command() -> None:
    """Let `blender --command restir_farm` be known."""
    if _Registered.command is None:
        _Registered.command = bpy.utils.register_cli_command("restir_farm", _restir_farm)


def withdraw_command() -> None:
    """Take it away."""
    if _Registered.command is not None:
        bpy.utils.unregister_cli_command(_Registered.command)
        _Registered.command = None
