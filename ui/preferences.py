"""The extension's preferences, and what they switch: compiling in the background."""

from __future__ import annotations

import bpy
from bpy.props import BoolProperty

from ..restir_engine.background import DELAY, Background
from ..restir_engine.engine import configure_cache

_PACKAGE = __package__.rpartition(".")[0]


def _switched(self, context: bpy.types.Context) -> None:
    if self.compile_in_background:
        _begin_now()
    else:
        Background.stop()


class RestirPreferences(bpy.types.AddonPreferences):
    """What is set for all files."""

    bl_idname = _PACKAGE

    compile_in_background: BoolProperty(
        name="Compile Kernels in the Background",
        description="Compile what is missing of the render kernels as soon as the extension is enabled, at the lowest "
        "priority. Off: the first render compiles what it needs",
        default=True,
        update=_switched,
    )

    def draw(self, context: bpy.types.Context) -> None:
        self.layout.prop(self, "compile_in_background")


CLASSES = (RestirPreferences,)


def begin() -> None:
    """Compile in the background, in a moment, where somebody sits before a window and has not switched it off."""
    if not bpy.app.background and not bpy.app.timers.is_registered(_begin_now):
        bpy.app.timers.register(_begin_now, first_interval=DELAY)


def end() -> None:
    """Do not, or no longer."""
    if bpy.app.timers.is_registered(_begin_now):
        bpy.app.timers.unregister(_begin_now)
    Background.stop()


def _begin_now() -> None:
    addon = bpy.context.preferences.addons.get(_PACKAGE)
    if addon is None or addon.preferences.compile_in_background:
        configure_cache()
        Background.start()
