"""Merging renders of ranges of the samples: a button, and `blender --command restir_merge`."""

from __future__ import annotations

from pathlib import Path

import bpy
from bpy.props import BoolProperty, CollectionProperty, StringProperty


class RESTIR_OT_merge_ranges(bpy.types.Operator):
    """Merge multilayer OpenEXR files, each a render of a range of the samples, to one file of all of them"""

    bl_idname = "restir.merge_ranges"
    bl_label = "Merge Sample Ranges"

    directory: StringProperty(subtype="DIR_PATH", options={"HIDDEN", "SKIP_SAVE"})
    files: CollectionProperty(type=bpy.types.OperatorFileListElement, options={"HIDDEN", "SKIP_SAVE"})
    filter_glob: StringProperty(default="*.exr", options={"HIDDEN"})
    out: StringProperty(
        name="Merged File",
        description="Name of the file that is written, in the same folder",
        default="merged.exr",
    )
    finish: BoolProperty(
        name="Finish",
        description="Leave the file as one render of all samples does: denoised where Denoise was on, shadow catchers "
        "in Combined. Off keeps what is needed to merge it with further files",
        default=True,
    )

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        from ..restir_engine.engine import configure_cache

        configure_cache()
        from ..restir_engine.farm.exr import FileError
        from ..restir_engine.farm.merge import merge

        folder, manager = Path(bpy.path.abspath(self.directory)), context.window_manager
        parts = [folder / file.name for file in self.files if file.name and file.name != self.out]
        if not parts:
            self.report({"ERROR"}, "Choose the files of all ranges: hold Shift or Ctrl to choose several")
            return {"CANCELLED"}
        manager.progress_begin(0.0, 1.0)
        try:
            warnings = merge(parts, folder / self.out, self.finish, progress=manager.progress_update)
        except FileError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        finally:
            manager.progress_end()
        for line in warnings:
            self.report({"WARNING"}, line)
        self.report({"INFO"}, f"Saved “{folder / self.out}”")
        return {"FINISHED"}


def merge_command(arguments: list[str]) -> int:
    """`blender --command restir_merge`: the same as `python -m restir_engine.farm.merge`."""
    from ..restir_engine.engine import configure_cache

    configure_cache()
    from ..restir_engine.farm.merge import main

    return main(arguments)
