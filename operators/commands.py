"""What `blender --command NAME …` does."""

from __future__ import annotations

import bpy

from .merge_ranges import merge_command


def farm_command(arguments: list[str]) -> int:
    """`blender --command restir_farm`: the same as `python -m restir_engine.farm.service`."""
    from ..restir_engine.farm.service import command

    return command(arguments)


COMMANDS = {"restir_merge": merge_command, "restir_farm": farm_command}


class _Registered:
    commands: tuple = ()  # what Blender knows them by


def register() -> None:
    """Let Blender know the commands."""
    if not _Registered.commands:
        _Registered.commands = tuple(bpy.utils.register_cli_command(*item) for item in COMMANDS.items())


def unregister() -> None:
    """Let it forget them."""
    for command in _Registered.commands:
        bpy.utils.unregister_cli_command(command)
    _Registered.commands = ()
