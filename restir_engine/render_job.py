"""What Blender renders at one request, from the first frame to the last, and which of its frames failed.

Of a frame in which an engine reports an error Blender writes nothing, and ends the animation; one of which it reports
none is written as it is. In a batch render, where nobody is there to begin again, a frame that failed is therefore
reported when the last one is written, and what Blender has written of it is thrown away.
"""

from __future__ import annotations

import atexit
import os
import shutil
import sys
from collections import defaultdict
from contextlib import ExitStack
from pathlib import Path
from typing import ClassVar

import bpy

ENGINE = "RESTIR"
COMMANDS = {"-a", "--render-anim", "-f", "--render-frame"}  # by which Blender renders without an operator
FAILED = 1  # exit code


class RenderJob:
    """A render that is going on."""

    _untold: ClassVar[set[int]] = set()  # frames that failed in this process, without an operator to say so
    _folder = ""  # of temporary files
    _is_last = False  # whether such frames were of the last job

    def __init__(self, scene: bpy.types.Scene, goes_on: bool) -> None:
        """goes_on: whether an animation does where a frame fails."""
        self._scene, self._frame = scene, scene.frame_current
        self._goes_on = goes_on and scene.render.engine == ENGINE
        self._stand_in: bpy.types.Object | None = None
        self._failures: dict[int, str] = {}  # frame → why
        self._engine: bpy.types.RenderEngine | None = None  # that can tell the operator
        self._thrown_away = ExitStack()
        self._composited: dict[Path, int] = {}  # of earlier renders
        self._keeps_engine = self._goes_on and not _by_command_line() and not scene.render.use_persistent_data
        if self._keeps_engine:  # or else none is left to report by when the last frame is written
            scene.render.use_persistent_data = True

    def begin_frame(self) -> None:
        """What is rendered from now on is the scene's present frame."""
        self._frame = self._scene.frame_current
        if self._goes_on and self._scene.camera is None:  # or else Blender ends the animation
            self._scene.camera = self._stand_in = self._stand_in or _stand_in()

    def stands_in(self, camera: bpy.types.Object | None) -> bool:
        """Whether a camera is there in place of one that the present frame lacks."""
        return camera is not None and self._stand_in is not None and camera.original == self._stand_in

    @property
    def frame_failed(self) -> bool:
        """Whether nothing that is rendered of the present frame will be kept."""
        return self._frame in self._failures

    def fail_frame(self, engine: bpy.types.RenderEngine, why: str) -> None:
        """Throw the present frame away, and go on."""
        from .farm.redirect import redirected

        if self.frame_failed:
            return
        print(f"ReSTIR: frame {self._frame} failed: {why}", flush=True)
        self._failures[self._frame], self._engine = why, engine
        self._composited = _composited(self._scene, self._frame)
        self._thrown_away.enter_context(redirected(self._scene, Path(bpy.app.tempdir)))

    def end_frame(self) -> None:
        """The present frame is written."""
        self._thrown_away.close()
        if self.stands_in(self._scene.camera):
            self._scene.camera = None
        if self.frame_failed:
            composited = _composited(self._scene, self._frame).items() - self._composited.items()
            for path in [*dict(composited), *_placeholders(self._scene, self._frame)]:
                path.unlink(missing_ok=True)

    def end(self) -> str:
        """Report what failed, as an error where somebody hears of it; also as a few words, "" where nothing did."""
        self.end_frame()
        told = not self._failures or self._reported()
        RenderJob._is_last, RenderJob._folder = not told, bpy.app.tempdir
        if not told and not bpy.app.module:
            RenderJob._untold |= set(self._failures)
        if self._keeps_engine:
            self._scene.render.use_persistent_data = False
        return _some_frames("failed", self._failures) if self._failures else ""

    def _reported(self) -> bool:
        """Whether the operator raises an error of what failed."""
        if _by_command_line():
            return False
        frames = defaultdict(list)
        for frame, why in self._failures.items():
            frames[why].append(frame)
        try:
            for why, several in frames.items():
                self._engine.report({"ERROR"}, f"{_some_frames('not written', several)}. {why}")
        except ReferenceError:  # that of another scene, which the sequencer or the compositor shows
            return False
        return True


def _some_frames(what: str, frames) -> str:
    from .farm.tasks import spans

    return f"{'frame' if len(frames) == 1 else 'frames'} {spans(frames)} {what}"


def _by_command_line() -> bool:
    """Whether no operator renders, but Blender by its arguments."""
    arguments = sys.argv[: sys.argv.index("--")] if "--" in sys.argv else sys.argv
    return not bpy.app.module and not COMMANDS.isdisjoint(arguments)


def _stand_in() -> bpy.types.Object:
    """A camera that is in no scene. It is not removed, because Blender may still look at it, nor is it ever saved."""
    return bpy.data.objects.new("No Camera", bpy.data.cameras.new("No Camera"))


def _composited(scene: bpy.types.Scene, frame: int) -> dict[Path, int]:
    """Files of a frame where File Output nodes write to, and when they were written."""
    from .farm.redirect import composited_folders

    found = (path for folder in composited_folders(scene) for path in folder.glob(f"*{frame:04d}*.*"))
    return {path: path.stat().st_mtime_ns for path in found if path.is_file()}


def _placeholders(scene: bpy.types.Scene, frame: int) -> list[Path]:
    """The empty files that Blender has put where it wanted to write a frame."""
    from .farm.redirect import frame_paths

    if not scene.render.use_placeholder:
        return []
    paths = frame_paths(scene, frame) | {Path(scene.render.frame_path(frame=frame))}  # that one for views, too
    return [path for path in paths if path.is_file() and not path.stat().st_size]


@atexit.register
def _exit_as_rendered() -> None:
    """Let Blender's exit code tell of frames that failed, which it does not know of."""
    if RenderJob._untold:
        from .farm.service import flush

        if not RenderJob._is_last:
            print("ReSTIR:", _some_frames("failed", RenderJob._untold))
        shutil.rmtree(RenderJob._folder, ignore_errors=True)
        flush()
        os._exit(FAILED)
