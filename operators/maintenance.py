"""Clearing the kernel cache; diagnostics for a report."""

from __future__ import annotations

import os
import platform
import sys
from importlib import metadata

import bpy

from ..restir_engine import requirements, warning_log
from ..restir_engine.engine import configure_cache


class RESTIR_OT_clear_kernel_cache(bpy.types.Operator):
    """Delete the compiled kernels from the disk. The first render after the next start compiles them again"""

    bl_idname = "restir.clear_kernel_cache"
    bl_label = "Clear Kernel Cache"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if requirements.problem():
            cls.poll_message_set("The packages that the engine needs are not installed")
            return False
        return True

    def execute(self, context: bpy.types.Context) -> set[str]:
        configure_cache()
        from ..restir_engine.kernels.core import cache

        cache.store().remove()
        self.report({"INFO"}, "Kernel cache cleared")
        return {"FINISHED"}


class RESTIR_OT_copy_diagnostics(bpy.types.Operator):
    """Copy versions, processor and the last render's warnings to the clipboard, for a report of a problem"""

    bl_idname = "restir.copy_diagnostics"
    bl_label = "Copy Diagnostics"

    def execute(self, context: bpy.types.Context) -> set[str]:
        context.window_manager.clipboard = diagnostics(context.scene)
        self.report({"INFO"}, "Diagnostics copied to the clipboard")
        return {"FINISHED"}


def diagnostics(scene: bpy.types.Scene) -> str:
    """What helps to understand a problem, as text; no names of files."""
    lines = [
        f"Blender {bpy.app.version_string} ({bpy.app.build_hash.decode(errors='replace')})",
        f"Python {sys.version.split()[0]}, {platform.platform()}",
        f"Processor {platform.processor() or platform.machine()}, {os.cpu_count()} threads",
    ]
    for package in ("numpy", *requirements.WHEELS):
        try:
            lines.append(f"{package} {metadata.version(package)}")
        except metadata.PackageNotFoundError:
            lines.append(f"{package} missing")
    own = scene.restir
    names = [p.identifier for p in own.bl_rna.properties if p.identifier not in ("rna_type", "name")]
    lines.append(", ".join(f"{name}={getattr(own, name)}" for name in names if own.is_property_set(name)))
    return "\n".join([*lines, *warning_log.lines(scene.name)])
